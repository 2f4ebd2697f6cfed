"""Ten housings, drawn as a user would draw them: each differs from the housing of a design in one way.

The plate lies in the xz plane, z points upwards, and y is its depth. `HOUSING.arms` holds the low arm and the high
arm. The levels of an arm are z of its lower and its upper leaf, and its roots are x of the two ends of the leaves, the
smaller one first. The wall of the low arm is on the left.
"""

from collections.abc import Callable
from dataclasses import replace

import cadquery as cq

from benchmarks.flexure import HOUSING
from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part

_REACH = 20.0  # half the length of a box that cuts through the plate [mm]


def _plate(housing: Housing) -> cq.Workplane:
    """Return the solid of a designed housing."""
    return cq.Workplane(housing_part(housing).shape)


def _box(x: tuple[float, float], z: tuple[float, float], y: tuple[float, float]) -> cq.Workplane:
    """Return a box between these limits [mm]."""
    corner = cq.Vector(x[0], y[0], z[0])
    return cq.Workplane(cq.Solid.makeBox(x[1] - x[0], y[1] - y[0], z[1] - z[0], corner))


def _through(x: tuple[float, float], z: tuple[float, float]) -> cq.Workplane:
    """Return a box between these limits [mm] that cuts through the whole depth of the plate."""
    return _box(x, z, (-_REACH, _REACH))


def _strip(path: cq.Workplane, thickness: float) -> cq.Workplane:
    """Return a leaf of this `thickness` [mm] along an open path in the xz plane, as deep as the plate."""
    centre_line = path.wire().val()
    outline = centre_line.offset2D(0.5 * thickness)[0]
    face = cq.Face.makeFromWires(outline)
    depth = HOUSING.depth
    solid = cq.Solid.extrudeLinear(face, cq.Vector(0.0, depth, 0.0))
    shift_to_plate = -0.5 * depth - solid.BoundingBox().ymin
    return cq.Workplane(solid.translate(cq.Vector(0.0, shift_to_plate, 0.0)))


def _plane() -> cq.Workplane:
    """Return the workplane on the back of the plate, from which sketches are extruded towards its front.

    Its coordinates are x and z [mm].
    """
    return cq.Workplane("XZ", origin=(0.0, 0.5 * HOUSING.depth, 0.0))


def _without_low_leaves(level: float | None = None) -> cq.Workplane:
    """Return the plate without its low leaves and their fillets, or without only the leaf at `level` [mm]."""
    low = HOUSING.arms[0]
    plate = _plate(HOUSING)
    half_height = 0.5 * low.flexure.thickness + low.flexure.fillet
    for z in low.levels if level is None else (level,):
        plate = plate.cut(_through(low.roots, (z - half_height, z + half_height)))
    return plate


def ribs() -> cq.Workplane:
    """Return the housing with ribs on the front of its top bar and its shuttles."""
    front = -0.5 * HOUSING.depth
    bar = _box((HOUSING.left + 12.0, HOUSING.right - 12.0), (26.5, 28.5), (front - 1.5, front + 1.0))
    plate = _plate(HOUSING).union(bar)
    for arm in HOUSING.arms:
        plate = plate.union(_box((arm.centre - 1.0, arm.centre + 1.0), (9.0, 20.0), (front - 1.5, front + 1.0)))
    return plate


def folded_leaf() -> cq.Workplane:
    """Return the housing with its upper low leaf folded on its way to the wall, like the letter S.

    The leaf is 1 mm thick. It runs in three passes, 2 mm apart: from the shuttle towards the wall, back, and to the
    wall. The ends of the leaf are 1 mm inside the shuttle and the wall.
    """
    low = HOUSING.arms[0]
    level = low.levels[1]
    wall, shuttle = low.roots
    turn = wall + 6.0  # x of the first turn [mm]
    path = _plane().moveTo(shuttle + 1.0, level).lineTo(turn + 1.0, level)
    path = path.threePointArc((turn, level - 1.0), (turn + 1.0, level - 2.0))
    path = path.lineTo(shuttle - 5.0, level - 2.0)
    path = path.threePointArc((shuttle - 4.0, level - 3.0), (shuttle - 5.0, level - 4.0))
    path = path.lineTo(wall - 1.0, level - 4.0)
    return _without_low_leaves(level).union(_strip(path, 1.0))


def cut_leaf() -> cq.Workplane:
    """Return the housing with its upper low leaf cut in two by a gap of 1 mm in its middle."""
    low = HOUSING.arms[0]
    middle = 0.5 * sum(low.roots)
    level = low.levels[1]
    return _plate(HOUSING).cut(_through((middle - 0.5, middle + 0.5), (level - 1.0, level + 1.0)))


def thinner_leaf() -> cq.Workplane:
    """Return the housing with its lower high leaf 0.2 mm thinner between its fillets."""
    high = HOUSING.arms[1]
    start, end = high.roots
    top = high.levels[0] + 0.5 * high.flexure.thickness  # upper side of the lower leaf
    return _plate(HOUSING).cut(_through((start + 0.5, end - 0.5), (top - 0.2, top + 0.5)))


def thick_fillets() -> cq.Workplane:
    """Return the housing with fillets of 1 mm."""
    low, high = (replace(arm.flexure, fillet=1.0) for arm in HOUSING.arms)
    return _plate(replace(HOUSING, low=low, high=high))


def another_frame() -> cq.Workplane:
    """Return the housing with an arch over its bar and a window in its left wall."""
    arch = _plane().moveTo(HOUSING.left, HOUSING.top_level - 1.0)
    middle = (0.5 * (HOUSING.left + HOUSING.right), HOUSING.top_level + 8.0)
    arch = arch.threePointArc(middle, (HOUSING.right, HOUSING.top_level - 1.0)).close().extrude(HOUSING.depth)
    wall = HOUSING.arms[0].wall
    window = _plane().center(wall - 4.0, 15.0).ellipse(1.5, 4.0).extrude(HOUSING.depth)
    return _plate(HOUSING).union(arch).cut(window)


def three_leaves() -> cq.Workplane:
    """Return the housing with a third low leaf between the two others."""
    low = HOUSING.arms[0]
    start, end = low.roots
    level = 0.5 * sum(low.levels)
    half_depth = 0.5 * HOUSING.depth
    third_leaf = _box((start - 0.5, end + 0.5), (level - 0.4, level + 0.4), (-half_depth, half_depth))
    return _plate(HOUSING).union(third_leaf)


def notch() -> cq.Workplane:
    """Return the housing with a round notch in the upper side of its lower low leaf."""
    low = HOUSING.arms[0]
    top = low.levels[0] + 0.5 * low.flexure.thickness  # upper side of the lower leaf
    x = low.roots[0] + 6.0
    return _plate(HOUSING).cut(_plane().center(x, top + 0.1).circle(0.4).extrude(HOUSING.depth))


def curved_leaf() -> cq.Workplane:
    """Return the housing with its lower low leaf bowed by 2 mm."""
    low = HOUSING.arms[0]
    level = low.levels[0]
    wall, shuttle = low.roots
    path = _plane().moveTo(wall - 0.8, level)
    path = path.threePointArc((0.5 * (wall + shuttle), level + 2.0), (shuttle + 0.8, level))
    return _without_low_leaves(level).union(_strip(path, 0.8))


def hinge() -> cq.Workplane:
    """Return the housing with high leaves of 3 mm, each with a hinge at either end.

    A hinge is the thin part of the leaf between two round cuts, one above and one below its mid-plane. It is 0.6 mm
    thick, because the cuts have a radius of 1.4 mm, and their centres are 1.7 mm from the mid-plane.
    """
    high = HOUSING.arms[1]
    start, end = high.roots
    plate = _plate(HOUSING)
    half_depth = 0.5 * HOUSING.depth
    for level in high.levels:
        thick_leaf = _box((start - 0.5, end + 0.5), (level - 1.5, level + 1.5), (-half_depth, half_depth))
        plate = plate.union(thick_leaf)
        for x in (start + 2.0, end - 2.0):  # the positions of the hinges
            for side in (-1.0, 1.0):  # below and above the mid-plane
                round_cut = _plane().center(x, level + side * 1.7).circle(1.4).extrude(HOUSING.depth)
                plate = plate.cut(round_cut)
    return plate


OWN_HOUSINGS: dict[str, Callable[[], cq.Workplane]] = {
    "ribs": ribs,
    "folded leaf": folded_leaf,
    "cut leaf": cut_leaf,
    "thinner leaf": thinner_leaf,
    "thick fillets": thick_fillets,
    "another frame": another_frame,
    "three leaves": three_leaves,
    "notch": notch,
    "curved leaf": curved_leaf,
    "hinge": hinge,
}
