"""Facets of a mesh of hexahedra as facets of the unit cube, and their areas."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from skfem import Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex, RefQuad

from mesh.cells import Floats, Ints, cell_slopes

_AREA_ORDER = 5


@dataclass(frozen=True, eq=False)
class ReferenceFacet:
    """The elements that have the same one of their six facets on a surface: its corner and two edges from it, (3,)."""

    elements: Ints
    corner: Floats
    along: Floats
    across: Floats

    def inside(self, points: Floats) -> Floats:
        """Return points (2, q) of a unit square as points of the unit cube (3, q) [1]."""
        return np.asarray(self.corner[:, None] + np.stack([self.along, self.across], axis=1) @ points)

    def normals(self, mesh: Mesh, points: Floats) -> Floats:
        """Return the normals at points (2, q) of a unit square, as long as its area there [mm^2], (3, elements, q)."""
        slopes = cell_slopes(mesh, self.inside(points), self.elements)
        along, across = (np.einsum("ijeq,j->ieq", slopes, edge) for edge in (self.along, self.across))
        return np.asarray(np.cross(along, across, axis=0))


def reference_facets(mesh: Mesh, facets: Ints) -> Iterator[ReferenceFacet]:
    """Yield the elements that facets (n,) of a mesh belong to, grouped by the facet of the unit cube [1] they are."""
    owners = mesh.f2t[0, facets]
    for local, corners in enumerate(RefHex.facets):
        elements = owners[mesh.t2f[local, owners] == facets]
        if len(elements):
            p, q, _, s = RefHex.p[:, corners].T
            yield ReferenceFacet(elements, p, q - p, s - p)


def facets_area(mesh: Mesh, facets: Ints) -> float:
    """Return the area [mm^2] of facets (n,) of a mesh of hexahedra, curved as their elements are."""
    points, weights = get_quadrature(RefQuad, _AREA_ORDER)
    groups = reference_facets(mesh, facets)
    return sum(float((np.linalg.norm(one.normals(mesh, points), axis=0) * weights).sum()) for one in groups)
