"""Cells of pressure on the tips' footprints and what they do to each other: the matrix of unilateral contact.

Near by, the Galerkin influence of the half-space on each footprint; from tip to tip and through the block's finite
size, the smooth rest through the nodal polynomials of the punch tables. One matrix serves all E, travels and gaps.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from cad.design.parameters import Fruit
from solve.fruit.box import Grading, block_lines, box_mesh
from solve.fruit.remainder import Parity, remainder_compliance
from solve.fruit.split import Foot, nodes_between, nodes_within
from solve.halfspace.punch import influence, square_punch

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]

GRADING = Grading(0.7, (0.7, 0.21, 0.09))
FEWEST_NODES = 3
GAUSS = 4


@dataclass(frozen=True)
class Footprints:
    """Cells on all footprints: centres on the fruit (cells, 2) [mm], areas [mm^2], tip of each cell, the tips' centres.

    `compliance` (cells, cells) is the mean displacement of a cell per force on a cell, times E [1/mm]; `error` is
    what these cells miss of the flat punch's stiffness, relative.
    """

    places: Floats
    areas: Floats
    owner: Ints
    centres: Floats
    compliance: Floats
    error: float

    @property
    def local(self) -> Floats:
        """Return the places of the cells from the centre of their own tip [mm], shape (cells, 2)."""
        shifted: Floats = self.places - np.stack([self.centres, np.zeros_like(self.centres)], axis=1)[self.owner]
        return shifted


def footprint_compliance(fruit: Fruit, feet: Sequence[Foot], edges: Floats) -> Footprints:
    """Return the cells and their compliance; `edges` are the lines of cells on (-1/2, 1/2) of each foot's side.

    The feet are squares that hold every place where a tip may touch. Raises SolveError when a solve is not exact.
    """
    per_side = max(FEWEST_NODES, nodes_between(feet))
    carry = np.kron(_means(edges, per_side), _means(edges, per_side))
    smooth = _smooth_compliance(fruit, tuple(feet), per_side)
    width = np.diff(edges)
    area = np.outer(width, width).ravel()
    pairs = influence(edges, edges).transpose(0, 2, 1, 3).reshape(len(area), len(area))
    unit = pairs / np.outer(area, area)
    flat = float(np.linalg.solve(unit, np.ones(len(area))).sum())
    own = (1.0 - fruit.poisson**2) * unit
    spread = block_diag(*[carry] * len(feet))
    compliance = block_diag(*(own / foot.side for foot in feet)) + spread @ smooth @ spread.T
    middle = 0.5 * (edges[1:] + edges[:-1])
    cells = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)
    return Footprints(
        places=np.concatenate([foot.side * cells + np.array([foot.x, 0.0]) for foot in feet]),
        areas=np.concatenate([foot.side**2 * area for foot in feet]),
        owner=np.repeat(np.arange(len(feet)), len(area)),
        centres=np.array([foot.x for foot in feet]),
        compliance=0.5 * (compliance + compliance.T),
        error=abs(flat / square_punch(1).flat_stiffness - 1.0),
    )


def folded(footprints: Footprints) -> Footprints:
    """Return cells that stand for themselves and their mirror images at y = 0, for contact alike on both sides.

    The number of lines of cells across a foot must be even; the cells at y > 0 stay, in their order.
    """
    cells = round((len(footprints.owner) / len(footprints.centres)) ** 0.5)
    kept = footprints.places[:, 1] > 0.0
    mirrored = np.arange(len(kept)).reshape(-1, cells)[:, ::-1].ravel()
    pairs = 0.5 * (footprints.compliance + footprints.compliance[:, mirrored])
    return replace(
        footprints,
        places=footprints.places[kept],
        areas=2.0 * footprints.areas[kept],
        owner=footprints.owner[kept],
        compliance=pairs[np.ix_(kept, kept)],
    )


def _means(edges: Floats, per_side: int) -> Floats:
    """Return the mean of each nodal polynomial of a line over each cell, shape (cells, nodes)."""
    point, weight = np.polynomial.legendre.leggauss(GAUSS)
    table = square_punch(per_side)
    middle = 0.5 * (edges[1:] + edges[:-1])
    places = middle[:, None] + 0.5 * np.diff(edges)[:, None] * point
    values = table.along(0, places.ravel()).reshape(*places.shape, per_side)
    return np.asarray(np.einsum("cgk,g->ck", values, 0.5 * weight))


@functools.lru_cache(maxsize=4)
def _smooth_compliance(fruit: Fruit, feet: tuple[Foot, ...], per_side: int) -> Floats:
    """Return the answer between all nodes of all feet but for the half-space under one's own foot, times E [1/mm]."""
    within = max(FEWEST_NODES, nodes_within(fruit, feet))
    raise_order = square_punch(within).interpolate(square_punch(per_side).nodes)
    up = block_diag(*[raise_order] * len(feet))
    places = np.concatenate([foot.nodes(per_side) for foot in feet])
    owner = np.repeat(np.arange(len(feet)), per_side**2)
    apart = places[:, None] - places
    distance = np.where(owner[:, None] == owner, np.inf, np.hypot(apart[..., 0], apart[..., 1]))
    smooth: Floats = up @ _remainder_of_nodes(fruit, feet, within) @ up.T + (1.0 - fruit.poisson**2) / np.pi / distance
    return smooth


def _remainder_of_nodes(fruit: Fruit, feet: Sequence[Foot], within: int) -> Floats:
    """Return the remainder's answer between the nodes of all feet, from loads even and odd across the length axis."""
    half = within // 2
    kept = within - half
    places = np.concatenate([foot.nodes(within).reshape(within, within, 2)[:, half:].reshape(-1, 2) for foot in feet])
    extent = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    every = np.concatenate([foot.nodes(within) for foot in feet])
    mesh = box_mesh(block_lines(extent, every, (False, True), GRADING))
    parities: tuple[Parity, ...] = ((0, 1), (0, -1))
    even, odd = remainder_compliance(mesh, fruit.poisson, places, parities).compliances
    same, across = 0.5 * (even + odd), 0.5 * (even - odd)
    line = np.arange(within)
    row = np.maximum(line, within - 1 - line) - half
    chosen = (np.arange(len(feet) * within)[:, None] * kept + row).ravel()
    sign = np.tile(np.sign(2 * line - within + 1), len(feet) * within)
    on_one_side = sign[:, None] * sign >= 0
    found: Floats = np.where(on_one_side, same[np.ix_(chosen, chosen)], across[np.ix_(chosen, chosen)])
    return found
