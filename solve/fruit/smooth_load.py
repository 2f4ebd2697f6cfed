"""Smooth loads that stand for rigid tips on a coarse mesh: normal distributions as seen from above, lengths in mm."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from cad.design.fruit import Fruit
from solve.arrays import Floats
from solve.fruit.footprints import Footprint, closest_spacing

# Deviation over the least one; over it, what the distance to a side face and what the spacing must at least be.
WIDEST, IN_ROOM, IN_SPACING = 3.0, 3.2, 3.0
FEWEST_NODES = 3
POINTS_A_STEP = 24


@dataclass(frozen=True)
class SmoothLoad:
    """A unit load about a place of the plan, of normal distribution with one standard deviation [mm] each way."""

    x: float
    y: float
    deviation: float


def smooth_loads(fruit: Fruit, footprints: Sequence[Footprint]) -> tuple[SmoothLoad, ...]:
    """Return the loads that stand for the footprints [mm]: as wide as room and spacing let them be."""
    closest = closest_spacing(footprints)
    loads = []
    for one in footprints:
        limits = WIDEST * least_deviation(one), one.room(fruit) / IN_ROOM, closest * one.side / IN_SPACING
        loads.append(SmoothLoad(one.x, one.y, min(limits)))
    return tuple(loads)


def least_deviation(footprint: Footprint) -> float:
    """Return the deviation [mm] of the normal distribution that sinks into a half-space as far as the rigid tip."""
    return 0.5 * footprint.side * footprint.punch(FEWEST_NODES).flat_stiffness / math.sqrt(math.pi)


def line_shares(line: Floats, place: float, deviation: float, sign: int) -> tuple[Floats, Floats]:
    """Return the nodes of quadratic elements along a line [mm], and the share of a load at a place [mm] on each [1].

    `sign` adds (1), subtracts (-1) or leaves out (0) the mirror image of the load at -place.
    """
    nodes = np.zeros(2 * len(line) - 1)
    nodes[::2], nodes[1::2] = line, 0.5 * (line[1:] + line[:-1])
    points, weights = legendre.leggauss(POINTS_A_STEP)
    t, steps = 0.5 * (points + 1.0), np.diff(line)[:, None]
    s = line[:-1, None] + steps * t
    density = _normal(s - place, deviation) + sign * _normal(s + place, deviation)
    local = (0.5 * steps * weights * density) @ _shapes(t).T
    shares = np.zeros(len(nodes))
    for node in range(3):
        shares[node : node + 2 * len(steps) : 2] += local[:, node]
    return nodes, shares


def _shapes(t: Floats) -> Floats:
    """Return the shape functions of a quadratic element at places t on (0, 1), shape (3, places)."""
    return np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)])


def _normal(distance: Floats, deviation: float) -> Floats:
    density: Floats = np.exp(-0.5 * (distance / deviation) ** 2) / (deviation * math.sqrt(2.0 * math.pi))
    return density
