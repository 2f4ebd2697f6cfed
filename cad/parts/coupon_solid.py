"""The solid of a coupon in the axes of the housing. The centre of the clamped block is at x = 0 and z = 0."""

import itertools

import cadquery as cq

from cad.parts.coupon import (
    BEYOND_LEAF_MM,
    BLOCK_HEIGHT_MM,
    BLOCK_WIDTH_MM,
    CLAMP_HOLE_MM,
    CLAMP_INSET_MM,
    PAD_MM,
    WEIGHT_HOLE_MM,
)
from cad.parts.housing import Arm, Housing, Point
from cad.parts.part import FaceTest, Part, fillet_edges_along_y, is_hole, named_part


def coupon_part(housing: Housing) -> Part:
    """Return the coupon of a housing as one solid with the faces clamp_holes, low_weight and high_weight.

    The block in the middle carries a leaf on each side, with the dimensions of the leaves of the arm on that side. A
    pad at the end of each leaf has a hole for a weight. Both ends of a leaf have the fillets of the housing.
    """
    depth = housing.depth
    # The normal of the workplane "XZ" is -y, so all outlines and holes are extruded from the back to the front.
    back_plane = cq.Workplane("XZ", origin=(0.0, 0.5 * depth, 0.0))
    body = back_plane.rect(BLOCK_WIDTH_MM, BLOCK_HEIGHT_MM).extrude(depth)
    weight_holes = []  # centres (x, z)
    leaf_corners: list[Point] = []  # (x, z) of the edges along y that get fillets
    for arm in housing.arms:
        root, end = _leaf_ends(arm)
        hole_x = end + arm.sign * BEYOND_LEAF_MM
        middle = 0.5 * (root + end)
        leaf = back_plane.center(middle, 0.0).rect(arm.flexure.length, arm.flexure.thickness).extrude(depth)
        pad = back_plane.center(hole_x, 0.0).rect(PAD_MM, PAD_MM).extrude(depth)
        body = body.union(leaf).union(pad)
        weight_holes.append((hole_x, 0.0))
        half_thickness = 0.5 * arm.flexure.thickness
        leaf_corners += itertools.product((root, end), (-half_thickness, half_thickness))

    clamp_x = 0.5 * BLOCK_WIDTH_MM - CLAMP_INSET_MM
    clamp_holes = [(-clamp_x, 0.0), (clamp_x, 0.0)]
    body = body.cut(back_plane.pushPoints(clamp_holes).circle(0.5 * CLAMP_HOLE_MM).extrude(depth))
    body = body.cut(back_plane.pushPoints(weight_holes).circle(0.5 * WEIGHT_HOLE_MM).extrude(depth))
    body = fillet_edges_along_y(body, leaf_corners, housing.corner)
    faces: dict[str, FaceTest] = {"clamp_holes": lambda face: is_hole(face, CLAMP_HOLE_MM)}
    for arm in housing.arms:
        faces[f"{arm.name}_weight"] = _weight_test(arm)
    return named_part("coupon", body.findSolid(), faces)


def _leaf_ends(arm: Arm) -> tuple[float, float]:
    """Return the x coordinates at which the leaf of an arm leaves the block, and at which it reaches its pad [mm]."""
    half_block = 0.5 * BLOCK_WIDTH_MM
    return arm.sign * half_block, arm.sign * (half_block + arm.flexure.length)


def _weight_test(arm: Arm) -> FaceTest:
    """Return a test that accepts the weight hole of an arm, on its side of the plane x = 0."""
    return lambda face: is_hole(face, WEIGHT_HOLE_MM) and arm.sign * face.Center().x > 0.0
