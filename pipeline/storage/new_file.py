"""Files beside an output folder that a command writes where it is told to, and never over another one unasked."""

import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import InputError, validation_error

_OR_FORCE = "choose another name, or add --force"


@dataclass(frozen=True)
class NewFile:
    """A text file that is to be written, and the flag that named it."""

    path: Path
    text: str
    flag: str


def refuse_existing(files: Sequence[NewFile], *, force: bool = False) -> None:
    """Raise InputError where a file is there and not forced, where a folder is in its place, or where two are one."""
    for place, file in enumerate(files):
        shown = str(file.path)
        if file.path.exists() and not force:
            raise validation_error(file.flag, shown, "", "a file that is not there yet", _OR_FORCE)
        if file.path.is_dir() or not file.path.parent.is_dir():
            raise validation_error(file.flag, shown, "", "a file in a folder that is there", "choose another place")
        if file.path.resolve() in [other.path.resolve() for other in files[:place]]:
            raise validation_error(
                file.flag, shown, "", "another file than that of the other flag", "choose another name"
            )


def write_all_new(files: Sequence[NewFile], *, force: bool = False) -> None:
    """Write text files, none where one of them is refused; raises InputError as `refuse_existing` and `write_new`."""
    refuse_existing(files, force=force)
    for file in files:
        write_new(file.path, file.text, file.flag, force=force)


def write_new(path: Path, text: str, flag: str, *, force: bool = False, remedy: str = _OR_FORCE) -> None:
    """Write a text file, whole or not at all.

    Raises InputError where a file of this name exists and `force` is not set, or where the place cannot be written. The
    error names the file by its `flag`, and for a file that exists says the `remedy`.
    """
    part = _part(path)
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        if not force:
            path.touch(exist_ok=False)  # claims the name: of two writers only one gets past this
        part.replace(path)
    except FileExistsError as error:
        raise validation_error(flag, str(path), "", "a file that is not there yet", remedy) from error
    except OSError as error:
        raise _not_writable(path, flag, error) from error
    finally:
        with suppress(OSError):
            part.unlink()


def refuse_unwritable(path: Path, flag: str, remedy: str = _OR_FORCE) -> None:
    """Raise InputError as `write_new` would without `force`; the place is tried, and nothing is left there."""
    part = _part(path)
    try:
        if os.path.lexists(path):
            raise validation_error(flag, str(path), "", "a file that is not there yet", remedy)
        part.touch()
        part.unlink()
    except OSError as error:
        raise _not_writable(path, flag, error) from error


def _part(path: Path) -> Path:
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def _not_writable(path: Path, flag: str, error: OSError) -> InputError:
    bound = f"a place that can be written ({error.strerror})"
    return validation_error(flag, str(path), "", bound, "choose another place")
