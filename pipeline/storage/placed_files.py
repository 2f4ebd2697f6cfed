"""Single files put into a person's folder: one that is there already is replaced only where it still has our seal."""

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from cad.quantity import InputError, fault
from pipeline.storage.belongings import keep_aside
from pipeline.storage.seal import has_seal, sealed


def refuse_taken(folder: Path, names: Iterable[str], flag: str) -> None:
    """Raise InputError when a folder has something of one of these names that is not as we wrote it."""
    for name in names:
        path = folder / name
        if os.path.lexists(path) and not has_seal(path):
            bound = f"a folder where only unchanged files of this command are replaced, and its {name!r} is none"
            remedy = f"name another folder with {flag}, move this file away, or keep it as NAME.bak with --force"
            raise fault(flag, str(folder), "", bound, remedy)


def place_files(folder: Path, files: Mapping[str, bytes], flag: str, *, force: bool = False) -> list[Path]:
    """Write files, sealed, into a folder, all or none of them; return their paths.

    Raises InputError as `refuse_taken`, unless `force` keeps what is there as NAME.bak, and where the folder cannot be
    written; the message names the flag that gave the folder.
    """
    if not force:
        refuse_taken(folder, files, flag)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".twintip-") as name:
            aside, before = Path(name) / "new", Path(name) / "old"
            aside.mkdir()
            before.mkdir()
            for file, content in files.items():
                (aside / file).write_bytes(sealed(file, content))
            for file in files:
                _replace(aside / file, folder / file, before / file, flag, force=force)
    except OSError as error:
        raise _not_writable(folder, flag, error) from error
    return [folder / file for file in files]


def _replace(new: Path, place: Path, before: Path, flag: str, *, force: bool) -> None:
    """Move aside what is in the place, look at it there, where nobody changes it, and take the place."""
    if os.path.lexists(place):
        place.rename(before)
        if not has_seal(before):
            if not force:
                before.rename(place)
                refuse_taken(place.parent, [place.name], flag)
            keep_aside(before, place.parent)
    new.rename(place)


def _not_writable(folder: Path, flag: str, error: OSError) -> InputError:
    bound = f"a folder that can be written ({error.strerror})"
    return fault(flag, str(folder), "", bound, f"name another folder with {flag}")
