"""Layers between a housing and a rigid ground: a cover, or the skin of a print under a washer.

A thin layer whose far side is held is a bed of springs: G / thickness along it, E / thickness across it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, kron
from skfem import CellBasis
from skfem.refdom import RefTet

from mesh.cells import cell_points, shape_table
from sensor.arrays import Flags, Floats
from solve.displacement_basis import cell_nodes
from solve.elasticity import assemble_elements, lame_parameters
from solve.surface import surface_facets

Rectangle = tuple[tuple[float, float], tuple[float, float]]  # ends in x and in z [mm]
Disc = tuple[float, float, float]  # centre x, z and radius [mm]

_ACROSS = 1  # the axis y, along which the layer is thin
# An edge of a layer may cut a facet; these points along both sides of the facet give the fraction inside.
_SIDE = (np.arange(8) + 0.5) / 8
_POINTS = np.array([np.repeat(_SIDE, 8), np.tile(_SIDE, 8)])
_WEIGHT = 1.0 / 64
# The centroids of 64 equal triangles, eight along each side: 36 point the same way as the facet, 28 the opposite way.
_TRIANGLE_POINTS = np.array(
    [((i + t) / 8, (j + t) / 8) for t, n in ((1 / 3, 8), (2 / 3, 7)) for i in range(n) for j in range(n - i)]
).T


@dataclass(frozen=True, kw_only=True)
class ElasticLayer:
    """A layer of the housing's own material between its surface `name` and the ground: its place and thickness [mm].

    It covers points inside a rectangle, inside a disc if there are any, and outside all holes. Without rectangles it
    covers the whole surface.
    """

    name: str
    thickness: float
    rectangles: tuple[Rectangle, ...] = ()
    discs: tuple[Disc, ...] = ()
    holes: tuple[Disc, ...] = ()

    def covers(self, x: Floats, z: Floats) -> Floats:
        """Return 1 for points [mm] under the layer and 0 for others, in their shape."""
        covered = np.full(x.shape, not self.rectangles)
        for (x0, x1), (z0, z1) in self.rectangles:
            covered |= (x0 <= x) & (x <= x1) & (z0 <= z) & (z <= z1)
        if self.discs:
            covered &= np.any([_in_disc(x, z, disc) for disc in self.discs], axis=0)
        for hole in self.holes:
            covered &= ~_in_disc(x, z, hole)
        return covered.astype(np.float64)


def _in_disc(x: Floats, z: Floats, disc: Disc) -> Flags:
    centre_x, centre_z, radius = disc
    return (x - centre_x) ** 2 + (z - centre_z) ** 2 < radius**2


def layer_matrix(basis: CellBasis, layers: Sequence[ElasticLayer], E: float, poisson: float) -> csc_matrix:
    """Return the contribution of layers to the stiffness matrix [N/mm from MPa, mm], shape (dofs, dofs).

    It is int N_a N_b times the stiffness of the bed per area, over the part of each facet that lies under the layer.
    The components along the layer have the stiffness G / thickness, the component across it E / thickness.
    """
    _, shear = lame_parameters(E, poisson)
    nodes = cell_nodes(basis)
    count = basis.N // 3
    along = csc_matrix((count, count))  # for both components along the layer
    across = csc_matrix((count, count))
    for layer in layers:
        points = _TRIANGLE_POINTS if basis.mesh.refdom is RefTet else _POINTS
        for facet in surface_facets(basis, layer.name):
            inside = facet.inside(points)
            area = np.linalg.norm(facet.normals(basis.mesh, points), axis=0)
            x, _, z = cell_points(basis.mesh, inside, facet.elements)
            weight = (0.5 if basis.mesh.refdom is RefTet else 1.0) * _WEIGHT
            weights = area * weight * layer.covers(x, z)  # (facets, points), 0 outside the layer
            # The shape functions are defined on the unit cube, so they are the same on every facet.
            shapes = shape_table(basis.elem.elem, inside).values
            springs = np.einsum("ap,bp,ep->eab", shapes, shapes, weights, optimize=True)
            of_facets = nodes[facet.elements]
            along = along + assemble_elements(shear / layer.thickness * springs, of_facets, count)
            across = across + assemble_elements(E / layer.thickness * springs, of_facets, count)
    is_across = np.arange(3) == _ACROSS
    return csc_matrix(kron(along, np.diag(1.0 * ~is_across)) + kron(across, np.diag(1.0 * is_across)))
