"""The kernel comes without its toolkit for pictures, and does not take that away from anybody."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST_SECONDS = 120.0
LATER = """
import sys
from cad.kernel import cq
print("vtk" in sys.modules, "vtkmodules.vtkWebCore" in sys.modules)
print(cq.Workplane().box(1.0, 1.0, 1.0).val().toVtkPolyData().GetNumberOfCells() > 0)
import vtk, pyvista
print(vtk.vtkVersion().GetVTKVersion() != "", pyvista.Sphere().n_cells > 0)
"""
BEFORE = "import sys, vtk\nfrom cad.kernel import cq\nprint(sys.modules['vtk'] is vtk)"


@pytest.mark.parametrize(
    ("program", "said"), [(LATER, "False False\nTrue\nTrue True\n"), (BEFORE, "True\n")], ids=["later", "before"]
)
def test_pictures_are_not_loaded_and_still_can_be(program, said):
    """Drawn by CadQuery, imported later, beside PyVista; who has imported the toolkit before keeps it."""
    words = [sys.executable, "-c", program]
    done = subprocess.run(
        words, cwd=ROOT, env=dict(os.environ), capture_output=True, text=True, timeout=MOST_SECONDS, check=False
    )
    assert (done.stdout, done.stderr) == (said, "")
