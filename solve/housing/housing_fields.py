"""Displacement, strain and stress of the loaded housing for viewing, at the nodes of its 20-node hexahedra.

Strain is extrapolated from the points where it is most accurate. These points are the 2^3 Gauss points of a cell or, on
an unloaded surface, the 2^2 Gauss points of a facet. See J. Barlow, Int. J. Numer. Meth. Eng. 10 (1976) 243,
doi:10.1002/nme.1620100202. The extrapolation is linear along each axis of the cell or facet. The values at a node are
averaged over the adjacent cells or facets.
"""

import numpy as np
from skfem import CellBasis, ElementHexS2, Mesh

from mesh.cells import ReferenceFacet
from sensor.arrays import Floats, Ints
from solve.displacement_basis import scalar_gradients
from solve.elasticity import NodalFields, stress, vector_basis
from solve.housing.clamped_half import POINTS, REDUCED
from solve.housing.stiffness import SPRINGS, leaf_faces
from solve.surface import nodal_dofs, patch_inside, surface_facets

_FREE = "free"
_PLANE_TOLERANCE = 1e-9  # a node of the unit cube closer than this to the plane of a facet lies in that plane


def fields_in(mesh: Mesh, E: float, poisson: float, u: Floats) -> NodalFields:
    """Return displacement, stress and strain at the nodes, for displacements u (dofs,) [mm] of 20-node hexahedra.

    The nodes are the corners, followed by the midpoints of edges; they are the first nodes in `mesh.doflocs`. All named
    boundaries except the leaves carry a load or a support. All other surfaces are unloaded. E [MPa] and Poisson's ratio
    describe the housing.
    """
    leaf_names = [leaf_faces(spring) for spring in SPRINGS]
    loaded = [facets for name, facets in (mesh.boundaries or {}).items() if name not in leaf_names]
    unloaded = np.setdiff1d(mesh.boundary_facets(), np.concatenate(loaded))
    basis = vector_basis(mesh.with_boundaries({_FREE: unloaded}), ElementHexS2(), order=REDUCED)
    strain = nodal_strain(basis, u, poisson, _FREE)
    displacement = u[np.hstack([basis.nodal_dofs, basis.edge_dofs]).T]
    # `stress` expects a displacement gradient, but uses only its symmetric part, the strain.
    return NodalFields(displacement=displacement, stress=stress(strain, E, poisson), strain=strain)


def nodes_of_cells(mesh: Mesh) -> Ints:
    """Return the indices of the nodes of each cell that the solver uses, shape (20, cells).

    The solver uses the first 20 of the 27 nodes that the mesh has in each cell.
    """
    return np.asarray(mesh.dofs.element_dofs[: len(ElementHexS2().doflocs)])


def most_strained_node(mesh: Mesh, surface: str, fields: NodalFields) -> int:
    """Return the index of the node on a named surface with the largest absolute principal strain."""
    dofs = mesh.dofs.get_facet_dofs((mesh.boundaries or {})[surface])
    nodes = np.unique(np.concatenate([dofs.nodal["u"], dofs.edge["u"]]))
    return int(nodes[fields.largest_principal_strain[nodes].argmax()])


def nodal_strain(basis: CellBasis, u: Floats, poisson: float, unloaded: str) -> Floats:
    """Return the strain [1] at the nodes, shape (3, 3, nodes), for displacements u (dofs,) [mm].

    `basis` has 20-node cells with 2^3 Gauss points, and `unloaded` is the name of the unloaded boundary. At nodes on
    this boundary, the strain is extrapolated only within facets of the boundary. At a fillet, strain varies nonlinearly
    through the thickness of a leaf, so linear extrapolation from two points in a cell would miss the peak strain. The
    strain normal to an unloaded surface depends on Poisson's ratio, `poisson`.
    """
    nodes = nodes_of_cells(basis.mesh)
    # The extrapolation is more accurate in a small cell, so the weight of a cell in the average is 1 / volume.
    weights = np.broadcast_to(1.0 / basis.dx.sum(axis=1), nodes.shape)

    strain_sum, weight_sum = _sum_cell_strains(basis, u, nodes, weights)
    surface_strain_sum, surface_weight_sum = _sum_surface_strains(basis, u, nodes, weights, poisson, unloaded)
    on_surface = surface_weight_sum > 0.0  # nodes of the unloaded boundary
    strain_sum[on_surface] = surface_strain_sum[on_surface]
    weight_sum[on_surface] = surface_weight_sum[on_surface]
    return (strain_sum / weight_sum[:, None, None]).transpose(1, 2, 0)


def _sum_surface_strains(
    basis: CellBasis, u: Floats, nodes: Ints, weights: Floats, poisson: float, unloaded: str
) -> tuple[Floats, Floats]:
    """Return the weighted sum of strains at each node (nodes, 3, 3), and the sum of the weights (nodes,).

    Only the facets on the boundary named `unloaded` contribute. The strains are extrapolated from their Gauss points,
    for displacements u (dofs,) [mm] and Poisson's ratio `poisson`. `nodes` and `weights` (20, cells) are the indices of
    the nodes of each cell, and their weights in the average.
    """
    reference_nodes = basis.elem.elem.doflocs  # nodes of the unit cube
    count = 1 + int(nodes.max())
    strain_sum = np.zeros((count, 3, 3))
    weight_sum = np.zeros(count)
    # Each `facet` represents all facets that are the same face of their cells. The indices in `einsum` are node n of a
    # cell, axes i and j, cell c and Gauss point q.
    for facet in surface_facets(basis, unloaded):
        reference_points = facet.inside(POINTS)
        # No integral is computed here, so the quadrature weights are arbitrary.
        patch = patch_inside(basis, facet.elements, reference_points, np.ones((len(facet.elements), POINTS.shape[1])))
        gradient = np.einsum("nic,njcq->ijcq", u[patch.dofs], patch.gradients)
        strain = _unloaded_strain(gradient, facet.normals(basis.mesh, POINTS), poisson)

        on_facet, facet_coordinates = _nodes_on_facet(reference_nodes, facet)
        at_nodes = np.einsum("nq,ijcq->ncij", _extrapolation(facet_coordinates, POINTS), strain)
        facet_nodes = nodes[on_facet][:, facet.elements]
        _add_weighted(strain_sum, weight_sum, facet_nodes, at_nodes, weights[on_facet][:, facet.elements])
    return strain_sum, weight_sum


def _nodes_on_facet(reference_nodes: Floats, facet: ReferenceFacet) -> tuple[Ints, Floats]:
    """Return the indices (n,) of the nodes on a facet of the unit cube, and their coordinates on it (2, n) [1].

    `reference_nodes` (20, 3) [1] are the nodes of a cell in the unit cube. The coordinates run from 0 to 1 along the
    two edges of the facet.
    """
    from_corner = reference_nodes - facet.corner
    out_of_plane = np.abs(from_corner @ np.cross(facet.along, facet.across))
    on_facet = np.flatnonzero(out_of_plane < _PLANE_TOLERANCE)
    return on_facet, np.stack([from_corner[on_facet] @ facet.along, from_corner[on_facet] @ facet.across])


def _sum_cell_strains(basis: CellBasis, u: Floats, nodes: Ints, weights: Floats) -> tuple[Floats, Floats]:
    """Return the weighted sum of strains at each node (nodes, 3, 3), and the sum of the weights (nodes,).

    The strains are extrapolated from the Gauss points of each cell, for displacements u (dofs,) [mm]. `nodes` and
    `weights` (20, cells) are the indices of the nodes of each cell, and their weights in the average.
    """
    # The indices in `einsum` are node n, axes i and j, cell c and Gauss point q.
    cells = np.arange(basis.mesh.nelements)
    gradient = np.einsum("nic,njcq->ijcq", u[nodal_dofs(basis, cells)], scalar_gradients(basis))
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1))
    to_nodes = _extrapolation(basis.elem.elem.doflocs.T, basis.quadrature[0])
    count = 1 + int(nodes.max())
    strain_sum = np.zeros((count, 3, 3))
    weight_sum = np.zeros(count)
    _add_weighted(strain_sum, weight_sum, nodes, np.einsum("nq,ijcq->ncij", to_nodes, strain), weights)
    return strain_sum, weight_sum


def _add_weighted(strain_sum: Floats, weight_sum: Floats, nodes: Ints, strain: Floats, weights: Floats) -> None:
    """Add weighted strains to the sums at their nodes.

    `strain` (n, cells, 3, 3) has the weights `weights` (n, cells) and belongs to the node indices `nodes` (n, cells).
    The sum of weighted strains (nodes, 3, 3) and the sum of weights (nodes,) are changed in place. A node of several
    cells is added several times.
    """
    np.add.at(strain_sum, nodes, strain * weights[..., None, None])
    np.add.at(weight_sum, nodes, weights)


def _unloaded_strain(gradient: Floats, normal: Floats, poisson: float) -> Floats:
    """Return the strain on an unloaded surface, shape (3, 3, facets, points), from the displacement gradient there.

    Only the in-plane strain is taken from the gradient. Because the traction on the surface is zero, the transverse
    shear strain is zero. The normal strain is -nu / (1 - nu) (e_1 + e_2), where e_1 and e_2 are the in-plane normal
    strains. `gradient` has the shape of the result. `normal` (3, facets, points) need not be a unit vector.
    """
    n = normal / np.linalg.norm(normal, axis=0)
    normal_projector = np.einsum("i...,j...->ij...", n, n)
    identity = np.eye(3).reshape(3, 3, *([1] * (n.ndim - 1)))  # with one axis of length 1 for each further axis
    plane_projector = identity - normal_projector
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1))
    in_plane = np.einsum("ik...,kl...,lj...->ij...", plane_projector, strain, plane_projector)
    return np.asarray(in_plane - poisson / (1.0 - poisson) * np.trace(in_plane) * normal_projector)


def _extrapolation(nodes: Floats, gauss: Floats) -> Floats:
    """Return the matrix (n, q) that extrapolates values at Gauss points (d, q) to nodes (d, n) of the unit cube.

    There are q = 2^d Gauss points. Along one axis, the linear function that is 1 at one Gauss point and 0 at the other
    is (1 + 3 X X') / 2. Here X is the coordinate of the node, scaled to the range -1 to 1. X' = -1 / sqrt(3) or
    1 / sqrt(3) is the coordinate of the Gauss point at which the function is 1.
    """
    X = 2.0 * nodes - 1.0
    X_gauss = 2.0 * gauss - 1.0
    return np.asarray((0.5 + 1.5 * X[:, :, None] * X_gauss[:, None, :]).prod(axis=0))
