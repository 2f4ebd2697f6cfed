"""Outputs appear whole: written into a hidden folder beside their place, moved there at the end, or not at all."""

import errno
import fcntl
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.storage.belongings import REPORT, foreign_files, is_whole, keep_aside, own_files
from pipeline.storage.interruption import hold

_OF_THE_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


class OutputError(InputError):
    """An output folder that cannot be used; the message is one line: folder, bound, remedy."""


@contextmanager
def output_folder(path: Path | None, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `path` when the block ends well, and vanishes when it does not.

    Without a path it vanishes either way. Of the folder before it only files as its report.json lists them are
    dropped. Raises OutputError before the block runs when `path` cannot be written, is in use by another run, or holds
    anything else; with `force` that is kept as NAME.bak instead.
    """
    if path is None:
        with tempfile.TemporaryDirectory(prefix="twintip-") as name, _named(Path(name)):
            yield Path(name)
        return
    target = _usable(path)
    with _parents_of(target), _locked(target):
        _recover(target)
        if not force:
            refuse_foreign(target)
        new = _beside(target, "new")
        try:
            _make(new)
            with _named(target):
                yield new
            _refuse_unlisted(new)
            hold()
            _publish(new, target, force=force)
        finally:
            hold()
            shutil.rmtree(new, ignore_errors=True)


@contextmanager
def _named(folder: Path) -> Iterator[None]:
    """Give an error of a full or broken disk the folder's name: `write` has none, unlike `open`."""
    try:
        yield
    except OSError as error:
        if error.errno in _OF_THE_DISK and error.filename is None:
            error.filename = str(folder)
        raise


def refuse_unusable(path: Path, *, force: bool = False) -> None:
    """Raise OutputError when `output_folder` would refuse this place; makes nothing and takes no lock."""
    target = _usable(path)
    if not force:
        refuse_foreign(target)


def whole_report(path: Path) -> bytes | None:
    """Return the report.json of an output folder that is as its last run left it; None for any other.

    Raises OutputError where the place cannot be used or is in use by a run.
    """
    target = _usable(path)
    if not target.parent.is_dir():
        return None
    with _locked(target):
        _recover(target)
        return (target / REPORT).read_bytes() if target.is_dir() and is_whole(target) else None


def refuse_foreign(folder: Path) -> None:
    """Raise OutputError when a folder holds anything but the files of its report.json as they were written."""
    foreign = foreign_files(folder) if folder.exists() else []
    if foreign:
        more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
        bound = f"a new or empty folder, or one with the unchanged files of its last run, and it holds {foreign[0]!r}"
        remedy = "name another folder with --out, move these files away, or keep them as NAME.bak with --force"
        raise _refused(folder, f"{bound}{more}", remedy)


def _refuse_unlisted(folder: Path) -> None:
    """Raise ValueError when the new folder holds a file that the next run would take for somebody else's."""
    unlisted = foreign_files(folder)
    if unlisted:
        msg = f"output {unlisted[0]!r}: must be listed in report.json; write it before the report"
        raise ValueError(msg)


def _refused(folder: Path, bound: str, remedy: str) -> OutputError:
    return OutputError(str(validation_error("--out", str(folder), "", bound, remedy)))


def _usable(path: Path) -> Path:
    """Return the real place of an output folder; raises OutputError where no folder can be put."""
    try:
        target = path.resolve()
        here = Path.cwd()
        existing = target
        while not existing.exists():
            existing = existing.parent
    except (OSError, RuntimeError) as error:
        raise _refused(path, f"a path that leads somewhere ({error})", "name another folder with --out") from error
    if not existing.is_dir():
        bound = f"a folder, and {str(existing)!r} is a file"
        raise _refused(path, bound, "name another folder with --out")
    if target == here or target in here.parents or target.is_mount():
        bound = "a folder that can be replaced, not the current one, one above it or a mounted one"
        raise _refused(path, bound, "name a folder inside it")
    parent = existing if existing != target else target.parent
    if not os.access(parent, os.W_OK | os.X_OK):
        bound = f"in a folder that can be written, and {str(parent)!r} cannot"
        raise _refused(path, bound, "name another folder with --out, or change its permissions")
    return target


def _beside(target: Path, purpose: str) -> Path:
    return target.with_name(f".{target.name}.twintip-{purpose}")


def _make(folder: Path) -> None:
    try:
        folder.mkdir()
    except OSError as error:
        raise _not_writable(folder, error) from error


def _not_writable(folder: Path, error: OSError) -> OutputError:
    bound = f"in a folder that can be written ({error.strerror})"
    return _refused(folder, bound, "name another folder with --out, or change its permissions")


@contextmanager
def _parents_of(target: Path) -> Iterator[None]:
    """Make the missing folders above a target; take them away again when nothing came to stand in them."""
    missing = [folder for folder in target.parents if not folder.exists()]
    try:
        for folder in reversed(missing):
            try:
                folder.mkdir(exist_ok=True)
            except OSError as error:
                raise _not_writable(target, error) from error
        yield
    finally:
        with suppress(OSError):  # not empty: something stands in it, here or from another run
            for folder in missing:
                folder.rmdir()


@contextmanager
def _locked(target: Path) -> Iterator[None]:
    """Hold the lock of a target; the kernel frees it when a run is killed, so no stale lock refuses the next one."""
    path = _beside(target, "lock")
    handle = _lock(path, target)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(handle)


def _lock(path: Path, target: Path) -> int:
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o644)
        except OSError as error:
            raise _not_writable(target, error) from error
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(handle)
            bound = "a folder that no other run is writing"
            raise _refused(target, bound, "wait for that run, or name another folder with --out") from error
        if os.fstat(handle).st_size:
            os.close(handle)
            raise _refused(target, f"one whose lock {path.name!r} is empty, as ours are", "move that file away")
        if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
            return handle
        os.close(handle)  # its last owner removed this file between the two calls


def _recover(target: Path) -> None:
    """Clear what a killed run left: its unfinished folder goes, a result that it had moved aside comes back."""
    new, old = _beside(target, "new"), _beside(target, "old")
    shutil.rmtree(new, ignore_errors=True)
    if old.exists():
        if target.exists():
            _drop(old, target)
        else:
            old.rename(target)


def _publish(new: Path, target: Path, *, force: bool) -> None:
    """Move the folder before it aside, look at it once more where nobody writes any longer, and take its place."""
    old = _beside(target, "old")
    try:
        if target.exists():
            new.chmod(stat.S_IMODE(target.stat().st_mode))
            target.rename(old)
            if not force and foreign_files(old):
                old.rename(target)
                refuse_foreign(target)
        new.rename(target)
    except OSError as error:
        if old.exists() and not target.exists():
            old.rename(target)
        raise _not_writable(target, error) from error
    if old.exists():
        _drop(old, target)


def _drop(old: Path, target: Path) -> None:
    """Remove what a run had written into a folder that was moved aside; what else it holds goes to the target."""
    with suppress(OSError):  # what stays is found by the next run
        for name in own_files(old):
            (old / name).unlink()
        for left in sorted(old.iterdir()):
            keep_aside(left, target)
        old.rmdir()
