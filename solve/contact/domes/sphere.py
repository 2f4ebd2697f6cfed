"""A rigid sphere pressed into a half-space, with its own profile and not that of a paraboloid.

C. M. Segedin, Mathematika 4 (1957) 156, doi:10.1112/S0025579300001224; I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47,
doi:10.1016/0020-7225(65)90019-4: with contact radius a, sphere r and a surface that falls away by rho^2 / (2 R),

    depth = a artanh(a / r) + a^2 / R.

Hertz is what remains for a much smaller than r.
"""

import numpy as np

from sensor.arrays import Floats

STEPS = 12  # of Newton's method from above, on a convex function
SETTLED = 4.0 * float(np.finfo(np.float64).eps)  # relative, of a step: round-off
SMALL = 0.1  # below, artanh(x) - x is a series: the difference would lose its digits
TERMS = 9
_SERIES = 1.0 / np.arange(2 * TERMS + 1, 2, -2)  # of x^(2 n + 1), from the highest power down to the third


def sphere_contact_radius(depth: Floats, sphere: float, curvature: Floats) -> Floats:
    """Return the contact radius [mm] of a sphere's radius [mm] at depths >= 0 [mm], of their shape.

    `curvature` [1/mm] is that of the surface, 1 / R of the module's first lines.
    """
    relative_depth = depth / sphere
    relative_curvature = sphere * curvature
    # Newton's method for x = a / r. Both starts are upper bounds: the paraboloid's radius, and artanh(x) <= 1.25 depth
    # where x is above 0.8.
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
