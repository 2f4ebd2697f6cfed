"""The layout rules: every dimension of the housing [mm] from a design and its springs."""

import math
from typing import NamedTuple

from cad.parts.cover import cover_level
from cad.parts.housing import DOWEL_MM, TILT_DEG, BackToBack, DomeCap, Housing, Pin
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.tip_mount import pad_height, plate_depth, tip_mount
from sensor.design.tips import Tips
from sensor.theory.leaf_spring import Flexure

LEDGE = 1.0  # straight wall between a fillet and the next corner; also the longest tip that prints without support
CLEARANCE = 0.5  # clearance of the frame above the fruit in the worst press
STOP_MARGIN = 1.5  # ratio of the gap at a stop to the deflection at full travel
POCKET_SIDES = 3.0  # ratio of the depth of the pocket for a pin to the side of the pin
BESIDE_BALL = 0.2  # difference between the width of a tip and the diameter of its hemisphere
_LEAST_PROTRUSION = 0.1  # smallest height of printed tips or feet below the frame
_BEYOND_LEAVES = 20.0  # upper bound for the length of shuttle and wall beside the leaf of an arm
_TRAVELS_OF_TIP = 1.5  # smallest ratio of the length of a tip to the travel, so that no other part touches the fruit


def housing_for(
    design: Design,
    process: Process,
    lengths: tuple[float, ...],
    deflections: tuple[float, ...],
) -> Housing:
    """Return the housing of a design for leaf lengths and deflections at full travel [mm], each for low and then high.

    The tips protrude from the frame so far that the frame clears the fruit at full travel and 3 degrees of tilt. Levels
    are stacked from the tips upwards: neck, lower leaf, upper leaf, cavity, bar. The stops are above the deflections.
    Raises InputError if a leaf is too short for its fillets.
    """
    tips = design.tips
    layout = tips.tip_layout
    depth = plate_depth(design, process)
    separation = layout.leaf_separation_mm
    low, high = (
        Flexure(thickness=thickness, length=length, depth=depth, separation=separation, fillet=process.fillet_mm)
        for thickness, length in zip(process.leaf_thicknesses_mm, lengths, strict=True)
    )

    end = _shuttle_end(design, process, depth)
    shuttle_width = max(end.side, min(layout.shuttle_width_mm, tips.spacing_mm - process.min_gap_mm))
    neck_level = end.height + _neck_height(depth, shuttle_width, end.side)
    protrusion = max(_tip_protrusion(design, lengths, depth) - end.beyond_face, _LEAST_PROTRUSION)

    # A fillet and a straight ledge separate a leaf from the next corner.
    half_leaf = 0.5 * max(low.thickness, high.thickness) + process.fillet_mm
    lower_leaf_level = max(neck_level, protrusion) + LEDGE + half_leaf
    low_stop, high_stop = (round(max(process.min_gap_mm, STOP_MARGIN * deflection), 2) for deflection in deflections)
    cavity_level = lower_leaf_level + separation + half_leaf + LEDGE + max(low_stop, high_stop)
    pin = _pin(tips, end, neck_level - process.min_wall_mm)
    dome = DomeCap(radius=tips.dome_radius_mm) if pin is None and tips.dome_radius_mm is not None else None
    return Housing(
        low=low,
        high=high,
        tip_side=end.side,
        tip_height=end.height,
        spacing=tips.spacing_mm,
        shuttle_width=shuttle_width,
        neck_level=neck_level,
        lower_leaf_level=lower_leaf_level,
        low_top_level=cavity_level - low_stop,
        high_top_level=cavity_level - high_stop,
        cavity_level=cavity_level,
        top_level=cavity_level + layout.top_bar_mm,
        protrusion=protrusion,
        mount=design.print.mount,
        cover_level=cover_level(protrusion, design.press),
        pin=pin,
        dome=dome,
        back_to_back=_back_to_back(process) if layout.is_back_to_back else None,
    )


def _back_to_back(process: Process) -> BackToBack:
    """Return the pads and dowel holes of a plate of a square.

    The holes are smaller than the dowels by the accuracy of the process, so that dowels are never loose.
    """
    return BackToBack(pad_height=pad_height(process), dowel_hole=round(DOWEL_MM - process.accuracy_mm, 3))


class _ShuttleEnd(NamedTuple):
    """The printed end of a shuttle [mm]: a tip, or a foot with the pocket for a pin.

    `beyond_face` is the distance from the printed face down to the face that touches the fruit; 0 for printed tips.
    """

    side: float
    height: float
    beyond_face: float = 0.0
    pocket_side: float | None = None


def _pin(tips: Tips, end: _ShuttleEnd, deepest: float) -> Pin | None:
    """Return the pin at the end of a shuttle, or None for a printed tip.

    `deepest` [mm] is the largest possible depth of its pocket.
    """
    if end.pocket_side is None:
        return None
    return Pin(
        side=tips.side_mm,
        is_round=tips.tip_shape.is_round,
        outside=end.beyond_face,
        pocket_side=end.pocket_side,
        pocket_depth=min(POCKET_SIDES * tips.side_mm, deepest),
    )


def _shuttle_end(design: Design, process: Process, depth: float) -> _ShuttleEnd:
    """Return the end of a shuttle in a plate of this depth [mm].

    A tip or pin protrudes by at least 1.5 travels, so that nothing else of the arm touches the fruit.
    """
    tips = design.tips
    mount = tip_mount(design, process)
    protrusion = max(min(tips.side_mm, LEDGE), _TRAVELS_OF_TIP * design.press.travel_mm)
    if mount.pocket_side is not None:
        outside = max(protrusion, _cap_height(tips, tips.side_mm), tips.tip_shape.height_mm)
        return _ShuttleEnd(side=mount.side, height=LEDGE, beyond_face=outside, pocket_side=mount.pocket_side)
    side = _tip_side(tips, depth)
    height = max(protrusion, _cap_height(tips, side))
    return _ShuttleEnd(side=side, height=height)


def _tip_side(tips: Tips, depth: float) -> float:
    """Return the side of a printed tip [mm], which can exceed the side of the design for two reasons.

    A hemisphere needs a wider tip. In a plate of a square, a tip nearly as deep as the plate gets the whole depth;
    otherwise the small step between them would be printed without support.
    """
    side = tips.side_mm
    if tips.dome_radius_mm and side > 2.0 * tips.dome_radius_mm - BESIDE_BALL:
        side = round(2.0 * tips.dome_radius_mm + BESIDE_BALL, 3)
    return depth if tips.tip_layout.is_back_to_back and 0.0 <= depth - side < LEDGE else side


def _cap_height(tips: Tips, side: float) -> float:
    """Return the height [mm] of the corners of a square tip above the apex of its dome, rounded up to 0.1 mm.

    It is 0 without a dome.
    """
    radius = tips.dome_radius_mm or 0.0
    corner_distance = min(radius, math.sqrt(0.5) * side)
    # The subtrahend keeps a height that is a multiple of 0.1 mm from being rounded up because of round-off.
    return math.ceil(10.0 * (radius - math.sqrt(radius**2 - corner_distance**2)) - 1e-9) / 10.0


def _neck_height(depth: float, shuttle_width: float, tip_side: float) -> float:
    """Return the height of a neck [mm], which tapers from the shuttle to the tip.

    `depth`, `shuttle_width` and `tip_side` are the depth of the plate and the widths of shuttle and tip [mm]. In the
    direction of the depth the neck leans by at most 45 degrees, which is printable. Its height is at least `LEDGE`,
    except where the step in this direction is between half of `LEDGE` and `LEDGE`.
    """
    step = 0.5 * (depth - tip_side)
    return step if 0.5 * LEDGE <= step < LEDGE else max(step, 0.5 * (shuttle_width - tip_side), LEDGE)


def _tip_protrusion(design: Design, lengths: tuple[float, ...], depth: float) -> float:
    """Return the distance by which the tips must protrude below the frame [mm], rounded up to 0.1 mm.

    It is the sum of the full travel, the drop of the frame's edge in a tilt, and a clearance. The edge matters only as
    far out as there is fruit below it.
    """
    fruit = design.fruit
    tips = design.tips
    press = design.press
    frame_length = 0.5 * tips.spacing_mm + max(lengths) + _BEYOND_LEAVES  # measured from the centre
    reach_along = min(0.5 * fruit.length_mm + abs(tips.offset_mm), frame_length)
    frame_width = 0.5 * depth + 0.5 * tips.tip_layout.width * tips.spacing_mm
    reach_across = min(0.5 * fruit.width_mm, frame_width)
    drop = math.tan(math.radians(max(TILT_DEG, abs(press.tilt_deg)))) * max(reach_along, reach_across)
    return math.ceil(10.0 * (press.travel_mm + drop + CLEARANCE)) / 10.0
