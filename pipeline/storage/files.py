"""Files that a command writes where it is told to: whole or not at all, and never over what somebody else wrote.

The cache keeps the digest of each file that was written so.
"""

import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pipeline.storage.cache import store, stored
from pipeline.storage.digests import REPORT, file_digest, is_regular, keep_aside, kind_of
from pipeline.storage.folder import written_beside
from pipeline.storage.interrupts import interruptible
from sensor.quantity import InputError, validation_error

Content = bytes | Callable[[Path], object]
"""The bytes of a file, or a function that writes them to a path."""

_WRITTEN = "written"


def refuse_taken(paths: Iterable[Path], flag: str, *, force: bool = False, renew: bool = False) -> None:
    """Raise InputError, which names the flag, where something is in one of these places, or nothing can be.

    With `renew`, a file that `write_files` wrote and nobody changed may be replaced. With `force`, any file may be, but
    never a folder, a link, a pipe or a device. The output folder of a run takes no other file at all: its next run
    would refuse it.
    """
    for path in paths:
        existing = next(folder for folder in path.absolute().parents if folder.exists())
        try:
            with tempfile.TemporaryFile(dir=existing):
                pass
        except OSError as error:
            raise _not_writable(path, flag, error) from error
        if is_regular(path.parent / REPORT):
            bound = "a file outside the output folder of a run, which would refuse it"
            raise validation_error(flag, str(path), "", bound, f"name another place with {flag}")
        if os.path.lexists(path) and not is_regular(path):
            bound = f"a file, and a {kind_of(path)} is there"
            raise validation_error(flag, str(path), "", bound, f"name another place with {flag}")
        if not force and os.path.lexists(path) and not (renew and is_ours(path)):
            bound = "a new file, or an unchanged one of this command" if renew else "a file that is not there yet"
            hint = f"name another one with {flag}, or keep this one as NAME.bak with --force"
            raise validation_error(flag, str(path), "", bound, hint)


def write_files(files: Mapping[Path, Content], flag: str, *, force: bool = False, renew: bool = False) -> list[Path]:
    """Write each file aside and rename it; return their paths.

    Raises InputError as `refuse_taken` before one is written; with `force` what is there is kept as NAME.bak instead.
    """
    refuse_taken(files, flag, force=force, renew=renew)
    for path, content in files.items():
        try:
            with written_beside(path, flag) as folder:
                part = folder / "part"
                with interruptible():
                    if isinstance(content, bytes):
                        part.write_bytes(content)
                    else:
                        content(part)
                digest = file_digest(part)
                refuse_taken([path], flag, force=force, renew=renew)  # once more: the content may have taken long
                if os.path.lexists(path) and not (renew and is_ours(path)):
                    keep_aside(path, path.parent)
                part.replace(path)
        except OSError as error:
            raise _not_writable(path, flag, error) from error
        store(_WRITTEN, digest, result=True)
    return list(files)


def _not_writable(path: Path, flag: str, error: OSError) -> InputError:
    bound = f"a file in a place that can be written ({error.strerror})"
    return validation_error(flag, str(path), "", bound, f"name another place with {flag}")


def is_ours(path: Path) -> bool:
    """Say whether a file has the content that `write_files` once wrote."""
    return is_regular(path) and stored(_WRITTEN, file_digest(path), bool) is True
