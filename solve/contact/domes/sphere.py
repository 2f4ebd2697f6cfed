"""A rigid sphere pressed into a half-space, with the exact profile of the sphere instead of a paraboloid.

C. M. Segedin, Mathematika 4 (1957) 156, doi:10.1112/S0025579300001224; I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47,
doi:10.1016/0020-7225(65)90019-4: with contact radius a, sphere radius r and a surface that falls by rho^2 / (2 R),

    depth = a artanh(a / r) + a^2 / R.

Hertz's contact is the limit for a much smaller than r.
"""

import numpy as np

from sensor.arrays import Floats

STEPS = 12  # steps of Newton's method from above, on a convex function
SETTLED = 4.0 * float(np.finfo(np.float64).eps)  # relative step at convergence: round-off
SMALL = 0.1  # largest x for the series of artanh(x) - x, whose difference would lose its digits
TERMS = 9
_SERIES = 1.0 / np.arange(2 * TERMS + 1, 2, -2)  # coefficients of x^(2 n + 1), from the highest power to the third


def sphere_contact_radius(depth: Floats, sphere: float, curvature: Floats) -> Floats:
    """Return the contact radii [mm] of a sphere of radius `sphere` [mm] at depths >= 0 [mm], in their shape.

    `curvature` [1/mm] is the curvature of the surface, 1 / R in the module docstring.
    """
    relative_depth = depth / sphere
    relative_curvature = sphere * curvature
    # Newton's method for x = a / r. Both starts are upper bounds: the radius for a paraboloid, and, if x is above 0.8,
    # artanh(x) <= 1.25 depth.
    paraboloid = np.sqrt(relative_depth / (1.0 + relative_curvature))
    x = np.minimum(paraboloid, np.maximum(0.8, np.tanh(1.25 * relative_depth)))
    for _ in range(STEPS):
        artanh = x + _artanh_less(x)
        slope = artanh + x / (1.0 - x**2) + 2.0 * x * relative_curvature
        excess = x * artanh + x**2 * relative_curvature - relative_depth
        step = np.divide(excess, slope, out=np.zeros_like(x), where=x > 0.0)
        x = x - step
        if (np.abs(step) <= SETTLED * x).all():
            break
    return sphere * x


def _artanh_less(x: Floats) -> Floats:
    """Return artanh(x) - x for 0 <= x < 1."""
    few = np.minimum(x, SMALL)
    series = few**3 * np.polyval(_SERIES, few**2)
    return np.where(x < SMALL, series, np.arctanh(x) - x)
