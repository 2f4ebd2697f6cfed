"""The drawing of a housing: section, view from the left, gauges, and every dimension once, on a sheet [mm]."""

import itertools
import math

from cad.design.processes import Process
from cad.drawing.canvas import MEASURED, Box, Canvas, format_length, text_width
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.section import draw_section, section
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.parts.housing import Arm, Housing, fillet_corners
from cad.parts.part import NEAR_MM, Part
from cad.theory.strain_gauge import GAUGES, FoilGauge, Span, gauge_spans

_GAUGE_THICK = 0.25  # [mm] of a gauge seen from its edge, many times its thickness
_ROOM_OF_ROWS_MM = 24.0  # on paper, for two rows of dimensions


def housing_drawing(part: Part, housing: Housing, title: Title) -> Sheet:
    """Return the sheet of a housing: its section y = 0 seen along +y, and to the right the view from its left.

    Raises InputError for a leaf without room for its gauges.
    """
    profile = section(part.shape)

    def draw_views(canvas: Canvas) -> None:
        draw_section(canvas, profile)
        view = Box(housing.left, 0.0, housing.right, housing.top_level)
        draw_lengths(canvas, _lengths(housing, title.process), view)
        for arm in housing.arms:
            _draw_in_window(canvas, arm, title.process)
            _draw_stop(canvas, housing, arm)
        _draw_callouts(canvas, housing)
        if housing.pin_side:
            _draw_pins(canvas, housing)
        front = canvas.extents()
        _draw_from_the_left(canvas, housing, front.right + BETWEEN_MM / canvas.scale)
        gauge = GAUGES[housing.gauges]
        if gauge is not None:
            draw_gauges(canvas, housing, gauge, front.top + BETWEEN_MM / canvas.scale)

    return on_sheet(draw_views, _notes(housing, title.process), title)


def _lengths(housing: Housing, process: Process) -> list[Length]:
    """Return the lengths around the section."""
    left, right, bottom, top = housing.left, housing.right, housing.protrusion, housing.top_level
    low, high = housing.arms
    (x0, z0), (x1, z1) = housing.holes[0], housing.holes[-1]
    half, wide, neck = 0.5 * housing.spacing, 0.5 * housing.shuttle_width, housing.neck_level
    lower, upper = high.levels
    frame = [
        Length(side="top", start=(left, top), end=(right, top)),
        Length(side="top", start=(x0, z1), end=(x1, z1)),
        Length(side="top", start=(left, top), end=(x0, z1)),
        Length(side="bottom", start=(low.outer, bottom), end=(low.wall, bottom)),
        Length(side="right", start=(high.wall, housing.cavity_level), end=(right, top)),
        Length(side="left", start=(left, bottom), end=(left, top)),
        Length(side="left", start=(x0, z0), end=(x0, z1)),
        Length(side="left", start=(left, bottom), end=(x0, z0)),
        Length(side="left", start=(low.centre - 0.5 * housing.tip_side, 0.0), end=(left, bottom)),
    ]
    springs = [
        Length(side="right", start=(high.centre, 0.0), end=(high.wall, lower)),
        Length(side="right", start=(high.wall, lower), end=(high.wall, upper)),
    ]
    for arm in housing.arms:
        under = arm.levels[0] - 0.5 * arm.flexure.thickness
        start, end = ((x, under) for x in arm.roots)
        springs.append(Length(side="bottom", start=start, end=end, label=f"<> ±{process.accuracy_mm:g}"))
    tips = [
        Length(side="bottom", start=(-half, 0.0), end=(half, 0.0)),
        Length(side="bottom", start=(-half - wide, neck), end=(-half + wide, neck), label="<> 2x"),
        Length(side="right", start=(half, 0.0), end=(half + wide, neck)),
    ]
    if housing.tip_height < neck - NEAR_MM:
        shoulder = (half + 0.5 * housing.tip_side, housing.tip_height)
        tips.append(Length(side="right", start=(half, 0.0), end=shoulder))
    dowels = []
    if housing.dowels:
        first, last = sorted(housing.dowels)
        dowels = [
            Length(side="top", start=first, end=last),
            Length(side="left", start=(left, bottom), end=first),
        ]
    return [*frame, *springs, *tips, *dowels]


def _draw_in_window(canvas: Canvas, arm: Arm, process: Process) -> None:
    """Draw the thickness of the leaves and the name of the spring, in the window between its leaves."""
    height = canvas.text_height
    left, right = arm.roots
    upper, half = arm.levels[1], 0.5 * arm.flexure.thickness
    label = f"<> ±{process.accuracy_mm:g}"
    width = text_width(label.replace(MEASURED, format_length(2.0 * half)), height)
    x = left + max(0.6 * height, 0.1 * (right - left))
    text_at = (x + 0.6 * height + 0.5 * width, upper - half - 2.0 * height)
    canvas.length("z", (x, upper - half), (x, upper + half), text_at, x, label)
    middle = (0.5 * (left + right), 0.5 * sum(arm.levels) + 0.3 * height)
    canvas.words(f"{arm.name.upper()} SPRING", middle, 0.8 * height)


def _draw_stop(canvas: Canvas, housing: Housing, arm: Arm) -> None:
    """Draw the gap over a shuttle, its text in the top bar."""
    height = canvas.text_height
    low, high = arm.top_level, housing.cavity_level
    width = text_width(format_length(high - low), height)
    text_at = (arm.centre - 0.8 * height, high + height + 0.5 * width)
    canvas.length("z", (arm.centre, low), (arm.centre, high), text_at, arm.centre, text_rotation=90.0)


def _draw_callouts(canvas: Canvas, housing: Housing) -> None:
    """Draw radii and diameters: of fillets, holes for screws, and where there are any of dowels and domes."""
    height = canvas.text_height
    arm, radius = housing.arms[0], housing.low.fillet
    x, z = arm.wall, arm.levels[0] + 0.5 * arm.flexure.thickness
    label = f"<> {len(fillet_corners(housing))}x"
    beside = (x, z + 1.4 * height)
    canvas.callout("radius", (x + radius, z + radius), radius, beside, "right", label, angle=225.0)
    call_out_screw_holes(canvas, housing)
    if housing.dowels:
        beside = (housing.right, housing.top_level + 2.4 * height)
        canvas.callout("diameter", housing.dowels[-1], housing.dowel_hole, beside, "right", "<> 2x, dowels")
    if housing.dome_radius:
        dome = housing.dome_radius
        angle = 270.0 - math.degrees(0.25 * housing.tip_side / dome)
        beside = (arm.centre - 2.5 * height, -8.0 * height)
        canvas.callout("radius", (arm.centre, dome), dome, beside, "left", "<> 2x, domes", angle=angle)


def call_out_screw_holes(canvas: Canvas, housing: Housing) -> None:
    """Draw the diameter [mm] of the holes for screws, at the upper left one, its text beside that corner."""
    beside = (housing.left, housing.top_level + 2.4 * canvas.text_height)
    canvas.callout("diameter", housing.holes[1], housing.hole_diameter, beside, "left", f"<> {len(housing.holes)}x")


def _draw_pins(canvas: Canvas, housing: Housing) -> None:
    """Draw the pins in their pockets and say what they are."""
    side, out, height = housing.pin_side, housing.pin_out, canvas.text_height
    for arm in housing.arms:
        pin = Box(arm.centre - 0.5 * side, -out, arm.centre + 0.5 * side, housing.pocket_depth)
        canvas.rectangle(pin, "NOTES")
    cross_section = f"Ø{side:g}" if housing.pin_round else f"{side:g} x {side:g}"
    text = f"steel pin {cross_section} x {housing.pocket_depth + out:g} 2x, {out:g} out"
    at = (housing.left - 2.0 * height - 0.5 * text_width(text, height), -6.0 * height)
    canvas.words(text, at, height)


def _draw_from_the_left(canvas: Canvas, housing: Housing, start: float) -> None:
    """Draw the view from the left, from a place x [mm] of the sheet on: the front of the plate to its right."""
    deep, tip, top, pad = 0.5 * housing.depth, 0.5 * housing.tip_side, housing.top_level, housing.pad_height
    middle = start + pad + deep
    plate = Box(middle - deep, housing.protrusion, middle + deep, top)
    canvas.rectangle(plate)
    for side in (-1.0, 1.0):
        tip_edge, plate_edge = middle + side * tip, middle + side * deep
        edge = [(tip_edge, 0.0), (tip_edge, housing.tip_height), (plate_edge, housing.neck_level)]
        for a, b in itertools.pairwise(edge):
            if math.dist(a, b) > NEAR_MM:
                canvas.line(a, b)
    canvas.line((middle - tip, 0.0), (middle + tip, 0.0))
    lengths = [
        Length(side="top", start=(plate.left, top), end=(plate.right, top)),
        Length(side="bottom", start=(middle - tip, 0.0), end=(middle + tip, 0.0)),
    ]
    if pad:
        foot = max(housing.cover_level, housing.protrusion)
        canvas.rectangle(Box(plate.left - pad, foot, plate.left, top))
        lengths += [
            Length(side="top", start=(plate.left - pad, top), end=(plate.left, top)),
            Length(side="left", start=(plate.left, plate.bottom), end=(plate.left - pad, foot)),
        ]
    draw_lengths(canvas, lengths, Box(plate.left - pad, 0.0, plate.right, top))


def draw_gauges(canvas: Canvas, housing: Housing, gauge: FoilGauge, level: float) -> None:
    """Draw the gauges on the section, and from a level of the sheet [mm] the upper leaves with them from above.

    Raises InputError for a leaf without room for them.
    """
    for arm in housing.arms:
        upper, half = arm.levels[1], 0.5 * arm.flexure.thickness
        for spans in gauge_spans(arm.flexure, gauge):
            left, right = sorted(arm.along(spans.backing))
            canvas.rectangle(Box(left, upper + half, right, upper + half + _GAUGE_THICK), "NOTES")
            canvas.rectangle(Box(left, upper - half - _GAUGE_THICK, right, upper - half), "NOTES")
        _draw_leaf_from_above(canvas, arm, gauge, level + _ROOM_OF_ROWS_MM / canvas.scale)


def _draw_leaf_from_above(canvas: Canvas, arm: Arm, gauge: FoilGauge, base: float) -> None:
    """Draw an upper leaf from above with the gauges at its roots, and their sizes and places."""
    left, right = arm.roots
    leaf = Box(left, base, right, base + arm.flexure.depth)
    middle = base + 0.5 * arm.flexure.depth
    canvas.rectangle(leaf)
    for spans in gauge_spans(arm.flexure, gauge):
        for span, width in ((spans.backing, gauge.backing_width_mm), (spans.grid, gauge.grid_width_mm)):
            x0, x1 = sorted(arm.along(span))
            canvas.rectangle(Box(x0, middle - 0.5 * width, x1, middle + 0.5 * width), "NOTES")

    at_wall = gauge_spans(arm.flexure, gauge)[0]
    edge = middle - 0.5 * gauge.backing_width_mm
    lengths = []
    for span in (Span(0.0, at_wall.backing.start), at_wall.backing, at_wall.grid):
        start, end = ((x, edge) for x in arm.along(span))
        lengths.append(Length(side="bottom", start=start, end=end))
    if arm.sign < 0.0:  # the widths are those of all gauges: they stand beside the first leaf alone
        for width in (gauge.backing_width_mm, gauge.grid_width_mm):
            start, end = (arm.wall, middle - 0.5 * width), (arm.wall, middle + 0.5 * width)
            lengths.append(Length(side="left", start=start, end=end))
    draw_lengths(canvas, lengths, leaf)
    height = canvas.text_height
    canvas.words(f"{arm.name.upper()} UPPER LEAF", (0.5 * (left + right), leaf.top + height), 0.7 * height)


def _notes(housing: Housing, process: Process) -> list[str]:
    """Return the notes of the sheet, from above."""
    layer = f", layer {process.layer_mm:g} mm" if process.layer_mm else ""
    faces = "tips are domes as made" if housing.dome_radius else "tip faces sharp-edged"
    notes = [
        "Millimetres. Section in the middle of the depth, and view from the left.",
        f"{process.material}{layer}; made flat, this profile in the plane of the bed.",
        f"Leaves solid: stiffness assumes E = {process.E_MPa:g} MPa. Two leaves of a spring are equal.",
        f"Gaps over the shuttles are stops; {faces}.",
        "Measure leaf thicknesses; calibrate both springs of each unit.",
    ]
    if housing.dowels:
        notes.append("Plate of a square: MAKE TWO, one turned half round the press axis, pads on pads.")
    if housing.pin_side:
        size = f"{housing.pocket_side:g} wide, {housing.pocket_depth:g} deep"
        notes.append(f"Pockets for steel pins {size}; pins stand out {housing.pin_out:g}.")
    return notes
