"""Smooth loads that replace rigid tips on a coarse mesh: normally distributed forces in plan. Lengths are in mm."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from solve.fruit.footprints import Footprint, closest_spacing

WIDEST = 3.0  # largest ratio of a load's standard deviation to the smallest one for its tip
DEVIATIONS_TO_FACE = 3.2  # smallest distance of a load from a side face [standard deviations]
DEVIATIONS_BETWEEN = 3.0  # smallest spacing of two loads [standard deviations]
FEWEST_NODES = 3  # nodes per side of the punch table, which are enough for a flat punch
GAUSS_POINTS, GAUSS_WEIGHTS = legendre.leggauss(24)  # Gauss rule for integrating a load over an element


@dataclass(frozen=True)
class SmoothLoad:
    """A unit load around x, y [mm], normally distributed with the same standard deviation [mm] in both directions."""

    x: float
    y: float
    deviation: float


def smooth_loads(
    fruit: Fruit, footprints: Sequence[Footprint], largest_ratio: float = WIDEST
) -> tuple[SmoothLoad, ...]:
    """Return the smooth loads that replace the footprints, as wide as side faces and neighbouring loads allow.

    The width of a load is its standard deviation, at most `largest_ratio` [1] times the smallest standard deviation of
    the footprint (`least_deviation`).
    """
    closest_spacing_ratio = closest_spacing(footprints)
    loads = []
    for footprint in footprints:
        widest = largest_ratio * least_deviation(footprint)
        limit_at_face = footprint.distance_to_edge(fruit) / DEVIATIONS_TO_FACE
        limit_at_neighbour = closest_spacing_ratio * footprint.side / DEVIATIONS_BETWEEN
        loads.append(SmoothLoad(footprint.x, footprint.y, min(widest, limit_at_face, limit_at_neighbour)))
    return tuple(loads)


def least_deviation(footprint: Footprint) -> float:
    """Return the smallest standard deviation [mm] of the load that replaces a tip.

    With this standard deviation, the load has the same compliance on a half-space as the rigid tip.
    """
    return 0.5 * footprint.side * footprint.punch(FEWEST_NODES).flat_stiffness / math.sqrt(math.pi)


def line_fractions(line: Floats, centre: float, deviation: float, sign: int) -> tuple[Floats, Floats]:
    """Return the nodes of quadratic elements along one axis [mm], and the fraction of a unit load on each [1].

    `line` [mm] holds the ends of the elements. The load is normally distributed around `centre` [mm] with the standard
    deviation `deviation` [mm]. Its mirror image at -centre is added if `sign` is 1, subtracted if it is -1, and omitted
    if it is 0.
    """
    # Each element has a node at both ends, and one in the middle.
    nodes = np.zeros(2 * len(line) - 1)
    nodes[::2] = line
    nodes[1::2] = 0.5 * (line[1:] + line[:-1])

    element_forces = _element_forces(line, centre, deviation, sign)
    fractions = np.zeros(len(nodes))
    for node in range(3):
        # Element e has the nodes 2 e, 2 e + 1 and 2 e + 2 of the line. Neighbouring elements share a node, so their
        # contributions are added.
        fractions[node : node + 2 * len(element_forces) : 2] += element_forces[:, node]
    return nodes, fractions


def _element_forces(line: Floats, centre: float, deviation: float, sign: int) -> Floats:
    """Return the integrals of the load's density times the shape functions of each element [1], (elements, 3).

    The arguments are those of `line_fractions`. The integrals are computed by Gauss quadrature.
    """
    t = 0.5 * (GAUSS_POINTS + 1.0)  # coordinate within an element, from 0 to 1
    element_lengths = np.diff(line)[:, None]
    s = line[:-1, None] + element_lengths * t  # Gauss points of all elements [mm], (elements, points)
    density = _normal_density(s - centre, deviation) + sign * _normal_density(s + centre, deviation)
    shapes = np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)])
    return np.asarray((0.5 * element_lengths * GAUSS_WEIGHTS * density) @ shapes.T)


def _normal_density(distance: Floats, deviation: float) -> Floats:
    """Return the density of a normal distribution [1/mm] at distances from its centre [mm]."""
    return np.exp(-0.5 * (distance / deviation) ** 2) / (deviation * math.sqrt(2.0 * math.pi))
