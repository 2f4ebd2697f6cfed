"""Export of meshes and fields to VTU files for ParaView and PyVista; the names of arrays contain units.

The nodes of a cell are written in VTK's order. Hexahedra with 8 nodes are written unchanged. Hexahedra with 27 nodes
are written as 20-node cells, on which the displacements are solved.
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

KNOWN_BITS = 20  # number of significant bits with which the largest value of an array is written
_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=np.float64
)
_EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
)
VTK_NODES = np.vstack([_CORNERS, _CORNERS[_EDGES].mean(axis=1)])
"""Reference coordinates of the nodes of a 20-node hexahedron in VTK's order, from its file format."""

_CELLS = {8: ("hexahedron", 8), 27: ("hexahedron20", 20)}
"""The cell type in meshio and the number of its nodes, keyed by the number of nodes per cell in scikit-fem."""


class Mesh(Protocol):
    """The attributes of a scikit-fem mesh that this module uses."""

    doflocs: Floats
    boundaries: Any
    dofs: Any
    elem: Any


HALF_AT_Y = "half_model_mirror_at_y_mm"
"""Name of the array that marks a mesh as one half of a body; its value is y of the symmetry plane [mm]."""

_GRID = b"<UnstructuredGrid>\n"
_FIELD_DATA = (
    '<FieldData>\n<DataArray type="Float64" Name="{name}" NumberOfTuples="1" format="ascii">{value:g}</DataArray>\n'
    "</FieldData>\n"
)


def write_vtu(path: Path, mesh: Mesh, point_data: Mapping[str, Floats], half_at_y: float | None = None) -> None:
    """Write a mesh [mm] and the arrays in `point_data` to a VTU file.

    An array has the shape (points,), (points, 3) or (points, 6), in the order of `mesh.doflocs`. Six components are xx,
    yy, zz, xy, yz, xz of a symmetric tensor, as in ParaView. Values are rounded to a millionth of the
    largest value in their array. For each named boundary, an array with its name is written, which is 1 at the nodes of
    the boundary and 0 elsewhere. `half_at_y` [mm] is the y coordinate of the symmetry plane of a mesh that is one half
    of a body, and None for a whole body.

    Raises ValueError for an array with another shape, with a value that is not finite, or with the name of a boundary,
    and for cells of a type that `_CELLS` does not contain.
    """
    kind, cells = _vtk_cells(mesh)
    # In `doflocs` (3, points), the nodes that are written come first, followed by the centres of facets and cells.
    node_count = 1 + int(cells.max())
    points = np.ascontiguousarray(mesh.doflocs.T[:node_count])
    arrays = {name: _prepare_array(path, name, values, len(points)) for name, values in point_data.items()}
    marks = {name: _mark_nodes(mesh, facets, len(points)) for name, facets in sorted((mesh.boundaries or {}).items())}
    clashes = sorted(arrays.keys() & marks.keys())
    if clashes:
        msg = f"{path.name}: array {clashes[0]!r} has the name of a boundary; choose another name, with its unit"
        raise ValueError(msg)
    meshio.Mesh(points, [(kind, cells)], point_data={**arrays, **marks}).write(path)
    if half_at_y is not None:  # added as text, because meshio cannot write an array that belongs to the whole grid
        field_data = _FIELD_DATA.format(name=HALF_AT_Y, value=half_at_y).encode()
        path.write_bytes(path.read_bytes().replace(_GRID, _GRID + field_data, 1))


def _vtk_cells(mesh: Mesh) -> tuple[str, Ints]:
    """Return the type of the cells as meshio names it, and their nodes (cells, nodes) in VTK's order.

    The positions of the nodes in the reference cell determine this order. Raises ValueError for an unknown cell type.
    """
    nodes = np.asarray(mesh.dofs.element_dofs, dtype=np.int64)
    if len(nodes) not in _CELLS:
        msg = f"mesh: {len(nodes)} nodes per cell; must be one of {', '.join(map(str, _CELLS))}; write its linear mesh"
        raise ValueError(msg)
    kind, count = _CELLS[len(nodes)]
    # scikit-fem's hexahedron is mirrored relative to VTK's. Swapping two axes of the reference cell corrects this. The
    # distances (VTK nodes, scikit-fem nodes) then show which node of scikit-fem is at the position of each node of VTK.
    distances = np.linalg.norm(VTK_NODES[:count, None, [1, 0, 2]] - mesh.elem().doflocs, axis=2)
    return kind, np.ascontiguousarray(nodes[distances.argmin(axis=1)].T)


def _prepare_array(path: Path, name: str, values: Floats, count: int) -> NDArray[np.float32]:
    """Check an array for `count` points, and return it with the rounded values that are written to the file.

    Raises ValueError for a wrong shape, and for values that are not finite. The message names the file at `path` and
    the array.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape not in ((count,), (count, 3), (count, 6)):
        msg = f"{path.name}: array {name!r} has shape {array.shape}; must be ({count},), ({count}, 3) or ({count}, 6)"
        raise ValueError(msg)
    if not np.isfinite(array).all():
        msg = f"{path.name}: array {name!r} has values that are not finite; check the solution"
        raise ValueError(msg)
    return _round_values(array)


def _round_values(array: Floats) -> NDArray[np.float32]:
    """Return the values rounded to about a millionth of their largest magnitude.

    Further digits are not reproducible, because they depend on the number of threads.
    """
    largest = float(np.abs(array).max(initial=0.0))
    _, exponent = math.frexp(largest)  # 2^exponent is the smallest power of 2 above `largest`
    step = math.ldexp(1.0, exponent - KNOWN_BITS)  # a power of 2, so that its multiples are exact
    rounded = np.round(array / step) * step + 0.0  # adding 0 makes negative zeros positive
    return rounded.astype(np.float32)


def _mark_nodes(mesh: Mesh, facets: Any, count: int) -> NDArray[np.int8]:  # noqa: ANN401 - indices of some int type
    """Return an array (count,) that is 1 at the nodes of the given facets and of their edges, and 0 elsewhere."""
    dofs = mesh.dofs.get_facet_dofs(facets)
    marks = np.zeros(count, dtype=np.int8)
    for nodes in (*dofs.nodal.values(), *dofs.edge.values()):
        marks[nodes] = 1
    return marks
