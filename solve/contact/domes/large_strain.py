"""Corrections of Hertz's law for a rigid, frictionless sphere at large strain: polynomials in the contact radius.

Let a be Hertz's contact radius at a given depth, s = a / dome radius and t = a / fruit radius. The force is Hertz's
force times

    g = 1 + c1 s + c2 t + c3 s^2 + c4 s t.

The contact radius of the deformed body is a times another polynomial of this form. Both polynomials are fitted to
finite-element solutions at finite strain. The strain is of the order of s and t, so the linear terms are the effects of
second-order elasticity. The quadratic terms include the difference between a sphere and a paraboloid.
"""

import functools
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

POISSONS = (0.0, 0.15, 0.3, 0.45, 0.49)  # Poisson's ratio for each row of the tables
# c1 to c4 for the force on neo-Hookean flesh.
NEO_HOOKE = (
    (0.2454, -0.1035, -0.1607, 0.0832),
    (0.1819, -0.1045, -0.1566, 0.0314),
    (0.0914, -0.1071, -0.1402, 0.0467),
    (-0.0235, -0.0837, -0.1152, 0.1120),
    (-0.0536, -0.0629, -0.1105, 0.1131),
)
# Half the difference in relative force between Hencky's law and Storakers's law (foam).
LAW_SPREAD = (
    (0.1781, 0.1871, 0.0178, 0.0795),
    (0.1304, 0.1273, 0.0148, 0.0053),
    (0.0808, 0.0741, 0.0180, -0.0074),
    (0.0577, 0.0536, -0.0025, -0.0007),
    (0.0622, 0.0643, -0.0181, -0.0272),
)
# c1 to c4 for the contact radius of the deformed body, relative to Hertz's radius at the same depth. The second column
# is the inward displacement of the surface under Hertz's pressure, -2 (1 - 2 nu) / (3 pi (1 - nu)). See K. L. Johnson,
# Contact Mechanics (1985), equation (3.42).
EDGE = (
    (-0.1189, -0.2122, -0.0431, 0.1877),
    (-0.0876, -0.1748, -0.0692, 0.2743),
    (-0.0407, -0.1213, -0.1080, 0.2570),
    (-0.0036, -0.0386, -0.1278, 0.1518),
    (0.0387, -0.0083, -0.1755, 0.1657),
)
LARGEST_S = 0.7  # largest s for which g was fitted
# Relative error of the fitted force: 8e-4 from the fit, and up to 1.2e-3 more with other elements, at s = 0.15.
FIT_ERROR = 1.5e-3
# Relative error of the fitted contact radius, mostly because the edge of the contact lies inside an element.
EDGE_FIT_ERROR = 5e-3
# Value of s + t above which FIT_ERROR and EDGE_FIT_ERROR apply in full; below it, they are proportional to s + t.
FULL_ERROR_STRAIN = 0.1


@dataclass(frozen=True, eq=False)
class LargeStrain:
    """Corrections of Hertz's law for large strain [1]; all arrays have the same shape.

    `factor` is g, `slope` is dg / d ln a, and `error` bounds the error of g. `law_spread` is half the relative
    difference in force between two material laws of flesh. `edge` is the contact radius divided by Hertz's radius, and
    `edge_error` bounds its error.
    """

    factor: Floats
    slope: Floats
    error: Floats
    law_spread: Floats
    edge: Floats
    edge_error: Floats


def large_strain(contact_radius: Floats, dome_radius: float, curvature: Floats, poisson: float) -> LargeStrain:
    """Return the corrections of Hertz's law for large strain, at Hertz's contact radii `contact_radius` [mm].

    `dome_radius` [mm] is the radius of the domes. `curvature` [1/mm] is the curvature of the fruit, with the same shape
    as `contact_radius`. `poisson` is Poisson's ratio of the flesh. Outside the range of the fit, the factor g of the
    force keeps its value at the end of the range. Its error bound then includes all of g - 1.
    """
    s = contact_radius / dome_radius
    t = contact_radius * curvature
    # Beyond the range of the fit, s and t are scaled back so that s is LARGEST_S.
    is_beyond = s > LARGEST_S
    scale = np.divide(LARGEST_S, s, out=np.ones_like(s), where=is_beyond)
    s = scale * s
    t = scale * t
    linear, quadratic = _terms(NEO_HOOKE, poisson, s, t)
    law_spread = np.abs(sum(_terms(LAW_SPREAD, poisson, s, t)))
    # `np.interp` uses the nearest row of a table for a Poisson's ratio outside it, which is an extrapolation too.
    is_outside = is_beyond | (not POISSONS[0] <= poisson <= POISSONS[-1])
    correction = linear + quadratic  # g - 1
    edge_correction: Floats = np.add(*_terms(EDGE, poisson, s, t))
    fit_share = np.minimum(1.0, (s + t) / FULL_ERROR_STRAIN)  # fraction of the fitting errors at this strain
    return LargeStrain(
        factor=1.0 + correction,
        slope=np.where(is_beyond, 0.0, linear + 2.0 * quadratic),  # d/d(ln a) of the terms in a and in a^2
        error=np.where(is_outside, np.abs(correction), 0.0) + FIT_ERROR * fit_share,
        law_spread=law_spread,
        edge=1.0 + edge_correction,
        edge_error=np.where(is_outside, np.abs(edge_correction), 0.0) + EDGE_FIT_ERROR * fit_share,
    )


@functools.cache
def coefficients(table: tuple[tuple[float, ...], ...], poisson: float) -> tuple[float, ...]:
    """Return c1 to c4 [1] at a Poisson's ratio, by linear interpolation between the rows of a table."""
    return tuple(float(np.interp(poisson, POISSONS, column)) for column in zip(*table, strict=True))


def _terms(table: tuple[tuple[float, ...], ...], poisson: float, s: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Return the linear terms c1 s + c2 t and the quadratic terms c3 s^2 + c4 s t of a correction [1]."""
    c1, c2, c3, c4 = coefficients(table, poisson)
    return c1 * s + c2 * t, c3 * s**2 + c4 * s * t
