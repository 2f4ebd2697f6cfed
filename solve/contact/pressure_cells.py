"""Cells of uniform pressure on the footprints of the tips, and the compliance matrix between them.

Within a footprint, the compliance is the Galerkin influence matrix of the half-space. Two further parts are smooth: the
compliance between different tips, and the compliance that the finite size of the block adds. The nodal polynomials of
the punch tables interpolate these parts. One matrix serves all moduli, travels and gaps.
"""

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.fruit.box import Grading, block_lines
from solve.fruit.footprints import (
    Footprint,
    NodeCounts,
    half_space_coupling,
    node_remainder,
    nodes_between,
    nodes_within,
)
from solve.halfspace.layered import Layer, added_compliances
from solve.halfspace.punch import influence, lagrange, square_punch

FINE = Grading(0.7, (0.7, 0.21, 0.09))  # mesh grading for the remainder
# Minimum number of nodes per side. The pressure of a partial contact has higher moments than under a level punch.
FEWEST_NODES = 3
GAUSS = 4  # Gauss points along each side of a cell


@dataclass(frozen=True, eq=False)
class ContactCells:
    """The cells on all footprints, and the compliance between them.

    The cells are ordered by tip, then by x, then by y. `points` (cells, 2) [mm] are the centres of the cells, and
    `areas` (cells,) [mm^2] their areas. `owner` (cells,) is the index of each cell's tip, and `centres` (tips, 2) [mm]
    are the centres of the footprints. `compliance` (cells, cells) [1/mm] is the mean displacement of one cell per force
    on another, times E.
    """

    points: Floats
    areas: Floats
    owner: Ints
    centres: Floats
    compliance: Floats

    @property
    def local(self) -> Floats:
        """Return the centre of each cell relative to the centre of its own tip [mm], shape (cells, 2)."""
        return self.points - self.centres[self.owner]

    @property
    def tips(self) -> Floats:
        """Return the incidence matrix (cells, tips): 1 in the column of a cell's own tip, and 0 elsewhere."""
        return np.eye(len(self.centres))[self.owner]


def contact_cells(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    edges: Floats,
    layer: Layer | None = None,
    grading: Grading = FINE,
) -> ContactCells:
    """Return the cells of square footprints on a block of fruit, and the compliance between them.

    The footprints must contain all possible contact of each tip. `edges` [1] are the grid lines of the cells, as
    fractions of the side of a footprint, from -1/2 to 1/2. If a `layer` is given, it covers the half-space under each
    tip. The effect of the layer between different tips is left out; the caller adds it to the compliance between tips.
    `grading` determines the mesh of the remainder. Raises SolveError if a solve does not converge.
    """
    centres = np.array([(footprint.x, footprint.y) for footprint in footprints])
    sides = np.array([footprint.side for footprint in footprints])
    interval_centres = 0.5 * (edges[1:] + edges[:-1])
    unit_areas = np.outer(np.diff(edges), np.diff(edges)).ravel()
    cell_centres = np.stack(np.meshgrid(interval_centres, interval_centres, indexing="ij"), axis=-1).reshape(-1, 2)

    to_cells = _nodes_to_cells(footprints, edges)
    part_within_tips = _compliance_within_tips(fruit, sides, edges, cell_centres, layer)
    smooth_part = smooth_compliance(fruit, tuple(footprints), grading)  # between nodes
    compliance = part_within_tips + np.asarray(to_cells @ smooth_part @ to_cells.T)

    return ContactCells(
        points=(sides[:, None, None] * cell_centres + centres[:, None]).reshape(-1, 2),
        areas=np.multiply.outer(sides**2, unit_areas).ravel(),
        owner=np.repeat(np.arange(len(sides)), len(unit_areas)),
        centres=centres,
        compliance=0.5 * (compliance + compliance.T),  # removes the asymmetry due to round-off
    )


def _nodes_to_cells(footprints: Sequence[Footprint], edges: Floats) -> Floats:
    """Return the matrix (cells, nodes) that converts values at the nodes of all footprints to means over their cells.

    The nodes belong to a punch table, whose nodal polynomials interpolate the values. `edges` [1] are the grid lines of
    the cells, as fractions of the side of a footprint.
    """
    cell_means = _cell_means(square_punch(_interaction_nodes(footprints)).x, edges)
    to_cells_of_tip = np.kron(cell_means, cell_means)  # x and y have the same nodes and grid lines
    return np.asarray(block_diag(*[to_cells_of_tip] * len(footprints)))


def _compliance_within_tips(
    fruit: Fruit, sides: Floats, edges: Floats, cell_centres: Floats, layer: Layer | None
) -> Floats:
    """Return the half-space compliance between cells under the same tip, times E [1/mm], shape (cells, cells).

    It is 0 between cells under different tips. `sides` (tips,) [mm] are the sides of the footprints. `edges` and
    `cell_centres` [1] are fractions of a side. `layer` is the skin on the half-space, or None.
    """
    # Galerkin's method gives the mean displacement of one cell per force on another, for a side of 1 and a modulus
    # E* = E / (1 - nu^2) of 1.
    unit_areas = np.outer(np.diff(edges), np.diff(edges)).ravel()
    influence_integrals = influence(edges, edges).transpose(0, 2, 1, 3).reshape(len(unit_areas), len(unit_areas))
    half_space = influence_integrals / np.outer(unit_areas, unit_areas)
    if layer is None:
        compliances = np.multiply.outer((1.0 - fruit.poisson**2) / sides, half_space)  # (tips, cells, cells)
        return np.asarray(block_diag(*compliances))
    # A half-space of the layer's material, plus the effect of the flesh below the layer.
    distances = np.linalg.norm(cell_centres[:, None] - cell_centres, axis=2)
    base_effects = [added_compliances([layer], side * distances)[0] for side in sides]
    compliances = layer.surface / sides[:, None, None] * half_space + base_effects
    return np.asarray(block_diag(*compliances))


def _cell_means(nodes: Floats, edges: Floats) -> Floats:
    """Return the mean of each nodal polynomial over each interval between `edges` [1], shape (intervals, nodes).

    `nodes` and `edges` lie between -1/2 and 1/2. The means are computed by Gauss quadrature.
    """
    middle = 0.5 * (edges[1:] + edges[:-1])
    point, weight = np.polynomial.legendre.leggauss(GAUSS)  # for the interval from -1 to 1, whose weights add up to 2
    gauss_points = middle[:, None] + 0.5 * np.diff(edges)[:, None] * point
    polynomials = lagrange(nodes, gauss_points.ravel()).reshape(*gauss_points.shape, -1)
    return np.asarray(np.einsum("cgk,g->ck", polynomials, 0.5 * weight))


def half_cells(cells: ContactCells) -> ContactCells:
    """Return the cells at y > 0, in the same order, each combined with its mirror image at y < 0.

    Combined cells are used if the contact is symmetric about y = 0. All footprints must be centred at y = 0, and the
    number of cells per side must be even. The area of a combined cell is the area of both cells.
    """
    is_kept = cells.points[:, 1] > 0.0
    # Each row of `rows` holds the indices of the cells with the same x, in the order of y. The reversed row therefore
    # holds the indices of their mirror images.
    per_side = round((len(cells.owner) / len(cells.centres)) ** 0.5)
    rows = np.arange(len(is_kept)).reshape(-1, per_side)
    mirror_image = rows[:, ::-1].ravel()
    # Half of each force acts on the cell, and half on its mirror image.
    combined_compliance = 0.5 * (cells.compliance + cells.compliance[:, mirror_image])
    return replace(
        cells,
        points=cells.points[is_kept],
        areas=2.0 * cells.areas[is_kept],  # area of the cell and its mirror image
        owner=cells.owner[is_kept],
        compliance=combined_compliance[np.ix_(is_kept, is_kept)],
    )


# The coarse and the fine grid of a scene share one result, so it is cached.
@functools.lru_cache(maxsize=4)
def smooth_compliance(fruit: Fruit, footprints: tuple[Footprint, ...], grading: Grading) -> Floats:
    """Return the smooth part of the compliance between all nodes of all footprints, times E [1/mm], (nodes, nodes).

    It is the remainder of the block and, between different tips, also the compliance of the half-space. `grading`
    determines the mesh of the remainder. Raises SolveError if a solve does not converge.
    """
    interaction_nodes = _interaction_nodes(footprints)
    counts = NodeCounts(between=interaction_nodes, within=max(FEWEST_NODES, nodes_within(fruit, footprints)))
    nodes = np.concatenate([footprint.nodes(counts.within) for footprint in footprints])
    # If all tips are centred on a mirror plane, only one side of it is meshed. Tilted tips press unequally on the two
    # sides, so odd loads are needed too.
    mirror_x = all(footprint.x == 0.0 for footprint in footprints)
    mirror_y = all(footprint.y == 0.0 for footprint in footprints)
    lines = block_lines(fruit, nodes, (mirror_x, mirror_y), grading)
    # A sign is 1 for even loads and -1 for odd loads about a mirror plane. It is 0 if the plane is not used.
    signs_x = (1, -1) if mirror_x else (0,)
    signs_y = (1, -1) if mirror_y else (0,)
    parities = list(itertools.product(signs_x, signs_y))
    remainder, _ = node_remainder(fruit, footprints, lines, parities, counts)
    return remainder + half_space_coupling(footprints, fruit.poisson, counts.between)


def _interaction_nodes(footprints: Sequence[Footprint]) -> int:
    """Return the number of nodes per side for the interaction between tips under any pressure distribution."""
    return max(FEWEST_NODES, nodes_between(footprints))
