"""Files that a study writes for a person: each is replaced only where it still is as this study wrote it."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.storage.digests import file_digest, is_regular, keep_aside
from pipeline.study.store import STORE, StudyStore, stored_study

_FACT = "files"  # sha256 by path


def refuse_taken(folder: Path, paths: Iterable[Path], flag: str) -> None:
    """Raise InputError where a file is in the way that the study of a folder did not write, or that was changed."""
    present = [path for path in paths if os.path.lexists(path)]
    if not present:
        return
    if not (folder / STORE).is_file():
        raise _taken(present[0], flag)
    with stored_study(folder) as store:
        for path in present:
            if not is_own(store, path):
                raise _taken(path, flag)


def refuse_no_folder(path: Path, folder: Path, flag: str) -> None:
    """Raise InputError where a file is to stand in a folder that is not there; that of the study will be."""
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise validation_error(flag, str(path), "", "a file in a folder that is there", "make that folder first")


def write_output(
    store: StudyStore, path: Path, content: bytes | Callable[[Path], object], flag: str, *, force: bool = False
) -> None:
    """Write a file, or let a function write it, whole or not at all; `force` keeps what is in the way as NAME.bak.

    Raises InputError as `refuse_taken`, and where the file cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, bytes):
            part.write_bytes(content)
        else:
            content(part)
        if os.path.lexists(path) and not is_own(store, path):
            if not force:
                raise _taken(path, flag)
            keep_aside(path, path.parent)
        digest = file_digest(part)
        part.replace(path)
    except OSError as error:
        bound = f"a file that can be written ({error.strerror})"
        raise validation_error(flag, str(path), "", bound, "name another one") from error
    finally:
        part.unlink(missing_ok=True)
    store.remember(_FACT, {**(store.fact(_FACT) or {}), str(path.resolve()): digest})


def is_own(store: StudyStore, path: Path) -> bool:
    """Say whether a file still is as this study wrote it there."""
    digests = store.fact(_FACT) or {}
    return is_regular(path) and digests.get(str(path.resolve())) == file_digest(path)


def _taken(path: Path, flag: str) -> InputError:
    bound = "a new file, or an unchanged one of this study"
    return validation_error(flag, str(path), "", bound, "name another one, or keep this one as NAME.bak with --force")
