"""Help and sizing are instant: nothing heavy is imported before a command needs it."""

import subprocess
import sys
from pathlib import Path

import pytest
from deadline import DEADLINE_S

from twintip.flags import COMMANDS

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "scipy", "cadquery", "OCP", "gmsh", "skfem", "pyvista", "vtk", "matplotlib", "trimesh", "meshio"}
HEAVY |= {"rich"}
# Lines through forces and sums over tables take NumPy: readings and errors need them, no help does.
NUMERICAL = {"contrast_law", "contrast_rise", "elastica", "rounded_edge", "sloped_skin", "soft_tissue", "flesh_memory"}
NUMERICAL |= {"uneven_skin", "dome_form", "straight_line"}
ROOMS = [path for room in ("theory", "design") for path in sorted((ROOT / "sensor" / room).glob("[a-z]*.py"))]
PUBLIC = """import twintip
print(*dir(twintip), twintip.load_design('mango').name)
springs = twintip.size_springs(P_max=5.0, NL=0.05, K_m_max=4.6)
print(twintip.force_ratio(springs, K_m=2.0), twintip.RunOptions(), twintip.InputError, twintip.Verdict)"""
SIZING = ["quantity", "verdict", *(f"{path.parent.name}.{path.stem}" for path in ROOMS if path.stem not in NUMERICAL)]
HELP = """from twintip.cli import main
from twintip.flags import COMMANDS
raise SystemExit(max(map(main, [["--help"], ["--version"], *([name, "-h"] for name in COMMANDS)])))"""
DESIGN = "from pipeline import RunOptions, load_design; print(load_design('mango').name)"


@pytest.mark.parametrize(
    ("program", "printed"),
    [
        (HELP, [*(f"example: pipeline {name}" for name in COMMANDS), "twintip ", "exit code: 0"]),
        (DESIGN, ["mango\n"]),
        (PUBLIC, ["housing", "mango\n"]),
        ("\n".join(f"import sensor.{name}" for name in SIZING), []),
    ],
    ids=["help", "design", "public names", "sizing"],
)
def test_nothing_heavy_is_imported(program, printed):
    told = "import atexit, sys\natexit.register(lambda: print(*sys.modules, file=sys.stderr))"
    command = [sys.executable, "-c", f"{told}\n{program}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", check=True, timeout=DEADLINE_S)
    assert "sensor" in done.stderr.split()
    assert set(done.stderr.split()) & HEAVY == set()
    assert [words for words in printed if words not in done.stdout] == []
