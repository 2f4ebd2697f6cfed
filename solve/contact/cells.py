"""Cells of pressure on the tips' footprints and what they do to each other: the matrix of unilateral contact.

Near by, the Galerkin influence of the half-space on each footprint; from tip to tip and through the block's finite
size, the smooth rest through the nodal polynomials of the punch tables. One matrix serves all E, travels and gaps.
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
    half_space_between,
    node_remainder,
    nodes_between,
    nodes_within,
)
from solve.halfspace.layered import Layer, added_compliances
from solve.halfspace.punch import influence, lagrange, square_punch

FINE = Grading(0.7, (0.7, 0.21, 0.09))
FEWEST_NODES = 3
GAUSS = 4


@dataclass(frozen=True, eq=False)
class ContactCells:
    """Cells on all footprints: points on the fruit (cells, 2) [mm], areas [mm^2], tip of each cell.

    `centres` (tips, 2) [mm] are those of the footprints. `compliance` (cells, cells) is the mean displacement of a cell
    per force on a cell, times E [1/mm].
    """

    points: Floats
    areas: Floats
    owner: Ints
    centres: Floats
    compliance: Floats

    @property
    def local(self) -> Floats:
        """Return the points of the cells from the centre of their own tip [mm], shape (cells, 2)."""
        return self.points - self.centres[self.owner]

    @property
    def tips(self) -> Floats:
        """Return 1 where a cell belongs to a tip, else 0, shape (cells, tips)."""
        return np.eye(len(self.centres))[self.owner]


def contact_cells(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    edges: Floats,
    layer: Layer | None = None,
    grading: Grading = FINE,
) -> ContactCells:
    """Return the cells between `edges`, lines on (-1/2, 1/2) of each footprint's side [1], and their compliance.

    Under each tip the half-space has a `layer`, if any: farther away it acts by a constant, which is left to others.
    The footprints are squares that hold every point where a tip may touch; `grading` is that of the mesh of what is
    smooth. Raises SolveError when a solve is not exact.
    """
    centres = np.array([(footprint.x, footprint.y) for footprint in footprints])
    sides = np.array([footprint.side for footprint in footprints])
    middle = 0.5 * (edges[1:] + edges[:-1])

    # Under each tip the half-space itself: mean displacement of a cell per force on another, for E* = 1 and side 1.
    area = np.outer(np.diff(edges), np.diff(edges)).ravel()
    pairs = influence(edges, edges).transpose(0, 2, 1, 3).reshape(len(area), len(area))
    half_space = pairs / np.outer(area, area)
    cell_centres = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)
    if layer is None:
        within_tips = block_diag(*np.multiply.outer((1.0 - fruit.poisson**2) / sides, half_space))
    else:
        apart = np.linalg.norm(cell_centres[:, None] - cell_centres, axis=2)
        added = [added_compliances([layer], side * apart)[0] for side in sides]
        within_tips = block_diag(*(layer.surface / sides[:, None, None] * half_space + added))

    # The rest is smooth: known between nodes, averaged over cells through the nodal polynomials.
    point, weight = np.polynomial.legendre.leggauss(GAUSS)
    gauss_points = middle[:, None] + 0.5 * np.diff(edges)[:, None] * point
    nodes = square_punch(_nodes_between(footprints)).x
    polynomials = lagrange(nodes, gauss_points.ravel()).reshape(*gauss_points.shape, -1)
    means = np.einsum("cgk,g->ck", polynomials, 0.5 * weight)
    to_cells = block_diag(*[np.kron(means, means)] * len(footprints))
    smooth = smooth_compliance(fruit, tuple(footprints), grading)
    compliance = within_tips + np.asarray(to_cells @ smooth @ to_cells.T)

    return ContactCells(
        points=(sides[:, None, None] * cell_centres + centres[:, None]).reshape(-1, 2),
        areas=np.multiply.outer(sides**2, area).ravel(),
        owner=np.repeat(np.arange(len(sides)), len(area)),
        centres=centres,
        compliance=0.5 * (compliance + compliance.T),
    )


def half_cells(cells: ContactCells) -> ContactCells:
    """Return cells that stand for themselves and their mirror images at y = 0, for contact alike on both sides.

    All centres lie at y = 0 and the number of lines of cells across a footprint is even; the cells at y > 0 stay, in
    their order.
    """
    kept = cells.points[:, 1] > 0.0
    # Cells stand in rows across their footprint: the mirror image of each is its place in the reversed row.
    across = round((len(cells.owner) / len(cells.centres)) ** 0.5)
    rows = np.arange(len(kept)).reshape(-1, across)
    image = rows[:, ::-1].ravel()
    # Half of the force of a pair of cells acts on either.
    pairs = 0.5 * (cells.compliance + cells.compliance[:, image])
    return replace(
        cells,
        points=cells.points[kept],
        areas=2.0 * cells.areas[kept],
        owner=cells.owner[kept],
        compliance=pairs[np.ix_(kept, kept)],
    )


# Both grids of a scene share it.
@functools.lru_cache(maxsize=4)
def smooth_compliance(fruit: Fruit, footprints: tuple[Footprint, ...], grading: Grading) -> Floats:
    """Return the compliance between all nodes but for the half-space under a node's own tip, times E [1/mm].

    Shape (nodes, nodes). Raises SolveError when a solve is not exact.
    """
    between = _nodes_between(footprints)
    within = max(FEWEST_NODES, nodes_within(fruit, footprints))
    mirror_x = all(footprint.x == 0.0 for footprint in footprints)
    mirror_y = all(footprint.y == 0.0 for footprint in footprints)
    nodes = np.concatenate([footprint.nodes(within) for footprint in footprints])
    lines = block_lines(fruit, nodes, (mirror_x, mirror_y), grading)
    signs_x = (1, -1) if mirror_x else (0,)
    signs_y = (1, -1) if mirror_y else (0,)
    parities = list(itertools.product(signs_x, signs_y))
    remainder, _ = node_remainder(fruit, footprints, lines, parities, within, between)
    return remainder + half_space_between(footprints, fruit.poisson, between)


def _nodes_between(footprints: Sequence[Footprint]) -> int:
    return max(FEWEST_NODES, nodes_between(footprints))
