"""Smooth loads that represent rigid tips on a coarse mesh: normal distributions seen from above, lengths in mm."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from solve.fruit.footprints import Footprint, closest_spacing

WIDEST = 3.0  # largest deviation over the least one
IN_ROOM = 3.2  # least distance to a side face [deviations]
IN_SPACING = 3.0  # least spacing [deviations]
FEWEST_NODES = 3
GAUSS_POINTS, GAUSS_WEIGHTS = legendre.leggauss(24)  # Gauss points in a step


@dataclass(frozen=True)
class SmoothLoad:
    """A unit load around a point of the plan, normally distributed with the same standard deviation [mm] in x and y."""

    x: float
    y: float
    deviation: float


def smooth_loads(fruit: Fruit, footprints: Sequence[Footprint], most: float = WIDEST) -> tuple[SmoothLoad, ...]:
    """Return the smooth loads that represent the footprints, as wide as room and spacing allow.

    No load is wider than `most` times its least deviation [1].
    """
    closest = closest_spacing(footprints)
    loads = []
    for footprint in footprints:
        widest = most * least_deviation(footprint)
        deviation = min(widest, footprint.room(fruit) / IN_ROOM, closest * footprint.side / IN_SPACING)
        loads.append(SmoothLoad(footprint.x, footprint.y, deviation))
    return tuple(loads)


def least_deviation(footprint: Footprint) -> float:
    """Return the deviation [mm] of the normal distribution with the rigid tip's compliance on a half-space."""
    return 0.5 * footprint.side * footprint.punch(FEWEST_NODES).flat_stiffness / math.sqrt(math.pi)


def line_forces(line: Floats, centre: float, deviation: float, sign: int) -> tuple[Floats, Floats]:
    """Return the nodes of quadratic elements along a line [mm], and the fraction of a unit load on each [1].

    The load is a normal distribution about `centre` with a standard deviation [both mm]. `sign` adds (1), subtracts
    (-1) or leaves out (0) its mirror image at -centre.
    """
    nodes = np.zeros(2 * len(line) - 1)
    nodes[::2] = line
    nodes[1::2] = 0.5 * (line[1:] + line[:-1])

    # Integrals of the density times the three shape functions of each step, by Gauss's rule.
    t = 0.5 * (GAUSS_POINTS + 1.0)  # on (0, 1)
    steps = np.diff(line)[:, None]
    s = line[:-1, None] + steps * t
    density = _normal(s - centre, deviation) + sign * _normal(s + centre, deviation)
    shapes = np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)])
    local = (0.5 * steps * GAUSS_WEIGHTS * density) @ shapes.T
    forces = np.zeros(len(nodes))
    for node in range(3):
        forces[node : node + 2 * len(steps) : 2] += local[:, node]
    return nodes, forces


def _normal(distance: Floats, deviation: float) -> Floats:
    return np.exp(-0.5 * (distance / deviation) ** 2) / (deviation * math.sqrt(2.0 * math.pi))
