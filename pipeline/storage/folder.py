"""The output folder: written aside and renamed whole, one run at a time; a file that no run wrote is never touched.

What a run needs beside the folder NAME is in the hidden folder .NAME.twintip. It holds the lock, the new outputs, and
for the moment between two renames the old ones. A run that was killed leaves it behind, and the next run clears it.
"""

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.storage.digests import KEY, REPORT, content_digest, has_digest, is_regular, keep_aside, kind_of
from pipeline.storage.interrupts import interruptible, uninterrupted
from sensor.input_file import read_bytes
from sensor.quantity import InputError, validation_error

if TYPE_CHECKING:
    from filelock import BaseFileLock

_LOCK, _OLD, _NEW = "lock", "old", "new-"


class OutputError(InputError):
    """An output folder that cannot be used; the message is one line."""


@contextmanager
def output_folder(path: Path | None, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `path` when the block ends well, and vanishes when it does not.

    Without a path it vanishes either way. Of the folder before it only files as its report.json lists them are
    dropped; what the block copies from it stays. Raises OutputError before the block runs when `path` cannot be
    written, is in use by another run, or holds anything else. With `force` that is kept as NAME.bak instead.
    """
    if path is None:
        with uninterrupted(), tempfile.TemporaryDirectory(prefix="twintip-") as name, interruptible():
            yield Path(name)
        return
    target = _usable(path)
    missing = [folder for folder in target.parents if not folder.exists()]
    with uninterrupted():
        try:
            with written_beside(target, "--out") as new:
                refuse_unmanaged(target, force=force)
                with interruptible():
                    yield new
                    _refuse_unlisted(new)
                _publish(new, target, new.with_name(_OLD), force=force)
        finally:
            with suppress(OSError):  # not empty: the outputs stand in it
                for folder in missing:
                    folder.rmdir()


def refuse_unusable(path: Path, *, force: bool) -> None:
    """Raise OutputError where `output_folder` would refuse this place; makes nothing and takes no lock."""
    refuse_unmanaged(_usable(path), force=force)


def whole_report(path: Path) -> bytes | None:
    """Return the report.json of an output folder that is just as its last run left it; None for any other.

    Raises OutputError where the place cannot be used.
    """
    target = _usable(path)
    _clear_after_a_kill(target)
    listed = _listed_digests(target)
    if listed is None or unmanaged_files(target) or not set(listed) <= {file.name for file in target.iterdir()}:
        return None
    return (target / REPORT).read_bytes()


def _clear_after_a_kill(target: Path) -> None:
    """Remove what a run that was killed left beside a folder; a run that is writing keeps its lock, and its files."""
    if _folder_beside(target).exists():
        with suppress(OutputError), written_beside(target, "--out"):
            pass  # to leave it clears


def managed_files(folder: Path) -> list[str]:
    """Return the names of the files in a folder that are as the last run wrote them, report.json last.

    None are where the report is missing or was changed.
    """
    listed = _listed_digests(folder)
    if listed is None:
        return []
    return [*(name for name, digest in sorted(listed.items()) if has_digest(folder / name, digest)), REPORT]


def unmanaged_files(folder: Path) -> list[str]:
    """Return the sorted names of what is in a folder and not as the last run wrote it, links, pipes and folders too."""
    if not folder.exists():
        return []
    managed = set(managed_files(folder))
    names = [path.name for path in folder.iterdir() if path.name not in managed]
    return sorted(names, key=lambda name: (name != REPORT, name))


def refuse_unmanaged(folder: Path, *, force: bool) -> None:
    """Raise OutputError where a folder holds anything but the files of its report.json as they were written.

    With `force` other files are in nobody's way; a folder, a link, a pipe or a device always is.
    """
    names = unmanaged_files(folder)
    for name in names:
        if not is_regular(folder / name):
            bound = f"a folder of files, and it holds {name!r}, a {kind_of(folder / name)}"
            raise _refused(folder, bound, "name another folder with --out, or move that away")
    if names and not force:
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        bound = f"a new or empty folder, or one with the unchanged files of its last run, and it holds {names[0]!r}"
        hint = "name another folder with --out, move these files away, or keep them as NAME.bak with --force"
        raise _refused(folder, f"{bound}{more}", hint)


def _listed_digests(folder: Path) -> dict[str, str] | None:
    """Return sha256 by name of the files that report.json lists; None where it is not as a run wrote it."""
    path = folder / REPORT
    try:
        report = json.loads(read_bytes(path, REPORT)) if is_regular(path) else None
        if not isinstance(report, dict) or report.get(KEY) != content_digest(report):
            return None
        listed = {str(entry["path"]): entry["sha256"] for entry in report["files"]}
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return None
    leads_out = any(Path(name).name != name for name in listed)
    return None if leads_out else listed


def _refuse_unlisted(new: Path) -> None:
    """Raise ValueError where the new folder holds a file that the next run would take for somebody else's."""
    unlisted = unmanaged_files(new)
    if unlisted:
        msg = f"output {unlisted[0]!r}: must be listed in report.json; write it before the report"
        raise ValueError(msg)


def _refused(path: Path, bound: str, hint: str, flag: str = "--out") -> OutputError:
    line = str(validation_error(flag, str(path), "", bound, hint))
    return OutputError(line, field=flag, value=str(path), bound=bound)


def _usable(path: Path) -> Path:
    """Return the real place of an output folder; raises OutputError where no folder can be put."""
    try:
        target = path.resolve()
        here = Path.cwd()
        existing = next(folder for folder in (target, *target.parents) if folder.exists())
    except (OSError, RuntimeError) as error:
        raise _refused(path, f"a path that leads somewhere ({error})", "name another folder with --out") from error
    if not existing.is_dir():
        raise _refused(path, f"a folder; {str(existing)!r} is a file", "name another folder with --out")
    if target == here or target in here.parents or target.is_mount():
        bound = "a folder that can be replaced, not the current one, one above it or a mounted one"
        raise _refused(path, bound, "name a folder inside it")
    parent = existing if existing != target else target.parent
    if not os.access(parent, os.W_OK | os.X_OK):
        bound = f"in a folder that can be written, and {str(parent)!r} cannot"
        raise _refused(path, bound, "name another folder with --out, or change its permissions")
    return target


@contextmanager
def written_beside(target: Path, flag: str) -> Iterator[Path]:
    """Hold the lock of a file or folder, give an empty folder beside it, and clear both; a kill frees the lock.

    Signals are held all the while: let them end what may be cut in two by `interruptible`. Raises OutputError, which
    names the flag, where another process holds it, or where somebody else's folder has the name of the one beside.
    """
    with uninterrupted():
        aside = _folder_beside(target)
        lock = _locked(aside, target, flag)
        try:
            _clear(aside, target)
            new = aside / f"{_NEW}{os.getpid()}"  # no worker of a killed run writes there
            new.mkdir()
            yield new
        finally:
            _clear(aside, target)
            (aside / _LOCK).unlink(missing_ok=True)
            with suppress(OSError):  # files of a person that could not be given back stay
                aside.rmdir()
            lock.release()


def _locked(aside: Path, target: Path, flag: str) -> "BaseFileLock":
    """Make the folder beside and return its lock, held; raises OutputError."""
    from filelock import FileLock, Timeout

    hint = f"name another place with {flag}"
    try:
        aside.mkdir(parents=True, exist_ok=True)
        held = list(aside.iterdir())
        if held and not (is_regular(aside / _LOCK) and all(_is_of_a_run(path) for path in held)):
            bound = f"a folder beside which no other {aside.name!r} stands"
            raise _refused(target, bound, "move that folder away", flag)
        lock = FileLock(aside / _LOCK, blocking=False)
        lock.acquire()
    except Timeout as error:
        bound = "a folder that no other run is writing"
        raise _refused(target, bound, f"wait for that run, or {hint}", flag) from error
    except OSError as error:
        bound = f"in a folder that can be written ({error.strerror})"
        raise _refused(target, bound, f"{hint}, or change its permissions", flag) from error
    return lock


def _folder_beside(target: Path) -> Path:
    return target.with_name(f".{target.name}.twintip")


def _is_of_a_run(path: Path) -> bool:
    """Say whether a path in the folder beside is the empty lock, or one of the folders that a run makes there."""
    if path.name == _LOCK:
        return path.stat().st_size == 0
    is_folder = path.is_dir() and not path.is_symlink()
    return is_folder and (path.name == _OLD or path.name.removeprefix(_NEW).isdecimal())


def _clear(aside: Path, target: Path) -> None:
    """Remove unfinished outputs; give back, or drop, the old ones that were moved aside."""
    for new in aside.glob(f"{_NEW}*"):
        shutil.rmtree(new, ignore_errors=True)
    old = aside / _OLD
    if not old.exists():
        return
    if not target.exists():
        old.rename(target)
        return
    for name in managed_files(old):
        (old / name).unlink()
    for left in sorted(old.iterdir()):
        keep_aside(left, target)
    old.rmdir()


def _publish(new: Path, target: Path, old: Path, *, force: bool) -> None:
    """Move the folder before aside, look at it once more where nobody writes any longer, and take its place."""
    if target.exists():
        new.chmod(stat.S_IMODE(target.stat().st_mode))
        target.rename(old)
        try:
            refuse_unmanaged(old, force=force)
        except OutputError:
            old.rename(target)
            refuse_unmanaged(target, force=force)  # once more, for an error that names this folder
    new.rename(target)
