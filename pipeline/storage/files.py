"""Files that a command writes to a path of the user's choice: completely or not at all, and never over foreign files.

The cache stores the digest of each file that was written in this way, which identifies it later.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pipeline.storage.cache import store, stored
from pipeline.storage.digests import REPORT, file_digest, has_digest, is_regular, keep_aside, kind_of
from pipeline.storage.folder import write_beside
from pipeline.storage.interrupts import interruptible
from sensor.quantity import InputError, validation_error

Content = bytes | Callable[[Path], object]
"""The bytes of a file, or a function that writes them to a path."""

_WRITTEN = "written"  # stage of the cache whose entries are the digests of written files


def refuse_taken(paths: Iterable[Path], flag: str, *, force: bool = False) -> None:
    """Raise InputError if a file could not be written to one of these paths; the message names `flag`.

    An existing file must be one that `write_files` wrote and nobody changed; with `force` any file will do. A folder, a
    link, a pipe or a device is never replaced. The output folder of a run accepts no further file, because the next run
    would reject it.
    """
    for path in paths:
        nearest_folder = next(folder for folder in path.absolute().parents if folder.exists())
        try:
            with tempfile.TemporaryFile(dir=nearest_folder):
                pass  # this only tests whether a file can be created there
        except OSError as error:
            raise _not_writable(path, flag, error) from error
        if is_regular(path.parent / REPORT):
            bound = "a file outside the output folder of a run, which would refuse it"
            raise validation_error(flag, str(path), "", bound, f"name another place with {flag}")
        if os.path.lexists(path) and not is_regular(path):
            bound = f"the name of a file, but it is that of a {kind_of(path)}"
            raise validation_error(flag, str(path), "", bound, f"name another place with {flag}")
        if os.path.lexists(path) and not force and not is_ours(path):
            bound = "a new file, or one that a command wrote and nobody changed"
            hint = f"name another one with {flag}, or keep this one as NAME.bak with --force"
            raise validation_error(flag, str(path), "", bound, hint)


def write_files(files: Mapping[Path, Content], flag: str, *, force: bool = False) -> list[Path]:
    """Write the content of each file beside its path and rename it; return the paths.

    A file that already has these bytes is left unchanged. With `force` a foreign file is kept as NAME.bak. Raises
    InputError like `refuse_taken`, before anything is written.
    """
    new = {path: content for path, content in files.items() if not _has_content(path, content)}
    refuse_taken(new, flag, force=force)
    for path, content in new.items():
        try:
            with write_beside(path, flag) as folder:
                part = folder / "part"
                with interruptible():
                    if isinstance(content, bytes):
                        part.write_bytes(content)
                    else:
                        content(part)
                digest = file_digest(part)
                refuse_taken([path], flag, force=force)  # again, because producing the content may have taken long
                if os.path.lexists(path) and not is_ours(path):
                    keep_aside(path, path.parent)
                part.replace(path)
        except OSError as error:
            raise _not_writable(path, flag, error) from error
        store(_WRITTEN, digest, result=True)
    return list(files)


def _has_content(path: Path, content: Content) -> bool:
    """Return whether a file already has the bytes to be written; False for a function that writes the content."""
    return isinstance(content, bytes) and has_digest(path, hashlib.sha256(content).hexdigest())


def _not_writable(path: Path, flag: str, error: OSError) -> InputError:
    bound = f"a file in a place that can be written ({error.strerror})"
    return validation_error(flag, str(path), "", bound, f"name another place with {flag}")


def is_ours(path: Path) -> bool:
    """Return whether a file has the content of some file that `write_files` wrote."""
    return is_regular(path) and stored(_WRITTEN, file_digest(path), bool) is True
