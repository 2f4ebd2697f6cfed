"""Quadrature on the named surfaces of a mesh, by the shape functions of its elements on one of their facets.

The facet basis of scikit-fem locates a point in its element by Newton steps with an absolute tolerance, which fail in
long elements and in thin layers.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis

from mesh.cells import ReferenceFacet, cell_jacobian, cell_points, gradients, reference_facets, shape_table
from sensor.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class SurfacePatch:
    """Quadrature on facets: points [mm] (3, facets, q), weights [mm^2] (facets, q), dofs (nodes, 3, facets).

    The scalar shape functions there are `shapes` [1] (nodes, facets, q) and `gradients` [1/mm] (nodes, 3, facets, q).
    """

    points: Floats
    weights: Floats
    dofs: Ints
    shapes: Floats
    gradients: Floats


def surface_facets(basis: CellBasis, name: str) -> Iterator[ReferenceFacet]:
    """Yield the elements on a named surface, grouped by their facet on it, in coordinates of the unit cube [1]."""
    return reference_facets(basis.mesh, basis.mesh.boundaries[name])


def nodal_dofs(basis: CellBasis, elements: Ints) -> Ints:
    """Return the dofs of the nodes of some elements, shape (nodes, 3, elements)."""
    return np.asarray(basis.element_dofs[:, elements].reshape(-1, 3, len(elements)))


def patch_inside(basis: CellBasis, elements: Ints, inside: Floats, weights: Floats) -> SurfacePatch:
    """Return the quadrature at points of the unit cube [1], (3, q) or (3, elements, q), with weights [mm^2]."""
    table = shape_table(basis.elem.elem, inside)
    values = table.values.reshape(len(table.values), -1, weights.shape[1])
    return SurfacePatch(
        points=cell_points(basis.mesh, inside, elements),
        weights=weights,
        dofs=nodal_dofs(basis, elements),
        shapes=np.broadcast_to(values, (len(values), *weights.shape)),
        gradients=gradients(table, cell_jacobian(basis.mesh, inside, elements)),
    )


def surface_patches(basis: CellBasis, name: str, points: Floats, weights: Floats) -> Iterator[SurfacePatch]:
    """Yield the quadrature on a named surface, from points (2, q) and weights (q,) of the unit square [1]."""
    for facet in surface_facets(basis, name):
        area = np.linalg.norm(facet.normals(basis.mesh, points), axis=0)
        yield patch_inside(basis, facet.elements, facet.inside(points), area * weights)
