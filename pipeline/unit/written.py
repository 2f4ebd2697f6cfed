"""Files beside an output folder that a command writes where it is told to, and never over another one unasked."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import InputError, fault


@dataclass(frozen=True)
class NewFile:
    """A text file that is to be written, and the flag that named it."""

    path: Path
    text: str
    flag: str

    @property
    def part(self) -> Path:
        """Return where the text is kept until all files are written."""
        return self.path.with_name(f".{self.path.name}.{os.getpid()}.part")


def refuse_existing(files: Sequence[NewFile], *, force: bool = False) -> None:
    """Raise InputError where a file is there and not forced, where a folder is in its place, or where two are one."""
    for place, file in enumerate(files):
        if file.path.exists() and not force:
            raise _not_placed(file, "a file that is not there yet", "choose another name, or add --force")
        if file.path.is_dir() or not file.path.parent.is_dir():
            raise _not_placed(file, "a file in a folder that is there", "choose another place")
        if file.path.resolve() in [other.path.resolve() for other in files[:place]]:
            raise _not_placed(file, "another file than that of the other flag", "choose another name")


def write_new(files: Sequence[NewFile], *, force: bool = False) -> None:
    """Write text files, all of them or none; raises InputError as `refuse_existing`, or where one cannot be written."""
    refuse_existing(files, force=force)
    file = files[0]
    try:
        for file in files:
            file.part.write_text(file.text, encoding="utf-8", newline="\n")
        for file in files:
            file.part.replace(file.path)
    except OSError as error:
        for other in files:
            other.part.unlink(missing_ok=True)
        bound = f"a place that can be written ({error.strerror})"
        raise _not_placed(file, bound, "choose another place") from error


def _not_placed(file: NewFile, bound: str, remedy: str) -> InputError:
    return fault(file.flag, str(file.path), "", bound, remedy)
