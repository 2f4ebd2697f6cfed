"""The drawing of a housing, which is also its measuring sheet [mm].

It shows the section, the view from the left and, for a plate with pads, the view from behind. Every dimension is given
once. Dimensions that determine K or the contact are in a table with empty cells for measured values.

Distances between lines and texts are multiples of the text height, chosen by eye on printed sheets.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cadquery as cq

from cad.drawing.canvas import MEASURED, SMALL_MM, Box, CalloutText, Canvas, DimensionText, Point, text_width
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.measuring_table import HEADS, STEP_MM, MeasuredDimension, measuring_table
from cad.drawing.projection import draw_view, view_of
from cad.drawing.section import draw_section, hatch_section, section
from cad.drawing.sheet import BETWEEN_MM, Sheet, Table, Title, on_sheet
from cad.parts.hall_seats import HallSeats
from cad.parts.housing import DOWEL_MM, SETBACK_MM, Arm, BackToBack, Housing, fillet_corners
from cad.parts.part import NEAR_MM
from cad.parts.pin_socket import pin_places, pin_solid
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.design.readout import PROBE

_BESIDE_BEHIND_MM = 20.0  # space for dimensions to the left of the view from behind, on paper
_ASIDE = 0.6  # distance from a short dimension line to the text beside it, in text heights
_TITLE = 1.4  # letter height of the name of a view, in text heights
_NAME = 0.8  # letter height of the name of a spring, in text heights
_ROOM_BEHIND_MM = 14.0  # space for a row of dimensions above the view from behind, on paper
_NAME_BELOW_MM = 9.0  # distance from the view from behind to its name, on paper
_SPOT_MM = 0.8  # radius of the circle that marks a Hall sensor, on paper

Measured = Mapping[str, MeasuredDimension]


@dataclass(frozen=True, kw_only=True)
class _Shown:
    """Everything to be drawn: the sensor, sections of housing and pins, visible edges, and the measuring table."""

    sensor: SensorSolids
    cut: cq.Shape
    pin_cuts: Sequence[cq.Shape]
    from_left: Sequence[cq.Edge]
    from_behind: Sequence[cq.Edge]
    measured: Measured

    @property
    def housing(self) -> Housing:
        return self.sensor.housing


def housing_drawing(sensor: SensorSolids, title: Title) -> Sheet:
    """Return the sheet of a housing: the section y = 0 seen along +y, and to its right the view from the left.

    A plate with pads is also shown from behind, below these views.
    """
    housing = sensor.housing
    pin = housing.pin
    pins = [] if pin is None else [pin_solid(pin, sensor.tips).moved(place) for place in pin_places(housing).values()]
    printed = sensor.part.shape
    shown = _Shown(
        sensor=sensor,
        cut=section(printed),
        pin_cuts=[section(pin) for pin in pins],
        from_left=view_of(cq.Compound.makeCompound([printed, *pins]), "left"),
        from_behind=view_of(printed, "behind") if housing.back_to_back else (),
        measured=measuring_table(sensor, title.process),
    )
    return on_sheet(lambda canvas: _draw_views(canvas, shown), _notes(shown, title.process), title)


def _draw_views(canvas: Canvas, shown: _Shown) -> tuple[Table, list[Box]]:
    """Draw all views, and return the table of the sheet and the box of each view [mm].

    The section is drawn first, because its box determines the places of the other views.
    """
    housing = shown.housing
    measured = shown.measured
    _draw_section(canvas, shown)
    hatch_section(canvas, shown.cut)
    section_box = canvas.extents()
    drawn = canvas.count()
    _draw_from_the_left(canvas, shown, section_box)
    boxes = [section_box, canvas.extents(after=drawn)]
    if housing.back_to_back:
        drawn = canvas.count()
        _draw_from_behind(canvas, shown, housing.back_to_back, section_box)
        boxes.append(canvas.extents(after=drawn))
    rows = [row for one in measured.values() for row in one.rows]
    to_fill = ("plate 1", "plate 2") if housing.back_to_back else ("measured",)
    return Table(heads=HEADS, to_fill=to_fill, rows=rows), boxes


def _draw_section(canvas: Canvas, shown: _Shown) -> None:
    """Draw the section in the coordinates x, z of the housing, with its dimensions."""
    housing = shown.housing
    measured = shown.measured
    draw_section(canvas, shown.cut)
    for pin in shown.pin_cuts:
        draw_section(canvas, pin, "NOTES")
    lengths = [
        *_frame_lengths(housing, measured),
        *_spring_lengths(housing, measured),
        *_tip_lengths(housing, measured),
    ]
    draw_lengths(canvas, lengths, Box(housing.left, -housing.beyond_face, housing.right, housing.top_level))
    for arm in housing.arms:
        _draw_thickness_and_name(canvas, arm, measured[f"{arm.name} thickness"])
        _draw_stop(canvas, housing, arm, measured[f"{arm.name} stop"])
    _draw_callouts(canvas, housing, measured["fillet"])
    if shown.sensor.seats is not None:
        _draw_magnet_pockets(canvas, housing, shown.sensor.seats)
    level = canvas.extents().top + 1.6 * canvas.text_height
    canvas.words("A-A", (0.5 * (housing.left + housing.right), level), _TITLE * canvas.text_height)
    _mark_holes(canvas, housing, lambda x, z: (x, z))


def _mark_holes(canvas: Canvas, housing: Housing, place: Callable[[float, float], Point]) -> None:
    """Draw the centre lines of the holes for screws and dowels.

    `place` maps x and z of the housing to the point in a view [mm].
    """
    for hole in housing.holes:
        canvas.centre_mark(place(*hole), 0.5 * housing.hole_diameter)
    if housing.back_to_back:
        for hole in housing.dowels:
            canvas.centre_mark(place(*hole), 0.5 * housing.back_to_back.dowel_hole)


def _frame_lengths(housing: Housing, measured: Measured) -> list[Length]:
    """Return the lengths around the frame, each with the side of the section where it is drawn.

    They are outer sizes, walls, screw holes, and the height of the tips below the frame.
    """
    low, high = housing.arms
    bottom_left = (housing.left, housing.protrusion)
    top_left = (housing.left, housing.top_level)
    top_right = (housing.right, housing.top_level)
    lower_hole, upper_hole = low.holes
    tip_corner = (low.centre - 0.5 * housing.touching_side, -housing.beyond_face)
    return [
        Length("top", top_left, top_right),
        Length("top", upper_hole, high.holes[1]),
        Length("top", top_left, upper_hole),
        Length("bottom", bottom_left, (low.wall, housing.protrusion)),
        Length("right", (high.wall, housing.cavity_level), top_right),
        Length("left", bottom_left, top_left),
        Length("left", lower_hole, upper_hole),
        Length("left", bottom_left, lower_hole),
        Length("left", tip_corner, bottom_left, measured["height"].label()),
    ]


def _spring_lengths(housing: Housing, measured: Measured) -> list[Length]:
    """Return the levels of the leaves, and the leaf length of each spring."""
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
        lengths.append(Length("bottom", (left, underside), (right, underside), measured[f"{arm.name} length"].label()))
    return lengths


def _has_neck(housing: Housing) -> bool:
    """Return whether the tips are narrower than their shuttles."""
    return max(housing.shuttle_width, housing.depth) - housing.tip_side > NEAR_MM


def _tip_lengths(housing: Housing, measured: Measured) -> list[Length]:
    """Return the distance between the tips, and the widths and levels of tips, necks and pins.

    With pins, the printed tip is the foot from which the pin protrudes. A tip as wide as its shuttle has no neck, and
    then the dimensions of the neck are left out.
    """
    low, high = housing.arms
    half_width = 0.5 * housing.shuttle_width
    neck = housing.neck_level
    high_tip = (high.centre, 0.0)
    out = housing.beyond_face
    lengths = [
        Length("bottom", (low.centre, -out), (high.centre, -out), measured["spacing"].label()),
        Length("bottom", (low.centre - half_width, neck), (low.centre + half_width, neck), f"2x {MEASURED}"),
    ]
    if housing.pin:
        pin_corner = (low.centre - 0.5 * housing.pin.side, -out)
        foot_corner = (low.centre - 0.5 * housing.tip_side, 0.0)
        lengths.append(Length("left", pin_corner, foot_corner))
    if not _has_neck(housing):
        return lengths
    lengths.append(Length("right", high_tip, (high.centre + half_width, neck)))
    if housing.tip_height < neck - NEAR_MM:
        shoulder = (high.centre + 0.5 * housing.tip_side, housing.tip_height)
        lengths.append(Length("right", high_tip, shoulder))
    return lengths


def _draw_thickness_and_name(canvas: Canvas, arm: Arm, measured: MeasuredDimension) -> None:
    """Draw the thickness of the leaves and the name of the spring in the window between its leaves.

    The dimension is at the upper leaf near its left root, with its text below. If the window is too narrow for the
    whole name, a short one is written.
    """
    height = canvas.text_height
    left, right = arm.roots
    thickness = arm.flexure.thickness
    lower_leaf, upper_leaf = arm.levels
    underside = upper_leaf - 0.5 * thickness
    label = measured.label()
    x = left + max(_ASIDE * height, 0.1 * (right - left))
    text_at = (x + _ASIDE * height + 0.5 * canvas.label_width(label, thickness), underside - 2.0 * height)
    canvas.length("z", (x, underside), (x, underside + thickness), x, DimensionText(text_at, label))

    middle = (0.5 * (left + right), 0.5 * (lower_leaf + upper_leaf) + 0.3 * height)
    name = arm.name.upper()
    mark = name[0]
    words = f"{name} SPRING ({mark})"
    if text_width(words, _NAME * height) >= right - left - height:
        words = f"{name} ({mark})"
    canvas.words(words, middle, _NAME * height)


def _draw_stop(canvas: Canvas, housing: Housing, arm: Arm, measured: MeasuredDimension) -> None:
    """Draw the gap above a shuttle, which is its stop, with the text above the frame on the side of its spring."""
    height = canvas.text_height
    x = arm.centre
    shuttle = arm.top_level
    stop = housing.cavity_level
    label = measured.label()
    aside = _ASIDE * height + 0.5 * canvas.label_width(label, stop - shuttle)
    text_at = (x + arm.sign * aside, housing.top_level + 1.7 * height)
    canvas.length("z", (x, shuttle), (x, stop), x, DimensionText(text_at, label))


def _draw_callouts(canvas: Canvas, housing: Housing, measured: MeasuredDimension) -> None:
    """Draw the radius of the fillets and the diameter of the screw holes, each at one place.

    The radius is drawn between the wall of the low spring and the upper side of its lower leaf. The diameter is drawn
    at the upper hole beside the low spring. `measured` is the entry of the measuring table for the fillets.
    """
    height = canvas.text_height
    low, _ = housing.arms
    radius = housing.corner
    label = measured.label(f"{len(fillet_corners(housing))}x {MEASURED}")
    root_top = low.levels[0] + 0.5 * low.flexure.thickness
    centre = (low.wall + radius, root_top + radius)
    text = CalloutText((low.wall, root_top + 1.4 * height), "right", label)
    canvas.callout("radius", centre, radius, text, angle=225.0)  # the arc faces the corner, left and below
    text = CalloutText((housing.left, housing.top_level + 2.4 * height), "left", f"{len(housing.holes)}x {MEASURED}")
    canvas.callout("diameter", housing.holes[1], housing.hole_diameter, text)


def _draw_magnet_pockets(canvas: Canvas, housing: Housing, seats: HallSeats) -> None:
    """Draw the magnet pockets in the front of the shuttles; they lie in front of the plane of the section."""
    for arm in housing.arms:
        for below in seats.discs:
            canvas.circle((arm.centre, housing.top_level - below), 0.5 * seats.pocket_diameter, "NOTES")


def _draw_cutting_line(canvas: Canvas, middle: float, view: Box) -> None:
    """Draw both ends of the cutting line A-A at x = `middle` [mm] on the view from the left, and the name of the view.

    The arrows show the direction in which the section is seen: along +y, to the left in this view.
    """
    height = canvas.text_height
    for end, inwards in ((view.top, -1.0), (view.bottom, 1.0)):
        start = end - 1.2 * inwards * height
        canvas.line((middle, start), (middle, start - 2.0 * inwards * height))
        tip_x, tip_z = middle - 1.6 * height, start - inwards * height
        canvas.line((middle, tip_z), (tip_x, tip_z), "DIMENSIONS")
        for side in (0.3, -0.3):  # the two strokes of the arrow head
            canvas.line((tip_x, tip_z), (tip_x + 0.8 * height, tip_z + side * height), "DIMENSIONS")
        canvas.words("A", (middle + height, tip_z), 1.2 * height)
    canvas.words("FROM THE LEFT", (middle, view.top + 5.0 * height), height)


def _draw_from_the_left(canvas: Canvas, shown: _Shown, section_box: Box) -> None:
    """Draw the view from the left to the right of the section, with pad and back to the left, front to the right.

    The plane y = 0 of the housing is the vertical line x = `middle` of the drawing. Levels z are as in the section.
    """
    housing = shown.housing
    measured = shown.measured
    drawn = canvas.count()
    pad_left = section_box.right + BETWEEN_MM / canvas.scale
    back = pad_left + (housing.back_to_back.pad_height if housing.back_to_back else 0.0)
    front = back + housing.depth
    middle = back + 0.5 * housing.depth
    top = housing.top_level
    draw_view(canvas, shown.from_left, (middle, 0.0))
    lengths = [
        Length("top", (back, top), (front, top), measured["depth"].label()),
        *_widths_from_the_left(housing, measured["tip"], middle),
    ]
    if housing.back_to_back:
        lengths.append(Length("top", (pad_left, top), (back, top), measured["pad"].label()))
    if shown.sensor.seats is not None:
        lengths += _hall_lengths(canvas, housing, shown.sensor.seats, front)
    draw_lengths(canvas, lengths, Box(pad_left, -housing.beyond_face, front, top))
    if housing.dome:
        radius = housing.dome.radius
        half_tip = 0.5 * housing.tip_side
        text = CalloutText(
            (middle + half_tip, -1.2 * canvas.text_height), "right", measured["tip"].label(f"2x S{MEASURED}")
        )
        half_way_out = 270.0 + math.degrees(0.5 * half_tip / radius)  # from the apex, at 270 degrees
        canvas.callout("radius", (middle, radius), radius, text, angle=half_way_out)
    _draw_cutting_line(canvas, middle, canvas.extents(after=drawn))


def _widths_from_the_left(housing: Housing, measured: MeasuredDimension, middle: float) -> list[Length]:
    """Return the widths of pins and tips across the plate, whose middle plane is at x = `middle` [mm].

    `measured` is the entry of the measuring table for the part that touches the fruit. Its letter is on the width of
    the pins, or else of flat tips; the letter of domes is on their radius.
    """
    lengths = []
    if housing.pin:
        half_pin = 0.5 * housing.pin.side
        out = housing.pin.outside
        label = measured.label(f"2x {'Ø' if housing.pin.is_round else '□'}{MEASURED}")
        lengths.append(Length("bottom", (middle - half_pin, -out), (middle + half_pin, -out), label))
    if _has_neck(housing):
        half_tip = 0.5 * housing.tip_side
        label = MEASURED if housing.pin or housing.dome else measured.label(f"2x □{MEASURED}")
        lengths.append(Length("bottom", (middle - half_tip, 0.0), (middle + half_tip, 0.0), label))
    return lengths


def _hall_lengths(canvas: Canvas, housing: Housing, seats: HallSeats, front: float) -> list[Length]:
    """Draw magnet pockets and Hall sensor in the view from the left, and return the lengths that locate them.

    The pockets are open to the front, which is at x = `front` [mm]; the sensor is in front of them.
    """
    corner = (front, housing.top_level)
    lengths = []
    for below in seats.discs:
        level = housing.top_level - below
        half = 0.5 * seats.pocket_diameter
        canvas.rectangle(Box(front - seats.pocket_depth, level - half, front, level + half), "NOTES")
        lengths.append(Length("right", (front, level), corner))
    sensor = (front + seats.face_out, housing.top_level - seats.sensor)
    canvas.circle(sensor, _SPOT_MM / canvas.scale, "NOTES")
    return [*lengths, Length("right", sensor, corner), Length("bottom", (front, housing.protrusion), sensor)]


def _draw_from_behind(canvas: Canvas, shown: _Shown, back_to_back: BackToBack, above: Box) -> None:
    """Draw the back of a plate of a square below the other views, with its pads and its dowel holes.

    `above` is the box of the section [mm]. Seen from behind, +x of the housing points to the left.
    """
    housing = shown.housing
    height = canvas.text_height
    # The origin of the housing in the drawing: the view is left-aligned with the section, with room for its dimensions.
    at = (
        above.left + _BESIDE_BEHIND_MM / canvas.scale + housing.right,
        above.bottom - BETWEEN_MM / canvas.scale - housing.top_level - _ROOM_BEHIND_MM / canvas.scale,
    )

    def seen(x: float, z: float) -> Point:
        """Return the place in the drawing of a point x, z of the housing [mm]."""
        return at[0] - x, at[1] + z

    draw_view(canvas, shown.from_behind, at)
    top_left = seen(housing.right, housing.top_level)
    bottom_left = seen(housing.right, housing.protrusion)
    bottom_right = seen(housing.left, housing.protrusion)
    last, first = (seen(*dowel) for dowel in sorted(housing.dowels))  # counted from the left, where x is largest
    lengths = [Length("top", top_left, first), Length("top", first, last), Length("left", bottom_left, first)]
    lengths += _pad_lengths(housing, seen)
    _, bar_foot = seen(0.0, housing.cavity_level + SETBACK_MM)
    canvas.words("PAD", (at[0], 0.5 * (bar_foot + top_left[1])), height)
    draw_lengths(canvas, lengths, Box(top_left[0], bottom_left[1], bottom_right[0], top_left[1]))
    _mark_holes(canvas, housing, seen)
    window_level = at[1] + 0.5 * (housing.cavity_level + housing.protrusion)
    text = CalloutText((last[0], window_level), "left", f"2x {MEASURED}")
    canvas.callout("diameter", last, back_to_back.dowel_hole, text)
    level = bottom_left[1] - _NAME_BELOW_MM / canvas.scale
    canvas.words("FROM BEHIND", (at[0], level), _TITLE * height)


def _pad_lengths(housing: Housing, seen: Callable[[float, float], Point]) -> list[Length]:
    """Return the width of the posts of a pad, the height of its bar, and the height of its foot above the plate's foot.

    A pad is an upside-down U on the back of the frame: a post on each wall and a bar along the top. Its edges are set
    back from the cavity, in which the arms move. `seen` maps a point of the housing to its place in the drawing [mm].
    """
    foot = max(housing.cover_level, housing.protrusion)
    post = housing.right - housing.wall_width + SETBACK_MM
    pad_foot = seen(housing.right, foot)
    lengths = [
        Length("bottom", pad_foot, seen(post, foot), f"2x {MEASURED}"),
        Length("left", seen(post, housing.cavity_level + SETBACK_MM), seen(housing.right, housing.top_level)),
    ]
    if foot - housing.protrusion > NEAR_MM:
        lengths.append(Length("left", seen(housing.right, housing.protrusion), pad_foot))
    return lengths


def _notes(shown: _Shown, process: Process) -> list[str]:
    """Return the notes of the sheet, one per line, from the top."""
    housing = shown.housing
    measured = shown.measured
    layer = f", layer {process.layer_mm:g} mm" if process.layer_mm else ""
    faces = "tips are domes as made" if housing.dome else "tip faces sharp-edged"
    notes = [
        "Millimetres. Section in the middle of the depth.",
        f"{process.material}{layer}; made flat, this profile in the plane of the bed.",
        f"Leaves solid, E = {process.E_MPa:g} MPa. Two leaves of a spring are equal.",
        f"Gaps over the shuttles are stops; {faces}.",
        "Letters name rows of the table; no letter: general tolerance.",
        f"±{process.accuracy_mm:g}: holds 95 % of {process.name}, for leaves and lengths under {SMALL_MM:g}.",
        f"{measured['spacing'].letter}): mean of two readings, over both tips and between them.",
        f"+{STEP_MM:g} moves: stiffness K, contact or force of a tip, in proportion.",
        "Outside its tolerance: make it again. Calibrate every unit.",
    ]
    if housing.dowels:
        notes.append("MAKE TWO: one is turned half round the press axis, pads on pads.")
        notes.append(f"Dowels ISO 8734 {DOWEL_MM:g} m6: ream their holes {DOWEL_MM:g} H7.")
    if seats := shown.sensor.seats:
        magnets = f"Magnets {PROBE.magnet_mm:g} x {PROBE.magnet_height_mm:g}"
        notes.append(f"{magnets}, flush in the FRONT of each shuttle, over its tip.")
        end = ", closed by a cone of 90 degrees" if seats.is_pointed else ""
        size = f"Ø{seats.pocket_diameter:g}, {seats.pocket_depth:g} deep"
        notes.append(f"Their pockets, {measured['pocket'].letter}): {size}{end}.")
        notes.append("The small circle before them is the marked face of their Hall sensor.")
    if pin := housing.pin:
        ends = "edges of their ends sharp" if shown.sensor.tips.tip_shape.is_flat else "ends as in pin.step, polished"
        notes.append(f"Pins of ground steel, glued in pockets {pin.pocket_side:g} wide, {pin.pocket_depth:g} deep;")
        notes.append(f"{ends}.")
    return notes
