"""Fields survive the way into VTK: PyVista interpolates inside the cells what the mesh's own elements would."""

import dataclasses

import numpy as np
import pytest
import pyvista as pv
from skfem import MeshHex1, MeshHex2, MeshTri1

from pipeline.storage.vtu import write_vtu

BOX = (3.0, 2.0, 1.0)


def box(kind, pushed=0.05):
    """Return a box of 3 x 2 x 1 mm with two named sides, its nodes inside pushed about so that no cell is a brick."""
    axes = [np.linspace(0.0, length, 4) for length in BOX]
    straight = MeshHex1.init_tensor(*axes).with_boundaries(
        {"base": lambda x: x[2] == 0.0, "high_tip": lambda x: x[0] == BOX[0]}
    )
    inside = np.setdiff1d(np.arange(straight.p.shape[1]), straight.boundary_nodes())
    p = straight.p.copy()
    p[:, inside] += np.random.default_rng(3).uniform(-pushed, pushed, (3, len(inside)))
    moved = dataclasses.replace(straight, doflocs=p)
    return moved if kind == "hex8" else dataclasses.replace(MeshHex2.from_mesh(moved), _boundaries=moved.boundaries)


def points_in_vtk(mesh):
    """Return the points of the file: all, or the corners and the middles of edges of 27-node cells, shape (3, n)."""
    corners_and_edges = 1 + mesh.t.max() + mesh.edges.shape[1]
    return mesh.doflocs[:, :corners_and_edges] if isinstance(mesh, MeshHex2) else mesh.doflocs


def bent(mesh):
    """Return the mesh with all its nodes moved by a quadratic map: edges and faces become curves."""
    x, y, z = mesh.doflocs
    return dataclasses.replace(mesh, doflocs=np.array([x + 0.05 * y * z, y, z + 0.1 * x * x]))


def read(path):
    grid = pv.read(path)
    assert isinstance(grid, pv.UnstructuredGrid)
    return grid


def jacobians(grid, at):
    """Return VTK's own map's determinant in every cell at a parametric place, by central differences."""
    step = 1e-5
    found = []
    for i in range(grid.n_cells):
        cell = grid.GetCell(i)
        weights = [0.0] * cell.GetNumberOfPoints()

        def place(r, cell=cell, weights=weights):
            x = [0.0, 0.0, 0.0]
            cell.EvaluateLocation(pv._vtk.reference(0), list(r), x, weights)
            return np.array(x)

        columns = [(place(np.add(at, e)) - place(np.subtract(at, e))) / (2.0 * step) for e in step * np.eye(3)]
        found.append(float(np.linalg.det(np.column_stack(columns))))
    return found


@pytest.mark.parametrize("kind", ["hex8", "hex27"])
def test_vtk_interpolates_a_polynomial_of_the_elements_order_exactly(kind, tmp_path, rng):
    """On straight cells an element of order k holds every polynomial of degree k: two nodes exchanged would show."""
    mesh = box(kind)

    def u(x, y, z):
        return 1.0 + x - 2.0 * y + 3.0 * z

    points = points_in_vtk(mesh)
    write_vtu(tmp_path / "box.vtu", mesh, {"u_mm": u(*points), "points_mm": points.T})
    places = rng.uniform((0.05, 0.05, 0.05), (2.95, 1.95, 0.95), (200, 3))
    grid = read(tmp_path / "box.vtu")
    np.testing.assert_allclose(grid["points_mm"], grid.points, rtol=0.0, atol=1e-6 * BOX[0])  # the digits of a file
    assert min(jacobians(grid, (0.3, 0.3, 0.3))) > 0.0  # no cell is inside out
    sampled = pv.PolyData(places).sample(grid)
    assert sampled["vtkValidPointMask"].all()
    # VTK finds the place in a cell by iteration, in one of 20 nodes to a thousandth of the cell
    assert sampled["u_mm"] == pytest.approx(u(*places.T), abs=1e-3 if kind == "hex27" else 1e-4)


def test_curved_cells_keep_their_map(tmp_path):
    """VTK's map of a curved cell has the determinant of scikit-fem's at the same place of every cell.

    Of bricks: the bent ones are then held by 20 nodes as well as by 27.
    """
    mesh = bent(box("hex27", pushed=0.0))
    write_vtu(tmp_path / "bent.vtu", mesh, {})
    at = (0.5, 0.5, 0.5)  # the one place that turned axes leave alone
    expected = np.abs(mesh.mapping().detDF(np.array(at)[:, None]))[:, 0]
    assert jacobians(read(tmp_path / "bent.vtu"), at) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kind", ["hex8", "hex27"])
def test_named_boundary_marks_the_nodes_in_its_plane_and_no_others(kind, tmp_path):
    write_vtu(tmp_path / "box.vtu", box(kind), {})
    grid = read(tmp_path / "box.vtu")
    assert sorted(grid.point_data) == ["base", "high_tip"]
    assert np.array_equal(grid["base"] == 1, grid.points[:, 2] == 0.0)
    assert np.array_equal(grid["high_tip"] == 1, grid.points[:, 0] == BOX[0])


def test_digits_below_a_millionth_of_the_largest_value_do_not_reach_the_bytes(tmp_path, rng):
    """A share of 2e-9 of the values then lies at an edge of rounding, against a few thousand here."""
    mesh = box("hex8")
    stress = rng.normal(size=(64, 6)) * 10.0 ** rng.integers(-12, 3, (64, 6))
    noise = 1e-15 * np.abs(stress).max() * rng.normal(size=stress.shape)
    contents = set()
    for name, values in (("a.vtu", stress), ("b.vtu", stress + noise), ("c.vtu", stress - noise)):
        write_vtu(tmp_path / name, mesh, {"stress_MPa": values})
        contents.add((tmp_path / name).read_bytes())
    assert len(contents) == 1


@pytest.mark.parametrize(
    ("point_data", "message"),
    [
        ({"u_mm": np.zeros(63)}, r"box\.vtu: array 'u_mm' has shape \(63,\); must be \(64,\), \(64, 3\) or \(64, 6\)"),
        ({"u_mm": np.zeros((3, 64))}, r"has shape \(3, 64\); must be"),
        ({"u_mm": np.full(64, np.nan)}, r"'u_mm' has values that are not finite"),
        ({"base": np.zeros(64)}, r"'base' has the name of a boundary"),
    ],
)
def test_bad_array_is_refused_and_no_file_written(point_data, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        write_vtu(tmp_path / "box.vtu", box("hex8"), point_data)
    assert list(tmp_path.iterdir()) == []


def test_cells_that_are_no_solids_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"3 nodes per cell; must be one of 8, 27"):
        write_vtu(tmp_path / "flat.vtu", MeshTri1(), {})
