"""A flat tip whose edge is rounded: how much softer it is than a sharp one, at any depth.

The tip counts as a round one of the same width: a flat face of radius a, then a quarter circle of the edge's radius.
I. N. Sneddon, Int. J. Eng. Sci. 3, 1965, doi 10.1016/0020-7225(65)90019-4, gives depth and force of any round tip on a
half-space. Unilateral contact of square tips loses the same within 0.003 from 0.02 sides deep on.
"""

import bisect
import functools
import math

_POINTS = 48  # of each integral, by the midpoint rule: 1e-4 of the loss
_CURVE = 40
_WIDEST = 0.999  # of the edge's radius: the depth grows without bound as contact nears the side wall


def edge_loss(depth: float, side: float, radius: float) -> float:
    """Return the fraction of force that a tip of a side loses at a depth by an edge of a radius [1 from mm].

    2 radius / side at first touch, ever less the deeper it stands; 0 for a sharp edge. The radius is at most side / 2.
    """
    if radius <= 0.0:
        return 0.0
    depths, missing = _missing_forces(min(1.0, 2.0 * radius / side))
    reach = 2.0 * depth / side
    if reach >= depths[-1]:
        return missing[-1] / reach
    upper = bisect.bisect_right(depths, reach)
    start = depths[upper - 1]
    end = depths[upper]
    between = missing[upper - 1] * (end - reach) + missing[upper] * (reach - start)
    return between / ((end - start) * reach) if reach > 0.0 else missing[1] / depths[1]


@functools.lru_cache(maxsize=32)
def _missing_forces(edge: float) -> tuple[list[float], list[float]]:
    """Return depths and the loss times the depth at each [1], lengths in half sides, for an edge of that radius."""
    depths = [0.0]
    missing = [0.0]
    fallen = 0.0
    before = 0.0
    for step in range(1, _CURVE + 1):
        contact = _WIDEST * step / _CURVE
        fallen += edge * (contact - before) * _mean_fall(edge, before, contact)
        before = contact
        depth = _fall(edge, math.asin(contact))
        # F = 2 E* (depth b - integral of the fall from a to b), over the sharp tip's 2 E* depth
        missing.append(edge * (1.0 - contact) * depth + fallen)
        depths.append(depth)
    return depths, missing


def _mean_fall(edge: float, start: float, end: float) -> float:
    """Return the mean of the fall between two radii of contact, given as sines of the edge's angle."""
    total = 0.0
    for point in range(_POINTS):
        sine = start + (end - start) * (point + 0.5) / _POINTS
        total += _fall(edge, math.asin(sine))
    return total / _POINTS


def _fall(edge: float, angle: float) -> float:
    """Return the depth at which contact reaches an angle of the edge: t times the integral of g' / sqrt(t^2 - r^2)."""
    t = 1.0 - edge + edge * math.sin(angle)
    total = 0.0
    for point in range(_POINTS):
        s = (point + 0.5) / _POINTS  # the angle within the edge is angle (1 - s^2), which takes the root's pole away
        within = angle * (1.0 - s * s)
        r = 1.0 - edge + edge * math.sin(within)
        total += 2.0 * s * math.sin(within) / math.sqrt(t * t - r * r)
    return t * edge * angle * total / _POINTS
