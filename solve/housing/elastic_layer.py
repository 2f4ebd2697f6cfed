"""Elastic layers between a housing and a rigid ground: a cover, or the outer layer of a print under a washer.

A thin layer bonded to the ground acts like an elastic foundation. The stiffness of the layer per area is G / thickness
parallel to the layer and E / thickness normal to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, kron
from skfem import CellBasis
from skfem.refdom import RefTet

from mesh.cells import ReferenceFacet, cell_points, shape_table
from sensor.arrays import Flags, Floats
from solve.displacement_basis import cell_nodes
from solve.elasticity import assemble_elements, lame_parameters
from solve.surface import surface_facets

Rectangle = tuple[tuple[float, float], tuple[float, float]]  # limits of x and limits of z [mm]
Disc = tuple[float, float, float]  # coordinates x and z of the centre, and radius [mm]

_ACROSS = 1  # index of the y axis, which is normal to all layers
# The edge of a layer may cut through a facet, so each facet is sampled at 8 x 8 points of equal weight.
_SIDE = (np.arange(8) + 0.5) / 8
_POINTS = np.array([np.repeat(_SIDE, 8), np.tile(_SIDE, 8)])
_WEIGHT = 1.0 / 64
# A triangular facet is sampled at the centroids of 64 equal triangles, eight along each side. Of these triangles, 36
# have the orientation of the facet, and 28 are rotated by 180 deg.
_TRIANGLE_POINTS = np.array(
    [((i + t) / 8, (j + t) / 8) for t, n in ((1 / 3, 8), (2 / 3, 7)) for i in range(n) for j in range(n - i)]
).T


@dataclass(frozen=True, kw_only=True)
class ElasticLayer:
    """A layer of the same material as the housing, between the housing's surface `name` and the ground.

    The layer has the given `thickness` [mm]. It covers the points inside any of the rectangles or, without rectangles,
    the whole surface. If there are discs, it covers only points that are also inside a disc. It covers no point inside
    a hole.
    """

    name: str
    thickness: float
    rectangles: tuple[Rectangle, ...] = ()
    discs: tuple[Disc, ...] = ()
    holes: tuple[Disc, ...] = ()

    def covers(self, x: Floats, z: Floats) -> Floats:
        """Return 1 at points (x, z) [mm] that the layer covers and 0 at other points, in the shape of x."""
        covered = np.full(x.shape, not self.rectangles)  # without rectangles, start from the whole surface
        for (x0, x1), (z0, z1) in self.rectangles:
            covered |= (x0 <= x) & (x <= x1) & (z0 <= z) & (z <= z1)
        if self.discs:
            covered &= np.any([_in_disc(x, z, disc) for disc in self.discs], axis=0)
        for hole in self.holes:
            covered &= ~_in_disc(x, z, hole)
        return covered.astype(np.float64)


def _in_disc(x: Floats, z: Floats, disc: Disc) -> Flags:
    """Return whether points (x, z) [mm] lie inside a disc."""
    centre_x, centre_z, radius = disc
    return (x - centre_x) ** 2 + (z - centre_z) ** 2 < radius**2


def layer_matrix(basis: CellBasis, layers: Sequence[ElasticLayer], E: float, poisson: float) -> csc_matrix:
    """Return the contribution of elastic layers to the stiffness matrix [N/mm], shape (dofs, dofs).

    An entry is the stiffness per area times int N_a N_b over the covered part of each facet, where N_a and N_b are
    shape functions. The stiffness per area is G / thickness for the components parallel to the layer, and E / thickness
    for the normal component. `basis` holds the displacements of the housing. The housing and the layers have the same
    material, with modulus E [MPa], Poisson's ratio and shear modulus G.
    """
    _, shear = lame_parameters(E, poisson)
    nodes = cell_nodes(basis)
    count = basis.N // 3  # number of nodes, each of which has three displacement components
    tangential = csc_matrix((count, count))  # entries for each of the two components parallel to the layer
    normal = csc_matrix((count, count))  # entries for the normal component
    for layer in layers:
        for facet in surface_facets(basis, layer.name):
            springs = _covered_integrals(basis, layer, facet)
            facet_nodes = nodes[facet.elements]
            tangential = tangential + assemble_elements(shear / layer.thickness * springs, facet_nodes, count)
            normal = normal + assemble_elements(E / layer.thickness * springs, facet_nodes, count)
    # The Kronecker products distribute the entries of the nodes over the three components of their displacements.
    is_normal = np.arange(3) == _ACROSS
    normal_axes = np.diag(1.0 * is_normal)  # 1 on the diagonal for the normal component
    tangential_axes = np.diag(1.0 * ~is_normal)  # 1 on the diagonal for the other two components
    return csc_matrix(kron(tangential, tangential_axes) + kron(normal, normal_axes))


def _covered_integrals(basis: CellBasis, layer: ElasticLayer, facet: ReferenceFacet) -> Floats:
    """Return int N_a N_b over the part of each facet that a layer covers [mm^2], shape (facets, nodes, nodes).

    N_a and N_b are the shape functions of the element at a facet. `facet` represents a group of facets on the surface
    under the layer, all of which are the same face of their elements.
    """
    # The reference facet is the unit square, or half of it for a tetrahedron.
    if basis.mesh.refdom is RefTet:
        points = _TRIANGLE_POINTS
        weight = 0.5 * _WEIGHT
    else:
        points = _POINTS
        weight = _WEIGHT
    reference_points = facet.inside(points)
    area = np.linalg.norm(facet.normals(basis.mesh, points), axis=0)
    x, _, z = cell_points(basis.mesh, reference_points, facet.elements)
    weights = area * weight * layer.covers(x, z)  # (facets, points), 0 outside the layer
    shapes = shape_table(basis.elem.elem, reference_points).values
    # The indices are nodes a and b, facet e and point p.
    return np.asarray(np.einsum("ap,bp,ep->eab", shapes, shapes, weights, optimize=True))
