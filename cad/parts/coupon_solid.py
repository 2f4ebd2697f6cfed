"""The solid of a coupon, in the frame of the housing with the middle of the clamped block at x = 0, z = 0."""

import cadquery as cq

from cad.parts.coupon import CLAMP_INSET, Coupon
from cad.parts.housing import Arm
from cad.parts.part import FaceTest, Part, is_hole, named_part, round_upright_edges


def coupon_part(coupon: Coupon) -> Part:
    """Return the coupon as one solid with the faces clamp_holes, low_weight and high_weight."""
    depth = coupon.arms[0].flexure.depth
    half_block = 0.5 * coupon.block_width
    back = cq.Workplane("XZ", origin=(0.0, 0.5 * depth, 0.0))
    body = back.rect(coupon.block_width, coupon.block_height).extrude(depth)
    weight_holes = []
    leaf_corners = []
    for arm in coupon.arms:
        root = arm.sign * half_block
        end = arm.sign * (half_block + arm.flexure.length)
        hole = end + arm.sign * coupon.arm_beyond_leaf
        leaf = back.center(0.5 * (root + end), 0.0).rect(arm.flexure.length, arm.flexure.thickness).extrude(depth)
        pad = back.center(hole, 0.0).rect(coupon.pad_side, coupon.pad_side).extrude(depth)
        body = body.union(leaf).union(pad)
        weight_holes.append((hole, 0.0))
        half_thick = 0.5 * arm.flexure.thickness
        leaf_corners += [(root, -half_thick), (root, half_thick), (end, -half_thick), (end, half_thick)]

    clamp_holes = [(CLAMP_INSET - half_block, 0.0), (half_block - CLAMP_INSET, 0.0)]
    body = body.cut(back.pushPoints(clamp_holes).circle(0.5 * coupon.clamp_hole).extrude(depth))
    body = body.cut(back.pushPoints(weight_holes).circle(0.5 * coupon.weight_hole).extrude(depth))
    body = round_upright_edges(body, leaf_corners, coupon.arms[0].flexure.fillet)
    faces: dict[str, FaceTest] = {"clamp_holes": lambda face: is_hole(face, coupon.clamp_hole)}
    for arm in coupon.arms:
        faces[f"{arm.name}_weight"] = _weight_test(coupon, arm)
    return named_part("coupon", body.findSolid(), faces)


def _weight_test(coupon: Coupon, arm: Arm) -> FaceTest:
    return lambda face: is_hole(face, coupon.weight_hole) and arm.sign * face.Center().x > 0.0
