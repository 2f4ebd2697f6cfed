"""Shape functions at points of the unit cell, evaluated once for all meshes, and where cells of a mesh carry them.

scikit-fem's own mapping evaluates them anew for each component, each mesh and each call.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import Element, Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]

_SPACE = 3
_SHARED = 2  # axes of points that all cells share


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Values [1] (nodes, q) and slopes [1] (nodes, dim, q) of shape functions at q points of the unit cell.

    At other points in each of e cells the shapes are (nodes, e, q) and (nodes, dim, e, q).
    """

    values: Floats
    slopes: Floats


def shape_table(element: Element, points: Floats) -> ShapeTable:
    """Return the shape functions of a scalar element at points (dim, q), which are kept, or (dim, e, q)."""
    if points.ndim > _SHARED:
        return _evaluated(element, points)
    places = np.ascontiguousarray(points, dtype=np.float64).tobytes()
    return _kept(type(element), points.shape, places)  # type: ignore[arg-type]


@functools.lru_cache(maxsize=64)
def _kept(kind: type[Element], shape: tuple[int, ...], places: bytes) -> ShapeTable:
    table = _evaluated(kind(), np.frombuffer(places).reshape(shape))
    for array in (table.values, table.slopes):
        array.setflags(write=False)
    return table


def _evaluated(element: Element, points: Floats) -> ShapeTable:
    pairs = [element.lbasis(points, node) for node in range(len(element.doflocs))]
    values = [np.broadcast_to(value, points.shape[1:]) for value, _ in pairs]
    slopes = [np.broadcast_to(slope, points.shape) for _, slope in pairs]
    return ShapeTable(np.stack(values), np.stack(slopes))


def cell_places(mesh: Mesh, points: Floats, cells: Ints | None = None) -> Floats:
    """Return the places [mm] of points of the unit cell, (dim, q) or (dim, e, q), in e cells, shape (dim, e, q)."""
    values = shape_table(mesh.elem(), points).values
    nodes = _nodes_at(mesh, cells)
    if points.ndim > _SHARED:
        return np.asarray(np.einsum("neq,ien->ieq", values, nodes))
    return np.asarray(nodes @ values)


def cell_slopes(mesh: Mesh, points: Floats, cells: Ints | None = None) -> Floats:
    """Return d place / d point [mm] at points of the unit cell, (dim, q) or (dim, e, q), shape (dim, dim, e, q)."""
    slopes = shape_table(mesh.elem(), points).slopes
    nodes = _nodes_at(mesh, cells)
    if points.ndim > _SHARED:
        return np.asarray(np.einsum("njeq,ien->ijeq", slopes, nodes))
    return np.asarray(np.stack([nodes @ slopes[:, axis] for axis in range(slopes.shape[1])], axis=1))


def _nodes_at(mesh: Mesh, cells: Ints | None) -> Floats:
    """Return where the nodes of cells lie [mm], shape (dim, cells, nodes)."""
    numbers = mesh.dofs.element_dofs if cells is None else mesh.dofs.element_dofs[:, cells]
    return np.asarray(mesh.doflocs[:, numbers.T], dtype=np.float64)


def gradients(table: ShapeTable, slopes: Floats) -> Floats:
    """Return the gradients [1/mm] of shape functions in e cells of given slopes [mm], shape (nodes, dim, e, q)."""
    rule = "nkq,kjeq->njeq" if table.slopes.ndim == slopes.ndim - 1 else "nkeq,kjeq->njeq"
    return np.asarray(np.einsum(rule, table.slopes, inverse(slopes)))


def determinant(slopes: Floats) -> Floats:
    """Return det of the slopes of a map, (dim, dim, ...) [mm], shape (...) [mm^dim]."""
    if len(slopes) != _SPACE:
        return np.asarray(np.linalg.det(np.moveaxis(slopes, (0, 1), (-2, -1))))
    first, second, third = slopes.swapaxes(0, 1)
    return np.asarray((first * _cross(second, third)).sum(axis=0))


def inverse(slopes: Floats) -> Floats:
    """Return the inverse of the slopes of a map, (dim, dim, ...) [mm], same shape [1/mm]."""
    if len(slopes) != _SPACE:
        return np.asarray(np.moveaxis(np.linalg.inv(np.moveaxis(slopes, (0, 1), (-2, -1))), (-2, -1), (0, 1)))
    first, second, third = slopes.swapaxes(0, 1)
    rows = np.stack([_cross(second, third), _cross(third, first), _cross(first, second)])
    return np.asarray(rows / (first * rows[0]).sum(axis=0))


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (3, ...); numpy's own moves the axes about."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
