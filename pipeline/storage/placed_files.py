"""Single files put into a person's folder: one that is there already is replaced only where it still has our seal.

A flag gives either the folder or, where `file` is given, the path of the one file: messages name what was given.
"""

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.storage.belongings import REPORT, keep_aside
from pipeline.storage.seal import has_seal, sealed


def refuse_taken(folder: Path, names: Iterable[str], flag: str, *, file: Path | None = None) -> None:
    """Raise InputError when a folder has something of one of these names that is not as we wrote it.

    So does a folder as a run left it: its next run would refuse what it did not write.
    """
    noun = "folder" if file is None else "file"
    if has_seal(folder / REPORT):
        where = "that is not the output folder of a run" if file is None else "outside the output folder of a run"
        remedy = f"name another {noun} with {flag}: the next run would refuse a folder with other files in it"
        raise validation_error(flag, str(file or folder), "", f"a {noun} {where}", remedy)
    for name in names:
        path = folder / name
        if os.path.lexists(path) and not has_seal(path):
            raise _taken(path, flag, file)


def _taken(path: Path, flag: str, file: Path | None) -> InputError:
    """Return the error for a place that a person's file has."""
    keep = "move this file away, or keep it as NAME.bak with --force"
    if file is not None:
        bound = "a new file, or an unchanged one of this command"
        return validation_error(flag, str(file), "", bound, f"name another file with {flag}, {keep}")
    bound = f"a folder where only unchanged files of this command are replaced, and its {path.name!r} is none"
    return validation_error(flag, str(path.parent), "", bound, f"name another folder with {flag}, {keep}")


def place_file(path: Path, content: bytes, flag: str, *, force: bool = False) -> Path:
    """Write one file, sealed, and return its path; raises InputError as `place_files`, which names the file."""
    (placed,) = place_files(path.parent, {path.name: content}, flag, force=force, file=path)
    return placed


def place_files(
    folder: Path, files: Mapping[str, bytes], flag: str, *, force: bool = False, file: Path | None = None
) -> list[Path]:
    """Write files, sealed, into a folder, all or none of them; return their paths.

    Raises InputError as `refuse_taken`, unless `force` keeps what is there as NAME.bak, and where the folder cannot be
    written; the message names the flag that gave the folder or the file.
    """
    if not force:
        refuse_taken(folder, files, flag, file=file)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".twintip-") as name:
            aside, before = Path(name) / "new", Path(name) / "old"
            aside.mkdir()
            before.mkdir()
            for each, content in files.items():
                (aside / each).write_bytes(sealed(each, content))
            for each in files:
                if not _replaced(aside / each, folder / each, before / each, force=force):
                    raise _taken(folder / each, flag, file)
    except OSError as error:
        raise _not_writable(folder, flag, file, error) from error
    return [folder / each for each in files]


def _replaced(new: Path, place: Path, before: Path, *, force: bool) -> bool:
    """Move aside what is in the place, look at it there, where nobody changes it, and take the place.

    False where it is a person's: it is put back.
    """
    if os.path.lexists(place):
        place.rename(before)
        if not has_seal(before):
            if not force:
                before.rename(place)
                return False
            keep_aside(before, place.parent)
    new.rename(place)
    return True


def _not_writable(folder: Path, flag: str, file: Path | None, error: OSError) -> InputError:
    noun = "folder" if file is None else "file"
    bound = f"a {noun} that can be written ({error.strerror})"
    return validation_error(flag, str(file or folder), "", bound, f"name another {noun} with {flag}")
