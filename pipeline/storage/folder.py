"""The output folder of a run, which is replaced as a whole when the run is complete.

A run writes its outputs into the hidden folder .NAME.twintip beside the output folder NAME, and renames it at the end.
Files that no run has written are never deleted. The hidden folder holds a lock, the new outputs, and for a moment also
the old outputs, because the replacement consists of two renames. If a run is killed, it leaves the hidden folder
behind, and the next run clears it.
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

# Names in the hidden folder: the lock file, the folder of the old outputs, and the folder of the new outputs, to whose
# name the number of the process is appended
_LOCK, _OLD, _NEW = "lock", "old", "new-"


class OutputError(InputError):
    """An output folder cannot be used; the message is one line."""


@contextmanager
def output_folder(path: Path | None, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder for the outputs of a run, which replaces `path` if the block succeeds.

    The folder is removed if the block fails; without a path, it is always removed. Of the previous folder at `path`,
    only the files that its report.json lists are deleted. With `force`, other files are kept as NAME.bak.

    Raises OutputError if `path` cannot be written, is in use by another run, or contains other files. The path is
    checked before the block runs, and again at the end.
    """
    if path is None:
        with uninterrupted(), tempfile.TemporaryDirectory(prefix="twintip-") as name, interruptible():
            yield Path(name)
        return
    target = _check_usable(path)
    missing_parents = [folder for folder in target.parents if not folder.exists()]  # `write_beside` creates them
    with uninterrupted():
        try:
            with write_beside(target, "--out") as new:
                refuse_unmanaged(target, force=force)
                with interruptible():
                    yield new
                    _check_listed(new)
                _publish(new, target, new.with_name(_OLD), force=force)
        finally:
            # The parents that were created are removed from the inside out. After a success, the innermost one contains
            # the outputs, so this ends at once.
            with suppress(OSError):
                for folder in missing_parents:
                    folder.rmdir()


def refuse_unusable(path: Path, *, force: bool) -> None:
    """Raise OutputError if `output_folder` would reject this path, without creating or locking anything."""
    refuse_unmanaged(_check_usable(path), force=force)


def unchanged_report(path: Path) -> bytes | None:
    """Return the content of report.json if no file in the output folder has changed since its last run.

    Returns None if a file was changed, removed or added. Raises OutputError if no run can write a folder at this path.
    Before the check, the working files of a killed run are removed, and the outputs that it was replacing are restored.
    """
    target = _check_usable(path)
    _clear_after_kill(target)
    digests = _listed_digests(target)
    if digests is None or unmanaged_files(target):
        return None
    present_names = {file.name for file in target.iterdir()}
    if not set(digests) <= present_names:
        return None
    return (target / REPORT).read_bytes()


def _clear_after_kill(target: Path) -> None:
    """Remove the working files that a killed run left beside a folder; the files of an active run are locked."""
    if _folder_beside(target).exists():
        with suppress(OutputError), write_beside(target, "--out"):
            pass  # the end of the block clears the working folder


def managed_files(folder: Path) -> list[str]:
    """Return the names of the files that the last run wrote into a folder and that are unchanged; report.json is last.

    The list is empty if the report is missing or was changed.
    """
    digests = _listed_digests(folder)
    if digests is None:
        return []
    unchanged_names = [name for name, digest in sorted(digests.items()) if has_digest(folder / name, digest)]
    return [*unchanged_names, REPORT]


def unmanaged_files(folder: Path) -> list[str]:
    """Return the sorted names of all entries in a folder except the unchanged files of its last run.

    Links and folders are included. If report.json was changed, it comes first, because its change is the reason why all
    other files are included too.
    """
    if not folder.exists():
        return []
    managed = set(managed_files(folder))
    names = [path.name for path in folder.iterdir() if path.name not in managed]
    return sorted(names, key=lambda name: (name != REPORT, name))


def refuse_unmanaged(folder: Path, *, force: bool) -> None:
    """Raise OutputError if a folder contains anything except the unchanged files of its last run.

    With `force`, other files are allowed, because the next run keeps them as NAME.bak. Folders, links, pipes and
    devices are never allowed.
    """
    names = unmanaged_files(folder)
    for name in names:
        if not is_regular(folder / name):
            bound = f"a folder that contains only files, but it contains {name!r}, a {kind_of(folder / name)}"
            raise _output_error(folder, bound, "choose another folder with --out, or move it elsewhere")
    if names and not force:
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        bound = f"new, empty, or unchanged since its last run, but it contains {names[0]!r}"
        hint = "choose another folder with --out, move these files away, or keep them as NAME.bak with --force"
        raise _output_error(folder, f"{bound}{more}", hint)


def _listed_digests(folder: Path) -> dict[str, str] | None:
    """Return the SHA-256 digest of each file that the report.json of a folder lists, keyed by name.

    Returns None if the report is missing, unreadable or changed. A report that lists a file in another folder is not
    accepted either, because a run deletes the listed files.
    """
    path = folder / REPORT
    try:
        report = json.loads(read_bytes(path, REPORT)) if is_regular(path) else None
        if not isinstance(report, dict) or report.get(KEY) != content_digest(report):
            return None
        digests = {str(entry["path"]): entry["sha256"] for entry in report["files"]}
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return None
    lists_other_folder = any(Path(name).name != name for name in digests)
    return None if lists_other_folder else digests


def _check_listed(new: Path) -> None:
    """Raise ValueError if the new folder contains a file that report.json does not list.

    The next run would treat this file as one of the user and reject the folder.
    """
    unlisted = unmanaged_files(new)
    if unlisted:
        msg = f"output {unlisted[0]!r}: must be listed in report.json; write it before the report"
        raise ValueError(msg)


def _output_error(path: Path, bound: str, hint: str, flag: str = "--out") -> OutputError:
    """Return the error for an output folder or file that cannot be used; the message names `flag` and `path`."""
    line = str(validation_error(flag, str(path), "", bound, hint))
    return OutputError(line, field=flag, value=str(path), bound=bound)


def _check_usable(path: Path) -> Path:
    """Return the resolved path of an output folder; raises OutputError if no run can write a folder at this path.

    The path need not exist, but it must be resolvable, must not be a file, and must be in a folder that can be written.
    A folder that cannot be replaced is rejected too: the current folder, a folder above it, or a mount point.
    """
    try:
        target = path.resolve()
        current_folder = Path.cwd()
        existing = next(folder for folder in (target, *target.parents) if folder.exists())  # the nearest one
    except (OSError, RuntimeError) as error:
        raise _output_error(
            path, f"a path that can be resolved ({error})", "choose another folder with --out"
        ) from error
    if not existing.is_dir():
        raise _output_error(path, f"a folder, but {str(existing)!r} is a file", "choose another folder with --out")
    if target == current_folder or target in current_folder.parents or target.is_mount():
        bound = "a folder that can be replaced: not the current folder, a folder above it, or a mount point"
        raise _output_error(path, bound, "choose a folder inside it")
    parent = existing if existing != target else target.parent  # the folder whose entries are created and renamed
    if not os.access(parent, os.W_OK | os.X_OK):
        bound = f"in a folder that can be written, but {str(parent)!r} cannot be written"
        raise _output_error(path, bound, "choose another folder with --out, or change its permissions")
    return target


@contextmanager
def write_beside(target: Path, flag: str) -> Iterator[Path]:
    """Lock a file or folder `target`, and yield an empty folder beside it; lock and folder are removed at the end.

    If the process is killed, the operating system releases the lock. Signals are delayed until the end of the block;
    use `interruptible` around work that may be interrupted. Raises OutputError if another process holds the lock, or if
    the working folder beside `target` contains other files. The message names `flag`, the command-line flag of the
    target.
    """
    with uninterrupted():
        working_folder = _folder_beside(target)
        lock = _acquire_lock(working_folder, target, flag)
        try:
            _clear(working_folder, target)
            # The name is unique, because workers of a killed run may still be writing into its folder.
            new = working_folder / f"{_NEW}{os.getpid()}"
            new.mkdir()
            yield new
        finally:
            _clear(working_folder, target)
            (working_folder / _LOCK).unlink(missing_ok=True)
            with suppress(OSError):  # the folder remains if it contains files that could not be moved back
                working_folder.rmdir()
            lock.release()


def _acquire_lock(working_folder: Path, target: Path, flag: str) -> BaseFileLock:
    """Create the working folder of a target, acquire its lock, and return the lock.

    `flag` is the command-line flag of the target, which messages name. Raises OutputError if another process holds the
    lock, if the folder cannot be created, or if it contains files that no run has written there.
    """
    hint = f"choose another path with {flag}"
    try:
        working_folder.mkdir(parents=True, exist_ok=True)
        contents = list(working_folder.iterdir())
        is_from_a_run = is_regular(working_folder / _LOCK) and all(_is_working_file(path) for path in contents)
        if contents and not is_from_a_run:
            bound = f"beside no other folder called {working_folder.name!r}"
            raise _output_error(target, bound, "move that folder away", flag)
        lock = FileLock(working_folder / _LOCK, blocking=False)  # `acquire` raises Timeout instead of waiting
        lock.acquire()
    except Timeout as error:
        bound = "a folder that no other run is writing"
        raise _output_error(target, bound, f"wait until the other run has finished, or {hint}", flag) from error
    except OSError as error:
        bound = f"in a folder that can be written ({error.strerror})"
        raise _output_error(target, bound, f"{hint}, or change its permissions", flag) from error
    return lock


def _folder_beside(target: Path) -> Path:
    """Return the path of the hidden working folder of a file or folder `target`."""
    return target.with_name(f".{target.name}.twintip")


def _is_working_file(path: Path) -> bool:
    """Return whether a path in the working folder is the empty lock file, or a folder that a run creates there."""
    if path.name == _LOCK:
        return path.stat().st_size == 0
    is_folder = path.is_dir() and not path.is_symlink()
    return is_folder and (path.name == _OLD or path.name.removeprefix(_NEW).isdecimal())


def _clear(working_folder: Path, target: Path) -> None:
    """Remove unfinished outputs from the working folder of `target`, and restore or delete the old outputs in it.

    Files of the user among the old outputs are moved into the target as NAME.bak.
    """
    for new in working_folder.glob(f"{_NEW}*"):
        shutil.rmtree(new, ignore_errors=True)
    old = working_folder / _OLD
    if not old.exists():
        return
    if not target.exists():  # the run ended between the two renames in `_publish`, so the old outputs are restored
        old.rename(target)
        return
    for name in managed_files(old):
        (old / name).unlink()
    for user_file in sorted(old.iterdir()):
        keep_aside(user_file, target)
    old.rmdir()


def _publish(new: Path, target: Path, old: Path, *, force: bool) -> None:
    """Move the existing folder `target` to `old`, and rename the folder `new` to `target`.

    The existing folder is checked again after it was moved, because a file may have been added during the run. If this
    check fails, the folder is moved back, and OutputError is raised. With `force`, the check accepts files that no run
    has written.
    """
    if target.exists():
        new.chmod(stat.S_IMODE(target.stat().st_mode))  # the outputs keep the permissions of their folder
        target.rename(old)
        try:
            refuse_unmanaged(old, force=force)
        except OutputError:
            old.rename(target)
            refuse_unmanaged(target, force=force)  # raises the same error again, but with the path of the target
    new.rename(target)
