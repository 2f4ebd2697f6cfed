"""Effects of the slope and the curvature of the skin on the compliance of a half-space under a vertical load.

On a level half-space, the compliance between two points is c / r, where r is their horizontal distance. On a slope, c
depends on the direction. For tips of equal extent along and across the slope, the mean over all directions is used. A
curved skin of mean curvature H adds -C H ln r.
"""

import functools
import math

import numpy as np
import numpy.typing as npt

_DIRECTIONS = np.pi * (np.arange(64) + 0.5) / 64.0  # angles [rad]; the mean over them is exact except for rounding


def slope_factor(poisson: float, slope: float) -> float:
    """Return the vertical compliance of a skin that falls by `slope` [1], divided by its value on a level skin [1].

    A vertical load has a component along the normal and a component down the slope: K. L. Johnson, Contact Mechanics
    (1985), equations (3.22) and (3.75), doi:10.1017/CBO9781139171731. A horizontal step of length 1 has the length r on
    the slope, and the component x down the slope. With the angle beta of the slope, the factor is the mean over all
    directions of

        (1 + nu / (1 - nu) sin^2(beta) (x / r)^2) / r.
    """
    sine_squared = slope**2 / (1.0 + slope**2)
    share = sine_squared * poisson / (1.0 - poisson)
    along, r = _step_on_slope(slope)
    return float(np.mean((1.0 + share * (along / r) ** 2) / r))


def log_coefficient(poisson: float, slope: float) -> float:
    """Return the coefficient C [1] of the compliance that the curvature of the skin adds on a `slope` [1].

    A skin of mean curvature H [1/mm] adds -C H ln(r) to the vertical compliance times E [1/mm] at a distance r. With
    the principal curvatures k1 and k2, H is (k1 + k2) / 2. The skin lies H r^2 / 2 below its tangent plane, averaged
    over all directions. Removing the material between them releases its strain energy 1/2 sigma:eps under two unit
    loads (a shape derivative). The surface stresses of normal and tangential loads are given by K. L. Johnson, Contact
    Mechanics (1985), equations (3.20) and (3.76). With the angle beta of the slope and k = 1 - 2 nu, the result is

        C = cos^2(beta) n + sin^2(beta) t,
        n = k^2 (1 + nu) / (2 pi),    t = ((3 + nu) k^2 + 12 nu k + 18 nu^2) / (4 pi).
    """
    cosine_squared = 1.0 / (1.0 + slope**2)  # square of the normal component of a vertical unit load
    compressibility = 1.0 - 2.0 * poisson  # 0 for incompressible flesh
    normal = compressibility**2 * (1.0 + poisson) / (2.0 * math.pi)
    tangential = ((3.0 + poisson) * compressibility**2 + 12.0 * poisson * compressibility + 18.0 * poisson**2) / (
        4.0 * math.pi
    )
    return cosine_squared * normal + (1.0 - cosine_squared) * tangential


@functools.lru_cache(maxsize=32)
def frictionless_stiffness_change(poisson: float, slope: float) -> float:
    """Return the relative change of the fruit stiffness [1] if a guided tip slides on a slope instead of gripping it.

    A frictionless tip presses along the normal. A tip that moves down by d indents the fruit by d cos(slope) along the
    normal. Only the fraction cos(slope) of the tip force is vertical; the guide carries the horizontal component. The
    result is negative, usually about -sin^2 of the slope angle.
    """
    return slope_factor(poisson, slope) / ((1.0 + slope**2) * stretch_factor(slope)) - 1.0


def stretch_factor(slope: float) -> float:
    """Return the factor [1] by which a `slope` [1] of the skin changes the compliance along its normal.

    The load is circular when seen from above, so it is elongated down the slope. The factor is the mean of 1 / r over
    all directions.
    """
    _, r = _step_on_slope(slope)
    return float(np.mean(1.0 / r))


def _step_on_slope(slope: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the length on the slope of a step of horizontal length 1: its component down the slope, and its total.

    Both results are arrays over the directions of the step.
    """
    along = np.cos(_DIRECTIONS) * math.hypot(1.0, slope)
    return along, np.hypot(along, np.sin(_DIRECTIONS))
