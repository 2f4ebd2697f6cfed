"""The output folder: written aside and renamed as a whole, by one run at a time; foreign files are never touched.

Working files for the folder NAME are in the hidden folder .NAME.twintip: the lock, the new outputs, and between two
renames the old ones. A killed run leaves it behind, and the next run clears it.
"""

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import BaseFileLock, FileLock, Timeout

from pipeline.storage.digests import KEY, REPORT, content_digest, has_digest, is_regular, keep_aside, kind_of
from pipeline.storage.interrupts import interruptible, uninterrupted
from sensor.input_file import read_bytes
from sensor.quantity import InputError, validation_error

_LOCK, _OLD, _NEW = "lock", "old", "new-"


class OutputError(InputError):
    """An unusable output folder; the message is one line."""


@contextmanager
def output_folder(path: Path | None, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder, which replaces `path` if the block succeeds and is removed if it fails.

    Without a path it is removed in either case. Of the previous folder, only the files listed in its report.json are
    dropped. Raises OutputError before the block runs if `path` cannot be written, is in use by another run, or holds
    other files. With `force` other files are kept as NAME.bak.
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
            with suppress(OSError):  # the folder is not empty: it holds the outputs
                for folder in missing:
                    folder.rmdir()


def refuse_unusable(path: Path, *, force: bool) -> None:
    """Raise OutputError if `output_folder` would refuse this place; creates nothing and takes no lock."""
    refuse_unmanaged(_usable(path), force=force)


def whole_report(path: Path) -> bytes | None:
    """Return the report.json of an output folder that is unchanged since its last run; None for any other.

    Raises OutputError for an unusable place.
    """
    target = _usable(path)
    _clear_after_a_kill(target)
    listed = _listed_digests(target)
    if listed is None or unmanaged_files(target) or not set(listed) <= {file.name for file in target.iterdir()}:
        return None
    return (target / REPORT).read_bytes()


def _clear_after_a_kill(target: Path) -> None:
    """Remove what a killed run left beside a folder; a running one holds the lock and keeps its files."""
    if _folder_beside(target).exists():
        with suppress(OutputError), written_beside(target, "--out"):
            pass  # leaving the block clears the folder


def managed_files(folder: Path) -> list[str]:
    """Return the names of the files in a folder that are unchanged since the last run, report.json last.

    Empty if the report is missing or was changed.
    """
    listed = _listed_digests(folder)
    if listed is None:
        return []
    return [*(name for name, digest in sorted(listed.items()) if has_digest(folder / name, digest)), REPORT]


def unmanaged_files(folder: Path) -> list[str]:
    """Return the sorted names of all in a folder that the last run did not write, including links and folders."""
    if not folder.exists():
        return []
    managed = set(managed_files(folder))
    names = [path.name for path in folder.iterdir() if path.name not in managed]
    return sorted(names, key=lambda name: (name != REPORT, name))


def refuse_unmanaged(folder: Path, *, force: bool) -> None:
    """Raise OutputError if a folder holds anything except the unchanged files of its report.json.

    With `force` other files are allowed, but a folder, a link, a pipe or a device is not.
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
    """Return the sha256 of the files in report.json by name; None unless it is as a run wrote it."""
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
    """Raise ValueError if the new folder holds a file that the next run would take for a foreign one."""
    unlisted = unmanaged_files(new)
    if unlisted:
        msg = f"output {unlisted[0]!r}: must be listed in report.json; write it before the report"
        raise ValueError(msg)


def _refused(path: Path, bound: str, hint: str, flag: str = "--out") -> OutputError:
    line = str(validation_error(flag, str(path), "", bound, hint))
    return OutputError(line, field=flag, value=str(path), bound=bound)


def _usable(path: Path) -> Path:
    """Return the real path of an output folder; raises OutputError if no folder can be there."""
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
    """Lock a file or folder, yield an empty folder beside it, and remove both; a killed process frees the lock.

    Signals are held meanwhile; use `interruptible` for work that may be interrupted. Raises OutputError, which names
    the flag, if another process holds the lock, or a foreign folder has the name of the one beside.
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
            with suppress(OSError):  # files of a person that could not be moved back stay
                aside.rmdir()
            lock.release()


def _locked(aside: Path, target: Path, flag: str) -> BaseFileLock:
    """Create the folder beside and return its lock, held; raises OutputError."""
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
    """Return whether a path in the folder beside is the empty lock, or a folder that a run creates there."""
    if path.name == _LOCK:
        return path.stat().st_size == 0
    is_folder = path.is_dir() and not path.is_symlink()
    return is_folder and (path.name == _OLD or path.name.removeprefix(_NEW).isdecimal())


def _clear(aside: Path, target: Path) -> None:
    """Remove unfinished outputs; restore or drop the old ones that were moved aside."""
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
    """Move the old folder aside, check it again once nobody writes to it, and rename the new one to its place."""
    if target.exists():
        new.chmod(stat.S_IMODE(target.stat().st_mode))
        target.rename(old)
        try:
            refuse_unmanaged(old, force=force)
        except OutputError:
            old.rename(target)
            refuse_unmanaged(target, force=force)  # again, for an error that names this folder
    new.rename(target)
