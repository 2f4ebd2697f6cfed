"""`pipeline doctor`: whether this machine has what the commands need, as a table and an exit code."""

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
    "prusa-slicer": "optional: PrusaSlicer, slices the parts in the tests",
}
LEAST_MEMORY_GIB = 2.0  # resident memory; a run needs half of it
_IMPORT_SECONDS = 120
_IMPORTED = "imported"
_IMPORTING = f"""
import sys
for name in sys.argv[1:]:
    __import__(name)
    print("{_IMPORTED}", name, flush=True)
"""
_WIDTH = 120  # [characters]
_COLOURS = {"ok": "green", "note": "yellow", "wrong": "red"}


class Finding(NamedTuple):
    """One line of the table: the subject, what was found, its status, and a remark."""

    name: str
    found: str
    status: Literal["ok", "note", "wrong"] = "ok"
    remark: str = ""


def run(_arguments: Namespace) -> Iterator[Answer]:
    """Examine this machine; the exit code is 0, or 2 if a requirement of every run is missing."""
    yield Answer(code=PASSED, text=f"imports {len(IMPORTS)} packages, which takes some seconds")
    with showing_progress(f"imports {', '.join(IMPORTS)}"):
        rows = examination()
    heads = ("what", "found", "", "remark")
    table = Table(*(Column(head, overflow="fold") for head in heads), title="what this machine has")
    for row in rows:
        table.add_row(row.name, escape(row.found), f"[{_COLOURS[row.status]}]{row.status}[/]", escape(row.remark))
    is_wrong = any(row.status == "wrong" for row in rows)
    yield Answer(code=WRONG_INPUT if is_wrong else PASSED, parts=[table], width=_WIDTH)


def examination() -> list[Finding]:
    """Return every row of the table."""
    rows = [Finding("Python", platform.python_version()), *_packages(), *_imports(IMPORTS), *_optional()]
    GiB = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    is_enough = GiB >= LEAST_MEMORY_GIB
    remark = "" if is_enough else f"a run needs about {LEAST_MEMORY_GIB:g} GiB"
    rows.append(Finding("memory", f"{GiB:.1f} GiB", "ok" if is_enough else "note", remark))
    cache = cache_folder()
    if cache is None:
        rows.append(Finding("cache", "none", "note", "no home; set XDG_CACHE_HOME, or each run solves all again"))
    else:
        rows.append(folder_row("cache", cache))
    rows.append(folder_row("outputs", Path.cwd() / "outputs"))
    return rows


def _packages() -> list[Finding]:
    """Return a row for each package that every run needs."""
    text = LOCK.read_text(encoding="utf-8") if LOCK.is_file() else ""
    locked = dict(re.findall(r"^([A-Za-z0-9._-]+)==([^\s;]+)", text, flags=re.MULTILINE))
    return [package_row(name, installed_version(name), locked.get(name)) for name in declared_packages()]


def package_row(name: str, found: str | None, locked: str | None) -> Finding:
    """Return the row of a package: wrong if it is missing, a note if its version differs from the locked one."""
    if found is None:
        return Finding(name, "absent", "wrong", "run make setup")
    if locked in (None, found):
        return Finding(name, found)
    return Finding(name, found, "note", f"locked at {locked}; tests ran with that one")


def _imports(names: Sequence[str]) -> Iterator[Finding]:
    """Import heavy packages in a separate process, which a missing system library may crash.

    After a failure, another process imports the remaining packages.
    """
    waiting = list(names)
    while waiting:
        command = [sys.executable, "-W", "ignore", "-c", _IMPORTING, *waiting]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_IMPORT_SECONDS)
        except subprocess.TimeoutExpired:
            for name in waiting:
                remark = f"took more than {_IMPORT_SECONDS} s with the packages imported beside it"
                yield Finding(f"import {name}", "fails", "wrong", remark)
            return
        imported = [name for name in waiting if f"{_IMPORTED} {name}" in done.stdout.splitlines()]
        for name in imported:
            yield Finding(f"import {name}", "ok")
        waiting = waiting[len(imported) :]
        if waiting:
            *_, reason = done.stderr.splitlines() or ["the process ended"]
            remark = f"{reason}; run make setup, it names missing system libraries"
            yield Finding(f"import {waiting.pop(0)}", "fails", "wrong", remark)


def _optional() -> list[Finding]:
    """Return a row for each program that some tests or comparisons use; its purpose is noted if it is absent."""
    return [
        Finding(program, "present") if shutil.which(program) else Finding(program, "absent", "note", purpose)
        for program, purpose in OPTIONAL_PROGRAMS.items()
    ]


def folder_row(name: str, folder: Path) -> Finding:
    """Return the row on whether a folder, or its nearest existing parent, can be written; nothing is created."""
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if existing.is_dir() and os.access(existing, os.W_OK | os.X_OK):
        return Finding(name, str(folder), "ok", "writable")
    fault = "cannot be written" if existing.is_dir() else "is a file"
    return Finding(name, str(folder), "wrong", f"{existing} {fault}; choose or free another folder")
