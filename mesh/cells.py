"""Shape functions, Jacobians and surface facets of hexahedra and tetrahedra, vectorised over the cells of a mesh.

The mapping in scikit-fem would evaluate the shape functions again for each component, each mesh and each call.
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

_SHARED_NDIM = 2  # number of axes of a point array (dim, q) that all cells share; (dim, e, q) differs between cells
_AREA_ORDER = 5  # polynomial degree up to which the quadrature of areas is exact


class ShapeTable(NamedTuple):
    """The `values` (nodes, q) [1] and derivatives, `slopes` (nodes, dim, q) [1], of shape functions at q points.

    The points and the derivatives are in coordinates of the unit cell. If each of e cells has its own points, the
    array shapes are (nodes, e, q) and (nodes, dim, e, q).
    """

    values: Floats
    slopes: Floats


def shape_table(element: Element, points: Floats) -> ShapeTable:
    """Evaluate the shape functions of a scalar element at points (dim, q) or (dim, e, q) of the unit cell [1].

    The returned arrays are read-only because they are cached.
    """
    points = np.asarray(points, dtype=np.float64)
    return _shape_table(cast(Hashable, type(element)), points.shape, points.tobytes())


# A run needs the same few tables, on the facets of a cube and at quadrature points, hundreds of times.
@functools.lru_cache(maxsize=64)
def _shape_table(element: type[Element], shape: tuple[int, ...], content: bytes) -> ShapeTable:
    """Evaluate the shape functions for `shape_table`. The points are passed as bytes, which can be a cache key."""
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
    """Map points of the unit cell to their positions [mm] in each of e cells, shape (dim, e, q).

    The points [1] have shape (dim, q), or (dim, e, q) if each cell has its own points. `cells` are the indices of the
    cells. By default, all cells are used.
    """
    values = shape_table(mesh.elem(), points).values
    nodes = _node_positions(mesh, cells)
    if points.ndim > _SHARED_NDIM:
        return np.asarray(np.einsum("neq,ien->ieq", values, nodes))
    return nodes @ values


def cell_jacobian(mesh: Mesh, points: Floats, cells: Ints | None = None) -> Floats:
    """Return the Jacobian d x_i / d X_j [mm], shape (dim, dim, e, q), of the map from the unit cell to each of e cells.

    The Jacobian is evaluated at `points` X [1] of the unit cell. The shape of `points` is (dim, q), or (dim, e, q) if
    each cell has its own points. `cells` are the indices of the cells. By default, all cells are used.
    """
    slopes = shape_table(mesh.elem(), points).slopes
    nodes = _node_positions(mesh, cells)
    if points.ndim > _SHARED_NDIM:
        return np.asarray(np.einsum("njeq,ien->ijeq", slopes, nodes))
    return np.stack([nodes @ slopes[:, axis] for axis in range(slopes.shape[1])], axis=1)


def _node_positions(mesh: Mesh, cells: Ints | None) -> Floats:
    """Return the node positions [mm] of the given cells, or of all cells by default, shape (dim, cells, nodes)."""
    indices = mesh.dofs.element_dofs if cells is None else mesh.dofs.element_dofs[:, cells]
    return np.asarray(mesh.doflocs[:, indices.T], dtype=np.float64)


def gradients(table: ShapeTable, jacobian: Floats) -> Floats:
    """Return the gradients dN/dx_j = dN/dX_k dX_k/dx_j of the shape functions N [1/mm], shape (nodes, dim, e, q).

    `jacobian` (dim, dim, e, q) [mm] is the Jacobian of e cells at the points of the table.
    """
    # The derivatives in the table either apply to all cells or differ between the cells (index e).
    subscripts = "nkq,kjeq->njeq" if table.slopes.ndim == jacobian.ndim - 1 else "nkeq,kjeq->njeq"
    return np.asarray(np.einsum(subscripts, table.slopes, inverse(jacobian)))


def determinant(jacobian: Floats) -> Floats:
    """Return the determinant [mm^3], shape (...), of a Jacobian (3, 3, ...) [mm]."""
    first, second, third = jacobian.swapaxes(0, 1)
    return np.asarray((first * _cross(second, third)).sum(axis=0))


def inverse(jacobian: Floats) -> Floats:
    """Return the inverse [1/mm] of a Jacobian (3, 3, ...) [mm] by Cramer's rule. The result has the same shape."""
    first, second, third = jacobian.swapaxes(0, 1)
    rows = np.stack([_cross(second, third), _cross(third, first), _cross(first, second)])
    return np.asarray(rows / (first * rows[0]).sum(axis=0))


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (3, ...). `numpy.cross` would be slower, because it moves axes."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True, eq=False)
class ReferenceFacet:
    """Elements that have the same local facet on a surface, for example the top face of the unit cube.

    `elements` holds the indices of the elements. `corner` (3,) [1] is a corner of the local facet in the unit cube. The
    two edge vectors that start there are `along` and `across` (3,) [1].
    """

    elements: Ints
    corner: Floats
    along: Floats
    across: Floats

    def inside(self, points: Floats) -> Floats:
        """Map points (2, q) of the facet, a unit square, to points (3, q) of the unit cube [1]."""
        return self.corner[:, None] + np.stack([self.along, self.across], axis=1) @ points

    def normals(self, mesh: Mesh, points: Floats) -> Floats:
        """Return the normals of the facet of each element, shape (3, elements, q), at points (2, q) of the unit square.

        The length of a normal is the surface Jacobian: the area on the facet per unit area of the unit square [mm^2].
        """
        jacobian = cell_jacobian(mesh, self.inside(points), self.elements)
        along = np.einsum("ijeq,j->ieq", jacobian, self.along)
        across = np.einsum("ijeq,j->ieq", jacobian, self.across)
        return np.cross(along, across, axis=0)


def reference_facets(mesh: Mesh, facets: Ints) -> Iterator[ReferenceFacet]:
    """Group surface facets, given by their indices (n,), by the local facet number in the elements that own them."""
    owners = mesh.f2t[0, facets]
    for local, corners in enumerate(mesh.refdom.facets):
        elements = owners[mesh.t2f[local, owners] == facets]
        if len(elements):
            first, second, *_, last = mesh.refdom.p[:, corners].T  # the corners are in order around the facet
            yield ReferenceFacet(elements, first, second - first, last - first)


def facets_area(mesh: Mesh, facets: Ints) -> float:
    """Return the total area [mm^2] of the facets with these indices (n,) in a mesh of hexahedra.

    The facets may be curved, so the area is integrated by Gauss quadrature.
    """
    points, weights = get_quadrature(RefQuad, _AREA_ORDER)
    area = 0.0
    for facet in reference_facets(mesh, facets):
        area += float((np.linalg.norm(facet.normals(mesh, points), axis=0) * weights).sum())
    return area
