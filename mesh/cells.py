"""Shape functions, Jacobians and surface facets of hexahedra and tetrahedra, vectorised over the cells of a mesh.

scikit-fem's own mapping would evaluate the shape functions again for each component, each mesh and each call.
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

_SHARED = 2  # dimensions of a point array (dim, q) that all cells share; (dim, e, q) has points for each cell
_AREA_ORDER = 5  # polynomial degree up to which the quadrature of areas is exact


class ShapeTable(NamedTuple):
    """Values [1] (nodes, q) and derivatives, `slopes` [1] (nodes, dim, q), of shape functions at q points.

    The points and the derivatives are in coordinates of the unit cell. If each of e cells has points of its own, the
    array shapes are (nodes, e, q) and (nodes, dim, e, q).
    """

    values: Floats
    slopes: Floats


def shape_table(element: Element, points: Floats) -> ShapeTable:
    """Return the shape functions of a scalar element at points (dim, q) or (dim, e, q) of the unit cell [1].

    The arrays are cached, and therefore read-only.
    """
    points = np.asarray(points, dtype=np.float64)
    return _shape_table(cast(Hashable, type(element)), points.shape, points.tobytes())


# A run needs the same few tables, on the facets of a cube and at quadrature points, some hundred times.
@functools.lru_cache(maxsize=64)
def _shape_table(element: type[Element], shape: tuple[int, ...], content: bytes) -> ShapeTable:
    """Return `shape_table` at the points with this array shape and content; unlike arrays, bytes can be cache keys."""
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
    """Return the positions [mm], shape (dim, e, q), of points of the unit cell in each of e cells.

    The points [1] have shape (dim, q), or (dim, e, q) if each cell has points of its own. `cells` are the indices of
    the cells; by default all cells.
    """
    values = shape_table(mesh.elem(), points).values
    nodes = _node_positions(mesh, cells)
    if points.ndim > _SHARED:
        return np.asarray(np.einsum("neq,ien->ieq", values, nodes))
    return nodes @ values


def cell_jacobian(mesh: Mesh, points: Floats, cells: Ints | None = None) -> Floats:
    """Return the Jacobian d x_i / d X_j [mm], shape (dim, dim, e, q), of the map from the unit cell to each of e cells.

    It is evaluated at `points` X [1]; these and `cells` are as in `cell_points`.
    """
    slopes = shape_table(mesh.elem(), points).slopes
    nodes = _node_positions(mesh, cells)
    if points.ndim > _SHARED:
        return np.asarray(np.einsum("njeq,ien->ijeq", slopes, nodes))
    return np.stack([nodes @ slopes[:, axis] for axis in range(slopes.shape[1])], axis=1)


def _node_positions(mesh: Mesh, cells: Ints | None) -> Floats:
    """Return the positions of the nodes of the given cells, by default of all [mm], shape (dim, cells, nodes)."""
    indices = mesh.dofs.element_dofs if cells is None else mesh.dofs.element_dofs[:, cells]
    return np.asarray(mesh.doflocs[:, indices.T], dtype=np.float64)


def gradients(table: ShapeTable, jacobian: Floats) -> Floats:
    """Return the gradients of shape functions in e cells [1/mm], shape (nodes, dim, e, q).

    `jacobian` (dim, dim, e, q) [mm] is the Jacobian of the cells at the points of the table.
    """
    # The derivatives in the table, by unit-cell coordinate k, may be the same for all cells or differ between cells.
    rule = "nkq,kjeq->njeq" if table.slopes.ndim == jacobian.ndim - 1 else "nkeq,kjeq->njeq"
    return np.asarray(np.einsum(rule, table.slopes, inverse(jacobian)))


def determinant(jacobian: Floats) -> Floats:
    """Return the determinant [mm^3], shape (...), of a Jacobian (3, 3, ...) [mm]."""
    first, second, third = jacobian.swapaxes(0, 1)
    return np.asarray((first * _cross(second, third)).sum(axis=0))


def inverse(jacobian: Floats) -> Floats:
    """Return the inverse [1/mm] of a Jacobian (3, 3, ...) [mm], in the same shape, by Cramer's rule."""
    first, second, third = jacobian.swapaxes(0, 1)
    rows = np.stack([_cross(second, third), _cross(third, first), _cross(first, second)])
    return np.asarray(rows / (first * rows[0]).sum(axis=0))


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (3, ...); faster than `numpy.cross`, which moves axes."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True, eq=False)
class ReferenceFacet:
    """Elements that lie on a surface with the same local facet, for instance all with the top face of the unit cube.

    `corner` (3,) is a corner of this facet in the unit cube [1]. `along` and `across` (3,) are the two edges from it.
    """

    elements: Ints
    corner: Floats
    along: Floats
    across: Floats

    def inside(self, points: Floats) -> Floats:
        """Return the points of the unit cube (3, q) [1] at points (2, q) of the facet, which is a unit square."""
        return self.corner[:, None] + np.stack([self.along, self.across], axis=1) @ points

    def normals(self, mesh: Mesh, points: Floats) -> Floats:
        """Return normals of the facet in each element, shape (3, elements, q), at points (2, q) of the unit square.

        Their length is the Jacobian of the surface, the area per area of the unit square [mm^2].
        """
        jacobian = cell_jacobian(mesh, self.inside(points), self.elements)
        along = np.einsum("ijeq,j->ieq", jacobian, self.along)
        across = np.einsum("ijeq,j->ieq", jacobian, self.across)
        return np.cross(along, across, axis=0)


def reference_facets(mesh: Mesh, facets: Ints) -> Iterator[ReferenceFacet]:
    """Yield the elements that own the surface facets with indices `facets` (n,), grouped by local facet number."""
    owners = mesh.f2t[0, facets]
    for local, corners in enumerate(mesh.refdom.facets):
        elements = owners[mesh.t2f[local, owners] == facets]
        if len(elements):
            first, second, *_, last = mesh.refdom.p[:, corners].T  # corners in order around the facet
            yield ReferenceFacet(elements, first, second - first, last - first)


def facets_area(mesh: Mesh, facets: Ints) -> float:
    """Return the total area [mm^2] of facets with indices (n,) of a mesh of hexahedra; facets may be curved."""
    points, weights = get_quadrature(RefQuad, _AREA_ORDER)
    area = 0.0
    for facet in reference_facets(mesh, facets):
        area += float((np.linalg.norm(facet.normals(mesh, points), axis=0) * weights).sum())
    return area
