"""Strain at the nodes of 20-node hexahedra, continued from the points where it is most accurate.

These are the 2^3 Gauss points of a cell and, on a free surface, the 2^2 of a facet: Barlow, Int. J. Numer. Meth. Eng.
10 (1976) 243, doi:10.1002/nme.1620100202. From there it is continued linearly along the axes of the cell or facet, and
at a node the neighbours are averaged.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from skfem import CellBasis

from mesh.cell_facets import ReferenceFacet
from solve.arrays import Floats, Ints
from solve.displacement_basis import scalar_gradients
from solve.surface import nodal_dofs, patch_inside, surface_facets

_ENDS = np.array([0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)])
_FACET_POINTS = np.array([np.repeat(_ENDS, 2), np.tile(_ENDS, 2)])
_NEAR = 1e-9  # of the side of a cell

Share = tuple[Ints, Floats, Floats]  # nodes (n, cells), strains there (n, cells, 3, 3), weights of the cells


def nodal_strain(basis: CellBasis, u: Floats, poisson: float, free: str) -> Floats:
    """Return the strain [1] of displacements u, shape (dofs,), at the nodes, shape (3, 3, nodes).

    `basis` is that of 20-node cells with 2^3 Gauss points. At nodes on the boundary `free`, which carries no load, only
    its facets count: over the thickness of a leaf strain is curved at a fillet, and a line through two points of a cell
    misses its peak.
    """
    count = 1 + int(_nodes(basis).max())
    total, weight = _summed([_from_cells(basis, u)], count)
    on_surface, surface_weight = _summed(_from_facets(basis, u, poisson, free), count)
    chosen = surface_weight > 0.0
    total[chosen], weight[chosen] = on_surface[chosen], surface_weight[chosen]
    return np.asarray((total / weight[:, None, None]).transpose(1, 2, 0))


def _nodes(basis: CellBasis) -> Ints:
    """Return the nodes of the cells, shape (20, cells): the first ones of the mesh's 27."""
    return np.asarray(basis.mesh.dofs.element_dofs[: len(basis.elem.elem.doflocs)])


def _weights(basis: CellBasis) -> Floats:
    """Return 1 / volume [1/mm^3] of each cell: what is continued over a small one is off by less."""
    return np.asarray(1.0 / basis.dx.sum(axis=1))


def _summed(shares: Iterable[Share], count: int) -> tuple[Floats, Floats]:
    """Return weighted sums of strains at all nodes, shape (count, 3, 3), and sums of the weights, (count,)."""
    total, weight = np.zeros((count, 3, 3)), np.zeros(count)
    for nodes, strains, weights in shares:
        np.add.at(total, nodes, strains * weights[:, None, None])
        np.add.at(weight, nodes, np.broadcast_to(weights, nodes.shape))
    return total, weight


def _from_cells(basis: CellBasis, u: Floats) -> Share:
    cells = np.arange(basis.mesh.nelements)
    gradient = np.einsum("nic,njcq->ijcq", u[nodal_dofs(basis, cells)], scalar_gradients(basis))
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1))
    matrix = _continuation(basis.elem.elem.doflocs.T, basis.quadrature[0])
    return _nodes(basis), np.einsum("nq,ijcq->ncij", matrix, strain), _weights(basis)


def _from_facets(basis: CellBasis, u: Floats, poisson: float, name: str) -> Iterator[Share]:
    places, nodes, weights = basis.elem.elem.doflocs, _nodes(basis), _weights(basis)
    for facet in surface_facets(basis, name):
        strain = _at_facet_points(basis, u, poisson, facet)
        away = places - facet.corner
        on = np.flatnonzero(np.abs(away @ np.cross(facet.along, facet.across)) < _NEAR)
        matrix = _continuation(np.stack([away[on] @ facet.along, away[on] @ facet.across]), _FACET_POINTS)
        yield nodes[on][:, facet.elements], np.einsum("nq,ijcq->ncij", matrix, strain), weights[facet.elements]


def _at_facet_points(basis: CellBasis, u: Floats, poisson: float, facet: ReferenceFacet) -> Floats:
    """Return the strain at the 2^2 points of each facet, shape (3, 3, cells, points)."""
    weights = np.ones((len(facet.elements), _FACET_POINTS.shape[1]))
    patch = patch_inside(basis, facet.elements, facet.inside(_FACET_POINTS), weights)
    gradient = np.einsum("nic,njcq->ijcq", u[patch.dofs], patch.gradients)
    return _without_load(gradient, facet.normals(basis.mesh, _FACET_POINTS), poisson)


def _without_load(gradient: Floats, normal: Floats, poisson: float) -> Floats:
    """Return the strain of a displacement gradient on a surface that carries no load, as a strain gauge is read.

    Its part in the surface is kept; the stress on the surface is zero, so the strain across it is
    -nu / (1 - nu) (e_1 + e_2) and its shear is zero. Shapes (3, 3, ...) and, of any length, `normal` (3, ...).
    """
    n = normal / np.linalg.norm(normal, axis=0)
    across = np.einsum("i...,j...->ij...", n, n)
    flat = np.eye(3).reshape(3, 3, *([1] * (n.ndim - 1))) - across
    within = np.einsum("ik...,kl...,lj...->ij...", flat, 0.5 * (gradient + gradient.swapaxes(0, 1)), flat)
    return np.asarray(within - poisson / (1.0 - poisson) * np.trace(within) * across)


def _continuation(places: Floats, points: Floats) -> Floats:
    """Return the matrix (n, q) from values at 2^d Gauss points (d, q) of the unit cube to those at places (d, n).

    Along one axis the function that is 1 at one Gauss point and 0 at the other is (1 + 3 X X') / 2, with X of the place
    and X' = -+ 1 / sqrt(3) of the point, both from -1 to 1.
    """
    X, X_points = 2.0 * places - 1.0, 2.0 * points - 1.0
    return np.asarray((0.5 + 1.5 * X[:, :, None] * X_points[:, None, :]).prod(axis=0))
