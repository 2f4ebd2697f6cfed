"""The reader of all input files: regular files of at most 16 MiB, and TOML files in UTF-8 or UTF-16."""

import codecs
import re
import stat
import tomllib
from os import PathLike
from pathlib import Path
from typing import Any

from sensor.quantity import check_type, validation_error

MOST_BYTES = 16 * 2**20  # size of the largest file that is read
MOST_LEVELS = 16  # maximum nesting depth of tables and lists; a design file has four levels
# A dotted key with more than MOST_LEVELS names is refused. The time that Python's parser takes for such a key is
# proportional to the square of the number of names.
_NAME = r"""(?:"[^"\n]*"|'[^'\n]*'|[^\s.,=#"']+)[ \t]*"""
_DEEP_KEY = re.compile(rf"(?<![^\s\[{{,])(?:{_NAME}\.[ \t]*){{{MOST_LEVELS}}}")


def path_of(path: object, name: str) -> Path:
    """Return an argument, a str or a Path, as a Path; raises InputError for any other value. `name` is the argument."""
    check_type(name, path, str | PathLike, "a path, a str or a Path", "write it as in 'outputs/mine'")
    return Path(path)  # type: ignore[arg-type]  # `check_type` makes sure of its type


def read_bytes(path: Path | str, name: str) -> bytes:
    """Return the content of a file as bytes. `name` is the key or flag that specifies the file.

    Raises InputError if the file is missing, unreadable or too large, or if it is a folder, a pipe or a device.
    """
    content = b""
    try:
        # Only a regular file is opened, because reading a pipe would block, and a device may be endless.
        is_regular = stat.S_ISREG(Path(path).stat().st_mode)
        if is_regular:
            with Path(path).open("rb") as file:
                content = file.read(MOST_BYTES + 1)  # the additional byte shows that a file is too large
    except FileNotFoundError as error:
        raise validation_error(name, str(path), "", "a file that exists", "check the path") from error
    except (OSError, ValueError) as error:  # a ValueError means an invalid name, for example one with a null byte
        reason = getattr(error, "strerror", None) or str(error)  # `strerror` is the message of an OSError, without path
        bound = f"a file that can be read ({reason})"
        raise validation_error(name, str(path), "", bound, "check its name and permissions") from error
    if not is_regular:
        raise validation_error(name, str(path), "", "a regular file, not a folder, pipe or device", "name a file")
    if len(content) > MOST_BYTES:
        bound = f"a file of at most {MOST_BYTES // 2**20} MiB"
        raise validation_error(name, str(path), "", bound, "name a smaller file")
    return content


def read_toml(path: Path, name: str) -> dict[str, Any]:
    """Return the tables of a TOML file. `name` is the key or flag that specifies the file.

    Raises InputError if the file cannot be read, is larger than 16 MiB or is not valid TOML.
    """
    content = read_bytes(path, name)
    # Some editors write UTF-16 files, which begin with a byte order mark. In a UTF-8 file such a mark is skipped.
    is_utf16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    encoding = "utf-16" if is_utf16 else "utf-8-sig"
    try:
        return parse_toml(content.decode(encoding))
    except UnicodeDecodeError as error:
        line = 1 + error.object.count(b"\n", 0, error.start)  # lines are numbered from 1
        reason = f"line {line} is not UTF-8 text"
        hint = "save the file in UTF-8"
    except ValueError as error:
        reason = str(error).splitlines()[0]  # the message of an error must be one line
        hint = "correct the file at that position"
    raise validation_error(name, str(path), "", f"valid TOML ({reason})", hint)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML document. Raises ValueError if it is invalid or nested too deeply."""
    too_deep_message = f"nested deeper than {MOST_LEVELS} levels"
    if _DEEP_KEY.search(text):  # before parsing, which is slow for such a key
        raise ValueError(too_deep_message)
    try:
        tables = tomllib.loads(text)
    except RecursionError as error:  # the parser calls itself for each level of nested lists
        raise ValueError(too_deep_message) from error
    if _is_deeper(tables, MOST_LEVELS):
        raise ValueError(too_deep_message)
    return tables


def _is_deeper(tables: dict[str, Any], levels: int) -> bool:
    """Return whether tables and lists are nested deeper than `levels`; `tables` itself is the first level.

    The search proceeds level by level without recursion, because a malicious file could exhaust the stack.
    """
    containers: list[dict[str, Any] | list[Any]] = [tables]  # all tables and lists at one level
    for _ in range(levels):
        next_level = []
        for container in containers:
            values = container.values() if isinstance(container, dict) else container
            next_level += [value for value in values if isinstance(value, dict | list)]
        containers = next_level
    return len(containers) > 0  # whether there is a level below the last allowed one
