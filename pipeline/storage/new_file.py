"""Files beside an output folder that a command writes where it is told to, and never over another one unasked."""

import os
from contextlib import suppress
from pathlib import Path

from cad.quantity import InputError, fault

_OR_FORCE = "choose another name, or add --force"


def write_new(path: Path, text: str, flag: str, *, force: bool = False, remedy: str = _OR_FORCE) -> None:
    """Write a text file whole or not at all; raises InputError where one is there, unless forced, or none can be.

    `remedy` is what to do about a file that is there already.
    """
    part = _part(path)
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        if not force:
            path.touch(exist_ok=False)  # claims the name: of two writers only one gets past this
        part.replace(path)
    except FileExistsError as error:
        raise fault(flag, str(path), "", "a file that is not there yet", remedy) from error
    except OSError as error:
        raise _not_writable(path, flag, error) from error
    finally:
        with suppress(OSError):
            part.unlink()


def refuse_unwritable(path: Path, flag: str, remedy: str = _OR_FORCE) -> None:
    """Raise InputError where a file is there already, or none can be written; nothing stays of the attempt."""
    part = _part(path)
    try:
        if os.path.lexists(path):
            raise fault(flag, str(path), "", "a file that is not there yet", remedy)
        part.touch()
        part.unlink()
    except OSError as error:
        raise _not_writable(path, flag, error) from error


def _part(path: Path) -> Path:
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def _not_writable(path: Path, flag: str, error: OSError) -> InputError:
    bound = f"a place that can be written ({error.strerror})"
    return fault(flag, str(path), "", bound, "choose another place")
