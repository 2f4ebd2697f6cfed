"""Mesh and fields of a folder as other programs read them: every cell and every node."""

import shutil
import subprocess

import meshio
import pytest
import pyvista as pv

FREECAD = shutil.which("freecadcmd")
SCRIPT = "import Fem\nmesh = Fem.read({!r})\nprint('cells', mesh.VolumeCount, 'nodes', mesh.NodeCount)\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["flexure.vtu", "fruit.vtu"])
def test_meshio_and_vtk_read_the_same(name, run_with_fields):
    path = run_with_fields / name
    one, other = meshio.read(path), pv.read(path)
    assert sum(len(block.data) for block in one.cells) == other.n_cells
    assert len(one.points) == other.n_points
    assert set(one.point_data) == set(other.point_data.keys())


@pytest.mark.slow
@pytest.mark.skipif(FREECAD is None, reason="FreeCAD is not installed")
@pytest.mark.parametrize("name", ["flexure.vtu", "fruit.vtu"])
def test_freecad_reads_every_cell(name, run_with_fields, tmp_path):
    mesh = pv.read(run_with_fields / name)
    script = tmp_path / "read.py"
    script.write_text(SCRIPT.format(str(run_with_fields / name)), encoding="utf-8")
    ran = subprocess.run([FREECAD, str(script)], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120)
    assert f"cells {mesh.n_cells} nodes {mesh.n_points}" in ran.stdout
