"""Help and sizing are instant: nothing heavy is imported before a command needs it."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "scipy", "cadquery", "OCP", "gmsh", "skfem", "pyvista", "vtk", "matplotlib", "trimesh", "meshio"}
COMMANDS = ("run", "design", "check", "view", "doctor", "calibrate", "read")
ROOT_ROOMS = ("quantity", "verdict")
NUMERICAL = {"contrast_law", "pair_line"}  # fit lines through forces with NumPy; no sizing and no help needs them
SIZING = (
    *ROOT_ROOMS,
    *(
        f"{room}.{path.stem}"
        for room in ("theory", "design")
        for path in sorted((ROOT / "cad" / room).glob("[a-z]*.py"))
        if path.stem not in NUMERICAL
    ),
)


def _imported(*arguments: str) -> tuple[set[str], str]:
    """Return the top-level modules that a Python process imported, and what it printed."""
    command = [sys.executable, "-X", "importtime", *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", check=False, timeout=60)
    assert done.returncode == 0, done.stderr.splitlines()[-1]
    names = (line.rpartition("|")[2].strip() for line in done.stderr.splitlines() if line.startswith("import time:"))
    return {name.partition(".")[0] for name in names}, done.stdout


def test_help_imports_nothing_heavy() -> None:
    modules, printed = _imported("-c", "from pipeline.cli import main; raise SystemExit(main(['--help']))")
    assert "pipeline" in modules
    assert modules & HEAVY == set()
    assert [command for command in COMMANDS if command not in printed] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_imports_nothing_heavy(command: str) -> None:
    modules, printed = _imported("-m", "pipeline", command, "-h")
    assert modules & HEAVY == set()
    assert f"example: pipeline {command}" in printed


def test_version_imports_nothing_heavy() -> None:
    modules, printed = _imported("-m", "pipeline", "--version")
    assert modules & HEAVY == set()
    assert printed.startswith("twintip ")


def test_design_is_loaded_without_anything_heavy() -> None:
    modules, printed = _imported("-c", "from pipeline import RunOptions, load_design; print(load_design('mango').name)")
    assert modules & HEAVY == set()
    assert printed == "mango\n"


@pytest.mark.parametrize("name", SIZING)
def test_sizing_imports_the_standard_library_only(name: str) -> None:
    modules, _ = _imported("-I", "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r}); import cad.{name}")
    assert "cad" in modules
    assert modules & HEAVY == set()


def test_heavy_import_is_seen() -> None:
    modules, _ = _imported("-c", "def f():\n    import numpy.linalg\nf()")
    assert modules & HEAVY == {"numpy"}
