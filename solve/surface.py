"""Quadrature on the named surfaces of a mesh, with the shape functions of the elements at these surfaces.

It replaces scikit-fem's facet basis, which locates points in their elements by Newton's method with an absolute
tolerance. That method fails in long elements and in thin layers.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis

from mesh.cells import ReferenceFacet, cell_jacobian, cell_points, gradients, reference_facets, shape_table
from sensor.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class SurfacePatch:
    """The q quadrature points on each facet of a group, and the shape functions of the elements at these points.

    `points` (3, facets, q) [mm] and `weights` (facets, q) [mm^2] are the quadrature rule. `dofs` (nodes, 3, facets) are
    the displacement dofs at the nodes of the elements. The scalar shape functions have the values `shapes` (nodes,
    facets, q) [1] and the gradients `gradients` (nodes, 3, facets, q) [1/mm].
    """

    points: Floats
    weights: Floats
    dofs: Ints
    shapes: Floats
    gradients: Floats


def surface_facets(basis: CellBasis, name: str) -> Iterator[ReferenceFacet]:
    """Yield the elements on a named surface in groups, in each of which the same local facet lies on the surface."""
    return reference_facets(basis.mesh, basis.mesh.boundaries[name])


def nodal_dofs(basis: CellBasis, elements: Ints) -> Ints:
    """Return the displacement dofs at the nodes of the given elements, shape (nodes, 3, elements)."""
    return np.asarray(basis.element_dofs[:, elements].reshape(-1, 3, len(elements)))


def patch_inside(basis: CellBasis, elements: Ints, points: Floats, weights: Floats) -> SurfacePatch:
    """Return the patch of the elements (e,) with quadrature at given points and with the weights (e, q) [mm^2].

    `points` [1] are positions in the reference cell. Points of shape (3, q) are the same in all elements; points of
    shape (3, e, q) differ between elements. The points may also lie inside the elements instead of on a facet.
    """
    table = shape_table(basis.elem.elem, points)
    # The shape is (nodes, e, q), or (nodes, 1, q) if all elements have the same points.
    values = table.values.reshape(len(table.values), -1, weights.shape[1])
    return SurfacePatch(
        points=cell_points(basis.mesh, points, elements),
        weights=weights,
        dofs=nodal_dofs(basis, elements),
        shapes=np.broadcast_to(values, (len(values), *weights.shape)),
        gradients=gradients(table, cell_jacobian(basis.mesh, points, elements)),
    )


def surface_patches(basis: CellBasis, name: str, points: Floats, weights: Floats) -> Iterator[SurfacePatch]:
    """Yield one patch of quadrature points for each group of facets on a named surface.

    `points` (2, q) [1] and `weights` (q,) [1] are the quadrature rule on the reference facet.
    """
    for facet in surface_facets(basis, name):
        # The length of a normal is the area on the surface per area of the reference facet [mm^2].
        area = np.linalg.norm(facet.normals(basis.mesh, points), axis=0)
        yield patch_inside(basis, facet.elements, facet.inside(points), area * weights)
