"""Outputs appear whole: written into a hidden folder beside their place, moved there at the end, or not at all."""

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path

from cad.quantity import InputError, fault
from pipeline.storage.interruption import hold

OURS = (
    "design.toml",
    "report.json",
    "report.html",
    "response.csv",
    "fabrication.md",
    *(f"{part}.{kind}" for part in ("housing", "assembly", "coupon", "cover") for kind in ("step", "stl", "3mf")),
    "pin.step",
    *(f"drawing.{kind}" for kind in ("dxf", "svg")),
    *(f"{part}{kind}" for part in ("housing", "flexure*", "fruit*", "sensor*") for kind in (".vtu", ".png")),
    "response.png",
    "pictures/*.png",
)
"""Every file that a command writes into an output folder; `*` stands for the rest of a name."""
FOLDERS = ("pictures",)
MARK = "report.json"


class OutputError(InputError):
    """An output folder that cannot be used; the message is one line: folder, bound, remedy."""


@contextmanager
def output_folder(path: Path | None) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `path` when the block ends well, and vanishes when it does not.

    Without a path it vanishes either way. Raises OutputError before the block runs when `path` cannot be written, is in
    use by another run, or holds files that are not ours.
    """
    if path is None:
        with tempfile.TemporaryDirectory(prefix="twintip-") as name:
            yield Path(name)
        return
    target = _usable(path)
    with _parents_of(target), _locked(target):
        _recover(target)
        refuse_foreign(target)
        new = _beside(target, "new")
        try:
            _make(new)
            yield new
            refuse_unknown_names(new)
            refuse_foreign(target)
            hold()
            _publish(new, target)
        finally:
            hold()
            shutil.rmtree(new, ignore_errors=True)


def refuse_unusable(path: Path) -> None:
    """Raise OutputError when `output_folder` would refuse this place; makes nothing and takes no lock."""
    refuse_foreign(_usable(path))


def foreign_files(folder: Path) -> list[str]:
    """Return the names inside a folder that no command of ours writes, sorted."""
    found = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        ours = name in FOLDERS if path.is_dir() and not path.is_symlink() else _is_ours(name)
        if not ours:
            found.append(name)
    return found


def _is_ours(name: str) -> bool:
    return any(fnmatchcase(name, known) and name.count("/") == known.count("/") for known in OURS)


def refuse_foreign(folder: Path) -> None:
    """Raise OutputError when a folder exists and is neither empty nor an output folder of ours."""
    if not folder.exists():
        return
    foreign = foreign_files(folder)
    if not foreign and any(folder.iterdir()) and not (folder / MARK).is_file():
        # A lone design.toml may be somebody's own; a folder of ours has its report.
        foreign = sorted(path.name for path in folder.iterdir())
    if foreign:
        more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
        bound = f"a new or empty folder or one that this program wrote, and it holds {foreign[0]!r}{more}"
        raise _refused(folder, bound, "name another folder with --out, or move these files away")


def refuse_unknown_names(folder: Path) -> None:
    """Raise ValueError when a file was written under a name that the next run would take for foreign."""
    unknown = foreign_files(folder)
    if unknown:
        msg = f"output {unknown[0]!r}: must have a name in pipeline.storage.folder.OURS; add it there"
        raise ValueError(msg)


def _refused(folder: Path, bound: str, remedy: str) -> OutputError:
    return OutputError(str(fault("--out", str(folder), "", bound, remedy)))


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
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise _not_writable(target, error) from error
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(handle)
            bound = "a folder that no other run is writing"
            raise _refused(target, bound, "wait for that run, or name another folder with --out") from error
        if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
            return handle
        os.close(handle)  # its last owner removed this file between the two calls


def _recover(target: Path) -> None:
    """Clear what a killed run left: its unfinished folder goes, a result that it had moved aside comes back."""
    new, old = _beside(target, "new"), _beside(target, "old")
    shutil.rmtree(new, ignore_errors=True)
    if old.exists():
        if target.exists():
            shutil.rmtree(old, ignore_errors=True)
        else:
            old.rename(target)


def _publish(new: Path, target: Path) -> None:
    old = _beside(target, "old")
    try:
        if target.exists():
            target.rename(old)
        new.rename(target)
    except OSError as error:
        if old.exists() and not target.exists():
            old.rename(target)
        raise _not_writable(target, error) from error
    shutil.rmtree(old, ignore_errors=True)
