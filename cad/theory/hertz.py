"""Hertz's contact of smooth bodies, its one home: a dome on a fruit, a fruit on a table, a fruit between plates.

Two bodies touch at a point and are pressed together by d: F = 4/3 E* sqrt(R) d^(3/2), with E* = E / (1 - nu^2) where
one of them is rigid. K. L. Johnson, Contact Mechanics (1985), chapter 4, doi:10.1017/CBO9781139171731. mm, N, MPa.
"""

import math

_HALVINGS = 60  # of the ratio of the axes: to rounding
_ROUND = 1e-9  # two radii that are alike to this share make a circular contact


def hertz_factor(radius: float, poisson: float) -> float:
    """Return h [mm (MPa/N)^(2/3)] of d = h (F / E)^(2/3) for a relative radius of curvature [mm].

    F = 4/3 E / (1 - nu^2) sqrt(R) d^(3/2): Johnson (4.23).
    """
    return math.pow(0.75 * (1.0 - poisson**2) / math.sqrt(radius), 2.0 / 3.0)


def force_factor(reduced_modulus: float, radius: float) -> float:
    """Return c [N mm^(-3/2)] of F = c d^(3/2) for E* = E / (1 - nu^2) [MPa] and a relative radius of curvature [mm].

    c = 4/3 E* sqrt(R): Johnson (4.23).
    """
    return 4.0 / 3.0 * reduced_modulus * math.sqrt(radius)


def relative_curvature(dome_radius: float, fruit_radius: float) -> float:
    """Return the radius R* of the sphere that touches a plane as a dome touches a fruit [mm]: 1/R* = 1/r + 1/R."""
    return 1.0 / (1.0 / dome_radius + 1.0 / fruit_radius)


def mean_relative_curvature(dome_radius: float, along: float, across: float) -> float:
    """Return R* of a dome on a fruit of two radii, whose mean curvature is taken [mm].

    1 / R* = 1 / r + (1 / along + 1 / across) / 2.
    """
    return 1.0 / (1.0 / dome_radius + 0.5 / along + 0.5 / across)


def approach(force: float, E: float, poisson: float, radius: float) -> float:
    """Return how far a body of a relative radius [mm] is pressed in by a force [mm from N, MPa, mm]; 0 for none."""
    return hertz_factor(radius, poisson) * math.pow(max(force, 0.0) / E, 2.0 / 3.0)


def contact_radius(force: float, E: float, poisson: float, radius: float) -> float:
    """Return a = sqrt(R* d) of a dome that is pressed in by d [mm from N, MPa, mm]; 0 for a tip that is off."""
    return math.sqrt(radius * approach(force, E, poisson, radius))


def contact_reach(force: float, E: float, poisson: float, radius: float, slope: float) -> float:
    """Return how far from the axis of a dome its contact ends [mm] on a fruit that is inclined by a slope [1] to it.

    The point of first contact runs from the axis by the slope times R*, the `radius` [mm].
    """
    return slope * radius + contact_radius(force, E, poisson, radius)


def plate_stiffness(radius: float, plates: int) -> float:
    """Return c [mm^(1/2)] of F = c E* D^(3/2), a body of a radius [mm] and D the travel of one plate towards the other.

    Two plates share the travel: each side is pressed in by D / 2. One plate and a support that gives nothing: by D.
    """
    return force_factor(1.0, radius / plates**3)


def equivalent_radius(radius: float, radius_across: float) -> float:
    """Return the radius of the sphere that a plate presses in by the same force as a body of two radii [mm].

    The contact is an ellipse: Johnson (4.26) to (4.28). Where both radii are alike, it is that radius.
    """
    smaller, larger = sorted((radius, radius_across))
    if larger - smaller <= _ROUND * larger:
        return radius
    ratio = _axis_ratio(larger / smaller)
    first, second = _elliptic_integrals(ratio)
    eccentricity_squared = 1.0 - ratio**2
    spread = math.sqrt((second / ratio**2 - first) * (first - second))
    F1 = math.cbrt(4.0 / (math.pi * eccentricity_squared) * ratio**1.5 * spread)
    F2 = 2.0 / math.pi * math.sqrt(ratio) * first / F1
    return math.sqrt(smaller * larger) / F2**3


def _axis_ratio(radii: float) -> float:
    """Return b / a of the ellipse that a body of this ratio of radii, above 1, makes on a plate [1]; Johnson (4.28)."""
    low = 0.0
    high = 1.0
    for _ in range(_HALVINGS):
        ratio = 0.5 * (low + high)
        first, second = _elliptic_integrals(ratio)
        if (second / ratio**2 - first) / (first - second) > radii:
            low = ratio
        else:
            high = ratio
    return 0.5 * (low + high)


def _elliptic_integrals(ratio: float) -> tuple[float, float]:
    """Return K and E of the eccentricity of an ellipse with this ratio of its axes [1], by arithmetic-geometric mean.

    M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions (1964), 17.6.
    """
    a = 1.0
    b = ratio
    power = 0.5
    lost = power * (1.0 - ratio**2)
    while abs(a - b) > math.ulp(a):
        a, b, c = 0.5 * (a + b), math.sqrt(a * b), 0.5 * (a - b)
        power *= 2.0
        lost += power * c * c
        if c < math.ulp(1.0):
            break
    first = math.pi / (2.0 * a)
    return first, first * (1.0 - lost)
