"""The output folder: a run writes it beside its place and then renames it as a whole; foreign files are never touched.

Working files for the folder NAME are in the hidden folder .NAME.twintip: the lock, the new outputs, and between the two
renames also the old outputs. A killed run leaves the hidden folder behind, and the next run clears it.
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
    """Yield an empty folder, which replaces `path` if the block succeeds and is removed if the block fails.

    Without a path the folder is removed in either case. Of the previous folder, only files that its report.json lists
    are deleted. Raises OutputError before the block runs if `path` cannot be written, is in use by another run, or
    holds other files. With `force` other files are kept as NAME.bak.
    """
    if path is None:
        with uninterrupted(), tempfile.TemporaryDirectory(prefix="twintip-") as name, interruptible():
            yield Path(name)
        return
    target = _check_usable(path)
    missing = [folder for folder in target.parents if not folder.exists()]
    with uninterrupted():
        try:
            with write_beside(target, "--out") as new:
                refuse_unmanaged(target, force=force)
                with interruptible():
                    yield new
                    _check_listed(new)
                _publish(new, target, new.with_name(_OLD), force=force)
        finally:
            with suppress(OSError):  # the folder is not empty: it holds the outputs
                for folder in missing:
                    folder.rmdir()


def refuse_unusable(path: Path, *, force: bool) -> None:
    """Raise OutputError if `output_folder` would reject this path; nothing is created or locked."""
    refuse_unmanaged(_check_usable(path), force=force)


def unchanged_report(path: Path) -> bytes | None:
    """Return the content of report.json if all files of an output folder are unchanged since its last run.

    None if a file was changed, removed or added. Raises OutputError if no folder can be at this path.
    """
    target = _check_usable(path)
    _clear_after_kill(target)
    digests = _listed_digests(target)
    if digests is None or unmanaged_files(target) or not set(digests) <= {file.name for file in target.iterdir()}:
        return None
    return (target / REPORT).read_bytes()


def _clear_after_kill(target: Path) -> None:
    """Remove the working files that a killed run left beside a folder; those of a run in progress are locked."""
    if _folder_beside(target).exists():
        with suppress(OutputError), write_beside(target, "--out"):
            pass  # leaving the block clears the folder


def managed_files(folder: Path) -> list[str]:
    """Return the names of the files that the last run wrote into a folder and nobody changed, report.json last.

    Empty if the report is missing or was changed itself.
    """
    digests = _listed_digests(folder)
    if digests is None:
        return []
    return [*(name for name, digest in sorted(digests.items()) if has_digest(folder / name, digest)), REPORT]


def unmanaged_files(folder: Path) -> list[str]:
    """Return the sorted names of everything in a folder that is not a managed file, including links and folders.

    A changed report.json comes first.
    """
    if not folder.exists():
        return []
    managed = set(managed_files(folder))
    names = [path.name for path in folder.iterdir() if path.name not in managed]
    return sorted(names, key=lambda name: (name != REPORT, name))


def refuse_unmanaged(folder: Path, *, force: bool) -> None:
    """Raise OutputError if a folder holds anything except the unchanged files of its last run.

    With `force` other files are allowed, but folders, links, pipes and devices are not.
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
    """Return the sha256 of each file that report.json lists, by name.

    None if the report is missing, unreadable or changed, or if it lists a file outside its folder.
    """
    path = folder / REPORT
    try:
        report = json.loads(read_bytes(path, REPORT)) if is_regular(path) else None
        if not isinstance(report, dict) or report.get(KEY) != content_digest(report):
            return None
        digests = {str(entry["path"]): entry["sha256"] for entry in report["files"]}
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return None
    is_outside = any(Path(name).name != name for name in digests)
    return None if is_outside else digests


def _check_listed(new: Path) -> None:
    """Raise ValueError if the new folder holds a file that report.json does not list.

    The next run would take it for a foreign file and reject the folder.
    """
    unlisted = unmanaged_files(new)
    if unlisted:
        msg = f"output {unlisted[0]!r}: must be listed in report.json; write it before the report"
        raise ValueError(msg)


def _refused(path: Path, bound: str, hint: str, flag: str = "--out") -> OutputError:
    line = str(validation_error(flag, str(path), "", bound, hint))
    return OutputError(line, field=flag, value=str(path), bound=bound)


def _check_usable(path: Path) -> Path:
    """Return the real path of an output folder; raises OutputError if no run can write a folder there.

    That is the case for a file, a path that cannot be resolved, a place without permission to write, and a folder that
    cannot be replaced: the current one, one above it, or a mount point.
    """
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
    parent = existing if existing != target else target.parent  # the folder in which names are created and renamed
    if not os.access(parent, os.W_OK | os.X_OK):
        bound = f"in a folder that can be written, and {str(parent)!r} cannot"
        raise _refused(path, bound, "name another folder with --out, or change its permissions")
    return target


@contextmanager
def write_beside(target: Path, flag: str) -> Iterator[Path]:
    """Lock a file or folder `target`, and yield an empty folder beside it; both are removed at the end.

    The lock of a killed process is free again. Signals are held until the end; use `interruptible` around work that may
    be interrupted. Raises OutputError if another process holds the lock, or if the working folder beside `target` holds
    foreign files. The message names `flag`, the flag of the command that names the target.
    """
    with uninterrupted():
        working_folder = _folder_beside(target)
        lock = _acquire_lock(working_folder, target, flag)
        try:
            _clear(working_folder, target)
            new = working_folder / f"{_NEW}{os.getpid()}"  # a new name, because workers of a killed run may still write
            new.mkdir()
            yield new
        finally:
            _clear(working_folder, target)
            (working_folder / _LOCK).unlink(missing_ok=True)
            with suppress(OSError):  # foreign files that could not be moved back remain there
                working_folder.rmdir()
            lock.release()


def _acquire_lock(working_folder: Path, target: Path, flag: str) -> BaseFileLock:
    """Create the working folder of a target and return its lock, which is held.

    Raises OutputError if another process holds the lock, the folder holds foreign files, or it cannot be created.
    """
    hint = f"name another place with {flag}"
    try:
        working_folder.mkdir(parents=True, exist_ok=True)
        contents = list(working_folder.iterdir())
        if contents and not (is_regular(working_folder / _LOCK) and all(_is_working_file(path) for path in contents)):
            bound = f"a folder beside which no other {working_folder.name!r} stands"
            raise _refused(target, bound, "move that folder away", flag)
        lock = FileLock(working_folder / _LOCK, blocking=False)
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


def _is_working_file(path: Path) -> bool:
    """Return whether a path in the working folder is the empty lock, or a folder that a run creates there."""
    if path.name == _LOCK:
        return path.stat().st_size == 0
    is_folder = path.is_dir() and not path.is_symlink()
    return is_folder and (path.name == _OLD or path.name.removeprefix(_NEW).isdecimal())


def _clear(working_folder: Path, target: Path) -> None:
    """Remove unfinished outputs from the working folder, and restore or delete the old outputs there.

    Foreign files among the old outputs are moved into the target as NAME.bak.
    """
    for new in working_folder.glob(f"{_NEW}*"):
        shutil.rmtree(new, ignore_errors=True)
    old = working_folder / _OLD
    if not old.exists():
        return
    if not target.exists():  # the run ended between the two renames of `_publish`, so the old outputs still count
        old.rename(target)
        return
    for name in managed_files(old):
        (old / name).unlink()
    for foreign in sorted(old.iterdir()):
        keep_aside(foreign, target)
    old.rmdir()


def _publish(new: Path, target: Path, old: Path, *, force: bool) -> None:
    """Move the old folder `target` to `old`, and rename the `new` one to its place.

    The old folder is checked again after its move, because a file may have been added during the run. If the check
    fails, the folder is moved back. Raises OutputError like `refuse_unmanaged`.
    """
    if target.exists():
        new.chmod(stat.S_IMODE(target.stat().st_mode))
        target.rename(old)
        try:
            refuse_unmanaged(old, force=force)
        except OutputError:
            old.rename(target)
            refuse_unmanaged(target, force=force)  # raises the same error again, with the name of the target
    new.rename(target)
