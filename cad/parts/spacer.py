"""The tool that holds both shuttles to the frame while glue sets: two blocks and a rail, printed flat [mm].

A block lies in the window of an arm between wall and shuttle: its length is the free length of the leaves. The rail
lies below the frame. The feet of the walls stand on its ends, the tips on its middle. That is lower by as much as the
tips shall stand out of the frame. All lie flat beside frame and shuttles, on the face that is flat on the print bed.
Their edges there are bevelled, so that no wide first layer of any part keeps them apart.
"""

from __future__ import annotations

import cadquery as cq

from cad.parts.housing import Arm, Housing, Point

OFF_STRIP_MM = 2.0  # of a block from the strips: glue that is squeezed out of a slot does not reach it
HANDLE_MM = 6.0  # of a block out of the plate, to pull it by
BEVEL_MM = 0.6  # higher than two layers of a coarse print
RAIL_MM = 6.0  # of the rail below the tips
RAIL = "rail"
_FOOT_INSET_MM = 1.0  # of the feet of the rail from the inner faces of the walls


def block_name(arm: Arm) -> str:
    """Return the name of the block of an arm."""
    return f"{arm.name} block"


def spacer_parts(housing: Housing) -> dict[str, cq.Shape]:
    """Return by name the parts of the tool where they are used [mm]: a block for each arm, and the rail."""
    parts: dict[str, cq.Shape] = {block_name(arm): _block(housing, arm) for arm in housing.arms}
    return {**parts, RAIL: _rail(housing)}


def block_levels(arm: Arm) -> tuple[float, float]:
    """Return the lower and the upper face z of the block of an arm [mm]."""
    off = 0.5 * arm.flexure.thickness + OFF_STRIP_MM
    return arm.levels[0] + off, arm.levels[1] - off


def _block(housing: Housing, arm: Arm) -> cq.Shape:
    left, right = arm.roots
    foot, top = block_levels(arm)
    return _prism(housing, [(left, foot), (right, foot), (right, top), (left, top)], HANDLE_MM)


def _rail(housing: Housing) -> cq.Shape:
    """Return the rail: a bar over the whole width of the frame, with a foot for each wall at both ends."""
    low, high = housing.arms
    feet = (low.wall - _FOOT_INSET_MM, high.wall + _FOOT_INSET_MM)
    level = housing.protrusion
    outline = [
        *((housing.left, -RAIL_MM), (housing.right, -RAIL_MM), (housing.right, level), (feet[1], level)),
        *((feet[1], 0.0), (feet[0], 0.0), (feet[0], level), (housing.left, level)),
    ]
    return _prism(housing, outline, 0.0)


def _prism(housing: Housing, outline: list[Point], beyond: float) -> cq.Shape:
    """Return the prism of an outline (x, z) over the depth and so far beyond it, bevelled where it lies on the bed.

    The bed is at the back of a single plate, at the front of one whose back has pads.
    """
    sign = 1.0 if housing.back_to_back else -1.0  # of the direction from the bed upwards, along y
    bed = -sign * 0.5 * housing.depth
    plane = cq.Workplane(cq.Plane(origin=(0.0, bed, 0.0), xDir=(1.0, 0.0, 0.0), normal=(0.0, sign, 0.0)))
    points = [(x, -sign * z) for x, z in outline]  # local y is normal x xDir
    prism = plane.polyline(points).close().extrude(housing.depth + beyond)
    return prism.faces("<Y" if sign > 0.0 else ">Y").edges().chamfer(BEVEL_MM).findSolid().Solids()[0]
