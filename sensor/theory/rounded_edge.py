"""A flat tip with a rounded edge: its loss of force against a sharp tip, at any depth.

The tip is modelled as a round one of the same width: a flat face of radius a, then a quarter circle with the radius of
the edge. I. N. Sneddon, Int. J. Eng. Sci. 3, 1965, doi 10.1016/0020-7225(65)90019-4, gives depth and force of any round
tip on a half-space. Unilateral contact of square tips has the same loss within 0.003, from a depth of 0.02 sides on.
"""

import functools

import numpy as np

from sensor.arrays import Floats

_CURVE = 40  # steps of the curve of force over depth
_WIDEST = 0.999  # largest contact over the edge's radius; the depth tends to infinity at the side wall
_POINTS = 48  # points per integral by the midpoint rule, for an error of 1e-4 of the loss
_MIDPOINTS = (np.arange(_POINTS) + 0.5) / _POINTS


def edge_loss(depth: Floats | float, side: float, radius: float) -> Floats:
    """Return the relative loss of force [1] of a tip with an edge radius, at depths [all in mm].

    It is 2 radius / side at first touch and decreases with depth; it is 0 for a sharp edge. The radius is at most side
    / 2.
    """
    reach = np.asarray(2.0 / side * depth, dtype=np.float64)
    if radius <= 0.0:
        return np.zeros_like(reach)
    depths, missing = _missing_forces(min(1.0, 2.0 * radius / side))
    at_touch = np.full_like(reach, missing[1] / depths[1])
    return np.divide(np.interp(reach, depths, missing), reach, out=at_touch, where=reach > 0.0)


@functools.lru_cache(maxsize=32)
def _missing_forces(edge: float) -> tuple[Floats, Floats]:
    """Return depths [1], from 0 up, and the loss times the depth at each [1], in units of half a side."""
    contact = _WIDEST * np.arange(_CURVE + 1) / _CURVE  # sine of the angle to which the edge touches
    steps = np.diff(contact)
    within_steps = contact[:-1, None] + steps[:, None] * _MIDPOINTS
    fallen = np.cumsum(edge * steps * _fall(edge, within_steps).mean(axis=1))
    depths = _fall(edge, contact[1:])
    # The force 2 E* (depth b - integral of the fall from a to b) is divided by 2 E* depth of the sharp tip.
    missing = edge * (1.0 - contact[1:]) * depths + fallen
    return np.append(0.0, depths), np.append(0.0, missing)


def _fall(edge: float, sine: Floats) -> Floats:
    """Return the depth at which the contact reaches an angle of the edge [half sides].

    It is t times the integral of g' / sqrt(t^2 - r^2), with t the radius of the contact and g the profile of the tip.
    """
    angle = np.arcsin(sine)
    t = 1.0 - edge + edge * sine
    within = angle[..., None] * (1.0 - _MIDPOINTS**2)  # angles within the edge; the square removes the singularity
    r = 1.0 - edge + edge * np.sin(within)
    slopes = 2.0 * _MIDPOINTS * np.sin(within) / np.sqrt(t[..., None] ** 2 - r**2)
    return np.asarray(t * edge * angle * slopes.mean(axis=-1))
