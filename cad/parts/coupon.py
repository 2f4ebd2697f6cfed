"""A small beam with the housing's leaves, clamped in the middle and loaded at its ends: its sag measures E as printed.

Coupon frame: that of the housing, with the middle of the clamped block at x = 0, z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cad.kernel import cq
from cad.parts.housing import Arm, Housing, Point
from cad.parts.part import FaceTest, Part, is_hole, named_part, upright_edges
from cad.theory.leaf_spring import Flexure

_POINTS = 24  # of Gauss, in each fillet and in the straight part
CLAMP_INSET = 6.0  # of a clamp hole from the side of the block


@dataclass(frozen=True, kw_only=True)
class Coupon:
    """A leaf of every arm of a housing out of one block [mm], each with a pad and a hole for a weight."""

    arms: tuple[Arm, ...]
    block_width: float = 24.0
    block_height: float = 12.0
    pad_side: float = 7.0
    weight_hole: float = 2.5
    clamp_hole: float = 3.4

    @property
    def arm_beyond_leaf(self) -> float:
        """Return the distance from the end of a leaf to the middle of the weight's hole [mm]."""
        return 0.5 * self.pad_side


def coupon_of(housing: Housing) -> Coupon:
    """Return the coupon whose leaves have the thickness, length, depth and fillets of the housing's."""
    return Coupon(arms=housing.arms)


def modulus_factor(flexure: Flexure, beyond: float) -> float:
    """Return C [1/mm] in E = C F / d: a weight F [N] at the hole moves it by d [mm] when the block is clamped.

    Euler-Bernoulli cantilever, C = integral of 12 (a - s)^2 / (w t(s)^3) ds over the leaf with its fillets,
    a = length + beyond; S. Timoshenko, Strength of Materials I, 1930, art. 34. The pad is taken rigid.
    """
    r, length = flexure.fillet, flexure.length
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    factor = 0.0
    for start, end in ((0.0, r), (r, length - r), (length - r, length)):
        s = 0.5 * (end - start) * nodes + 0.5 * (end + start)
        into_fillet = np.maximum(r - np.minimum(s, length - s), 0.0)
        rise = r - np.sqrt(np.maximum(r**2 - into_fillet**2, 0.0))
        thickness = flexure.thickness + 2.0 * rise
        curvature = 12.0 * (length + beyond - s) ** 2 / (flexure.depth * thickness**3)
        factor += 0.5 * (end - start) * float(weights @ curvature)
    return factor


def largest_weight(flexure: Flexure, beyond: float, E: float, strain: float) -> float:
    """Return the force [N] that strains the root of a leaf of modulus E [MPa] to the given strain [1]."""
    return strain * E * flexure.depth * flexure.thickness**2 / (6.0 * (flexure.length + beyond))


def coupon_part(coupon: Coupon) -> Part:
    """Return the coupon as one solid with the faces clamp_holes, low_weight and high_weight."""
    flexure, half = coupon.arms[0].flexure, 0.5 * coupon.block_width
    back = cq.Workplane("XZ", origin=(0.0, 0.5 * flexure.depth, 0.0))
    body = back.rect(coupon.block_width, coupon.block_height).extrude(flexure.depth)
    roots: list[Point] = []
    for arm in coupon.arms:
        body = body.union(_leaf(coupon, arm, back)).union(_pad(coupon, arm, back))
        ends = (arm.sign * half, arm.sign * (half + arm.flexure.length))
        roots += [(x, side * 0.5 * arm.flexure.thickness) for x in ends for side in (-1.0, 1.0)]
    for diameter, places in (
        (coupon.clamp_hole, [CLAMP_INSET - half, half - CLAMP_INSET]),
        (coupon.weight_hole, [_weight_place(coupon, arm) for arm in coupon.arms]),
    ):
        drill = back.pushPoints([(x, 0.0) for x in places]).circle(0.5 * diameter)
        body = body.cut(drill.extrude(flexure.depth))
    solid = body.findSolid()
    rounded = solid.fillet(flexure.fillet, list(upright_edges(solid, roots))).Solids()[0]
    weights = {f"{arm.name}_weight": _weight_test(coupon, arm) for arm in coupon.arms}
    return named_part("coupon", rounded, {"clamp_holes": lambda face: is_hole(face, coupon.clamp_hole), **weights})


def _weight_place(coupon: Coupon, arm: Arm) -> float:
    """Return x of the hole for a weight [mm]."""
    return arm.sign * (0.5 * coupon.block_width + arm.flexure.length) + arm.sign * coupon.arm_beyond_leaf


def _leaf(coupon: Coupon, arm: Arm, back: cq.Workplane) -> cq.Workplane:
    flexure, half = arm.flexure, 0.5 * coupon.block_width
    middle = 0.5 * (arm.sign * half + arm.sign * (half + flexure.length))
    return back.center(middle, 0.0).rect(flexure.length, flexure.thickness).extrude(flexure.depth)


def _pad(coupon: Coupon, arm: Arm, back: cq.Workplane) -> cq.Workplane:
    square = back.center(_weight_place(coupon, arm), 0.0).rect(coupon.pad_side, coupon.pad_side)
    return square.extrude(arm.flexure.depth)


def _weight_test(coupon: Coupon, arm: Arm) -> FaceTest:
    return lambda face: is_hole(face, coupon.weight_hole) and arm.sign * face.Center().x > 0.0
