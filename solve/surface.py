"""Quadrature on the named surfaces of hexahedra, by the elements' own shape functions on one of their facets.

The facet basis of scikit-fem finds a place in its element by Newton steps with an absolute tolerance, which fail in
long elements and in thin layers.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis
from skfem.refdom import RefHex

from solve.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class ReferenceFacet:
    """The elements that have the same one of their six facets on a surface: its corner and two edges from it, (3,)."""

    elements: Ints
    corner: Floats
    along: Floats
    across: Floats


@dataclass(frozen=True, eq=False)
class SurfacePatch:
    """Quadrature on such facets: places [mm] (3, facets, q), weights [mm^2] (facets, q), dofs (nodes, 3, facets).

    The scalar shape functions there are `shapes` [1] (nodes, facets, q) and `gradients` [1/mm] (nodes, 3, facets, q).
    """

    places: Floats
    weights: Floats
    dofs: Ints
    shapes: Floats
    gradients: Floats


def reference_facets(basis: CellBasis, name: str) -> Iterator[ReferenceFacet]:
    """Yield the elements on a named surface, grouped by the facet of the unit cube [1] that lies on it."""
    mesh = basis.mesh
    facets = mesh.boundaries[name]
    owners = mesh.f2t[0, facets]
    for local, corners in enumerate(RefHex.facets):
        elements = owners[mesh.t2f[local, owners] == facets]
        if len(elements):
            p, q, _, s = RefHex.p[:, corners].T
            yield ReferenceFacet(elements, p, q - p, s - p)


def nodal_dofs(basis: CellBasis, elements: Ints) -> Ints:
    """Return the dofs of the nodes of some elements, shape (nodes, 3, elements)."""
    return np.asarray(basis.element_dofs[:, elements].reshape(-1, 3, len(elements)))


def patch_inside(basis: CellBasis, elements: Ints, inside: Floats, weights: Floats) -> SurfacePatch:
    """Return the quadrature at points of the unit cube [1], (3, q) or (3, elements, q), with weights [mm^2]."""
    dofs = nodal_dofs(basis, elements)
    nodes = range(len(dofs))
    fields = [basis.elem.elem.gbasis(basis.mapping, inside, node, tind=elements)[0] for node in nodes]
    return SurfacePatch(
        places=np.asarray(basis.mapping.F(inside, tind=elements)),
        weights=weights,
        dofs=dofs,
        shapes=np.stack([np.broadcast_to(np.asarray(field), weights.shape) for field in fields]),
        gradients=np.stack([np.asarray(field.grad) for field in fields]),
    )


def facet_points(basis: CellBasis, facet: ReferenceFacet, points: Floats) -> tuple[Floats, Floats]:
    """Return points (2, q) of a unit square on the unit cube (3, q) [1], and its area there (facets, q) [mm^2]."""
    inside = facet.corner[:, None] + np.stack([facet.along, facet.across], axis=1) @ points
    slopes = np.asarray(basis.mapping.DF(inside, tind=facet.elements))
    along, across = (np.einsum("ijfq,j->ifq", slopes, edge) for edge in (facet.along, facet.across))
    return inside, np.linalg.norm(np.cross(along, across, axis=0), axis=0)


def surface_patches(basis: CellBasis, name: str, points: Floats, weights: Floats) -> Iterator[SurfacePatch]:
    """Yield the quadrature on a named surface from points (2, q) and weights (q,) of the unit square [1]."""
    for facet in reference_facets(basis, name):
        inside, area = facet_points(basis, facet, points)
        yield patch_inside(basis, facet.elements, inside, area * weights)
