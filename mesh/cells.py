"""Shape functions, their gradients and facets of hexahedra and tetrahedra, for all cells of a mesh at once.

scikit-fem's own mapping evaluates them again for each component, each mesh and each call.
"""

import functools
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from skfem import Element, Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad

from sensor.arrays import Floats

Ints = NDArray[np.integer[Any]]

_SHARED = 2  # dimensions of an array of points that all cells share
_AREA_ORDER = 5  # polynomial degree of the quadrature of areas


class ShapeTable(NamedTuple):
    """Values [1] (nodes, q) and slopes [1] (nodes, dim, q) of shape functions at q points of the unit cell.

    At other points in each of e cells the shapes are (nodes, e, q) and (nodes, dim, e, q).
    """

    values: Floats
    slopes: Floats


def shape_table(element: Element, points: Floats) -> ShapeTable:
    """Return the shape functions of a scalar element at points (dim, q), or (dim, e, q), read-only."""
    points = np.asarray(points, dtype=np.float64)
    return _shape_table(cast(Hashable, type(element)), points.shape, points.tobytes())


# A run needs the same few tables, on the facets of a cube and at quadrature points, some hundred times.
@functools.lru_cache(maxsize=64)
def _shape_table(element: type[Element], shape: tuple[int, ...], content: bytes) -> ShapeTable:
    points = np.frombuffer(content).reshape(shape)
    nodes = len(element.doflocs)
    values = np.empty((nodes, *shape[1:]))
    slopes = np.empty((nodes, *shape))
    for node in range(nodes):
        values[node], slopes[node] = element().lbasis(points, node)
    values.flags.writeable = False
    slopes.flags.writeable = False
    return ShapeTable(values, slopes)


def cell_points(mesh: Mesh, points: Floats, cells: Ints | None = None) -> Floats:
    """Return the positions in e cells [mm], (dim, e, q), of points of the unit cell, (dim, q) or (dim, e, q)."""
    values = shape_table(mesh.elem(), points).values
    nodes = _nodes(mesh, cells)
    if points.ndim > _SHARED:  # each cell has points of its own
        return np.asarray(np.einsum("neq,ien->ieq", values, nodes))
    return nodes @ values


def cell_jacobian(mesh: Mesh, points: Floats, cells: Ints | None = None) -> Floats:
    """Return d x_i / d X_j [mm], (dim, dim, e, q), at points X of the unit cell, (dim, q) or (dim, e, q)."""
    slopes = shape_table(mesh.elem(), points).slopes
    nodes = _nodes(mesh, cells)
    if points.ndim > _SHARED:
        return np.asarray(np.einsum("njeq,ien->ijeq", slopes, nodes))
    return np.stack([nodes @ slopes[:, axis] for axis in range(slopes.shape[1])], axis=1)


def _nodes(mesh: Mesh, cells: Ints | None) -> Floats:
    """Return the positions of the nodes of cells [mm], shape (dim, cells, nodes)."""
    numbers = mesh.dofs.element_dofs if cells is None else mesh.dofs.element_dofs[:, cells]
    return np.asarray(mesh.doflocs[:, numbers.T], dtype=np.float64)


def gradients(table: ShapeTable, jacobian: Floats) -> Floats:
    """Return the gradients [1/mm] of shape functions in e cells with a given Jacobian [mm], (nodes, dim, e, q)."""
    rule = "nkq,kjeq->njeq" if table.slopes.ndim == jacobian.ndim - 1 else "nkeq,kjeq->njeq"
    return np.asarray(np.einsum(rule, table.slopes, inverse(jacobian)))


def determinant(jacobian: Floats) -> Floats:
    """Return det of a Jacobian (3, 3, ...) [mm], shape (...) [mm^3]."""
    first, second, third = jacobian.swapaxes(0, 1)
    return np.asarray((first * _cross(second, third)).sum(axis=0))


def inverse(jacobian: Floats) -> Floats:
    """Return the inverse of a Jacobian (3, 3, ...) [mm], same shape [1/mm]."""
    first, second, third = jacobian.swapaxes(0, 1)
    rows = np.stack([_cross(second, third), _cross(third, first), _cross(first, second)])
    return np.asarray(rows / (first * rows[0]).sum(axis=0))


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (3, ...); faster than numpy's, which moves axes."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True, eq=False)
class ReferenceFacet:
    """Elements whose same local facet lies on a surface, with the corner of this facet and two edges from it, (3,)."""

    elements: Ints
    corner: Floats
    along: Floats
    across: Floats

    def inside(self, points: Floats) -> Floats:
        """Return points (2, q) of a unit square as points of the unit cube (3, q) [1]."""
        return self.corner[:, None] + np.stack([self.along, self.across], axis=1) @ points

    def normals(self, mesh: Mesh, points: Floats) -> Floats:
        """Return the normals at points (2, q) of a unit square, (3, elements, q); their length is the area [mm^2]."""
        jacobian = cell_jacobian(mesh, self.inside(points), self.elements)
        along = np.einsum("ijeq,j->ieq", jacobian, self.along)
        across = np.einsum("ijeq,j->ieq", jacobian, self.across)
        return np.cross(along, across, axis=0)


def reference_facets(mesh: Mesh, facets: Ints) -> Iterator[ReferenceFacet]:
    """Yield the elements of facets (n,) of a mesh, grouped by the local facet of the unit cell [1]."""
    owners = mesh.f2t[0, facets]
    for local, corners in enumerate(mesh.refdom.facets):
        elements = owners[mesh.t2f[local, owners] == facets]
        if len(elements):
            first, second, *_, last = mesh.refdom.p[:, corners].T  # corners in order around the facet
            yield ReferenceFacet(elements, first, second - first, last - first)


def facets_area(mesh: Mesh, facets: Ints) -> float:
    """Return the area [mm^2] of facets (n,) of a mesh of hexahedra, which may be curved."""
    points, weights = get_quadrature(RefQuad, _AREA_ORDER)
    area = 0.0
    for facet in reference_facets(mesh, facets):
        area += float((np.linalg.norm(facet.normals(mesh, points), axis=0) * weights).sum())
    return area
