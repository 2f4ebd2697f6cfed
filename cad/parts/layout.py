"""The layout rule: from a design and its springs to every dimension of the housing [mm]."""

import math
from dataclasses import replace

from cad.parts.cover import cover_level
from cad.parts.housing import DOWEL_MM, TILT_DEG, Housing
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


def housing_for(
    design: Design, process: Process, lengths: tuple[float, ...], deflections: tuple[float, ...]
) -> Housing:
    """Return the housing with leaves of the given lengths, low then high, and stops above the given deflections [mm].

    The frame stands back so far that it clears the fruit at full travel and 3 degrees of tilt. Raises InputError
    when a leaf is too short for its fillets.
    """
    tips = design.tips
    layout = tips.tip_layout
    mount_side, pocket = tip_mount(design, process)  # pocket: 0 for printed tips
    depth = plate_depth(design, process)
    separation = layout.leaf_separation_mm
    low, high = (
        Flexure(thickness=thickness, length=length, depth=depth, separation=separation, fillet=process.fillet_mm)
        for thickness, length in zip(process.leaf_thicknesses_mm, lengths, strict=True)
    )

    # From the tips up: a printed tip stands out itself, a pin out of a foot that is a low tip.
    side = mount_side if pocket else _tip_side(tips, depth)
    standing_out = max(min(tips.side_mm, LEDGE), 1.5 * design.press.travel_mm)
    if pocket:
        pin_out = max(standing_out, _cap_height(tips, tips.side_mm), tips.tip_shape.height_mm)
        tip_height = LEDGE
    else:
        pin_out = 0.0
        tip_height = max(standing_out, _cap_height(tips, side))
    shuttle = max(side, min(layout.shuttle_width_mm, tips.spacing_mm - process.min_gap_mm))
    neck = tip_height + _taper(depth, shuttle, side)
    protrusion = max(_protrusion(design, lengths, depth) - pin_out, _LEAST_PROTRUSION)

    # A fillet and a ledge lie between a leaf and the next corner.
    half_leaf = 0.5 * max(low.thickness, high.thickness) + process.fillet_mm
    lower_leaf = max(neck, protrusion) + LEDGE + half_leaf
    low_stop, high_stop = (round(max(process.min_gap_mm, STOP_MARGIN * each), 2) for each in deflections)
    cavity = lower_leaf + separation + half_leaf + LEDGE + max(low_stop, high_stop)
    housing = Housing(
        low=low,
        high=high,
        tip_side=side,
        tip_height=tip_height,
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
        gauges=design.print.gauges,
        dome_radius=0.0 if pocket else tips.dome_radius_mm or 0.0,
    )
    if layout.is_back_to_back:
        dowel = round(DOWEL_MM - process.accuracy_mm, 3)  # as much too small as a hole may be off: never loose
        housing = replace(housing, back_to_back=True, pad_height=pad_height(process), dowel_hole=dowel)
    if not pocket:
        return housing
    return replace(
        housing,
        pin_side=tips.side_mm,
        pin_round=tips.tip_shape.is_round,
        pin_out=pin_out,
        pocket_side=pocket,
        pocket_depth=min(POCKET_SIDES * tips.side_mm, neck - process.min_wall_mm),
    )


def _tip_side(tips: Tips, depth: float) -> float:
    """Return the side of a printed tip [mm]: that of its face, for a dome with room beside it.

    A whole half ball stands on a wider tip; in a plate of a square a tip that is nearly as deep fills it, for the
    little step between them would print on air.
    """
    side = tips.side_mm
    if tips.dome_radius_mm and side > 2.0 * tips.dome_radius_mm - BESIDE_BALL:
        side = round(2.0 * tips.dome_radius_mm + BESIDE_BALL, 3)
    return depth if tips.tip_layout.is_back_to_back and 0.0 <= depth - side < LEDGE else side


def _cap_height(tips: Tips, side: float) -> float:
    """Return how far the corners of a square tip lie above the top of its dome [mm], in steps of 0.1; 0 without."""
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
    frame_length = 0.5 * tips.spacing_mm + max(lengths) + 20.0
    along = min(0.5 * fruit.length_mm + abs(tips.offset_mm), frame_length)
    frame_width = 0.5 * depth + 0.5 * tips.tip_layout.width * tips.spacing_mm
    across = min(0.5 * fruit.width_mm, frame_width)
    drop = math.tan(math.radians(max(TILT_DEG, abs(press.tilt_deg)))) * max(along, across)
    return math.ceil(10.0 * (press.travel_mm + drop + CLEARANCE)) / 10.0
