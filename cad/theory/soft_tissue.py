"""What soft tissue under a tip does that linear elasticity and a slippery tip leave out, in closed form or by FE."""

import bisect
import math

Curve = tuple[tuple[float, float], ...]

# Not recomputed here: axisymmetric FE at large strain of a sharp tip without slip, neo-Hooke with ln^2 J, a wall that
# does not rub. Loss of force [1] from 0.3 tip sides deep on, against Poisson's ratio.
LARGE_STRAIN_LOSS: Curve = ((0.3, 0.008), (0.45, 0.048), (0.49, 0.055))
LOSS_FULL_AT, LOSS_RISES_FROM = 0.3, 0.6  # depths in tip sides between which that loss stays the same
# The same at Poisson 0.3 with other laws: half of what Hencky (+) and Storakers' foam (-) lie apart, over depth / side.
CONSTITUTIVE_SPREAD: Curve = ((0.0, 0.0), (0.1, 0.024), (0.3, 0.06), (0.6, 0.09))
LEAST_COMPRESSIBLE = 0.4995  # Poisson's ratio beyond which a gripping tip is no stiffer than a slippery one
LARGEST_LOSS = 0.9  # of a stiffness; a larger loss is beyond these formulas


def no_slip(poisson: float) -> float:
    """Return how much stiffer a circular tip is on a half-space that it grips than on one it slides on [1].

    (1 - nu) ln(3 - 4 nu) / (1 - 2 nu) - 1, D. A. Spence, Proc. R. Soc. A 305, 1968, doi 10.1098/rspa.1968.0105.
    """
    nu = min(poisson, LEAST_COMPRESSIBLE)
    return (1.0 - nu) * math.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu) - 1.0


def large_strain(depth: float, poisson: float) -> float:
    """Return the largest loss of force by large strain [1] at an indentation of `depth` [tip sides].

    It grows with the depth up to 0.3, stays, and grows again from 0.6 on.
    """
    loss = interpolated(poisson, LARGE_STRAIN_LOSS)
    return min(LARGEST_LOSS, loss * max(min(1.0, depth / LOSS_FULL_AT), depth / LOSS_RISES_FROM))


def constitutive_spread(depth: float) -> float:
    """Return how far apart constitutive laws put the force [1] at an indentation of `depth` [tip sides].

    Beyond the deepest FE, 0.6, it grows with the depth.
    """
    return interpolated(depth, CONSTITUTIVE_SPREAD) * max(1.0, depth / CONSTITUTIVE_SPREAD[-1][0])


def interpolated(x: float, curve: Curve) -> float:
    """Return the height at x of straight lines between points (x, y), level beyond both ends [unit of y]."""
    upper = bisect.bisect_right(curve, (x, math.inf))
    if upper in (0, len(curve)):
        return curve[min(upper, len(curve) - 1)][1]
    (x0, y0), (x1, y1) = curve[upper - 1 : upper + 1]
    return y0 + (y1 - y0) / (x1 - x0) * (x - x0)
