"""Meshes and fields as VTU files for ParaView and PyVista; array names carry units, node order is VTK's.

A scikit-fem mesh of four- or ten-node tetrahedra or of eight-node hexahedra becomes cells of the same kind, one of
27-node hexahedra the 20-node cells that are solved on it.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol
from xml.etree.ElementTree import ParseError

import meshio
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KNOWN_BITS = 20
_TETRA = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
TETRA_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_HEXA = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_HEXA_EDGES = (
    (0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7),
)  # fmt: skip


class Mesh(Protocol):
    """What is read of a scikit-fem mesh."""

    doflocs: Floats
    boundaries: Any
    dofs: Any
    elem: Any


def _between(corners: tuple[tuple[int, ...], ...], edges: tuple[tuple[int, int], ...]) -> list[Floats]:
    return [0.5 * np.add(corners[a], corners[b]) for a, b in edges]


VTK_NODES: dict[str, Floats] = {
    "tetra": np.array(_TETRA, dtype=np.float64),
    "tetra10": np.array([*_TETRA, *_between(_TETRA, TETRA_EDGES)]),
    "hexahedron": np.array(_HEXA, dtype=np.float64),
    "hexahedron20": np.array([*_HEXA, *_between(_HEXA, _HEXA_EDGES)]),
}
"""Reference coordinates of each cell's nodes in VTK's order, from the figures of its file format."""

_CELL_OF = {4: "tetra", 10: "tetra10", 8: "hexahedron", 27: "hexahedron20"}


def write_vtu(path: Path, mesh: Mesh, point_data: Mapping[str, Floats]) -> None:
    """Write a mesh [mm] with arrays, shape (points,), (points, 3) or (points, 6), as a VTU file.

    Points are those of `mesh.doflocs`, without the middles of facets and cells; cells are those of `mesh.t`. Six
    components are a symmetric tensor's xx, yy, zz, xy, yz, xz, as ParaView names them. Values are those to a millionth
    of the largest of their array. A named boundary becomes a point array of that name, 1 on its nodes. Raises
    ValueError for an array of another size, with a value that is not finite or with the name of a boundary, and for
    cells that VTK does not have.
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


def vtu_points(path: Path) -> Floats:
    """Return the nodes of a VTU file [mm], shape (nodes, 3); raises ValueError where it is none."""
    try:
        return np.asarray(meshio.read(path).points, dtype=np.float64)
    except (meshio.ReadError, ParseError) as error:
        msg = f"{path.name}: must be a VTU file ({error}); run the design again"
        raise ValueError(msg) from error


def _vtk_cells(mesh: Mesh) -> tuple[str, Ints]:
    """Return the kind of the cells and their nodes in VTK's order, shape (cells, nodes).

    The order follows from where the nodes lie in the reference cell; a cell that is turned inside out, which
    scikit-fem allows and VTK does not, gets its first two axes exchanged.
    """
    nodes = np.asarray(mesh.dofs.element_dofs, dtype=np.int64)
    kind = _CELL_OF.get(len(nodes))
    if kind is None:
        msg = f"mesh: {len(nodes)} nodes a cell; must be one of {', '.join(map(str, _CELL_OF))}; write its linear mesh"
        raise ValueError(msg)
    here = np.asarray(mesh.elem().doflocs, dtype=np.float64)
    straight, turned = (_same_places(VTK_NODES[kind][:, axes], here) for axes in ([0, 1, 2], [1, 0, 2]))
    cells = nodes[straight].T
    axes_ends = [0, 1, 3, 4] if kind.startswith("hexa") else [0, 1, 2, 3]
    corners = mesh.doflocs.T[cells[:, axes_ends]]
    inside_out = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    cells[inside_out] = nodes[turned].T[inside_out]
    return kind, np.ascontiguousarray(cells)


def _same_places(wanted: Floats, there: Floats) -> Ints:
    """Return for each wanted place which of the others it is."""
    distance = np.linalg.norm(wanted[:, None, :] - there[None, :, :], axis=2)
    found: Ints = distance.argmin(axis=1)
    if distance.min(axis=1).max() > 0.0:
        msg = "mesh: its nodes do not lie where VTK's cell has them; write its linear mesh"
        raise ValueError(msg)
    return found


def _checked(path: Path, name: str, values: Floats, count: int) -> NDArray[np.float32]:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape not in ((count,), (count, 3), (count, 6)):
        msg = f"{path.name}: array {name!r} has shape {array.shape}; must be ({count},), ({count}, 3) or ({count}, 6)"
        raise ValueError(msg)
    if not np.isfinite(array).all():
        msg = f"{path.name}: array {name!r} has values that are not finite; check the solution"
        raise ValueError(msg)
    return _to_known_digits(array)


def _to_known_digits(array: Floats) -> NDArray[np.float32]:
    """Return values to a millionth of the largest: what lies below depends on threads, and so would the bytes."""
    step = math.ldexp(1.0, math.frexp(float(np.abs(array).max(initial=0.0)))[1] - KNOWN_BITS)
    rounded = np.round(array / step) * step + 0.0  # no zeros with a sign
    return rounded.astype(np.float32)


def _on_boundary(mesh: Mesh, facets: Any, count: int) -> NDArray[np.int8]:  # noqa: ANN401 - indices of some int type
    """Return 1 at the nodes that lie on the facets, those on their edges included."""
    dofs = mesh.dofs.get_facet_dofs(facets)
    marks = np.zeros(count, dtype=np.int8)
    for nodes in (*dofs.nodal.values(), *dofs.edge.values()):
        marks[nodes] = 1
    return marks
