"""A test beam (coupon) with leaves like the leaves of the housing, from which the modulus of the print is measured.

The coupon is clamped at a block in its middle, and weights are hung on its leaves. The modulus follows from the sag.
One leaf of each arm protrudes from the block, and ends in a pad with a hole for a weight. The coupon has the axes of
the housing, and its origin is the centre of the clamped block.
"""

import numpy as np

from sensor.theory.leaf_spring import Flexure

_POINTS = 24  # number of Gauss points in each fillet and in the straight part
BLOCK_WIDTH_MM = 24.0  # width of the clamped block
BLOCK_HEIGHT_MM = 12.0  # height of the clamped block
PAD_MM = 7.0  # side of the square pads
WEIGHT_HOLE_MM = 2.5  # diameter of the hole for a weight
CLAMP_HOLE_MM = 3.4  # diameter of the two holes for the clamping screws
CLAMP_INSET_MM = 6.0  # distance of a clamp hole from the side of the block
BEYOND_LEAF_MM = 0.5 * PAD_MM  # distance from the end of a leaf to the centre of its hole
MAX_SAG_RATIO = 0.09
"""Largest ratio of the sag to the distance of the weight [1]. At this sag, a leaf is 1 % stiffer than at small sags."""


def modulus_factor(flexure: Flexure) -> float:
    """Return the factor C [1/mm] that relates the modulus E [MPa] of a coupon to the sag of its leaf under a weight.

    The leaf is an Euler-Bernoulli cantilever with a rigid pad, and its length L includes the fillets:

        E = C F / d
        C = integral of 12 (a - s)^2 / (w t(s)^3) ds from s = 0 to L

    F [N] is the weight at the hole, and d [mm] is the sag of the hole. The distance from the block is s, and a is the
    value of s at the hole [mm]. The leaf has the width w and the thickness t(s) [mm]. See S. Timoshenko, Strength of
    Materials I, 1930, art. 34.
    """
    r = flexure.fillet  # radius of the fillets at both ends of the leaf
    length = flexure.length
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    factor = 0.0
    # The integral is split at the ends of the fillets, where the thickness is not smooth.
    for start, end in ((0.0, r), (r, length - r), (length - r, length)):
        s = 0.5 * (end - start) * nodes + 0.5 * (end + start)  # maps the nodes from -1..1 to start..end
        # Distance from the straight part of the leaf to s. It is 0 within the straight part.
        distance_into_fillet = np.maximum(r - np.minimum(s, length - s), 0.0)
        # Height of the circular fillet above the face of the straight leaf. Both faces have fillets.
        fillet_height = r - np.sqrt(np.maximum(r**2 - distance_into_fillet**2, 0.0))
        thickness = flexure.thickness + 2.0 * fillet_height
        integrand = 12.0 * (length + BEYOND_LEAF_MM - s) ** 2 / (flexure.depth * thickness**3)
        factor += 0.5 * (end - start) * float(weights @ integrand)
    return factor


def largest_weight(flexure: Flexure, E: float, strain: float) -> float:
    """Return the largest weight [N] that may hang on a leaf of modulus E [MPa].

    A weight F at the distance a causes the strain 6 F a / (E w t^2) at the root. This strain may be at most `strain`
    [1], and the sag must be small enough for small-deflection theory.
    """
    hole_distance = flexure.length + BEYOND_LEAF_MM
    weight_at_strain = strain * E * flexure.depth * flexure.thickness**2 / (6.0 * hole_distance)
    weight_at_sag = MAX_SAG_RATIO * hole_distance * E / modulus_factor(flexure)
    return min(weight_at_strain, weight_at_sag)
