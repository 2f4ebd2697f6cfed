"""The drawing of a housing: section, view from the left, gauges, and every dimension once, on a sheet [mm]."""

import math

from cad.design.processes import Process
from cad.drawing.canvas import MEASURED, SMALL_MM, Box, Canvas
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.section import draw_section, hatch_section, section
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.drawing.view import View, draw_view, views_of
from cad.parts.housing import DOWEL_MM, Arm, Housing, fillet_corners
from cad.parts.part import NEAR_MM, Part
from cad.theory.strain_gauge import GAUGES, FoilGauge, Span, gauge_spans

_GAUGE_THICK = 0.25  # [mm] of a gauge seen from its edge, many times its thickness
_ROOM_OF_ROWS_MM = 24.0  # on paper, for two rows of dimensions


def housing_drawing(part: Part, housing: Housing, title: Title) -> Sheet:
    """Return the sheet of a housing: its section y = 0 seen along +y, and to the right the view from its left.

    Raises InputError for a leaf without room for its gauges.
    """
    cut = section(part.shape)
    (from_left,) = views_of([part.shape], "left")
    within_accuracy = f"{MEASURED} ±{title.process.accuracy_mm:g}"

    def draw_views(canvas: Canvas) -> None:
        draw_section(canvas, cut)
        lengths = [*_frame_lengths(housing), *_spring_lengths(housing, within_accuracy), *_tip_lengths(housing)]
        draw_lengths(canvas, lengths, Box(housing.left, 0.0, housing.right, housing.top_level))
        for arm in housing.arms:
            _draw_in_window(canvas, arm, within_accuracy)
            _draw_stop(canvas, housing, arm)
        _draw_callouts(canvas, housing)
        if housing.pin_side:
            _draw_pins(canvas, housing)
        front = canvas.extents()
        _draw_from_the_left(canvas, housing, from_left, front.right + BETWEEN_MM / canvas.scale)
        _draw_cutting_line(canvas, housing, front)
        for centre, radius in (
            *((hole, 0.5 * housing.hole_diameter) for hole in housing.holes),
            *((hole, 0.5 * housing.dowel_hole) for hole in housing.dowels),
        ):
            canvas.centre_mark(centre, radius)
        hatch_section(canvas, cut)
        gauge = GAUGES[housing.gauges]
        if gauge is not None:
            draw_gauges(canvas, housing, gauge, front.top + BETWEEN_MM / canvas.scale)

    return on_sheet(draw_views, _notes(housing, title.process), title)


def _frame_lengths(housing: Housing) -> list[Length]:
    """Return the lengths around the frame: outer sizes, walls, holes for screws and dowels."""
    low, high = housing.arms
    bottom_left = (housing.left, housing.protrusion)
    top_left = (housing.left, housing.top_level)
    top_right = (housing.right, housing.top_level)
    lower_hole, upper_hole = low.holes
    tip_corner = (low.centre - 0.5 * housing.tip_side, 0.0)
    lengths = [
        Length("top", top_left, top_right),
        Length("top", upper_hole, high.holes[1]),
        Length("top", top_left, upper_hole),
        Length("bottom", bottom_left, (low.wall, housing.protrusion)),
        Length("right", (high.wall, housing.cavity_level), top_right),
        Length("left", bottom_left, top_left),
        Length("left", lower_hole, upper_hole),
        Length("left", bottom_left, lower_hole),
        Length("left", tip_corner, bottom_left),
    ]
    if housing.dowels:
        first, last = sorted(housing.dowels)
        lengths.append(Length("top", first, last))
        lengths.append(Length("left", bottom_left, first))
    return lengths


def _spring_lengths(housing: Housing, within_accuracy: str) -> list[Length]:
    """Return the levels of the leaves, and the length of those of each spring."""
    high = housing.arms[1]
    lower_root = (high.wall, high.levels[0])
    upper_root = (high.wall, high.levels[1])
    lengths = [
        Length("right", (high.centre, 0.0), lower_root),
        Length("right", lower_root, upper_root),
    ]
    for arm in housing.arms:
        left, right = arm.roots
        underside = arm.levels[0] - 0.5 * arm.flexure.thickness
        lengths.append(Length("bottom", (left, underside), (right, underside), within_accuracy))
    return lengths


def _has_neck(housing: Housing) -> bool:
    """Say whether the tips are smaller than the shuttles that they stand on."""
    return max(housing.shuttle_width, housing.depth) - housing.tip_side > NEAR_MM


def _tip_lengths(housing: Housing) -> list[Length]:
    """Return the distance of the tips, and the widths and levels of tips and necks."""
    low, high = housing.arms
    half_width = 0.5 * housing.shuttle_width
    neck = housing.neck_level
    high_tip = (high.centre, 0.0)
    lengths = [
        Length("bottom", (low.centre, 0.0), high_tip),
        Length("bottom", (low.centre - half_width, neck), (low.centre + half_width, neck), f"2x {MEASURED}"),
    ]
    if not _has_neck(housing):
        return lengths
    lengths.append(Length("right", high_tip, (high.centre + half_width, neck)))
    if housing.tip_height < neck - NEAR_MM:
        shoulder = (high.centre + 0.5 * housing.tip_side, housing.tip_height)
        lengths.append(Length("right", high_tip, shoulder))
    return lengths


def _draw_in_window(canvas: Canvas, arm: Arm, within_accuracy: str) -> None:
    """Draw the thickness of the leaves and the name of the spring, in the window between its leaves."""
    height = canvas.text_height
    left, right = arm.roots
    thickness = arm.flexure.thickness
    lower_leaf, upper_leaf = arm.levels
    underside = upper_leaf - 0.5 * thickness
    x = left + max(0.6 * height, 0.1 * (right - left))
    text_at = (x + 0.6 * height + 0.5 * canvas.label_width(within_accuracy, thickness), underside - 2.0 * height)
    canvas.length("z", (x, underside), (x, underside + thickness), text_at, x, within_accuracy)
    middle = (0.5 * (left + right), 0.5 * (lower_leaf + upper_leaf) + 0.3 * height)
    canvas.words(f"{arm.name.upper()} SPRING", middle, 0.8 * height)


def _draw_stop(canvas: Canvas, housing: Housing, arm: Arm) -> None:
    """Draw the gap over a shuttle, its text in the top bar."""
    height = canvas.text_height
    x = arm.centre
    shuttle = arm.top_level
    stop = housing.cavity_level
    text_at = (x - 0.8 * height, stop + 0.7 * height + 0.5 * canvas.label_width(MEASURED, stop - shuttle))
    canvas.length("z", (x, shuttle), (x, stop), text_at, x, text_rotation=90.0)


def _draw_callouts(canvas: Canvas, housing: Housing) -> None:
    """Draw radii and diameters: of fillets, of holes for screws and for dowels where there are any."""
    height = canvas.text_height
    low = housing.arms[0]
    radius = housing.low.fillet
    root_top = low.levels[0] + 0.5 * low.flexure.thickness
    centre = (low.wall + radius, root_top + radius)
    label = f"{len(fillet_corners(housing))}x {MEASURED}"
    canvas.callout("radius", centre, radius, (low.wall, root_top + 1.4 * height), "right", label, angle=225.0)
    call_out_screw_holes(canvas, housing)
    if housing.dowels:
        beside = (housing.right, housing.top_level + 2.4 * height)
        canvas.callout(
            "diameter", housing.dowels[-1], housing.dowel_hole, beside, "right", f"2x {MEASURED}, ream {DOWEL_MM:g} H7"
        )


def call_out_screw_holes(canvas: Canvas, housing: Housing) -> None:
    """Draw the diameter [mm] of the holes for screws, at the upper left one, its text beside that corner."""
    beside = (housing.left, housing.top_level + 2.4 * canvas.text_height)
    label = f"{len(housing.holes)}x {MEASURED}"
    canvas.callout("diameter", housing.holes[1], housing.hole_diameter, beside, "left", label)


def _draw_cutting_line(canvas: Canvas, housing: Housing, front: Box) -> None:
    """Draw both ends of the line A-A through the view from the left, looked along +y, and the name of its section."""
    height = canvas.text_height
    views = canvas.extents()
    middle = front.right + BETWEEN_MM / canvas.scale + housing.pad_height + 0.5 * housing.depth
    for end, inwards in ((views.top, -1.0), (views.bottom, 1.0)):
        start = end - 1.2 * inwards * height
        canvas.line((middle, start), (middle, start - 2.0 * inwards * height))
        arrow = (middle - 1.6 * height, start - inwards * height)  # +y is to the left there
        canvas.line((middle, arrow[1]), arrow, "DIMENSIONS")
        for side in (0.3, -0.3):
            canvas.line(arrow, (arrow[0] + 0.8 * height, arrow[1] + side * height), "DIMENSIONS")
        canvas.words("A", (middle + height, arrow[1]), 1.2 * height)
    canvas.words("A-A", (0.5 * (housing.left + housing.right), views.top + 1.6 * height), 1.4 * height)


def _draw_pins(canvas: Canvas, housing: Housing) -> None:
    """Draw the pins in their pockets."""
    side = housing.pin_side
    out = housing.pin_out
    for arm in housing.arms:
        canvas.rectangle(Box(arm.centre - 0.5 * side, -out, arm.centre + 0.5 * side, housing.pocket_depth), "NOTES")


def _draw_from_the_left(canvas: Canvas, housing: Housing, view: View, start: float) -> None:
    """Draw the view from the left, from x = `start` [mm] of the sheet on: the front of the plate to its right."""
    top = housing.top_level
    pad = housing.pad_height
    middle = start + pad + 0.5 * housing.depth
    plate = Box(start + pad, housing.protrusion, start + pad + housing.depth, top)
    draw_view(canvas, view, (middle, 0.0))
    tip = 0.5 * housing.tip_side
    top_left = (plate.left, top)
    lengths = [Length("top", top_left, (plate.right, top))]
    if _has_neck(housing):
        lengths.append(Length("bottom", (middle - tip, 0.0), (middle + tip, 0.0)))
    if pad:
        foot = max(housing.cover_level, housing.protrusion)
        lengths.append(Length("top", (start, top), top_left))
        lengths.append(Length("left", (plate.left, plate.bottom), (start, foot)))
    draw_lengths(canvas, lengths, Box(start, 0.0, plate.right, top))
    if housing.dome_radius:
        _, outward = housing.dome_beside(housing.arms[0])
        centre = (middle - outward, housing.dome_radius)  # +y is to the left there
        angle = 270.0 + math.degrees(0.5 * (tip + outward) / housing.dome_radius)  # at its edge
        beside = (middle + tip, -1.2 * canvas.text_height)
        canvas.callout("radius", centre, housing.dome_radius, beside, "right", f"2x {MEASURED}", angle=angle)


def draw_gauges(canvas: Canvas, housing: Housing, gauge: FoilGauge, level: float) -> None:
    """Draw the gauges on the section, and from a level of the sheet [mm] the upper leaves with them from above.

    Raises InputError for a leaf without room for them.
    """
    for arm in housing.arms:
        top = arm.levels[1] + 0.5 * arm.flexure.thickness
        underside = top - arm.flexure.thickness
        for spans in gauge_spans(arm.flexure, gauge):
            left, right = arm.along(spans.backing)
            canvas.rectangle(Box(left, top, right, top + _GAUGE_THICK), "NOTES")
            canvas.rectangle(Box(left, underside - _GAUGE_THICK, right, underside), "NOTES")
        _draw_leaf_from_above(canvas, arm, gauge, level + _ROOM_OF_ROWS_MM / canvas.scale)


def _draw_leaf_from_above(canvas: Canvas, arm: Arm, gauge: FoilGauge, base: float) -> None:
    """Draw an upper leaf from above with the gauges at its roots, and their sizes and places."""
    left, right = arm.roots
    leaf = Box(left, base, right, base + arm.flexure.depth)
    canvas.rectangle(leaf)
    middle = 0.5 * (leaf.bottom + leaf.top)
    half_backing = 0.5 * gauge.backing_width_mm
    half_grid = 0.5 * gauge.grid_width_mm
    at_wall, at_shuttle = gauge_spans(arm.flexure, gauge)
    for spans in (at_wall, at_shuttle):
        for span, half_width in ((spans.backing, half_backing), (spans.grid, half_grid)):
            start, end = arm.along(span)
            canvas.rectangle(Box(start, middle - half_width, end, middle + half_width), "NOTES")

    lengths = []
    for span in (Span(0.0, at_wall.backing.start), at_wall.backing, at_wall.grid):
        start, end = arm.along(span)
        lengths.append(Length("bottom", (start, middle - half_backing), (end, middle - half_backing)))
    if arm.sign < 0.0:  # the widths are those of all gauges: they stand beside the first leaf alone
        for half_width in (half_backing, half_grid):
            lengths.append(Length("left", (arm.wall, middle - half_width), (arm.wall, middle + half_width)))
    draw_lengths(canvas, lengths, leaf)
    height = canvas.text_height
    canvas.words(f"{arm.name.upper()} UPPER LEAF", (0.5 * (left + right), leaf.top + height), 0.7 * height)


def centres_of_domes(housing: Housing) -> str:
    """Return where the spheres of domes stand beside their tips [mm], in words; x and y are those of the plate."""
    places = []
    for arm in housing.arms:
        along, across = housing.dome_beside(arm)
        places.append(f"{arm.name} x {along:+.3f}, y {across:+.3f}")
    return "; ".join(places)


def _notes(housing: Housing, process: Process) -> list[str]:
    """Return the notes of the sheet, from above."""
    layer = f", layer {process.layer_mm:g} mm" if process.layer_mm else ""
    faces = "tips are domes as made" if housing.dome_radius else "tip faces sharp-edged"
    notes = [
        "Millimetres. Section in the middle of the depth, and view from the left.",
        f"{process.material}{layer}; made flat, this profile in the plane of the bed.",
        f"Leaves solid: stiffness assumes E = {process.E_MPa:g} MPa. Two leaves of a spring are equal.",
        f"Gaps over the shuttles are stops; {faces}.",
        f"Measure leaf thicknesses; calibrate both springs. Under {SMALL_MM:g}: ±{process.accuracy_mm:g}.",
    ]
    if housing.dowels:
        notes.append("Plate of a square: MAKE TWO, one turned half round the press axis, pads on pads.")
        notes.append(f"Dowels ISO 8734 {DOWEL_MM:g} m6 in holes reamed H7.")
    if housing.domes_beside:
        notes.append(f"Centres of domes from the middle of their tips: {centres_of_domes(housing)}.")
    if housing.pin_side:
        size = f"{housing.pocket_side:g} wide, {housing.pocket_depth:g} deep"
        notes.append(f"Pockets {size} for pins, see their drawing; these stand out {housing.pin_out:g}.")
    return notes
