"""`pipeline doctor`: a table that shows whether this machine meets the requirements of the commands."""

import os
import platform
import re
import shutil
import subprocess
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from rich.markup import escape
from rich.table import Column, Table

from pipeline.storage.cache import cache_folder
from pipeline.storage.versions import declared_packages, installed_version
from twintip.commands.console import PASSED, WRONG_INPUT, Answer
from twintip.commands.progress import showing_progress

LOCK = Path(__file__).parents[2] / "requirements.lock"
IMPORTS = ("numpy", "scipy", "skfem", "cadquery", "gmsh", "pyvista", "meshio", "trimesh", "manifold3d", "rtree")
OPTIONAL_PROGRAMS = {
    "ccx": "optional: CalculiX, a second solver for comparison",
    "prusa-slicer": "optional: PrusaSlicer, which slices the parts in the tests",
}
LEAST_MEMORY_GIB = 2.0  # twice the resident memory of a run
_IMPORT_SECONDS = 120  # time limit of a process that imports packages [s]
_IMPORTED = "imported"  # the word before the name of each package that has been imported
_IMPORT_PROGRAM = f"""
import sys
for name in sys.argv[1:]:
    __import__(name)
    print("{_IMPORTED}", name, flush=True)
"""
_WIDTH = 120  # [characters]
_COLOURS = {"ok": "green", "note": "yellow", "wrong": "red"}


class Finding(NamedTuple):
    """One row of the table: what was examined, what was found, the status, and a remark."""

    name: str
    found: str
    status: Literal["ok", "note", "wrong"] = "ok"
    remark: str = ""


def run(_arguments: Namespace) -> Iterator[Answer]:
    """Examine this machine, and yield first a remark on the duration and then the table of findings.

    The exit code is 0, or 2 if something is missing that every run needs.
    """
    yield Answer(code=PASSED, text=f"Importing {len(IMPORTS)} packages takes a few seconds.")
    with showing_progress(f"importing {', '.join(IMPORTS)}"):
        rows = examine_machine()
    headings = ("what", "found", "", "remark")  # the column of the status has no heading
    table = Table(*(Column(heading, overflow="fold") for heading in headings), title="what this machine has")
    for row in rows:
        table.add_row(row.name, escape(row.found), f"[{_COLOURS[row.status]}]{row.status}[/]", escape(row.remark))
    is_wrong = any(row.status == "wrong" for row in rows)
    yield Answer(code=WRONG_INPUT if is_wrong else PASSED, parts=[table], width=_WIDTH)


def examine_machine() -> list[Finding]:
    """Examine the packages, the optional programs, the memory and the folders, and return a row for each."""
    rows = [Finding("Python", platform.python_version()), *_package_rows(), *_import_rows(IMPORTS), *_program_rows()]
    memory_GiB = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30  # the physical memory
    is_enough = memory_GiB >= LEAST_MEMORY_GIB
    memory_remark = "" if is_enough else f"a run needs about {LEAST_MEMORY_GIB:g} GiB"
    rows.append(Finding("memory", f"{memory_GiB:.1f} GiB", "ok" if is_enough else "note", memory_remark))
    cache = cache_folder()
    if cache is None:
        cache_remark = "there is no home folder; set XDG_CACHE_HOME, or each run solves everything again"
        rows.append(Finding("cache", "none", "note", cache_remark))
    else:
        rows.append(folder_row("cache", cache))
    rows.append(folder_row("outputs", Path.cwd() / "outputs"))
    return rows


def _package_rows() -> list[Finding]:
    """Return a row for each package that every run needs.

    The installed version is compared with the version in the lock file, which only a copy of the repository has.
    """
    text = LOCK.read_text(encoding="utf-8") if LOCK.is_file() else ""
    # A line of the lock file is NAME==VERSION, possibly followed by a condition or a comment.
    locked = dict(re.findall(r"^([A-Za-z0-9._-]+)==([^\s;]+)", text, flags=re.MULTILINE))
    return [package_row(name, installed_version(name), locked.get(name)) for name in declared_packages()]


def package_row(name: str, found: str | None, locked: str | None) -> Finding:
    """Return the row of a package, given its installed version and the version in the lock file.

    The status is "wrong" if the package is missing, and "note" if the two versions differ.
    """
    if found is None:
        return Finding(name, "absent", "wrong", "run make setup")
    if locked in (None, found):
        return Finding(name, found)
    return Finding(name, found, "note", f"locked at {locked}, with which the tests were run")


def _import_rows(names: Sequence[str]) -> Iterator[Finding]:
    """Import large packages in a separate process, and yield a row for each.

    A missing system library may crash the process. After a failure, another process imports the remaining packages. If
    a process takes more than two minutes, all of its packages are reported as failed.
    """
    remaining = list(names)
    while remaining:
        command = [sys.executable, "-W", "ignore", "-c", _IMPORT_PROGRAM, *remaining]
        try:
            completed = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_IMPORT_SECONDS)
        except subprocess.TimeoutExpired:
            for name in remaining:
                remark = f"the import of these {len(remaining)} packages took more than {_IMPORT_SECONDS} s"
                yield Finding(f"import {name}", "fails", "wrong", remark)
            return
        # The process imports the packages in order, and prints a line after each.
        imported = [name for name in remaining if f"{_IMPORTED} {name}" in completed.stdout.splitlines()]
        for name in imported:
            yield Finding(f"import {name}", "ok")
        remaining = remaining[len(imported) :]
        if remaining:
            failed = remaining.pop(0)  # the process ended at the first package that it did not import
            *_, reason = completed.stderr.splitlines() or ["the process ended"]  # the last line names the error
            remark = f"{reason}; run make setup, which names missing system libraries"
            yield Finding(f"import {failed}", "fails", "wrong", remark)


def _program_rows() -> list[Finding]:
    """Return a row for each program that some tests or comparisons use, with its purpose if it is absent."""
    return [
        Finding(program, "present") if shutil.which(program) else Finding(program, "absent", "note", purpose)
        for program, purpose in OPTIONAL_PROGRAMS.items()
    ]


def folder_row(name: str, folder: Path) -> Finding:
    """Return a row that shows whether a folder is writable, or can be created. Nothing is created here."""
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if existing.is_dir() and os.access(existing, os.W_OK | os.X_OK):
        return Finding(name, str(folder), "ok", "writable")
    problem = "is not writable" if existing.is_dir() else "is a file"
    return Finding(name, str(folder), "wrong", f"{existing} {problem}; choose another folder, or make this one usable")
