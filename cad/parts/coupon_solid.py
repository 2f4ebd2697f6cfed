"""The solid of a coupon, in the frame of the housing with the middle of the clamped block at x = 0, z = 0."""

import cadquery as cq

from cad.parts.coupon import CLAMP_INSET, Coupon
from cad.parts.housing import Arm, Point
from cad.parts.part import FaceTest, Part, is_hole, named_part, upright_edges


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
