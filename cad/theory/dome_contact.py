"""Where a dome touches a fruit: how far from its axis, and over which radius.

K. L. Johnson, Contact Mechanics, 1985, section 4.2: Hertz. Units: mm, N, MPa.
"""

import math

from cad.theory.contrast_law import hertz_factor


def relative_curvature(dome_radius: float, fruit_radius: float) -> float:
    """Return the radius R* of the sphere that touches a plane as a dome touches a fruit [mm]: 1/R* = 1/r + 1/R."""
    return 1.0 / (1.0 / dome_radius + 1.0 / fruit_radius)


def contact_radius(force: float, E: float, poisson: float, radius: float) -> float:
    """Return a = sqrt(R* d) of a dome that is pressed in by d [mm from N, MPa, mm]; 0 for a tip that is off."""
    indentation = hertz_factor(radius, poisson) * (max(force, 0.0) / E) ** (2.0 / 3.0)
    return math.sqrt(radius * indentation)


def contact_reach(force: float, E: float, poisson: float, radius: float, slope: float) -> float:
    """Return how far from the axis of a dome its contact ends [mm] on a fruit that is inclined by a slope [1] to it.

    The point of first contact runs from the axis by the slope times R*, the `radius` [mm].
    """
    return slope * radius + contact_radius(force, E, poisson, radius)
