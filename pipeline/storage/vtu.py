"""Meshes and fields as VTU files for ParaView and PyVista; array names carry units, and nodes have VTK's order.

Eight-node hexahedra of scikit-fem stay cells of this kind; 27-node hexahedra become the 20-node cells that are solved.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import meshio
import numpy as np
from numpy.typing import NDArray

from sensor.arrays import Floats

Ints = NDArray[np.int64]

KNOWN_BITS = 20
_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=np.float64
)
_EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
)
VTK_NODES = np.vstack([_CORNERS, _CORNERS[_EDGES].mean(axis=1)])
"""Reference coordinates of the nodes of a 20-node hexahedron in VTK's order, from its file format."""

_CELL_OF = {8: ("hexahedron", 8), 27: ("hexahedron20", 20)}


class Mesh(Protocol):
    """The used part of a scikit-fem mesh."""

    doflocs: Floats
    boundaries: Any
    dofs: Any
    elem: Any


HALF_AT_Y = "half_model_mirror_at_y_mm"
"""Name of the array that marks a mesh as one half: its value is the plane y of symmetry [mm]."""

_GRID = b"<UnstructuredGrid>\n"
_OF_THE_GRID = (
    '<FieldData>\n<DataArray type="Float64" Name="{name}" NumberOfTuples="1" format="ascii">{value:g}</DataArray>\n'
    "</FieldData>\n"
)


def write_vtu(path: Path, mesh: Mesh, point_data: Mapping[str, Floats], half_at_y: float | None = None) -> None:
    """Write a mesh [mm] with arrays, shape (points,), (points, 3) or (points, 6), as a VTU file.

    Points are `mesh.doflocs` without the centres of facets and cells; cells are `mesh.t`. Six components are xx, yy,
    zz, xy, yz, xz of a symmetric tensor, as in ParaView. Values are rounded to a millionth of the largest in their
    array. A named boundary becomes a point array of that name, 1 on its nodes. An array of one value marks a mesh that
    is one half, with the plane y of symmetry [mm]. Raises ValueError for an array of another size, with a value that is
    not finite or with the name of a boundary. It also refuses cells that VTK lacks.
    """
    kind, cells = _vtk_cells(mesh)
    points = np.ascontiguousarray(mesh.doflocs.T[: 1 + int(cells.max())])
    arrays = {name: _checked(path, name, values, len(points)) for name, values in point_data.items()}
    marks = {name: _on_boundary(mesh, facets, len(points)) for name, facets in sorted((mesh.boundaries or {}).items())}
    taken = sorted(arrays.keys() & marks.keys())
    if taken:
        msg = f"{path.name}: array {taken[0]!r} has the name of a boundary; give it another name, with its unit"
        raise ValueError(msg)
    meshio.Mesh(points, [(kind, cells)], point_data={**arrays, **marks}).write(path)
    if half_at_y is not None:  # meshio does not write such arrays
        told = _OF_THE_GRID.format(name=HALF_AT_Y, value=half_at_y).encode()
        path.write_bytes(path.read_bytes().replace(_GRID, _GRID + told, 1))


def _vtk_cells(mesh: Mesh) -> tuple[str, Ints]:
    """Return the kind of the cells and their nodes in VTK's order, found by position; shape (cells, nodes)."""
    nodes = np.asarray(mesh.dofs.element_dofs, dtype=np.int64)
    if len(nodes) not in _CELL_OF:
        msg = f"mesh: {len(nodes)} nodes a cell; must be one of {', '.join(map(str, _CELL_OF))}; write its linear mesh"
        raise ValueError(msg)
    kind, count = _CELL_OF[len(nodes)]
    # a brick of scikit-fem mirrors its reference cell; exchanging two axes gives VTK's order
    distance = np.linalg.norm(VTK_NODES[:count, None, [1, 0, 2]] - mesh.elem().doflocs, axis=2)
    return kind, np.ascontiguousarray(nodes[distance.argmin(axis=1)].T)


def _checked(path: Path, name: str, values: Floats, count: int) -> NDArray[np.float32]:
    """Return an array rounded for the file; raises ValueError for a wrong shape and for values that are not finite."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape not in ((count,), (count, 3), (count, 6)):
        msg = f"{path.name}: array {name!r} has shape {array.shape}; must be ({count},), ({count}, 3) or ({count}, 6)"
        raise ValueError(msg)
    if not np.isfinite(array).all():
        msg = f"{path.name}: array {name!r} has values that are not finite; check the solution"
        raise ValueError(msg)
    return _to_known_digits(array)


def _to_known_digits(array: Floats) -> NDArray[np.float32]:
    """Return values rounded to a millionth of the largest; further digits, and so the bytes, depend on threads."""
    step = math.ldexp(1.0, math.frexp(float(np.abs(array).max(initial=0.0)))[1] - KNOWN_BITS)
    rounded = np.round(array / step) * step + 0.0  # no negative zeros
    return rounded.astype(np.float32)


def _on_boundary(mesh: Mesh, facets: Any, count: int) -> NDArray[np.int8]:  # noqa: ANN401 - indices of some int type
    """Return 1 at the nodes on the facets, including nodes on their edges."""
    dofs = mesh.dofs.get_facet_dofs(facets)
    marks = np.zeros(count, dtype=np.int8)
    for nodes in (*dofs.nodal.values(), *dofs.edge.values()):
        marks[nodes] = 1
    return marks
