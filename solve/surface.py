"""Quadrature on the named surfaces of a mesh, from the shape functions of the elements that lie on them.

scikit-fem's own facet basis finds the position of a point in its element by Newton's method with an absolute tolerance.
This fails in long elements and in thin layers.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis

from mesh.cells import ReferenceFacet, cell_jacobian, cell_points, gradients, reference_facets, shape_table
from sensor.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class SurfacePatch:
    """Quadrature with q points on each of some facets, and the shape functions of their elements at these points.

    `points` (3, facets, q) [mm] and `weights` (facets, q) [mm^2] are the quadrature. `dofs` (nodes, 3, facets) are the
    dofs of the nodes of the elements. The scalar shape functions have the values `shapes` (nodes, facets, q) [1] and
    the `gradients` (nodes, 3, facets, q) [1/mm].
    """

    points: Floats
    weights: Floats
    dofs: Ints
    shapes: Floats
    gradients: Floats


def surface_facets(basis: CellBasis, name: str) -> Iterator[ReferenceFacet]:
    """Yield the elements on a named surface, in groups with the same local facet on the surface."""
    return reference_facets(basis.mesh, basis.mesh.boundaries[name])


def nodal_dofs(basis: CellBasis, elements: Ints) -> Ints:
    """Return the displacement dofs at the nodes of the given elements, shape (nodes, 3, elements)."""
    return np.asarray(basis.element_dofs[:, elements].reshape(-1, 3, len(elements)))


def patch_inside(basis: CellBasis, elements: Ints, points: Floats, weights: Floats) -> SurfacePatch:
    """Return the quadrature at points of the unit cell of some elements (e,), with weights (e, q) [mm^2].

    The points (3, q) [1] are the same for all elements; points (3, e, q) differ between elements.
    """
    table = shape_table(basis.elem.elem, points)
    values = table.values.reshape(len(table.values), -1, weights.shape[1])
    return SurfacePatch(
        points=cell_points(basis.mesh, points, elements),
        weights=weights,
        dofs=nodal_dofs(basis, elements),
        shapes=np.broadcast_to(values, (len(values), *weights.shape)),
        gradients=gradients(table, cell_jacobian(basis.mesh, points, elements)),
    )


def surface_patches(basis: CellBasis, name: str, points: Floats, weights: Floats) -> Iterator[SurfacePatch]:
    """Yield the quadrature on a named surface, one patch for each group of `surface_facets`.

    `points` (2, q) and `weights` (q,) are the quadrature rule on the reference facet [1].
    """
    for facet in surface_facets(basis, name):
        area = np.linalg.norm(facet.normals(basis.mesh, points), axis=0)
        yield patch_inside(basis, facet.elements, facet.inside(points), area * weights)
