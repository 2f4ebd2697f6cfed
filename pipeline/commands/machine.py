"""What this machine has of what the commands need: one table, and an exit code."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from pipeline.storage.cache import cache_folder
from pipeline.storage.versions import declared_packages, installed_version

Status = Literal["ok", "note", "wrong"]

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", "requirements-fast.lock")
OLDEST_PYTHON = (3, 11)
IMPORTS = ("numpy", "scipy", "skfem", "cadquery", "gmsh", "pyvista", "meshio", "trimesh", "manifold3d", "rtree")
OPTIONAL_PROGRAMS = {
    "ccx": "CalculiX, a second solver for comparison",
    "prusa-slicer": "PrusaSlicer, slices the parts in the tests",
}
_IMPORT_SECONDS = 120
LEAST_MEMORY_GIB = 2.0  # resident; a run needs half of it
_PIN = re.compile(r"(?P<name>[A-Za-z0-9._-]+)==(?P<version>[^\s;]+)")


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table: what was looked at, what was found, and what it means."""

    name: str
    found: str
    status: Status
    remark: str = ""


def print_examination() -> int:
    """Print what this machine has; return 0, or 2 when something that every run needs is missing."""
    rows = examination()
    table = Table("what", "found", "", "remark", title="what this machine has")
    style = {"ok": "green", "note": "yellow", "wrong": "red"}
    for row in rows:
        table.add_row(row.name, escape(row.found), f"[{style[row.status]}]{row.status}[/]", escape(row.remark))
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    return 2 if any(row.status == "wrong" for row in rows) else 0


def examination() -> tuple[Row, ...]:
    """Return every row of the table."""
    return (_python(), *_packages(), *_imports(), *_optional(), _cores(), _memory(), *_places())


def _python() -> Row:
    found = ".".join(map(str, sys.version_info[:3]))
    new = sys.version_info[:2] >= OLDEST_PYTHON
    return Row(name="Python", found=found, status="ok" if new else "wrong", remark="" if new else "needs 3.11 or later")


def pins(text: str) -> dict[str, str]:
    """Return version by name of the pinned packages in the text of a lock file."""
    matches = (_PIN.match(line) for line in text.splitlines())
    return {match["name"]: match["version"] for match in matches if match}


def _packages() -> Iterator[Row]:
    """Yield a row for each declared package, and for each other locked one whose version is not the locked one."""
    locks = [ROOT / name for name in LOCKS]
    locked = pins("\n".join(path.read_text(encoding="utf-8") for path in locks if path.is_file()))
    declared = declared_packages()
    if not locked:
        yield Row(name="lock", found="absent", status="note", remark="versions are not compared")
    as_locked = 0
    for name, wanted in {**dict.fromkeys(declared, ""), **locked}.items():
        found = installed_version(name)
        if name in declared or found not in (None, wanted):
            yield package_row(name, found, wanted, needed=name in declared)
        else:
            as_locked += found is not None
    yield Row(name="other locked packages", found=f"{as_locked} as locked", status="ok")


def package_row(name: str, found: str | None, wanted: str, *, needed: bool) -> Row:
    """Return the row of one package; a needed one that is missing is wrong, another version is worth a note."""
    if found is None:
        return Row(name=name, found="absent", status="wrong" if needed else "note", remark="run make setup")
    if wanted in ("", found):
        return Row(name=name, found=found, status="ok")
    return Row(name=name, found=found, status="note", remark=f"locked at {wanted}; tests ran with that one")


def _imports() -> Iterator[Row]:
    """Import each heavy package in a process of its own: a missing system library can end that process."""
    program = (
        "import importlib, sys\n"
        "for name in sys.argv[1:]:\n"
        "    try:\n        importlib.import_module(name)\n"
        "    except (ImportError, OSError) as error:\n        print(name, str(error).splitlines()[0], sep='\\t')\n"
        "    else:\n        print(name, 'ok', sep='\\t')\n"
        "    sys.stdout.flush()\n"
    )
    command = [sys.executable, "-W", "ignore", "-c", program, *IMPORTS]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_IMPORT_SECONDS)
        printed = done.stdout
    except subprocess.TimeoutExpired:
        printed = "\n".join(f"{name}\ttook more than {_IMPORT_SECONDS} s" for name in IMPORTS)
    told = dict(line.split("\t", 1) for line in printed.splitlines() if "\t" in line)
    for name in IMPORTS:
        outcome = told.get(name, "the process ended")
        if outcome == "ok":
            yield Row(name=f"import {name}", found="ok", status="ok")
        else:
            remark = f"{outcome}; run make setup, it names missing system libraries"
            yield Row(name=f"import {name}", found="fails", status="wrong", remark=remark)


def _optional() -> Iterator[Row]:
    fast = installed_version("pypardiso")
    yield Row(
        name="pypardiso",
        found=fast or "absent",
        status="ok" if fast else "note",
        remark="" if fast else "optional, a faster direct solver: make setup FAST=1",
    )
    for program, purpose in OPTIONAL_PROGRAMS.items():
        where = shutil.which(program)
        yield Row(
            name=program,
            found="present" if where else "absent",
            status="ok" if where else "note",
            remark="" if where else f"optional: {purpose}",
        )


def _cores() -> Row:
    return Row(name="cores", found=str(len(os.sched_getaffinity(0))), status="ok")


def _memory() -> Row:
    GiB = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    enough = GiB >= LEAST_MEMORY_GIB
    remark = "" if enough else f"a run needs about {LEAST_MEMORY_GIB:g} GiB"
    return Row(name="memory", found=f"{GiB:.1f} GiB", status="ok" if enough else "note", remark=remark)


def _places() -> Iterator[Row]:
    cache = cache_folder()
    if cache is None:
        yield Row(
            name="cache", found="none", status="note", remark="no home; set XDG_CACHE_HOME, or each run solves anew"
        )
    else:
        yield place_row("cache", cache)
    yield place_row("outputs", Path.cwd() / "outputs")


def place_row(name: str, folder: Path) -> Row:
    """Return whether a folder, or the nearest one above it that exists, can be written; nothing is made."""
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if existing.is_dir() and os.access(existing, os.W_OK | os.X_OK):
        return Row(name=name, found=str(folder), status="ok", remark="writable")
    kind = "cannot be written" if existing.is_dir() else "is a file"
    return Row(name=name, found=str(folder), status="wrong", remark=f"{existing} {kind}; choose or free another place")
