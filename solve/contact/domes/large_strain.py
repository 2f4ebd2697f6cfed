"""Corrections of Hertz's contact of a rigid, frictionless ball for large strain: polynomials in the contact radius.

Let a be Hertz's contact radius at a depth, s = a / dome radius and t = a / fruit radius. The force is Hertz's times

    g = 1 + c1 s + c2 t + c3 s^2 + c4 s t,

and the contact radius of the deformed body is a times another such polynomial. Both are fitted to finite elements at
finite strain. Strain is proportional to a over a radius: the first two terms are second-order elasticity. The others
include the difference between a sphere and a paraboloid.
"""

import functools
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

POISSONS = (0.0, 0.15, 0.3, 0.45, 0.49)
NEO_HOOKE = (
    (0.2454, -0.1035, -0.1607, 0.0832),
    (0.1819, -0.1045, -0.1566, 0.0314),
    (0.0914, -0.1071, -0.1402, 0.0467),
    (-0.0235, -0.0837, -0.1152, 0.1120),
    (-0.0536, -0.0629, -0.1105, 0.1131),
)
# Half the difference of the relative force between Hencky's law and Storakers' law (foam).
LAW_SPREAD = (
    (0.1781, 0.1871, 0.0178, 0.0795),
    (0.1304, 0.1273, 0.0148, 0.0053),
    (0.0808, 0.0741, 0.0180, -0.0074),
    (0.0577, 0.0536, -0.0025, -0.0007),
    (0.0622, 0.0643, -0.0181, -0.0272),
)
# Deformed contact radius over Hertz's at the same depth. The second column is the inward displacement of the skin under
# Hertz's pressure, -2 (1 - 2 nu) / (3 pi (1 - nu)): K. L. Johnson, Contact Mechanics (1985), (3.42).
EDGE = (
    (-0.1189, -0.2122, -0.0431, 0.1877),
    (-0.0876, -0.1748, -0.0692, 0.2743),
    (-0.0407, -0.1213, -0.1080, 0.2570),
    (-0.0036, -0.0386, -0.1278, 0.1518),
    (0.0387, -0.0083, -0.1755, 0.1657),
)
DEEPEST = 0.7  # largest contact radius of the fit of g, over the dome radius
# Relative error of the force: the fit leaves 8e-4, and other elements give up to 1.2e-3 more at s = 0.15.
FIT = 1.5e-3
FIT_OF_EDGE = 5e-3  # relative error of the contact radius by the fit, mostly from edges inside an element
FULL = 0.1  # s + t above which FIT and FIT_OF_EDGE apply in full; below, they are proportional to s + t


@dataclass(frozen=True, eq=False)
class LargeStrain:
    """Corrections of Hertz's contacts for large strain [1], all of one shape.

    `factor` is g, `slope` its slope over ln a, `error` the bound of its error. `law_spread` is half the difference
    between laws of flesh. `edge` is the contact radius over Hertz's, `edge_error` the bound of its error.
    """

    factor: Floats
    slope: Floats
    error: Floats
    law_spread: Floats
    edge: Floats
    edge_error: Floats


def large_strain(contact: Floats, dome: float, curvature: Floats, poisson: float) -> LargeStrain:
    """Return the corrections of Hertz's contacts for large strain, at Hertz's contact radii [mm].

    `dome` [mm] is the radius of the domes; the fruit's curvature [1/mm] has the shape of the contact radii. Beyond the
    range of the fit g keeps its value at the end of the range, and all of g - 1 is an error.
    """
    s = contact / dome
    t = contact * curvature
    beyond = s > DEEPEST
    scale = np.where(beyond, DEEPEST / np.where(beyond, s, 1.0), 1.0)
    s = scale * s
    t = scale * t
    first, second = _terms(NEO_HOOKE, poisson, s, t)
    law_spread = np.abs(sum(_terms(LAW_SPREAD, poisson, s, t)))
    outside = beyond | (not POISSONS[0] <= poisson <= POISSONS[-1])
    departure = first + second  # g - 1
    edge_departure: Floats = np.add(*_terms(EDGE, poisson, s, t))
    strained = np.minimum(1.0, (s + t) / FULL)  # fraction of the fit's errors at this strain
    return LargeStrain(
        factor=1.0 + departure,
        slope=np.where(beyond, 0.0, first + 2.0 * second),  # first order in a, second in a^2
        error=np.where(outside, np.abs(departure), 0.0) + FIT * strained,
        law_spread=law_spread,
        edge=1.0 + edge_departure,
        edge_error=np.where(outside, np.abs(edge_departure), 0.0) + FIT_OF_EDGE * strained,
    )


@functools.cache
def coefficients(table: tuple[tuple[float, ...], ...], poisson: float) -> tuple[float, ...]:
    """Return c1 to c4 [1] of a table at a Poisson's ratio, linearly interpolated between its rows."""
    return tuple(float(np.interp(poisson, POISSONS, column)) for column in zip(*table, strict=True))


def _terms(table: tuple[tuple[float, ...], ...], poisson: float, s: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Return the terms of first order, c1 s + c2 t, and of second order, c3 s^2 + c4 s t [1]."""
    c1, c2, c3, c4 = coefficients(table, poisson)
    return c1 * s + c2 * t, c3 * s**2 + c4 * s * t
