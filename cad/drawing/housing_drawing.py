"""The drawing of a housing [mm], which also serves as its measuring sheet.

The drawing shows the section, the view from the left and, for a plate with pads, the view from behind. Every dimension
is given once. The dimensions that determine the stiffness K or the contact are also listed in a table, which has empty
cells for the measured values.

Distances between lines and texts are multiples of the text height. Where no reason is given, they were chosen by eye on
printed sheets.
"""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cadquery as cq

from cad.drawing.canvas import MEASURED, SMALL_MM, Box, CalloutText, Canvas, DimensionText, Point, text_width
from cad.drawing.lengths import LinearDimension, draw_dimensions
from cad.drawing.measuring_table import HEADINGS, STEP_MM, MeasuredDimension, list_measured_dimensions
from cad.drawing.projection import draw_view, project_visible_edges
from cad.drawing.section import draw_section, hatch_section, section
from cad.drawing.sheet import BETWEEN_MM, Sheet, Table, Title, lay_out_sheet
from cad.parts.hall_seats import HallSeats
from cad.parts.housing import DOWEL_MM, SETBACK_MM, Arm, BackToBack, Housing, Pin, fillet_corners
from cad.parts.layout import STOP_SAFETY
from cad.parts.part import NEAR_MM
from cad.parts.pin_socket import pin_locations, pin_solid
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.design.readout import PROBE

_SPACE_LEFT_MM = 20.0  # space for dimensions to the left of the view from behind, on paper
_SPACE_ABOVE_MM = 14.0  # space for a row of dimensions above the view from behind, on paper
_BESIDE_LINE = 0.6  # distance from a short dimension line to the text beside it, in text heights
_VIEW_NAME = 1.4  # letter height of the name of a view, in text heights
_SPRING_NAME = 0.8  # letter height of the name of a spring, in text heights
_NAME_BELOW_MM = 9.0  # distance from the view from behind to its name, on paper
_SENSOR_MARK_MM = 0.8  # radius of the circle that marks a Hall sensor, on paper

Measured = Mapping[str, MeasuredDimension]
"""The entries of the measuring table, keyed by name, such as "low thickness"."""


@dataclass(frozen=True, kw_only=True)
class _SheetContents:
    """The contents of the sheet.

    `cut` and `pin_cuts` are the sections of the housing and of its pins. `from_left` and `from_behind` hold the visible
    edges of two views. `measured` holds the entries of the measuring table, keyed by name.
    """

    sensor: SensorSolids
    cut: cq.Shape
    pin_cuts: Sequence[cq.Shape]
    from_left: Sequence[cq.Edge]
    from_behind: Sequence[cq.Edge]
    measured: Measured

    @property
    def housing(self) -> Housing:
        """Return the housing of the sensor."""
        return self.sensor.housing


def draw_housing_sheet(sensor: SensorSolids, title: Title, deflections: Sequence[float]) -> Sheet:
    """Draw a housing on a sheet, and return the sheet; `title` holds the contents of its title block.

    `deflections` [mm] are the deflections of the low and the high spring at full travel, which the stops must allow.
    The sheet shows the section y = 0 seen along +y, and to its right the view from the left. A plate with pads is also
    shown from behind, below these views.
    """
    housing = sensor.housing
    pins = []
    if housing.pin is not None:
        pin_shape = pin_solid(housing.pin, sensor.tips)
        pins = [pin_shape.moved(place) for place in pin_locations(housing).values()]
    printed_part = sensor.part.shape
    # A single plate has no pads, and no view from behind.
    from_behind = project_visible_edges(printed_part, "behind") if housing.back_to_back else ()
    contents = _SheetContents(
        sensor=sensor,
        cut=section(printed_part),
        pin_cuts=[section(pin) for pin in pins],
        from_left=project_visible_edges(cq.Compound.makeCompound([printed_part, *pins]), "left"),
        from_behind=from_behind,
        measured=list_measured_dimensions(sensor, title.process, deflections),
    )
    # The sheet calls this function once for each scale that it tries.
    draw_views = functools.partial(_draw_views, contents=contents)
    return lay_out_sheet(draw_views, _notes(contents, title.process), title)


def _draw_views(canvas: Canvas, contents: _SheetContents) -> tuple[Table, list[Box]]:
    """Draw all views on a canvas, and return the measuring table of the sheet and the bounding box of each view [mm].

    The section is drawn first, because its box determines the positions of the other views. The bounding box of each
    other view encloses the entities that were added to the canvas for it.
    """
    housing = contents.housing
    measured = contents.measured
    _draw_section(canvas, contents)
    hatch_section(canvas, contents.cut)
    section_box = canvas.extents()
    drawn_count = canvas.entity_count()
    _draw_from_the_left(canvas, contents, section_box)
    boxes = [section_box, canvas.extents(after=drawn_count)]
    if housing.back_to_back:
        drawn_count = canvas.entity_count()
        _draw_from_behind(canvas, contents, housing.back_to_back, section_box)
        boxes.append(canvas.extents(after=drawn_count))
    rows = [row for dimension in measured.values() for row in dimension.rows]
    blank_headings = ("plate 1", "plate 2") if housing.back_to_back else ("measured",)
    return Table(headings=HEADINGS, blank_headings=blank_headings, rows=rows), boxes


def _draw_section(canvas: Canvas, contents: _SheetContents) -> None:
    """Draw the section with its dimensions, names and hole marks, in the coordinates x and z of the housing [mm].

    Pins and magnet pockets are drawn on the layer NOTES, because they are not part of the printed section.
    """
    housing = contents.housing
    measured = contents.measured
    draw_section(canvas, contents.cut)
    for pin in contents.pin_cuts:
        draw_section(canvas, pin, "NOTES")
    dimensions = [
        *_frame_dimensions(housing, measured),
        *_spring_dimensions(housing, measured),
        *_tip_dimensions(housing, measured),
    ]
    draw_dimensions(canvas, dimensions, Box(housing.left, -housing.beyond_face, housing.right, housing.top_level))
    for arm in housing.arms:
        _draw_thickness(canvas, arm, measured[f"{arm.name} thickness"])
        _write_spring_name(canvas, arm)
        _draw_stop(canvas, housing, arm, measured[f"{arm.name} stop"])
    _draw_callouts(canvas, housing, measured["fillet"])
    if contents.sensor.seats is not None:
        _draw_magnet_pockets(canvas, housing, contents.sensor.seats)
    # The name of the section is written above all dimensions, which end at the top of the canvas. The distance of the
    # name from the dimensions was chosen by eye.
    name_position = (0.5 * (housing.left + housing.right), canvas.extents().top + 1.6 * canvas.text_height)
    canvas.write_text("A-A", name_position, _VIEW_NAME * canvas.text_height)
    _mark_holes(canvas, housing, lambda x, z: (x, z))  # the section has the coordinates of the housing


def _mark_holes(canvas: Canvas, housing: Housing, to_view: Callable[[float, float], Point]) -> None:
    """Draw the centre lines of the screw holes and dowel holes.

    `to_view` maps the coordinates x and z of the housing to a point in the view [mm].
    """
    for hole in housing.holes:
        canvas.centre_mark(to_view(*hole), 0.5 * housing.hole_diameter)
    if housing.back_to_back:
        for hole in housing.dowels:
            canvas.centre_mark(to_view(*hole), 0.5 * housing.back_to_back.dowel_hole)


def _frame_dimensions(housing: Housing, measured: Measured) -> list[LinearDimension]:
    """Return the dimensions of the frame, to be drawn around the section.

    The dimensions are the outer sizes, the wall thicknesses, the positions of the screw holes, and the distance by
    which the tips protrude from the frame. `measured` holds the entries of the measuring table, whose letters are in
    the labels.
    """
    low, high = housing.arms
    # The tip faces are at z = 0, so the lower edge of the frame is at z = `housing.protrusion`.
    bottom_left = (housing.left, housing.protrusion)
    top_left = (housing.left, housing.top_level)
    top_right = (housing.right, housing.top_level)
    lower_hole, upper_hole = low.holes
    _, high_upper_hole = high.holes
    tip_corner = (low.centre - 0.5 * housing.touching_side, -housing.beyond_face)
    return [
        LinearDimension("top", top_left, top_right),  # width
        LinearDimension("top", upper_hole, high_upper_hole),  # horizontal spacing of the screw holes
        LinearDimension("top", top_left, upper_hole),  # screw hole from the left edge
        LinearDimension("bottom", bottom_left, (low.wall, housing.protrusion)),  # thickness of the side wall
        LinearDimension("right", (high.wall, housing.cavity_level), top_right),  # thickness of the upper wall
        LinearDimension("left", bottom_left, top_left),  # height
        LinearDimension("left", lower_hole, upper_hole),  # vertical spacing of the screw holes
        LinearDimension("left", bottom_left, lower_hole),  # screw hole from the lower edge
        LinearDimension("left", tip_corner, bottom_left, measured["height"].label()),  # protrusion of the tips
    ]


def _spring_dimensions(housing: Housing, measured: Measured) -> list[LinearDimension]:
    """Return the dimensions of the springs: the levels of the leaves, and the leaf length of each spring.

    The levels are drawn only at the high spring, because they are the same for both springs. `measured` holds the
    entries of the measuring table, whose letters are in the labels.
    """
    _, high = housing.arms
    lower_level, upper_level = high.levels
    lower_root = (high.wall, lower_level)
    upper_root = (high.wall, upper_level)
    dimensions = [
        LinearDimension("right", (high.centre, 0.0), lower_root),  # lower leaf from the tip face
        LinearDimension("right", lower_root, upper_root),  # spacing of the leaves
    ]
    for arm in housing.arms:
        left, right = arm.roots
        lower_leaf, _ = arm.levels
        underside = lower_leaf - 0.5 * arm.flexure.thickness
        label = measured[f"{arm.name} length"].label()
        dimensions.append(LinearDimension("bottom", (left, underside), (right, underside), label))
    return dimensions


def _has_neck(housing: Housing) -> bool:
    """Return whether the tips have necks: whether they are narrower than the shuttles or shallower than the plate."""
    return max(housing.shuttle_width, housing.depth) - housing.tip_side > NEAR_MM


def _tip_dimensions(housing: Housing, measured: Measured) -> list[LinearDimension]:
    """Return the dimensions around the tips: spacing, width of a shuttle, and levels of tips, necks and pins.

    If there are pins, a printed tip is the foot from which a pin protrudes. If there are no necks, the dimensions of
    the necks are omitted. `measured` holds the entries of the measuring table, whose letters are in the labels.
    """
    low, high = housing.arms
    half_width = 0.5 * housing.shuttle_width
    neck_level = housing.neck_level
    high_face = (high.centre, 0.0)
    pin_protrusion = housing.beyond_face
    low_end, high_end = (low.centre, -pin_protrusion), (high.centre, -pin_protrusion)
    shuttle_left, shuttle_right = (low.centre - half_width, neck_level), (low.centre + half_width, neck_level)
    dimensions = [
        LinearDimension("bottom", low_end, high_end, measured["spacing"].label()),  # spacing of the tips
        LinearDimension("bottom", shuttle_left, shuttle_right, f"2x {MEASURED}"),  # both shuttles are equally wide
    ]
    if housing.pin:
        pin_corner = (low.centre - 0.5 * housing.pin.side, -pin_protrusion)
        foot_corner = (low.centre - 0.5 * housing.tip_side, 0.0)
        dimensions.append(LinearDimension("left", pin_corner, foot_corner))  # protrusion of the pins from their feet
    if not _has_neck(housing):
        return dimensions
    shuttle_corner = (high.centre + half_width, neck_level)
    dimensions.append(LinearDimension("right", high_face, shuttle_corner))  # top of the neck from the tip face
    if housing.tip_height < neck_level - NEAR_MM:
        shoulder = (high.centre + 0.5 * housing.tip_side, housing.tip_height)
        dimensions.append(LinearDimension("right", high_face, shoulder))  # height of the straight part of the tip
    return dimensions


def _draw_thickness(canvas: Canvas, arm: Arm, measured: MeasuredDimension) -> None:
    """Draw the leaf thickness of a spring at its upper leaf, with the text in the window between the two leaves.

    `measured` is the entry of the measuring table for the thickness. The dimension line is near the left root. The
    distances of this line from the root and from the text were chosen by eye.
    """
    height = canvas.text_height
    left, right = arm.roots
    thickness = arm.flexure.thickness
    _, upper_leaf = arm.levels
    underside = upper_leaf - 0.5 * thickness
    label = measured.label()
    x = left + max(_BESIDE_LINE * height, 0.1 * (right - left))
    text_position = (x + _BESIDE_LINE * height + 0.5 * canvas.label_width(label, thickness), underside - 2.0 * height)
    canvas.add_linear_dimension("z", (x, underside), (x, underside + thickness), x, DimensionText(text_position, label))


def _write_spring_name(canvas: Canvas, arm: Arm) -> None:
    """Write the name of a spring, such as "LOW SPRING (L)", in the window between its two leaves.

    If the window is too narrow, the short form "LOW (L)" is written. A margin of half a text height is left on each
    side. The text is slightly above the centre of the window, by a distance chosen by eye.
    """
    height = canvas.text_height
    left, right = arm.roots
    lower_leaf, upper_leaf = arm.levels
    position = (0.5 * (left + right), 0.5 * (lower_leaf + upper_leaf) + 0.3 * height)
    name = arm.name.upper()
    spring_letter = name[0]
    text = f"{name} SPRING ({spring_letter})"
    if text_width(text, _SPRING_NAME * height) >= right - left - height:
        text = f"{name} ({spring_letter})"
    canvas.write_text(text, position, _SPRING_NAME * height)


def _draw_stop(canvas: Canvas, housing: Housing, arm: Arm, measured: MeasuredDimension) -> None:
    """Draw the gap above a shuttle, which is the distance to its stop.

    The text is above the frame, at a distance chosen by eye, and beside the dimension line on the side of the leaves.
    `measured` is the entry of the measuring table for the gap.
    """
    height = canvas.text_height
    x = arm.centre
    shuttle_top = arm.top_level
    frame_underside = housing.cavity_level
    label = measured.label()
    offset = _BESIDE_LINE * height + 0.5 * canvas.label_width(label, frame_underside - shuttle_top)
    # The leaves are to the left of the left shuttle (`arm.sign` = -1), and to the right of the right one (1).
    text_position = (x + arm.sign * offset, housing.top_level + 1.7 * height)
    canvas.add_linear_dimension("z", (x, shuttle_top), (x, frame_underside), x, DimensionText(text_position, label))


def _draw_callouts(canvas: Canvas, housing: Housing, fillet: MeasuredDimension) -> None:
    """Draw one dimension for the radius of all fillets, and one for the diameter of all screw holes.

    The radius is drawn at the fillet between the wall of the low spring and the top of its lower leaf. The diameter is
    drawn at the upper hole beside the low spring. `fillet` is the entry of the measuring table for the fillets. Screw
    holes have no entry, because only the general tolerance applies to them.
    """
    height = canvas.text_height
    low, _ = housing.arms
    radius = housing.corner
    label = fillet.label(f"{len(fillet_corners(housing))}x {MEASURED}")
    lower_leaf, _ = low.levels
    leaf_top = lower_leaf + 0.5 * low.flexure.thickness
    centre = (low.wall + radius, leaf_top + radius)
    # These multiples of the text height were chosen by eye. They keep the texts away from leaves and dimension lines.
    radius_text = CalloutText((low.wall, leaf_top + 1.4 * height), "right", label)
    canvas.add_callout("radius", centre, radius, radius_text, angle=225.0)  # the corner is to the lower left of the arc
    hole_label = f"{len(housing.holes)}x {MEASURED}"
    hole_text = CalloutText((housing.left, housing.top_level + 2.4 * height), "left", hole_label)
    _, upper_hole = low.holes
    canvas.add_callout("diameter", upper_hole, housing.hole_diameter, hole_text)


def _draw_magnet_pockets(canvas: Canvas, housing: Housing, seats: HallSeats) -> None:
    """Draw the outlines of the magnet pockets on the layer NOTES, because they lie in front of the cutting plane."""
    for arm in housing.arms:
        for depth_below_top in seats.disc_levels:
            canvas.circle((arm.centre, housing.top_level - depth_below_top), 0.5 * seats.pocket_diameter, "NOTES")


def _draw_cutting_line(canvas: Canvas, middle: float, view: Box) -> None:
    """Draw both ends of the cutting line of section A-A on the view from the left, and the name of this view.

    The cutting line is at x = `middle`, and `view` is the bounding box of the view [mm]. The arrows show the viewing
    direction of the section: along +y, which points to the left in this view. The multiples of the text height were
    chosen by eye.
    """
    height = canvas.text_height
    for edge, inward in ((view.top, -1.0), (view.bottom, 1.0)):  # `inward` is the sign of z towards the view
        # A thick stroke marks the end of the cutting line. An arrow and the letter A are at the middle of the stroke.
        start = edge - 1.2 * inward * height
        canvas.line((middle, start), (middle, start - 2.0 * inward * height))
        tip_x, tip_z = middle - 1.6 * height, start - inward * height
        canvas.line((middle, tip_z), (tip_x, tip_z), "DIMENSIONS")
        for arrow_slope in (0.3, -0.3):  # the two strokes of the arrowhead
            canvas.line((tip_x, tip_z), (tip_x + 0.8 * height, tip_z + arrow_slope * height), "DIMENSIONS")
        canvas.write_text("A", (middle + height, tip_z), 1.2 * height)
    canvas.write_text("FROM THE LEFT", (middle, view.top + 5.0 * height), height)


def _draw_from_the_left(canvas: Canvas, contents: _SheetContents, section_box: Box) -> None:
    """Draw the view from the left, to the right of the section.

    `section_box` is the bounding box of the section [mm]. In this view, the pad and the back of the housing are on the
    left, and its front is on the right. The plane y = 0 of the housing is the line x = `middle_x` of the drawing.
    Heights z are the same as in the section.
    """
    housing = contents.housing
    measured = contents.measured
    drawn_count = canvas.entity_count()
    # The x coordinates in the drawing, from left to right: the face of the pad, the back, the mid-plane and the front.
    pad_left = section_box.right + BETWEEN_MM / canvas.scale
    pad_height = housing.back_to_back.pad_height if housing.back_to_back else 0.0
    back = pad_left + pad_height
    front = back + housing.depth
    middle_x = back + 0.5 * housing.depth
    top = housing.top_level
    draw_view(canvas, contents.from_left, (middle_x, 0.0))
    dimensions = [
        LinearDimension("top", (back, top), (front, top), measured["depth"].label()),
        *_widths_from_the_left(housing, measured["tip"], middle_x),
    ]
    if housing.back_to_back:
        dimensions.append(LinearDimension("top", (pad_left, top), (back, top), measured["pad"].label()))
    if contents.sensor.seats is not None:
        dimensions += _draw_hall_parts(canvas, housing, contents.sensor.seats, front)
    draw_dimensions(canvas, dimensions, Box(pad_left, -housing.beyond_face, front, top))
    if housing.dome:
        _draw_dome_radius(canvas, housing.dome.radius, 0.5 * housing.tip_side, middle_x, measured["tip"])
    _draw_cutting_line(canvas, middle_x, canvas.extents(after=drawn_count))


def _draw_dome_radius(
    canvas: Canvas, radius: float, half_tip: float, middle_x: float, measured: MeasuredDimension
) -> None:
    """Draw the radius of a dome in the view from the left, with its text to the lower right of the tip.

    `radius` [mm] is the radius of the dome, whose apex is at z = 0. `half_tip` [mm] is half the side of the tip, and
    `middle_x` [mm] is the x coordinate of its middle. `measured` is the entry of the measuring table for the radius.
    """
    label = measured.label(f"2x S{MEASURED}")  # a spherical radius is marked by SR, of which ezdxf adds the R
    text = CalloutText((middle_x + half_tip, -1.2 * canvas.text_height), "right", label)
    # The arrow meets the dome halfway between its apex, which is at 270 degrees, and the edge of the tip.
    angle = 270.0 + math.degrees(0.5 * half_tip / radius)
    canvas.add_callout("radius", (middle_x, radius), radius, text, angle=angle)


def _widths_from_the_left(housing: Housing, measured: MeasuredDimension, middle: float) -> list[LinearDimension]:
    """Return the dimensions of the widths of pins and tips in the view from the left.

    The prefix 2x of a label means that the dimension applies to both tips. The mid-plane of the plate is at x =
    `middle` [mm]. `measured` is the entry of the measuring table for the part that touches the fruit. The letter of
    this entry is written at the width of the pins, or at the width of flat tips if there are no pins. For domes, it is
    written at their radius instead.
    """
    dimensions = []
    if housing.pin:
        half_pin = 0.5 * housing.pin.side
        pin_end = -housing.pin.protruding_length  # z of the end of a pin
        shape_symbol = "Ø" if housing.pin.is_round else "□"
        label = measured.label(f"2x {shape_symbol}{MEASURED}")
        dimensions.append(LinearDimension("bottom", (middle - half_pin, pin_end), (middle + half_pin, pin_end), label))
    if _has_neck(housing):
        half_tip = 0.5 * housing.tip_side
        touches_fruit = not (housing.pin or housing.dome)  # whether the flat tip itself touches the fruit
        label = measured.label(f"2x □{MEASURED}") if touches_fruit else MEASURED
        dimensions.append(LinearDimension("bottom", (middle - half_tip, 0.0), (middle + half_tip, 0.0), label))
    return dimensions


def _draw_hall_parts(canvas: Canvas, housing: Housing, seats: HallSeats, front: float) -> list[LinearDimension]:
    """Draw the magnet pockets and the Hall sensor in the view from the left, and return their position dimensions.

    The pockets open at the front of the plate, at x = `front` [mm]. The sensor is in front of them. Pockets and sensor
    are drawn on the layer NOTES, because they are hidden or not part of the housing.
    """
    top_corner = (front, housing.top_level)
    half_width = 0.5 * seats.pocket_diameter
    dimensions = []
    for depth_below_top in seats.disc_levels:
        pocket_z = housing.top_level - depth_below_top
        canvas.rectangle(Box(front - seats.pocket_depth, pocket_z - half_width, front, pocket_z + half_width), "NOTES")
        dimensions.append(LinearDimension("right", (front, pocket_z), top_corner))
    # `seats.face_distance` is the distance of the sensor from the front. `seats.sensor_level` is its distance below the
    # upper edge.
    sensor_centre = (front + seats.face_distance, housing.top_level - seats.sensor_level)
    canvas.circle(sensor_centre, _SENSOR_MARK_MM / canvas.scale, "NOTES")
    return [
        *dimensions,
        LinearDimension("right", sensor_centre, top_corner),  # sensor from the upper edge of the frame
        LinearDimension("bottom", (front, housing.protrusion), sensor_centre),  # sensor from the front of the plate
    ]


def _draw_from_behind(canvas: Canvas, contents: _SheetContents, back_to_back: BackToBack, section_box: Box) -> None:
    """Draw the back of one of two back-to-back plates below the other views, with its pad and its dowel holes.

    The pad is the raised part of the back, which touches the pad of the other plate. `section_box` [mm] is the bounding
    box of the section y = 0, which is already drawn. Seen from behind, +x of the housing points to the left.
    """
    housing = contents.housing
    # `origin` is the position of the origin of the housing in the drawing. The view is to the right of the left edge of
    # the section, which leaves space for the dimensions of the view.
    origin = (
        section_box.left + _SPACE_LEFT_MM / canvas.scale + housing.right,
        section_box.bottom - BETWEEN_MM / canvas.scale - housing.top_level - _SPACE_ABOVE_MM / canvas.scale,
    )

    def to_view(x: float, z: float) -> Point:
        """Return the point of the drawing at which the point (x, z) of the housing is drawn [mm]."""
        return origin[0] - x, origin[1] + z

    draw_view(canvas, contents.from_behind, origin)
    left, top = to_view(housing.right, housing.top_level)
    right, bottom = to_view(housing.left, housing.protrusion)  # the lower edge of the frame, as the tips are at z = 0
    # PAD is written in the middle of the bar of the pad, which lies along the top of the frame.
    middle_x, bar_underside = to_view(0.0, housing.cavity_level + SETBACK_MM)
    canvas.write_text("PAD", (middle_x, 0.5 * (bar_underside + top)), canvas.text_height)
    dimensions = [*_dowel_dimensions(housing, to_view), *_pad_dimensions(housing, to_view)]
    draw_dimensions(canvas, dimensions, Box(left, bottom, right, top))
    _mark_holes(canvas, housing, to_view)
    _draw_dowel_diameter(canvas, housing, back_to_back.dowel_hole, to_view)
    name_position = (middle_x, bottom - _NAME_BELOW_MM / canvas.scale)
    canvas.write_text("FROM BEHIND", name_position, _VIEW_NAME * canvas.text_height)


def _dowel_dimensions(housing: Housing, to_view: Callable[[float, float], Point]) -> list[LinearDimension]:
    """Return the dimensions of the positions of the dowel holes in the view from behind.

    `to_view` maps the coordinates x and z of the housing to a point in the view [mm].
    """
    top_left = to_view(housing.right, housing.top_level)
    bottom_left = to_view(housing.right, housing.protrusion)
    # Seen from behind, the dowel with the smallest x is on the right.
    right_dowel, left_dowel = (to_view(*dowel) for dowel in sorted(housing.dowels))
    return [
        LinearDimension("top", top_left, left_dowel),  # dowel hole from the left edge
        LinearDimension("top", left_dowel, right_dowel),  # spacing of the dowel holes
        LinearDimension("left", bottom_left, left_dowel),  # dowel hole from the lower edge
    ]


def _draw_dowel_diameter(
    canvas: Canvas, housing: Housing, diameter: float, to_view: Callable[[float, float], Point]
) -> None:
    """Draw the diameter [mm] of the dowel holes at the right hole, with its text in the cavity between the posts.

    `to_view` maps the coordinates x and z of the housing to a point in the view [mm].
    """
    right_dowel = to_view(*min(housing.dowels))  # seen from behind, the smallest x is on the right
    _, text_z = to_view(0.0, 0.5 * (housing.cavity_level + housing.protrusion))
    text = CalloutText((right_dowel[0], text_z), "left", f"2x {MEASURED}")  # both holes have this diameter
    canvas.add_callout("diameter", right_dowel, diameter, text)


def _pad_dimensions(housing: Housing, to_view: Callable[[float, float], Point]) -> list[LinearDimension]:
    """Return the dimensions of a pad: the width of its posts, the height of its bar, and the level of its foot.

    A pad is an upside-down U on the back of the frame, with a post on each wall and a bar along the top. The edges of
    the pad are set back from the cavity in which the arms move. `to_view` maps the coordinates x and z of the housing
    to a point in the view [mm].
    """
    # The foot ends at the lower edge of a cover, or at the lower edge of the frame if the cover would extend below it.
    foot_level = max(housing.cover_level, housing.protrusion)
    post_edge = housing.right - housing.wall_width + SETBACK_MM  # the inner edge of the post on the right wall
    pad_foot = to_view(housing.right, foot_level)
    bar_underside = to_view(post_edge, housing.cavity_level + SETBACK_MM)
    bar_top = to_view(housing.right, housing.top_level)
    dimensions = [
        LinearDimension("bottom", pad_foot, to_view(post_edge, foot_level), f"2x {MEASURED}"),  # both posts
        LinearDimension("left", bar_underside, bar_top),  # height of the bar
    ]
    # The level of the foot is drawn only if the foot is above the lower edge of the frame.
    if foot_level - housing.protrusion > NEAR_MM:
        dimensions.append(LinearDimension("left", to_view(housing.right, housing.protrusion), pad_foot))
    return dimensions


def _notes(contents: _SheetContents, process: Process) -> list[str]:
    """Return the notes of the sheet, one string per line, from top to bottom.

    The notes are in the terse style of technical drawings, because the space on the sheet is limited.
    """
    housing = contents.housing
    measured = contents.measured
    layer = f", layer {process.layer_mm:g} mm" if process.layer_mm else ""
    tip_note = "tips are domes as made" if housing.dome else "tip faces sharp-edged"
    notes = [
        "Millimetres. Section in the middle of the depth.",
        f"{process.material}{layer}; made flat, this profile in the plane of the bed.",
        f"Leaves solid, E = {process.E_MPa:g} MPa. Two leaves of a spring are equal.",
        f"Gaps over the shuttles are stops: at least {STOP_SAFETY:g} x the deflection.",
        f"{tip_note[0].upper()}{tip_note[1:]}.",
        "Letters name rows of the table; no letter: general tolerance.",
        f"Leaves, lengths under {SMALL_MM:g}: ±{process.accuracy_mm:g} holds 95 % of {process.name} prints.",
        f"{measured['spacing'].letter}): mean of two readings, over both tips and between them.",
        f"+{STEP_MM:g} moves: stiffness K, contact or force of a tip, in proportion.",
        "Outside its tolerance: make it again. Calibrate every unit.",
    ]
    if housing.dowels:
        notes.append("MAKE TWO. Turn one by 180 deg about the press axis, pad on pad.")
        notes.append(f"Dowels ISO 8734 {DOWEL_MM:g} m6: ream their holes {DOWEL_MM:g} H7.")
    if contents.sensor.seats is not None:
        notes += _magnet_notes(contents.sensor.seats, measured["pocket"])
    if housing.pin is not None:
        notes += _pin_notes(housing.pin, is_flat=contents.sensor.tips.tip_shape.is_flat)
    return notes


def _pin_notes(pin: Pin, *, is_flat: bool) -> list[str]:
    """Return the notes on the pins and their pockets; `is_flat` is whether the ends of the pins are flat."""
    ends = "edges of their ends sharp" if is_flat else "ends as in pin.step, polished"
    return [
        f"Pins of ground steel, glued in pockets {pin.pocket_side:g} wide, {pin.pocket_depth:g} deep;",
        f"{ends}.",
    ]


def _magnet_notes(seats: HallSeats, pocket: MeasuredDimension) -> list[str]:
    """Return the notes on the magnets and their pockets; `pocket` is the entry of the measuring table for a pocket."""
    magnets = f"Magnets {PROBE.magnet_mm:g} x {PROBE.magnet_height_mm:g}"
    bottom_note = ", closed by a cone of 90 degrees" if seats.is_pointed else ""
    size = f"Ø{seats.pocket_diameter:g}, {seats.pocket_depth:g} deep"
    return [
        f"{magnets}, flush in the FRONT of each shuttle, over its tip.",
        f"Their pockets, {pocket.letter}): {size}{bottom_note}.",
        "The small circle before them is the marked face of their Hall sensor.",
    ]
