"""Fields of the loaded housing for viewing, at the nodes of its 20-node hexahedra.

Strain is extrapolated from the points where it is most accurate: the 2^3 Gauss points of a cell and, on a free surface,
the 2^2 of a facet. See Barlow, Int. J. Numer. Meth. Eng. 10 (1976) 243, doi:10.1002/nme.1620100202. The extrapolation
is linear along the axes of the cell or facet, and averaged at a node over its neighbours.
"""

import numpy as np
from skfem import CellBasis, ElementHexS2, Mesh

from sensor.arrays import Floats, Ints
from solve.displacement_basis import scalar_gradients
from solve.elasticity import NodalFields, stress, vector_basis
from solve.housing.clamped_half import POINTS, REDUCED
from solve.housing.stiffness import SPRINGS, leaf_faces
from solve.surface import nodal_dofs, patch_inside, surface_facets

_FREE = "free"
_NEAR = 1e-9  # tolerance of a distance, over the side of a cell


def fields_in(mesh: Mesh, E: float, poisson: float, u: Floats) -> NodalFields:
    """Return displacement, stress and strain at the nodes, from displacements u (dofs,) [mm] of 20-node cells.

    The nodes are the first of `mesh.doflocs`: corners, then the middles of edges. Named boundaries except leaves carry
    a load or a support. The rest of the surface is free of load.
    """
    leaves = [leaf_faces(spring) for spring in SPRINGS]
    loaded = [facets for name, facets in (mesh.boundaries or {}).items() if name not in leaves]
    free = np.setdiff1d(mesh.boundary_facets(), np.concatenate(loaded))
    basis = vector_basis(mesh.with_boundaries({_FREE: free}), ElementHexS2(), order=REDUCED)
    strain = nodal_strain(basis, u, poisson, _FREE)
    displacement = u[np.hstack([basis.nodal_dofs, basis.edge_dofs]).T]
    # `stress` takes a gradient, of which it uses only the symmetric part, the strain
    return NodalFields(displacement=displacement, stress=stress(strain, E, poisson), strain=strain)


def nodes_of_cells(mesh: Mesh) -> Ints:
    """Return the 20 nodes of each cell that the solve uses, shape (20, cells), the first of the mesh's 27."""
    return np.asarray(mesh.dofs.element_dofs[: len(ElementHexS2().doflocs)])


def most_strained_node(mesh: Mesh, surface: str, fields: NodalFields) -> int:
    """Return the node on a named surface with the largest magnitude of principal strain."""
    dofs = mesh.dofs.get_facet_dofs((mesh.boundaries or {})[surface])
    nodes = np.unique(np.concatenate([dofs.nodal["u"], dofs.edge["u"]]))
    return int(nodes[fields.largest_principal_strain[nodes].argmax()])


def nodal_strain(basis: CellBasis, u: Floats, poisson: float, free: str) -> Floats:
    """Return the strain [1] of displacements u, shape (dofs,), at the nodes, shape (3, 3, nodes).

    `basis` has 20-node cells with 2^3 Gauss points. At nodes on the boundary `free`, which carries no load, only its
    facets are used. At a fillet, strain is nonlinear over the thickness of a leaf, and linear extrapolation from two
    points of a cell would miss its peak.
    """
    corners = basis.elem.elem.doflocs  # nodes of the unit cube
    nodes = nodes_of_cells(basis.mesh)
    count = 1 + int(nodes.max())
    # Extrapolation over a small cell has a smaller error, hence a larger weight.
    weights = np.broadcast_to(1.0 / basis.dx.sum(axis=1), nodes.shape)

    total, weight = _cell_strain(basis, u, nodes, weights)
    surface_total = np.zeros((count, 3, 3))
    surface_weight = np.zeros(count)
    for facet in surface_facets(basis, free):
        inside = facet.inside(POINTS)
        patch = patch_inside(basis, facet.elements, inside, np.ones((len(facet.elements), POINTS.shape[1])))
        gradient = np.einsum("nic,njcq->ijcq", u[patch.dofs], patch.gradients)
        strain = _without_load(gradient, facet.normals(basis.mesh, POINTS), poisson)

        # Nodes of the unit cube in the plane of this facet, with their coordinates along its two edges.
        from_corner = corners - facet.corner
        on_facet = np.flatnonzero(np.abs(from_corner @ np.cross(facet.along, facet.across)) < _NEAR)
        facet_coordinates = np.stack([from_corner[on_facet] @ facet.along, from_corner[on_facet] @ facet.across])
        at_nodes = np.einsum("nq,ijcq->ncij", _extrapolation(facet_coordinates, POINTS), strain)
        of_facet = nodes[on_facet][:, facet.elements]
        _add_weighted(surface_total, surface_weight, of_facet, at_nodes, weights[on_facet][:, facet.elements])

    on_surface = surface_weight > 0.0
    total[on_surface] = surface_total[on_surface]
    weight[on_surface] = surface_weight[on_surface]
    return (total / weight[:, None, None]).transpose(1, 2, 0)


def _cell_strain(basis: CellBasis, u: Floats, nodes: Ints, weights: Floats) -> tuple[Floats, Floats]:
    """Return the weighted sum of the cells' strains at each node, (nodes, 3, 3), and the sum of the weights, (nodes,).

    `nodes` and `weights` (20, cells) belong to the nodes of each cell.
    """
    # indices: node n, axes i and j, cell c, Gauss point q
    cells = np.arange(basis.mesh.nelements)
    gradient = np.einsum("nic,njcq->ijcq", u[nodal_dofs(basis, cells)], scalar_gradients(basis))
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1))
    to_nodes = _extrapolation(basis.elem.elem.doflocs.T, basis.quadrature[0])
    count = 1 + int(nodes.max())
    total = np.zeros((count, 3, 3))
    weight = np.zeros(count)
    _add_weighted(total, weight, nodes, np.einsum("nq,ijcq->ncij", to_nodes, strain), weights)
    return total, weight


def _add_weighted(total: Floats, weight: Floats, nodes: Ints, strain: Floats, weights: Floats) -> None:
    """Add strains (n, cells, 3, 3) at nodes (n, cells) to their weighted sums, and the weights (n, cells) to theirs."""
    np.add.at(total, nodes, strain * weights[..., None, None])
    np.add.at(weight, nodes, weights)


def _without_load(gradient: Floats, normal: Floats, poisson: float) -> Floats:
    """Return the strain of a displacement gradient on a surface that carries no load.

    The strain within the surface is kept. The stress on the surface is zero, so the strain normal to it is -nu / (1 -
    nu) (e_1 + e_2) and the transverse shear is zero. Shapes are (3, 3, facets, points), and for `normal`, of any
    length, (3, facets, points).
    """
    n = normal / np.linalg.norm(normal, axis=0)
    across = np.einsum("i...,j...->ij...", n, n)
    tangent = np.eye(3).reshape(3, 3, *([1] * (n.ndim - 1))) - across
    within = np.einsum("ik...,kl...,lj...->ij...", tangent, 0.5 * (gradient + gradient.swapaxes(0, 1)), tangent)
    return np.asarray(within - poisson / (1.0 - poisson) * np.trace(within) * across)


def _extrapolation(nodes: Floats, gauss: Floats) -> Floats:
    """Return the matrix (n, q) from values at 2^d Gauss points (d, q) of the unit cube to values at nodes (d, n).

    Along one axis, the linear function that is 1 at one Gauss point and 0 at the other is (1 + 3 X X') / 2. X is the
    coordinate of the node and X' = -+ 1 / sqrt(3) of the point, both from -1 to 1.
    """
    X = 2.0 * nodes - 1.0
    X_gauss = 2.0 * gauss - 1.0
    return np.asarray((0.5 + 1.5 * X[:, :, None] * X_gauss[:, None, :]).prod(axis=0))
