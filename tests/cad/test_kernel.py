"""The kernel comes without pictures and DXF files, and does not take them away from anybody."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST_SECONDS = 120.0
PICTURES = """
import gc, sys
from cad.kernel import cq, load_kernel
print("OCP" in sys.modules)
load_kernel()
print({"vtk", "vtkmodules.vtkCommonDataModel", "ezdxf"} & set(sys.modules), gc.isenabled())
print(cq.Workplane().box(1.0, 1.0, 1.0).val().toVtkPolyData().GetNumberOfCells() > 0)
import vtk, pyvista
print(vtk.vtkVersion().GetVTKVersion() != "", pyvista.Sphere().n_cells > 0)
"""
DXF = """
import sys, tempfile
from pathlib import Path
from cad.kernel import cq
class Document(cq.exporters.DxfDocument): pass
print(isinstance(Document(), cq.exporters.DxfDocument), cq.exporters.dxf.DxfDocument in Document.__mro__)
with tempfile.TemporaryDirectory() as folder:
    path = str(Path(folder) / "square.dxf")
    cq.exporters.export(cq.Workplane().rect(2.0, 3.0), path)
    print(cq.importers.importDXF(path).val().Area())
"""
BEFORE = """
import sys, ezdxf, vtkmodules.vtkCommonDataModel as model
from cad.kernel import load_kernel
shapes = load_kernel().occ_impl.shapes
print(sys.modules["ezdxf"] is ezdxf, shapes.vtkPolyData is model.vtkPolyData)
"""


@pytest.mark.parametrize(
    ("program", "said"),
    [(PICTURES, "False\nset() True\nTrue\nTrue True\n"), (DXF, "True True\n6.0\n"), (BEFORE, "True True\n")],
    ids=["pictures", "dxf", "before"],
)
def test_what_is_left_out_still_can_be_had(program, said):
    """Drawn by CadQuery, imported later, beside PyVista; who has imported it before keeps it."""
    words = [sys.executable, "-c", program]
    done = subprocess.run(
        words, cwd=ROOT, env=dict(os.environ), capture_output=True, text=True, timeout=MOST_SECONDS, check=False
    )
    assert (done.stdout, done.stderr) == (said, "")
