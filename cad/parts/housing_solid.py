"""The solid of a housing with its named faces, whole and as the half y >= 0 for meshes that are made from it.

A dome on a tip is left out of what is solved, whose tips are flat: as a bar it adds less than 5e-4 to 1 / K_h
(tests/cad/parts/test_domes.py).
"""

from __future__ import annotations

import cadquery as cq

from cad.parts.housing import Arm, Housing, fillet_corners, profile
from cad.parts.part import (
    NEAR_MM,
    FaceTest,
    Part,
    is_hole,
    named_part,
    on_plane,
    upright_edges,
)

BALL_SHARE = 0.98  # of the radius, to which the cap of a whole half ball reaches: its poles lie beyond
_BESIDE_TIP = 0.1  # [mm] that a cut reaches beyond a tip


def _plate(housing: Housing) -> cq.Shape:
    """Return the plate before its tips are narrowed: the profile extruded over the whole depth."""
    back = cq.Workplane("XZ", origin=(0.0, 0.5 * housing.depth, 0.0))
    plate = back.polyline(profile(housing)).close().extrude(housing.depth)
    for arm in housing.arms:
        (x0, x1), half = arm.roots, 0.5 * arm.flexure.thickness
        z0, z1 = arm.levels[0] + half, arm.levels[1] - half
        window = back.center(0.5 * (x0 + x1), 0.5 * (z0 + z1)).rect(x1 - x0, z1 - z0)
        plate = plate.cut(window.extrude(housing.depth))
    drill = back.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter)
    solid = plate.cut(drill.extrude(housing.depth)).findSolid()
    corners = fillet_corners(housing)
    edges = list(upright_edges(solid, corners))
    if len(edges) != len(corners):
        msg = f"housing: {len(edges)} leaf-root edges found, must be {len(corners)}; check the levels of the housing"
        raise ValueError(msg)
    rounded: cq.Shape = solid.fillet(housing.low.fillet, edges)
    return rounded


def _beside_tips(housing: Housing) -> cq.Workplane | None:
    """Return what the 45 degree taper of the necks takes from the plate, or None where the tip is as deep as it."""
    deep, tip = 0.5 * housing.depth, 0.5 * housing.tip_side
    if deep - tip < NEAR_MM:
        return None
    away = deep + 1.0
    taper = [(tip, housing.tip_height), (deep, housing.neck_level)]
    section = [(tip, -1.0), *taper, (away, housing.neck_level), (away, -1.0)]
    reach = 0.5 * (housing.spacing + housing.shuttle_width) + 0.25 * housing.low.fillet
    wedge = cq.Workplane("YZ", origin=(-reach, 0.0, 0.0)).polyline(section).close().extrude(2.0 * reach)
    return wedge.union(wedge.mirror("XZ"))


def housing_part(housing: Housing) -> Part:
    """Return the housing as one solid with its faces `low_tip`, `high_tip`, `mounting_holes` and `side_faces`."""
    plate = cq.Workplane(obj=_plate(housing))
    wedges = _beside_tips(housing)
    shape = (plate.cut(wedges) if wedges is not None else plate).findSolid()
    return named_housing(shape.Solids()[0] if len(shape.Solids()) == 1 else shape, housing)


def domed(part: Part, housing: Housing) -> Part:
    """Return the housing with its tips cut to caps of the dome's radius, their apexes at z = 0; as it is without domes.

    A tip stays square above its cap, for a round one would hang over in print: the round face lies inside the square.
    """
    if not housing.dome_radius:
        return part
    cap = min(BALL_SHARE * housing.dome_radius, housing.tip_height)
    wide, deep = housing.tip_side + 2.0 * _BESIDE_TIP, housing.depth + 2.0 * _BESIDE_TIP
    shape = part.shape
    for arm in housing.arms:
        corner = cq.Vector(arm.centre - 0.5 * wide, -0.5 * deep, -_BESIDE_TIP)
        around = cq.Solid.makeBox(wide, deep, cap + _BESIDE_TIP, corner)
        middle, along = cq.Vector(arm.centre, 0.0, housing.dome_radius), cq.Vector(1.0, 0.0, 0.0)
        shape = shape.cut(around.cut(cq.Solid.makeSphere(housing.dome_radius, middle, along, -90.0, 90.0, 360.0)))
    return named_housing(shape.Solids()[0] if len(shape.Solids()) == 1 else shape, housing)


def named_housing(shape: cq.Shape, housing: Housing) -> Part:
    """Return a solid of the housing, perhaps read from a file, with its faces found again by their place.

    Raises ValueError when a name matches no face.
    """
    return named_part("housing", shape, _outer_tests(housing))


def housing_half(housing: Housing) -> Part:
    """Return the half y >= 0 [mm] with the faces of the whole, the plane symmetry, and low_leaves and high_leaves.

    Leaves are the flat faces of the straight parts, whose outline is where the strain is largest.
    """
    width, height = housing.right - housing.left + 2.0, housing.top_level + 2.0
    box = cq.Solid.makeBox(width, housing.depth, height, cq.Vector(housing.left - 1.0, 0.0, -1.0))
    half = housing_part(housing).shape.intersect(box)
    faces: dict[str, FaceTest] = {
        **_outer_tests(housing),
        "symmetry": on_plane(1, 0.0),
        **{f"{arm.name}_leaves": _leaf_test(arm) for arm in housing.arms},
    }
    return named_part("housing half", half.Solids()[0], faces)


def _outer_tests(housing: Housing) -> dict[str, FaceTest]:
    """Return by face name the test that picks tips, holes, and the two faces that covers or washers press on."""
    sides = [on_plane(1, side * housing.depth) for side in (-0.5, 0.5)]
    return {
        **_tip_tests(housing),
        "mounting_holes": lambda face: is_hole(face, housing.hole_diameter),
        "side_faces": lambda face: any(on_side(face) for on_side in sides),
    }


def _tip_tests(housing: Housing) -> dict[str, FaceTest]:
    """Return by face name the test that picks the flat face or the cap of each tip."""
    on_level = on_plane(2, 0.0)

    def beside(sign: float) -> FaceTest:
        return lambda face: (on_level(face) or face.geomType() == "SPHERE") and sign * face.Center().x > 0.0

    return {f"{arm.name}_tip": beside(arm.sign) for arm in housing.arms}


def _leaf_test(arm: Arm) -> FaceTest:
    half = 0.5 * arm.flexure.thickness
    surfaces = [on_plane(2, level + side) for level in arm.levels for side in (-half, half)]
    start, end = arm.roots
    return lambda face: start < face.Center().x < end and any(on_surface(face) for on_surface in surfaces)
