"""A rigid sphere pressed into an elastic body, with the exact profile of the sphere instead of a paraboloid.

Let a be the contact radius and r the radius of the sphere. At a distance rho from its apex, the surface of the body is
rho^2 / (2 R) lower. Then

    depth = a artanh(a / r) + a^2 / R.

See C. M. Segedin, Mathematika 4 (1957) 156, doi:10.1112/S0025579300001224, and I. N. Sneddon, Int. J. Engng Sci. 3
(1965) 47, doi:10.1016/0020-7225(65)90019-4. For a much smaller than r, the result is Hertz's contact.
"""

import numpy as np

from sensor.arrays import Floats

STEPS = 12  # maximum number of Newton steps; nine are enough up to a depth of six radii
SETTLED = 4.0 * float(np.finfo(np.float64).eps)  # relative step at convergence: a few units of round-off
SMALL = 0.1  # x below which artanh(x) - x is computed from a series, because the subtraction would lose digits
TERMS = 9  # number of terms in this series
_SERIES = 1.0 / np.arange(2 * TERMS + 1, 2, -2)  # coefficients of x^(2 n + 1), from the highest power to the third


def sphere_contact_radius(depth: Floats, sphere_radius: float, curvature: Floats) -> Floats:
    """Return the contact radii [mm] of a sphere at given depths >= 0 [mm], with the same shape as `depth`.

    Newton's method solves depth = a artanh(a / r) + a^2 / R for the contact radius a. `sphere_radius` [mm] is r, and
    `curvature` [1/mm] is 1 / R, the curvature of the body, with the same shape.
    """
    relative_depth = depth / sphere_radius
    relative_curvature = sphere_radius * curvature
    # The unknown is x = a / r. The residual is a convex function of x, so Newton's method converges monotonically from
    # above. The initial guess is the smaller of two upper bounds. One is the radius for a paraboloid. The other follows
    # from x artanh(x) <= depth / r. If x is above 0.8, artanh(x) is at most depth / (0.8 r) = 1.25 depth / r.
    paraboloid_bound = np.sqrt(relative_depth / (1.0 + relative_curvature))
    x = np.minimum(paraboloid_bound, np.maximum(0.8, np.tanh(1.25 * relative_depth)))
    for _ in range(STEPS):
        artanh = x + _artanh_minus_x(x)
        residual_slope = artanh + x / (1.0 - x**2) + 2.0 * x * relative_curvature
        residual = x * artanh + x**2 * relative_curvature - relative_depth
        step = np.divide(residual, residual_slope, out=np.zeros_like(x), where=x > 0.0)
        x = x - step
        if (np.abs(step) <= SETTLED * x).all():
            break
    return sphere_radius * x


def _artanh_minus_x(x: Floats) -> Floats:
    """Return artanh(x) - x for 0 <= x < 1, without loss of digits at small x."""
    small_x = np.minimum(x, SMALL)
    series = small_x**3 * np.polyval(_SERIES, small_x**2)
    return np.where(x < SMALL, series, np.arctanh(x) - x)
