"""The solid of a housing with its named faces.

The solid for the stiffness analysis has flat tips. Domes would change the compliance 1 / K_h of the high spring by a
relative amount of less than 5e-4 (tests/cad/parts/test_domes.py).
"""

from __future__ import annotations

import functools
import itertools

import cadquery as cq

from cad.parts.hall_seats import POINT_MM, HallSeats
from cad.parts.housing import Arm, Housing, fillet_corners, profile
from cad.parts.part import NEAR_MM, FaceTest, Part, fillet_edges_along_y, is_hole, named_part, plane_face_test

# Largest ratio of the height of a cap to its radius, so that the poles of the ball are not on the cap.
_MAX_CAP_HEIGHT_RATIO = 0.98
_MARGIN = 1.0  # extension of a cut beyond the plate [mm]
_BESIDE_TIP = 0.1  # extension of a cut beyond a tip or a face [mm]
_BESIDE_SHUTTLE = 0.25  # extension of a cut beyond a shuttle, as a fraction of the radius of the inner corners


@functools.lru_cache(maxsize=1)  # a run first needs the size of the part, and later the same part for the files
def housing_part(housing: Housing) -> Part:
    """Return the housing as one solid with the faces `low_tip`, `high_tip`, `mounting_holes` and `side_faces`.

    Its tips are flat, and it has no pockets for pins or magnets and no pads.
    """
    back_plane = cq.Workplane("XZ", origin=(0.0, 0.5 * housing.depth, 0.0))
    # The normal of the workplane "XZ" is -y, so the plate is extruded from its back to its front.
    plate = back_plane.polyline(profile(housing)).close().extrude(housing.depth)

    # A window between the two leaves of each spring is cut out of the plate.
    for arm in housing.arms:
        left, right = arm.roots
        lower_leaf, upper_leaf = arm.levels  # z of the mid-planes
        window_height = upper_leaf - lower_leaf - arm.flexure.thickness
        window = back_plane.center(0.5 * (left + right), 0.5 * (lower_leaf + upper_leaf))
        plate = plate.cut(window.rect(right - left, window_height).extrude(housing.depth))

    screw_holes = back_plane.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter).extrude(housing.depth)
    plate = plate.cut(screw_holes)
    plate = fillet_edges_along_y(plate, fillet_corners(housing), housing.corner)

    is_tip_shallower = housing.depth - housing.tip_side > 2.0 * NEAR_MM
    if is_tip_shallower:  # otherwise the tips are as deep as the plate, and the necks do not taper in this direction
        plate = plate.cut(_neck_cut(housing))
    return named_housing(plate.findSolid(), housing)


def _neck_cut(housing: Housing) -> cq.Workplane:
    """Return the solid that is cut from the plate, so that both necks taper in the direction of the depth [mm].

    The solid consists of two wedges, one on the front and one on the back, which extend along x over both shuttles. The
    wedges end a little beyond the shuttles, because a cut along the sides of the shuttles could leave a thin layer.
    """
    half_depth = 0.5 * housing.depth
    half_tip = 0.5 * housing.tip_side
    outer_y = half_depth + _MARGIN
    # The wedge at the back in y and z. Its inner side follows the tip up to the shoulder, and then the tapered neck.
    shoulder = (half_tip, housing.tip_height)
    neck_end = (half_depth, housing.neck_level)
    section = [(half_tip, -_MARGIN), shoulder, neck_end, (outer_y, housing.neck_level), (outer_y, -_MARGIN)]
    half_length = 0.5 * (housing.spacing + housing.shuttle_width) + _BESIDE_SHUTTLE * housing.corner
    wedge = cq.Workplane("YZ", origin=(-half_length, 0.0, 0.0)).polyline(section).close().extrude(2.0 * half_length)
    return wedge.union(wedge.mirror("XZ"))


def cut_domes(part: Part, housing: Housing) -> Part:
    """Cut the tips of a housing to spherical caps with their apexes at z = 0. A housing without domes is not changed.

    A tip remains square above its cap, because a round tip would overhang in print. A box around the end of the tip,
    minus the ball of the dome, is cut away. The named faces are found again on the cut solid.
    """
    if housing.dome is None:
        return part
    radius = housing.dome.radius
    # The box extends beyond the tip on all sides and below it. It ends at the end of the straight part of the tip, or
    # slightly below the equator of the ball if this is lower.
    width = housing.tip_side + 2.0 * _BESIDE_TIP
    depth = housing.depth + 2.0 * _BESIDE_TIP
    height = min(_MAX_CAP_HEIGHT_RATIO * radius, housing.tip_height) + _BESIDE_TIP
    poles_along_x = cq.Vector(1.0, 0.0, 0.0)  # with the poles on the x axis, they are not on the cap
    shape = part.shape
    for arm in housing.arms:
        tip_box = cq.Solid.makeBox(
            width, depth, height, cq.Vector(arm.centre - 0.5 * width, -0.5 * depth, -_BESIDE_TIP)
        )
        centre = cq.Vector(arm.centre, 0.0, radius)
        ball = cq.Solid.makeSphere(radius, centre, poles_along_x, -90.0, 90.0, 360.0)
        shape = shape.cut(tip_box.cut(ball))
    return named_housing(shape, housing)


def cut_magnet_pockets(part: Part, housing: Housing, seats: HallSeats | None) -> Part:
    """Cut magnet pockets into the fronts of the shuttles. Without a Hall read-out, the housing is not changed.

    The pockets are where the bending moment in a shuttle changes sign, so the stiffness analysis can neglect them. The
    named faces are found again on the cut solid.
    """
    if seats is None:
        return part
    radius = 0.5 * seats.pocket_diameter
    inward_axis = cq.Vector(0.0, 1.0, 0.0)  # from the front into the shuttle
    front = -0.5 * housing.depth
    shape = part.shape
    for arm, depth_below_top in itertools.product(housing.arms, seats.disc_levels):
        level = housing.top_level - depth_below_top
        pocket_start = cq.Vector(arm.centre, front - _BESIDE_TIP, level)
        shape = shape.cut(cq.Solid.makeCylinder(radius, _BESIDE_TIP + seats.pocket_depth, pocket_start, inward_axis))
        if seats.is_pointed:
            # The pocket ends in a cone of 45 degrees, which prints without support.
            floor = cq.Vector(arm.centre, front + seats.pocket_depth, level)
            shape = shape.cut(cq.Solid.makeCone(radius, POINT_MM, radius - POINT_MM, floor, inward_axis))
    return named_housing(shape, housing)


def named_housing(shape: cq.Shape, housing: Housing) -> Part:
    """Identify the named faces of a housing by their geometry, and return it as a part.

    The faces are `low_tip`, `high_tip`, `mounting_holes`, and `side_faces`, which covers or washers clamp. Because they
    are found by their geometry, the solid may have been cut, or read from a file. Raises ValueError if a name matches
    no face.
    """
    is_on_front = plane_face_test(1, -0.5 * housing.depth)  # in the plane y = -depth / 2
    is_on_back = plane_face_test(1, 0.5 * housing.depth)
    faces: dict[str, FaceTest] = {f"{arm.name}_tip": _tip_test(arm) for arm in housing.arms}
    faces["mounting_holes"] = lambda face: is_hole(face, housing.hole_diameter)
    faces["side_faces"] = lambda face: is_on_front(face) or is_on_back(face)
    return named_part("housing", shape, faces)


def _tip_test(arm: Arm) -> FaceTest:
    """Return a test that accepts the flat tip or the dome of an arm, on its side of the plane x = 0."""
    is_flat_tip = plane_face_test(2, 0.0)  # in the plane z = 0

    def is_tip(face: cq.Face) -> bool:
        """Return whether a face is the flat tip or the dome of this arm."""
        is_flat_or_dome = is_flat_tip(face) or face.geomType() == "SPHERE"
        return is_flat_or_dome and arm.sign * face.Center().x > 0.0

    return is_tip
