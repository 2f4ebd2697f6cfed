"""What real flesh under a tip does that linear elasticity and a slippery tip leave out, in closed form or by FE."""

import math

import numpy as np

# FE of one tip at large strain, loss of force from 0.3 sides deep on against Poisson's ratio.
STRAIN_POISSON, STRAIN_SIZES = (0.3, 0.45, 0.49), (0.008, 0.048, 0.055)
# The same with other laws of the flesh, spread of the force against the depth in sides.
LAW_DEPTHS, LAW_SIZES = (0.0, 0.1, 0.3, 0.6), (0.0, 0.024, 0.06, 0.09)
LEAST_COMPRESSIBLE = 0.4995  # beyond it no slip is no longer felt
LARGEST_LOSS = 0.9  # of a stiffness; what would take more is beyond these formulas


def no_slip(poisson: float) -> float:
    """Return how much stiffer a circular tip is on a half-space that it grips, (1 - nu) ln(3 - 4 nu) / (1 - 2 nu) - 1.

    D. A. Spence, Proc. R. Soc. A 305, 1968.
    """
    nu = min(poisson, LEAST_COMPRESSIBLE)
    return (1.0 - nu) * math.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu) - 1.0


def large_strain(depth: float, poisson: float) -> float:
    """Return the largest loss of force by large strain at a depth in tip sides, in proportion below 0.3, above 0.6."""
    size = float(np.interp(poisson, STRAIN_POISSON, STRAIN_SIZES))
    return min(LARGEST_LOSS, size * max(min(1.0, depth / LAW_DEPTHS[2]), depth / LAW_DEPTHS[3]))


def flesh_law(depth: float) -> float:
    """Return how far laws of the flesh spread the force at a depth in tip sides, in proportion above 0.6."""
    return float(np.interp(depth, LAW_DEPTHS, LAW_SIZES)) * max(1.0, depth / LAW_DEPTHS[-1])
