"""The layout rules, which determine every dimension of the housing [mm] from a design and its springs."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from cad.parts.cover import cover_level
from cad.parts.housing import DOWEL_MM, TILT_DEG, BackToBack, DomeCap, Housing, Pin
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.tip_mount import pad_height, plate_depth, tip_mount
from sensor.design.tips import Tips
from sensor.theory.leaf_spring import Flexure

# Lengths are in mm.
LEDGE = 1.0  # straight wall between a fillet and the next corner; also the longest tip that prints without support
CLEARANCE = 0.5  # clearance between the frame and the fruit in the worst press
STOP_SAFETY = 1.2  # smallest allowed deflection at the stop, divided by the deflection at full travel; our choice
STOP_MARGIN = 1.5  # ratio of the gap at a stop to the deflection at full travel
POCKET_SIDES = 3.0  # ratio of the depth of the pocket for a pin to the side of the pin
HEMISPHERE_MARGIN = 0.2  # difference between the width of a tip and the diameter of its hemisphere
_MIN_PROTRUSION = 0.1  # smallest distance by which printed tips or feet protrude below the frame
_BESIDE_LEAF = 20.0  # upper bound for the combined width of the shuttle and the wall of an arm
_MIN_TIP_TRAVELS = 1.5  # smallest ratio of the length of a tip to the travel, so that no other part touches the fruit


def housing_for(
    design: Design,
    process: Process,
    lengths: tuple[float, ...],
    deflections: tuple[float, ...],
) -> Housing:
    """Determine all dimensions of the housing of a design.

    `lengths` [mm] are the leaf lengths of the low and the high spring, and `deflections` [mm] are their deflections at
    full travel.

    The tips protrude from the frame, so that it clears the fruit at full travel even if the sensor is tilted. The
    levels are stacked from the tips upwards: neck, lower leaf, upper leaf, cavity, bar. The springs reach their stops
    only beyond full travel. Raises InputError if the parts do not fit, for example a leaf that is too short for its
    fillets.
    """
    tips = design.tips
    layout = tips.tip_layout
    depth = plate_depth(design, process)
    flexures = _flexures(process, lengths, depth, layout.leaf_separation_mm)
    shuttle_end = _shuttle_end(design, process, depth)
    # A shuttle is at least as wide as its end, and there must be a printable gap between the two shuttles.
    shuttle_width = max(shuttle_end.side, min(layout.shuttle_width_mm, tips.spacing_mm - process.min_gap_mm))
    neck_level = shuttle_end.height + _neck_height(depth, shuttle_width, shuttle_end.side)
    # The level of the frame is measured from the printed face. A pin extends below this face.
    protrusion = max(_tip_protrusion(design, lengths, depth) - shuttle_end.beyond_face, _MIN_PROTRUSION)
    levels = _stack_levels(process, flexures, max(neck_level, protrusion), deflections)
    pin = _pin(tips, shuttle_end, neck_level - process.min_wall_mm)
    low, high = flexures
    return Housing(
        low=low,
        high=high,
        tip_side=shuttle_end.side,
        tip_height=shuttle_end.height,
        spacing=tips.spacing_mm,
        shuttle_width=shuttle_width,
        neck_level=neck_level,
        lower_leaf_level=levels.lower_leaf,
        low_top_level=levels.low_top,
        high_top_level=levels.high_top,
        cavity_level=levels.cavity,
        top_level=levels.cavity + layout.top_bar_mm,
        protrusion=protrusion,
        mount=design.print.mount,
        cover_level=cover_level(protrusion, design.press),
        pin=pin,
        dome=_printed_dome(tips, pin),
        back_to_back=_back_to_back(process) if layout.is_back_to_back else None,
    )


class _Levels(NamedTuple):
    """Heights of the leaves and the cavity above the printed tip faces [mm].

    `lower_leaf` is the mid-plane of the lower leaves, and `low_top` and `high_top` are the tops of the two shuttles.
    `cavity` is the stop above the shuttles.
    """

    lower_leaf: float
    low_top: float
    high_top: float
    cavity: float


def _stack_levels(
    process: Process, flexures: Sequence[Flexure], lower_limit: float, deflections: tuple[float, ...]
) -> _Levels:
    """Return the levels of the leaves and the cavity, which are stacked upwards from `lower_limit` [mm].

    `lower_limit` is the upper end of the necks or the lower edge of the frame, whichever is higher. `flexures` are the
    low and the high spring, and `deflections` are their deflections at full travel [mm]. The gaps at the stops are
    larger than these deflections.
    """
    low, high = flexures
    # Each leaf is separated from the next corner by a fillet and a straight ledge.
    half_leaf = 0.5 * max(low.thickness, high.thickness) + process.fillet_mm
    lower_leaf = lower_limit + LEDGE + half_leaf
    # The gaps between the shuttles and their stops, rounded to 0.01 mm.
    low_gap, high_gap = (round(max(process.min_gap_mm, STOP_MARGIN * deflection), 2) for deflection in deflections)
    # The cavity ends above the upper leaf, its fillet, a ledge and the wider gap.
    cavity = lower_leaf + low.separation + half_leaf + LEDGE + max(low_gap, high_gap)
    return _Levels(lower_leaf=lower_leaf, low_top=cavity - low_gap, high_top=cavity - high_gap, cavity=cavity)


def _flexures(process: Process, lengths: tuple[float, ...], depth: float, separation: float) -> list[Flexure]:
    """Return the low and the high flexure of a plate, whose leaves have these lengths [mm].

    `depth` is the depth of the plate, and `separation` the distance between the two leaves of a flexure [mm]. The print
    process determines the leaf thicknesses and the fillets.
    """
    return [
        Flexure(thickness=thickness, length=length, depth=depth, separation=separation, fillet=process.fillet_mm)
        for thickness, length in zip(process.leaf_thicknesses_mm, lengths, strict=True)
    ]


def _back_to_back(process: Process) -> BackToBack:
    """Return the pads and dowel holes of a back-to-back plate.

    The holes are smaller than the dowels by the accuracy of the process, so that the dowels are never loose.
    """
    return BackToBack(pad_height=pad_height(process), dowel_hole=round(DOWEL_MM - process.accuracy_mm, 3))


def _printed_dome(tips: Tips, pin: Pin | None) -> DomeCap | None:
    """Return the dome of a printed tip, or None for a flat tip or a pin. A dome on a pin is a shape of the pin."""
    if pin is not None or tips.dome_radius_mm is None:
        return None
    return DomeCap(radius=tips.dome_radius_mm)


class _ShuttleEnd(NamedTuple):
    """The printed end of a shuttle [mm]: a tip, or a foot with a pocket for a pin.

    `side` and `height` are the sizes of the straight part of the tip or foot. `beyond_face` is the distance from the
    printed face down to the face that touches the fruit, which is 0 for printed tips. `pocket_side` is the width of the
    pocket, or None for printed tips.
    """

    side: float
    height: float
    beyond_face: float = 0.0
    pocket_side: float | None = None


def _pin(tips: Tips, shuttle_end: _ShuttleEnd, max_pocket_depth: float) -> Pin | None:
    """Return the pin at the end of a shuttle, or None for a printed tip.

    `max_pocket_depth` [mm] is the largest depth of the pocket for which a wall remains above it.
    """
    if shuttle_end.pocket_side is None:
        return None
    return Pin(
        side=tips.side_mm,
        is_round=tips.tip_shape.is_round,
        protruding_length=shuttle_end.beyond_face,
        pocket_side=shuttle_end.pocket_side,
        pocket_depth=min(POCKET_SIDES * tips.side_mm, max_pocket_depth),
    )


def _shuttle_end(design: Design, process: Process, depth: float) -> _ShuttleEnd:
    """Return the dimensions of the printed end of a shuttle, in a plate of this depth [mm].

    The end is the tip itself or, if the tips are pins, a foot with a pocket for a pin.
    """
    tips = design.tips
    mount = tip_mount(design, process)
    if mount.pocket_side is None:  # without pockets, the tips are printed
        side = _tip_side(tips, depth)
        return _ShuttleEnd(side=side, height=_least_tip_length(design, side))
    pin_length = max(_least_tip_length(design, tips.side_mm), tips.tip_shape.height_mm)
    # The foot can be short, because its pin extends to the fruit.
    return _ShuttleEnd(side=mount.side, height=LEDGE, beyond_face=pin_length, pocket_side=mount.pocket_side)


def _least_tip_length(design: Design, side: float) -> float:
    """Return the smallest length [mm] of a printed tip or a pin with this side [mm].

    The tip is long enough that no other part of the arm touches the fruit at full travel. It is also at least as long
    as its dome is high, and at least as long as `LEDGE` or the side in the design, whichever is smaller.
    """
    tips = design.tips
    length_for_travel = _MIN_TIP_TRAVELS * design.press.travel_mm
    return max(min(tips.side_mm, LEDGE), length_for_travel, _cap_height(tips, side))


def _tip_side(tips: Tips, depth: float) -> float:
    """Return the side of a printed tip [mm], which can exceed the side in the design for two reasons.

    A hemisphere needs a wider tip. In a back-to-back plate, a tip that is nearly as deep as the plate gets the full
    depth. Otherwise, the small step between them would have to be printed without support.
    """
    side = tips.side_mm
    if tips.dome_radius_mm and side > 2.0 * tips.dome_radius_mm - HEMISPHERE_MARGIN:
        side = round(2.0 * tips.dome_radius_mm + HEMISPHERE_MARGIN, 3)
    is_nearly_as_deep = 0.0 <= depth - side < LEDGE
    return depth if tips.tip_layout.is_back_to_back and is_nearly_as_deep else side


def _cap_height(tips: Tips, side: float) -> float:
    """Return the height [mm] of the corners of a square tip above the apex of its dome, rounded up to 0.1 mm.

    Without a dome, the height is 0.
    """
    radius = tips.dome_radius_mm or 0.0
    corner_distance = min(radius, math.sqrt(0.5) * side)  # distance of a corner from the axis of the tip
    # Without the term 1e-9, round-off could raise a height that is a multiple of 0.1 mm to the next multiple.
    return math.ceil(10.0 * (radius - math.sqrt(radius**2 - corner_distance**2)) - 1e-9) / 10.0


def _neck_height(depth: float, shuttle_width: float, tip_side: float) -> float:
    """Return the height of a neck [mm], which tapers from the shuttle to the tip.

    `depth` is the depth of the plate, and `shuttle_width` and `tip_side` are the widths of the shuttle and the tip
    [mm]. In the direction of the depth, the neck slopes by at most 45 degrees from the press axis, which is printable.
    The height is at least `LEDGE`, unless the step in this direction is between half of `LEDGE` and `LEDGE`.
    """
    depth_step = 0.5 * (depth - tip_side)
    if 0.5 * LEDGE <= depth_step < LEDGE:
        return depth_step
    return max(depth_step, 0.5 * (shuttle_width - tip_side), LEDGE)


def _tip_protrusion(design: Design, lengths: tuple[float, ...], depth: float) -> float:
    """Return the distance by which the tips must protrude below the frame [mm], rounded up to 0.1 mm.

    The protrusion is the sum of the full travel, a clearance, and the distance by which a tilt lowers the edge of the
    frame above the fruit. `lengths` are the leaf lengths of the two springs, and `depth` is the depth of the plate
    [mm].
    """
    press = design.press
    tilt_deg = max(TILT_DEG, abs(press.tilt_deg))
    edge_drop = math.tan(math.radians(tilt_deg)) * _reach_above_fruit(design, lengths, depth)
    return math.ceil(10.0 * (press.travel_mm + edge_drop + CLEARANCE)) / 10.0


def _reach_above_fruit(design: Design, lengths: tuple[float, ...], depth: float) -> float:
    """Return the largest distance along x or y from the sensor's centre to a point of the frame above the fruit [mm].

    `lengths` are the leaf lengths of the two springs, and `depth` is the depth of the plate [mm]. In each direction,
    the frame ends at half its size, and the fruit may end before.
    """
    fruit = design.fruit
    tips = design.tips
    half_length = 0.5 * tips.spacing_mm + max(lengths) + _BESIDE_LEAF
    reach_along = min(0.5 * fruit.length_mm + abs(tips.offset_mm), half_length)
    half_width = 0.5 * depth + 0.5 * tips.tip_layout.width_in_spacings * tips.spacing_mm
    reach_across = min(0.5 * fruit.width_mm, half_width)
    return max(reach_along, reach_across)
