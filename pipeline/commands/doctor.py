"""`pipeline doctor`: whether this machine has what the commands need, as one table and an exit code."""

import os
import re
import shutil
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Literal, NamedTuple

from pipeline.commands.console import PASSED, WRONG_INPUT

PURPOSE = "look whether this machine has what the commands need"
EXAMPLE = "pipeline doctor"

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", "requirements-fast.lock")
OLDEST_PYTHON = (3, 11)
IMPORTS = ("numpy", "scipy", "skfem", "cadquery", "gmsh", "pyvista", "meshio", "trimesh", "manifold3d", "rtree")
OPTIONAL_PROGRAMS = {
    "ccx": "optional: CalculiX, a second solver for comparison",
    "prusa-slicer": "optional: PrusaSlicer, slices the parts in the tests",
}
LEAST_MEMORY_GIB = 2.0  # resident; a run needs half of it
_IMPORT_SECONDS = 120
_IMPORTER = """
import importlib, sys
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except (ImportError, OSError) as error:
        print(name, str(error).splitlines()[0], sep="\\t")
    else:
        print(name, "ok", sep="\\t")
    sys.stdout.flush()
"""
_COLOURS = {"ok": "green", "note": "yellow", "wrong": "red"}


class Row(NamedTuple):
    """One line of the table: what was looked at, what was found, and what it means."""

    name: str
    found: str
    status: Literal["ok", "note", "wrong"]
    remark: str = ""


def add_arguments(_parser: ArgumentParser) -> None:
    """Add nothing."""


def execute(_arguments: Namespace) -> int:
    """Print what this machine has; return 0, or 2 when something that every run needs is missing."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    rows = examination()
    table = Table("what", "found", "", "remark", title="what this machine has")
    for row in rows:
        table.add_row(row.name, escape(row.found), f"[{_COLOURS[row.status]}]{row.status}[/]", escape(row.remark))
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    is_wrong = any(row.status == "wrong" for row in rows)
    return WRONG_INPUT if is_wrong else PASSED


def examination() -> list[Row]:
    """Return every row of the table."""
    from pipeline.storage.cache import cache_folder

    rows = [_python(), *_packages(), *_imports(), *_optional(), _cores(), _memory()]
    cache = cache_folder()
    if cache is None:
        rows.append(Row("cache", "none", "note", "no home; set XDG_CACHE_HOME, or each run solves anew"))
    else:
        rows.append(place_row("cache", cache))
    rows.append(place_row("outputs", Path.cwd() / "outputs"))
    return rows


def _python() -> Row:
    found = ".".join(map(str, sys.version_info[:3]))
    if sys.version_info[:2] < OLDEST_PYTHON:
        return Row("Python", found, "wrong", "needs 3.11 or later")
    return Row("Python", found, "ok")


def pins(text: str) -> dict[str, str]:
    """Return version by name of the pinned packages in the text of a lock file."""
    return dict(re.findall(r"^([A-Za-z0-9._-]+)==([^\s;]+)", text, flags=re.MULTILINE))


def _packages() -> list[Row]:
    """Return a row for each declared package, and for each other locked one whose version is not the locked one."""
    from pipeline.storage.versions import declared_packages, installed_version

    rows = []
    locked: dict[str, str] = {}
    for path in (ROOT / name for name in LOCKS):
        if path.is_file():
            locked |= pins(path.read_text(encoding="utf-8"))
    if not locked:
        rows.append(Row("lock", "absent", "note", "versions are not compared"))
    declared = declared_packages()
    for name in dict.fromkeys((*declared, *locked)):
        found = installed_version(name)
        wanted = locked.get(name, "")
        if name in declared or found not in (None, wanted):
            rows.append(package_row(name, found, wanted, needed=name in declared))
    return rows


def package_row(name: str, found: str | None, wanted: str, *, needed: bool) -> Row:
    """Return the row of one package; a needed one that is missing is wrong, another version is worth a note."""
    if found is None:
        return Row(name, "absent", "wrong" if needed else "note", "run make setup")
    if wanted in ("", found):
        return Row(name, found, "ok")
    return Row(name, found, "note", f"locked at {wanted}; tests ran with that one")


def _imports() -> list[Row]:
    """Import each heavy package in a process of its own: a missing system library can end that process."""
    command = [sys.executable, "-W", "ignore", "-c", _IMPORTER, *IMPORTS]
    outcomes = dict.fromkeys(IMPORTS, "the process ended")
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_IMPORT_SECONDS)
        outcomes |= dict(line.split("\t", 1) for line in done.stdout.splitlines() if "\t" in line)
    except subprocess.TimeoutExpired:
        outcomes = dict.fromkeys(IMPORTS, f"took more than {_IMPORT_SECONDS} s")
    rows = []
    for name in IMPORTS:
        if outcomes[name] == "ok":
            rows.append(Row(f"import {name}", "ok", "ok"))
        else:
            remark = f"{outcomes[name]}; run make setup, it names missing system libraries"
            rows.append(Row(f"import {name}", "fails", "wrong", remark))
    return rows


def _optional() -> list[Row]:
    """Return a row for the faster solver and for each program that some tests or comparisons use."""
    from pipeline.storage.versions import installed_version

    solver = installed_version("pypardiso")
    if solver is None:
        rows = [Row("pypardiso", "absent", "note", "optional, a faster direct solver: make setup FAST=1")]
    else:
        rows = [Row("pypardiso", solver, "ok")]
    for program, purpose in OPTIONAL_PROGRAMS.items():
        if shutil.which(program) is None:
            rows.append(Row(program, "absent", "note", purpose))
        else:
            rows.append(Row(program, "present", "ok"))
    return rows


def _cores() -> Row:
    return Row("cores", str(len(os.sched_getaffinity(0))), "ok")


def _memory() -> Row:
    GiB = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    if GiB < LEAST_MEMORY_GIB:
        return Row("memory", f"{GiB:.1f} GiB", "note", f"a run needs about {LEAST_MEMORY_GIB:g} GiB")
    return Row("memory", f"{GiB:.1f} GiB", "ok")


def place_row(name: str, folder: Path) -> Row:
    """Return whether a folder, or the nearest one above it that exists, can be written; nothing is made."""
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if existing.is_dir() and os.access(existing, os.W_OK | os.X_OK):
        return Row(name, str(folder), "ok", "writable")
    fault = "cannot be written" if existing.is_dir() else "is a file"
    return Row(name, str(folder), "wrong", f"{existing} {fault}; choose or free another place")
