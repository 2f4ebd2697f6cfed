"""A small beam with the housing's leaves, clamped in the middle and loaded at its ends: its sag measures E as printed.

A leaf of every arm of a housing stands out of one block, each with a pad and a hole for a weight. Coupon frame: that of
the housing, with the middle of the clamped block at x = 0, z = 0.
"""

import numpy as np

from sensor.theory.leaf_spring import Flexure

_POINTS = 24  # of Gauss, in each fillet and in the straight part
BLOCK_WIDTH_MM = 24.0
BLOCK_HEIGHT_MM = 12.0
PAD_MM = 7.0
WEIGHT_HOLE_MM = 2.5
CLAMP_HOLE_MM = 3.4
CLAMP_INSET_MM = 6.0  # of a clamp hole from the side of the block
BEYOND_LEAF_MM = 0.5 * PAD_MM  # from the end of a leaf to the middle of the weight's hole
FARTHEST_SAG = 0.09
"""Of the length to the weight: farther down a leaf is more than 1 % stiffer than by the law of small deflections."""


def modulus_factor(flexure: Flexure) -> float:
    """Return C [1/mm] in E = C F / d: a weight F [N] at the hole moves it by d [mm] when the block is clamped.

    Euler-Bernoulli cantilever, C = integral of 12 (a - s)^2 / (w t(s)^3) ds over the leaf with its fillets. a is from
    the block to the hole. S. Timoshenko, Strength of Materials I, 1930, art. 34. The pad is taken rigid.
    """
    r = flexure.fillet
    length = flexure.length
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    factor = 0.0
    for start, end in ((0.0, r), (r, length - r), (length - r, length)):
        s = 0.5 * (end - start) * nodes + 0.5 * (end + start)  # from the block
        into_fillet = np.maximum(r - np.minimum(s, length - s), 0.0)
        rise = r - np.sqrt(np.maximum(r**2 - into_fillet**2, 0.0))
        thickness = flexure.thickness + 2.0 * rise  # both sides are rounded
        curvature = 12.0 * (length + BEYOND_LEAF_MM - s) ** 2 / (flexure.depth * thickness**3)
        factor += 0.5 * (end - start) * float(weights @ curvature)
    return factor


def largest_weight(flexure: Flexure, E: float, strain: float) -> float:
    """Return the largest force [N] on a leaf of modulus E [MPa].

    It strains the root to the given strain [1], or lets the hole sink as far as E is read to 1 %.
    """
    to_hole = flexure.length + BEYOND_LEAF_MM
    by_strain = strain * E * flexure.depth * flexure.thickness**2 / (6.0 * to_hole)
    return min(by_strain, FARTHEST_SAG * to_hole * E / modulus_factor(flexure))
