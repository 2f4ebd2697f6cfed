"""The reader of all files that a user gives: regular files of at most 16 MiB, and TOML in UTF-8 or UTF-16."""

import codecs
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from sensor.quantity import validation_error

MOST_BYTES = 16 * 2**20
MOST_LEVELS = 16  # maximum nesting of tables and lists; a design file has four levels
# A dotted key of more than MOST_LEVELS names. The time of Python's parser grows with the square of their number.
_NAME = r"""(?:"[^"\n]*"|'[^'\n]*'|[^\s.,=#"']+)[ \t]*"""
_DEEP_KEY = re.compile(rf"(?<![^\s\[{{,])(?:{_NAME}\.[ \t]*){{{MOST_LEVELS}}}")


def read_bytes(path: Path | str, name: str) -> bytes:
    """Return the bytes of a file that the key or flag `name` gives.

    Raises InputError for a missing or unreadable file, a pipe, a device, and a file that is too large.
    """
    content = b""
    try:
        # Reading a pipe would block, and a device may be endless.
        is_regular = stat.S_ISREG(Path(path).stat().st_mode)
        if is_regular:
            with Path(path).open("rb") as file:
                content = file.read(MOST_BYTES + 1)
    except FileNotFoundError as error:
        raise validation_error(name, str(path), "", "a file that exists", "check the path") from error
    except (OSError, ValueError) as error:  # ValueError: no file can have such a name
        reason = getattr(error, "strerror", None) or str(error)
        bound = f"a file that can be read ({reason})"
        raise validation_error(name, str(path), "", bound, "check its name and permissions") from error
    if not is_regular:
        raise validation_error(name, str(path), "", "a regular file, not a folder, pipe or device", "name a file")
    if len(content) > MOST_BYTES:
        bound = f"a file of at most {MOST_BYTES // 2**20} MiB"
        raise validation_error(name, str(path), "", bound, "name a smaller file")
    return content


def read_toml(path: Path, name: str) -> dict[str, Any]:
    """Return the tables of a TOML file that the key or flag `name` gives.

    Raises InputError like `read_bytes`, and for a file that is not valid TOML.
    """
    content = read_bytes(path, name)
    # Some editors write UTF-16, which begins with a byte order mark.
    in_utf16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    hint = "correct the file at that place"
    try:
        return parse_toml(content.decode("utf-16" if in_utf16 else "utf-8-sig"))
    except UnicodeDecodeError as error:
        line = 1 + error.object.count(b"\n", 0, error.start)
        reason = f"line {line} is not text in UTF-8"
        hint = "save the file as UTF-8"
    except ValueError as error:
        reason = str(error).splitlines()[0]
    raise validation_error(name, str(path), "", f"valid TOML ({reason})", hint)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text; raises ValueError for invalid TOML and for nesting that is too deep."""
    too_deep = f"nested deeper than {MOST_LEVELS} levels"
    if _DEEP_KEY.search(text):
        raise ValueError(too_deep)
    try:
        tables = tomllib.loads(text)
    except RecursionError as error:
        raise ValueError(too_deep) from error
    if _is_deeper(tables, MOST_LEVELS):
        raise ValueError(too_deep)
    return tables


def _is_deeper(tables: dict[str, Any], levels: int) -> bool:
    """Return whether tables and lists are nested deeper than `levels`.

    The levels are searched one after another, because a hostile file could exhaust the stack of a recursion.
    """
    containers: list[dict[str, Any] | list[Any]] = [tables]
    for _ in range(levels):
        inside = []
        for container in containers:
            values = container.values() if isinstance(container, dict) else container
            inside += [value for value in values if isinstance(value, dict | list)]
        containers = inside
    return len(containers) > 0
