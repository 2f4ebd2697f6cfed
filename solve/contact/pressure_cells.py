"""Cells of pressure on the footprints of the tips, and the matrix of compliances between them for unilateral contact.

Within a footprint it is the Galerkin influence matrix of the half-space. Between tips, and for the finite size of the
block, the compliance is smooth and interpolated by the nodal polynomials of the punch tables. One matrix serves all
moduli, travels and gaps.
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
    half_space_between,
    node_remainder,
    nodes_between,
    nodes_within,
)
from solve.halfspace.layered import Layer, added_compliances
from solve.halfspace.punch import influence, lagrange, square_punch

FINE = Grading(0.7, (0.7, 0.21, 0.09))  # grading of the mesh of the remainder
FEWEST_NODES = 3  # fewest nodes per side; the pressure of a partial contact has higher moments than a level punch
GAUSS = 4  # Gauss points along a cell


@dataclass(frozen=True, eq=False)
class ContactCells:
    """Cells on all footprints: points on the fruit (cells, 2) [mm], areas [mm^2], and the tip of each cell, `owner`.

    `centres` (tips, 2) [mm] are the centres of the footprints. `compliance` (cells, cells) is the mean displacement of
    a cell per force on a cell, times E [1/mm].
    """

    points: Floats
    areas: Floats
    owner: Ints
    centres: Floats
    compliance: Floats

    @property
    def local(self) -> Floats:
        """Return the points of the cells relative to the centre of their own tip [mm], shape (cells, 2)."""
        return self.points - self.centres[self.owner]

    @property
    def tips(self) -> Floats:
        """Return a matrix with 1 at the tip of each cell, else 0, shape (cells, tips)."""
        return np.eye(len(self.centres))[self.owner]


def contact_cells(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    edges: Floats,
    layer: Layer | None = None,
    grading: Grading = FINE,
) -> ContactCells:
    """Return the cells between `edges`, lines on (-1/2, 1/2) of each footprint's side [1], with their compliance.

    The footprints are squares that contain all possible contact of each tip. Under each tip the half-space has a
    `layer`, if given; its effect on other tips is a constant, which the caller adds. `grading` belongs to the mesh of
    the remainder. Raises SolveError if a solve does not converge.
    """
    centres = np.array([(footprint.x, footprint.y) for footprint in footprints])
    sides = np.array([footprint.side for footprint in footprints])
    middle = 0.5 * (edges[1:] + edges[:-1])
    area = np.outer(np.diff(edges), np.diff(edges)).ravel()
    cell_centres = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)

    # Under each tip, the half-space: mean displacement of a cell per force on another, for E* = 1 and side 1.
    pairs = influence(edges, edges).transpose(0, 2, 1, 3).reshape(len(area), len(area))
    half_space = pairs / np.outer(area, area)
    if layer is None:
        within_tips = block_diag(*np.multiply.outer((1.0 - fruit.poisson**2) / sides, half_space))
    else:
        distances = np.linalg.norm(cell_centres[:, None] - cell_centres, axis=2)
        added = [added_compliances([layer], side * distances)[0] for side in sides]
        within_tips = block_diag(*(layer.surface / sides[:, None, None] * half_space + added))

    # The remainder is smooth: it is known between nodes, and the nodal polynomials average it over cells.
    means = _cell_means(square_punch(_nodes_between(footprints)).x, edges)
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


def _cell_means(nodes: Floats, edges: Floats) -> Floats:
    """Return the mean of each nodal polynomial over each interval between edges [1], shape (intervals, nodes).

    `nodes` and `edges` lie on (-1/2, 1/2).
    """
    middle = 0.5 * (edges[1:] + edges[:-1])
    point, weight = np.polynomial.legendre.leggauss(GAUSS)
    gauss_points = middle[:, None] + 0.5 * np.diff(edges)[:, None] * point
    polynomials = lagrange(nodes, gauss_points.ravel()).reshape(*gauss_points.shape, -1)
    return np.asarray(np.einsum("cgk,g->ck", polynomials, 0.5 * weight))


def half_cells(cells: ContactCells) -> ContactCells:
    """Return the cells at y > 0, in their order, which also represent their mirror images at y < 0.

    They serve contact that is symmetric about y = 0. All centres must lie at y = 0, and the number of cells across a
    footprint must be even.
    """
    kept = cells.points[:, 1] > 0.0
    # Cells are stored in rows across their footprint, so the mirror images are the reversed rows.
    across = round((len(cells.owner) / len(cells.centres)) ** 0.5)
    rows = np.arange(len(kept)).reshape(-1, across)
    image = rows[:, ::-1].ravel()
    # Half of the force of a pair of mirrored cells acts on each of them.
    pairs = 0.5 * (cells.compliance + cells.compliance[:, image])
    return replace(
        cells,
        points=cells.points[kept],
        areas=2.0 * cells.areas[kept],
        owner=cells.owner[kept],
        compliance=pairs[np.ix_(kept, kept)],
    )


# The cache serves both grids of a scene.
@functools.lru_cache(maxsize=4)
def smooth_compliance(fruit: Fruit, footprints: tuple[Footprint, ...], grading: Grading) -> Floats:
    """Return the smooth part of the compliance between all nodes of all footprints, times E [1/mm], (nodes, nodes).

    It is the remainder of the block, and, between different tips, also the half-space. Raises SolveError if a solve
    does not converge.
    """
    counts = NodeCounts(between=_nodes_between(footprints), within=max(FEWEST_NODES, nodes_within(fruit, footprints)))
    nodes = np.concatenate([footprint.nodes(counts.within) for footprint in footprints])
    # Tips in a row on a plane of symmetry halve the mesh. Tilted tips press unequally on its sides, so odd loads are
    # needed.
    mirror_x = all(footprint.x == 0.0 for footprint in footprints)
    mirror_y = all(footprint.y == 0.0 for footprint in footprints)
    lines = block_lines(fruit, nodes, (mirror_x, mirror_y), grading)
    signs_x = (1, -1) if mirror_x else (0,)
    signs_y = (1, -1) if mirror_y else (0,)
    parities = list(itertools.product(signs_x, signs_y))
    remainder, _ = node_remainder(fruit, footprints, lines, parities, counts)
    return remainder + half_space_between(footprints, fruit.poisson, counts.between)


def _nodes_between(footprints: Sequence[Footprint]) -> int:
    return max(FEWEST_NODES, nodes_between(footprints))
