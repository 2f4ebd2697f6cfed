"""What slope and curvature of the skin under a tip do to a half-space that is pressed along the vertical.

Compliances of a half-space under two places a distance r apart, seen from above, are c / r. On a slope c depends on the
direction; under tips alike along and across its mean over all directions counts. A curved skin adds a term -C H ln r.
"""

import functools
import math

import numpy as np
import numpy.typing as npt

_DIRECTIONS = np.pi * (np.arange(64) + 0.5) / 64.0  # of a smooth periodic function: its mean is exact to rounding


def slope_factor(poisson: float, slope: float) -> float:
    """Return vertical compliance on a skin that falls by `slope` [1], over that of a level one [1]; load vertical.

    The load has a part along the normal and one down the slope: K. L. Johnson, Contact Mechanics (1985), equations
    (3.22) and (3.75), doi:10.1017/CBO9781139171731.
    """
    sine_squared = slope**2 / (1.0 + slope**2)
    share = sine_squared * poisson / (1.0 - poisson)
    along, r = _stretched(slope)
    return float(np.mean((1.0 + share * (along / r) ** 2) / r))


def log_coefficient(poisson: float, slope: float) -> float:
    """Return C [1]: a skin of mean curvature H [1/mm] adds -C H ln(r) to vertical compliance times E [1/mm].

    Removing the skin below the tangent plane, H r^2 deep, frees the strain energy 1/2 sigma:eps there of two unit loads
    (shape derivative). The surface stress of normal and tangential loads is that of Johnson (3.20) and (3.76).
    """
    cosine_squared = 1.0 / (1.0 + slope**2)
    free = 1.0 - 2.0 * poisson
    normal = free**2 * (1.0 + poisson) / (2.0 * math.pi)
    tangential = ((3.0 + poisson) * free**2 + 12.0 * poisson * free + 18.0 * poisson**2) / (4.0 * math.pi)
    return cosine_squared * normal + (1.0 - cosine_squared) * tangential


@functools.lru_cache(maxsize=32)
def frictionless_press(poisson: float, slope: float) -> float:
    """Return the fruit's stiffness to a guided tip that slides on a slope [1], over that to a vertical load [1].

    A tip without friction presses along the normal. Going down by d it presses by d cos(slope) along the normal. Of its
    force the fraction cos(slope) is vertical, and the guide bears the rest. Negative: -sin^2 as a rule.
    """
    return slope_factor(poisson, slope) / ((1.0 + slope**2) * stretch_factor(slope)) - 1.0


def stretch_factor(slope: float) -> float:
    """Return compliance along the normal under a load that is round as seen from above, over that on a level skin [1].

    On a skin that falls by `slope` [1] such a load is longer down the slope: the mean of 1 / r over all directions.
    """
    _, r = _stretched(slope)
    return float(np.mean(1.0 / r))


def _stretched(slope: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the length on the slope of a unit step seen from above [1], by direction: its part down it, and all."""
    along = np.cos(_DIRECTIONS) * math.hypot(1.0, slope)
    return along, np.hypot(along, np.sin(_DIRECTIONS))
