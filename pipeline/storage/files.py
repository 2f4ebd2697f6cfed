"""Single files put into a person's folder: one that is there is replaced only where it is as we wrote it.

The cache keeps the digest of each file that was written so.
"""

import hashlib
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.storage.cache import is_kept, store
from pipeline.storage.digests import REPORT, file_digest, is_regular, keep_aside

_WRITTEN = "written"


def is_ours(path: Path) -> bool:
    """Say whether a file has the content that `place_files` once wrote."""
    return is_regular(path) and is_kept(_WRITTEN, file_digest(path))


def refuse_taken(folder: Path, names: Iterable[str], flag: str, *, file: Path | None = None) -> None:
    """Raise InputError where a folder has something of one of these names that is not as we wrote it.

    So does an output folder: its next run would refuse what it did not write. Where `file` is given, the flag gave the
    path of that one file, else the folder.
    """
    noun = "folder" if file is None else "file"
    shown = str(file or folder)
    if is_regular(folder / REPORT):
        hint = f"name another {noun} with {flag}: the next run would refuse a folder with other files in it"
        raise validation_error(flag, shown, "", f"a {noun} outside the output folder of a run", hint)
    for name in names:
        path = folder / name
        if os.path.lexists(path) and not is_ours(path):
            bound = f"a {noun} where no other file is replaced, and {path.name!r} is not as this command wrote it"
            hint = f"name another {noun} with {flag}, move this file away, or keep it as NAME.bak with --force"
            raise validation_error(flag, shown, "", bound, hint)


def place_file(path: Path, content: bytes, flag: str, *, force: bool = False) -> Path:
    """Write one file and return its path; raises InputError as `place_files`, which names the file."""
    (placed,) = place_files(path.parent, {path.name: content}, flag, force=force, file=path)
    return placed


def place_files(
    folder: Path, files: Mapping[str, bytes], flag: str, *, force: bool = False, file: Path | None = None
) -> list[Path]:
    """Write files aside, then move each to its place in a folder; return their paths.

    Raises InputError as `refuse_taken`, unless `force` keeps what is there as NAME.bak, and where the folder cannot be
    written; the message names the flag that gave the folder or the file.
    """
    if not force:
        refuse_taken(folder, files, flag, file=file)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".twintip-") as aside:
            for name, content in files.items():
                Path(aside, name).write_bytes(content)
            for name, content in files.items():
                path = folder / name
                if os.path.lexists(path) and not is_ours(path):
                    keep_aside(path, folder)
                Path(aside, name).replace(path)
                store(_WRITTEN, hashlib.sha256(content).hexdigest(), True)  # noqa: FBT003 - any value marks it
    except OSError as error:
        raise _not_writable(folder if file is None else file, flag, error) from error
    return [folder / name for name in files]


def _not_writable(path: Path, flag: str, error: OSError) -> InputError:
    bound = f"a place that can be written ({error.strerror})"
    return validation_error(flag, str(path), "", bound, f"name another one with {flag}")
