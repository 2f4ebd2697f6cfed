"""The layout rule: from a design and its springs to every dimension of the housing [mm]."""

import math
from typing import NamedTuple

from cad.parts.cover import cover_level
from cad.parts.housing import DOWEL_MM, TILT_DEG, BackToBack, DomeCap, Housing, Pin
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.tip_mount import pad_height, plate_depth, tip_mount
from sensor.design.tips import Tips
from sensor.theory.leaf_spring import Flexure

LEDGE = 1.0  # straight wall between a fillet and the next corner; the longest tip that prints without support
CLEARANCE = 0.5  # frame above the fruit in the worst press
STOP_MARGIN = 1.5  # stop gap over the deflection at full travel
POCKET_SIDES = 3.0  # depth of the pocket of a pin over its side
BESIDE_BALL = 0.2  # by which a tip is wider than its half ball
_LEAST_PROTRUSION = 0.1
_BEYOND_LEAVES = 20.0  # more than shuttle and wall of an arm add to its leaf


def housing_for(
    design: Design,
    process: Process,
    lengths: tuple[float, ...],
    deflections: tuple[float, ...],
) -> Housing:
    """Return the housing with leaves of the given lengths, low then high, and stops above the given deflections [mm].

    The frame stands back so far that it clears the fruit at full travel and 3 degrees of tilt. Levels are built up from
    the tips: neck, lower leaf, upper leaf, cavity, bar. Raises InputError when a leaf is too short for its fillets.
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
    shuttle = max(end.side, min(layout.shuttle_width_mm, tips.spacing_mm - process.min_gap_mm))
    neck = end.height + _taper(depth, shuttle, end.side)
    protrusion = max(_protrusion(design, lengths, depth) - end.beyond_face, _LEAST_PROTRUSION)

    # A fillet and a ledge lie between a leaf and the next corner.
    half_leaf = 0.5 * max(low.thickness, high.thickness) + process.fillet_mm
    lower_leaf = max(neck, protrusion) + LEDGE + half_leaf
    low_stop, high_stop = (round(max(process.min_gap_mm, STOP_MARGIN * each), 2) for each in deflections)
    cavity = lower_leaf + separation + half_leaf + LEDGE + max(low_stop, high_stop)
    pin = _pin(tips, end, neck - process.min_wall_mm)
    dome = DomeCap(radius=tips.dome_radius_mm) if pin is None and tips.dome_radius_mm is not None else None
    return Housing(
        low=low,
        high=high,
        tip_side=end.side,
        tip_height=end.height,
        spacing=tips.spacing_mm,
        shuttle_width=shuttle,
        neck_level=neck,
        lower_leaf_level=lower_leaf,
        low_top_level=cavity - low_stop,
        high_top_level=cavity - high_stop,
        cavity_level=cavity,
        top_level=cavity + layout.top_bar_mm,
        protrusion=protrusion,
        mount=design.print.mount,
        cover_level=cover_level(protrusion, design.press),
        pin=pin,
        dome=dome,
        back_to_back=_back_to_back(process) if layout.is_back_to_back else None,
    )


def _back_to_back(process: Process) -> BackToBack:
    """Return pads and holes of a plate of a square; dowels are never loose in holes that are too large by accuracy."""
    return BackToBack(pad_height=pad_height(process), dowel_hole=round(DOWEL_MM - process.accuracy_mm, 3))


class _ShuttleEnd(NamedTuple):
    """What is printed at the end of a shuttle [mm]: a tip, or the foot of a pin, with a pocket for it.

    What touches lies `beyond_face` below what is printed.
    """

    side: float
    height: float
    beyond_face: float = 0.0
    pocket_side: float | None = None


def _pin(tips: Tips, end: _ShuttleEnd, deepest: float) -> Pin | None:
    """Return the pin at the end of a shuttle, in a pocket of at most the given depth [mm]; None for a printed tip."""
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
    """Return the end of a shuttle in a plate of this depth [mm]: what touches stands out by 1.5 travels at least."""
    tips = design.tips
    mount = tip_mount(design, process)
    standing_out = max(min(tips.side_mm, LEDGE), 1.5 * design.press.travel_mm)
    if mount.pocket_side is not None:
        outside = max(standing_out, _cap_height(tips, tips.side_mm), tips.tip_shape.height_mm)
        return _ShuttleEnd(side=mount.side, height=LEDGE, beyond_face=outside, pocket_side=mount.pocket_side)
    side = _tip_side(tips, depth)
    height = max(standing_out, _cap_height(tips, side))
    return _ShuttleEnd(side=side, height=height)


def _tip_side(tips: Tips, depth: float) -> float:
    """Return the side of a printed tip [mm]: that of its face, for a dome with room beside it.

    A whole half ball stands on a wider tip. In a plate of a square a tip that is nearly as deep fills it, for the
    little step between them would print on air.
    """
    side = tips.side_mm
    if tips.dome_radius_mm and side > 2.0 * tips.dome_radius_mm - BESIDE_BALL:
        side = round(2.0 * tips.dome_radius_mm + BESIDE_BALL, 3)
    return depth if tips.tip_layout.is_back_to_back and 0.0 <= depth - side < LEDGE else side


def _cap_height(tips: Tips, side: float) -> float:
    """Return the height of the corners of a square tip above the apex of its dome, up to the next 0.1 mm; 0 without."""
    radius = tips.dome_radius_mm or 0.0
    corner = min(radius, math.sqrt(0.5) * side)
    return math.ceil(10.0 * (radius - math.sqrt(radius**2 - corner**2)) - 1e-9) / 10.0


def _taper(depth: float, shuttle: float, tip: float) -> float:
    """Return the height of a neck [mm]: 45 degrees over the depth, as it prints; a ledge where there is little step."""
    step = 0.5 * (depth - tip)
    return step if 0.5 * LEDGE <= step < LEDGE else max(step, 0.5 * (shuttle - tip), LEDGE)


def _protrusion(design: Design, lengths: tuple[float, ...], depth: float) -> float:
    """Return how far the tips stand out of the frame [mm]: full travel, the drop of a tilted edge, a clearance."""
    fruit = design.fruit
    tips = design.tips
    press = design.press
    frame_length = 0.5 * tips.spacing_mm + max(lengths) + _BEYOND_LEAVES  # from the middle
    along = min(0.5 * fruit.length_mm + abs(tips.offset_mm), frame_length)
    frame_width = 0.5 * depth + 0.5 * tips.tip_layout.width * tips.spacing_mm
    across = min(0.5 * fruit.width_mm, frame_width)
    drop = math.tan(math.radians(max(TILT_DEG, abs(press.tilt_deg)))) * max(along, across)
    return math.ceil(10.0 * (press.travel_mm + drop + CLEARANCE)) / 10.0
