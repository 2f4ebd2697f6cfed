"""Files that a command writes to a path chosen by the user.

A file is written completely or not at all, and never replaces a file that is not from this program. To recognise the
files of this program, the cache stores the digest of each file that is written.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pipeline.storage.cache import load_stored, store
from pipeline.storage.digests import REPORT, file_digest, has_digest, is_regular, keep_aside, kind_of
from pipeline.storage.folder import write_beside
from pipeline.storage.interrupts import interruptible
from sensor.quantity import InputError, validation_error

Content = bytes | Callable[[Path], object]
"""The content of a file, or a function that writes it to a path."""

_WRITTEN = "written"  # name of the stage under which the cache stores the digests of written files


def check_paths_are_free(paths: Iterable[Path], flag: str, *, force: bool = False) -> None:
    """Raise InputError if a file cannot be written to one of these paths.

    `flag` is the command-line flag that the message names. An existing file must be one that `write_files` wrote and
    that was not changed since; with `force`, any file is accepted. A folder, a link, a pipe or a device is never
    replaced. No file can be added to the output folder of a run, because the next run would reject the folder.
    """
    for path in paths:
        _check_creatable(path, flag)
        if is_regular(path.parent / REPORT):
            bound = "a file outside the output folder of a run, because the next run would reject this file"
            raise validation_error(flag, str(path), "", bound, f"choose another path with {flag}")
        if os.path.lexists(path) and not is_regular(path):
            bound = f"the path of a file, but it is a {kind_of(path)}"
            raise validation_error(flag, str(path), "", bound, f"choose another path with {flag}")
        if os.path.lexists(path) and not force and not is_ours(path):
            bound = "a new file, or a file that a command wrote and that is unchanged"
            hint = f"choose another path with {flag}, or keep this file as NAME.bak with --force"
            raise validation_error(flag, str(path), "", bound, hint)


def _check_creatable(path: Path, flag: str) -> None:
    """Raise InputError if no file can be created in the nearest existing folder above a path.

    As a test, a temporary file is created there and removed at once.
    """
    nearest_folder = next(folder for folder in path.absolute().parents if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=nearest_folder):
            pass
    except OSError as error:
        raise _write_error(path, flag, error) from error


def write_files(files: Mapping[Path, Content], flag: str, *, force: bool = False) -> list[Path]:
    """Write each file beside its path, move it to this path when it is complete, and return all paths.

    `files` holds the content of each file, keyed by path, and `flag` is the command-line flag that messages name. A
    file that already has the given bytes is left unchanged. With `force`, an existing file that is not from this
    program is kept as NAME.bak. The cache stores the digest of each new file, so that `is_ours` recognises it later.

    Raises InputError if `check_paths_are_free` rejects a path, or if a file cannot be written. All paths are checked
    before the first file is written, and each path again just before its file is moved there.
    """
    changed_files = {path: content for path, content in files.items() if not _has_content(path, content)}
    check_paths_are_free(changed_files, flag, force=force)
    for path, content in changed_files.items():
        digest = _write_file(path, content, flag, force=force)
        store(_WRITTEN, digest, result=True)
    return list(files)


def _write_file(path: Path, content: Content, flag: str, *, force: bool) -> str:
    """Write a file beside its path, move it to this path when it is complete, and return its digest.

    With `force`, an existing file that is not from this program is kept as NAME.bak.
    """
    try:
        with write_beside(path, flag) as folder:
            part = folder / "part"
            with interruptible():
                if isinstance(content, bytes):
                    part.write_bytes(content)
                else:
                    content(part)
            digest = file_digest(part)
            check_paths_are_free([path], flag, force=force)  # again, because writing the content may take long
            if os.path.lexists(path) and not is_ours(path):
                keep_aside(path, path.parent)
            part.replace(path)
    except OSError as error:
        raise _write_error(path, flag, error) from error
    return digest


def _has_content(path: Path, content: Content) -> bool:
    """Return whether a file already contains the given bytes; False if the content is a function that writes it."""
    return isinstance(content, bytes) and has_digest(path, hashlib.sha256(content).hexdigest())


def _write_error(path: Path, flag: str, error: OSError) -> InputError:
    """Return the InputError for a path at which the operating system cannot write a file."""
    bound = f"a file in a folder that can be written ({error.strerror})"
    return validation_error(flag, str(path), "", bound, f"choose another path with {flag}")


def is_ours(path: Path) -> bool:
    """Return whether a file has the same content as a file that `write_files` wrote."""
    return is_regular(path) and load_stored(_WRITTEN, file_digest(path), bool) is True
