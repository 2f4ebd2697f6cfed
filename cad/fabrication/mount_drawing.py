"""The drawing of the bracket: from the front, from the left and from above, every dimension once [mm]."""

import cadquery as cq

from cad.drawing.canvas import MEASURED, Box, Canvas
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.drawing.view import View, draw_view, views_of
from cad.fabrication.mount import FLANGE_CIRCLE_MM, FLANGE_HOLE_MM, FLANGE_MM, PLATE_MM, back_of, flange_holes
from cad.parts.housing import Housing
from cad.parts.part import NEAR_MM
from cad.parts.sensor import Sensor

_NOTES = (
    "Millimetres. Views from the front, from the left and from above.",
    "Flange ISO 9409-1-50-4-M6, its axis that of the press.",
    "Printed solid, on its back; or milled of aluminium.",
)
_HALF = 0.5 * FLANGE_MM
_BESIDE = 2.4  # heights of the text, of a callout from the outline


def mount_drawing(sensor: Sensor, mount: cq.Shape, title: Title) -> Sheet:
    """Return the sheet of the bracket in its place behind a sensor."""
    (front,) = views_of([mount], "front")
    (from_left,) = views_of([mount], "left")
    (from_above,) = views_of([mount], "above")
    box = mount.BoundingBox()

    def draw_views(canvas: Canvas) -> None:
        _draw_front(canvas, front, sensor.housing, Box(box.xmin, box.zmin, box.xmax, box.zmax))
        views = canvas.extents()
        between = BETWEEN_MM / canvas.scale
        _draw_from_above(canvas, from_above, sensor, views.bottom - between - box.ymax)
        _draw_from_the_left(canvas, from_left, sensor, box, views.right + between + box.ymax)

    return on_sheet(draw_views, _NOTES, title)


def _draw_front(canvas: Canvas, view: View, housing: Housing, outline: Box) -> None:
    draw_view(canvas, view)
    canvas.line((0.0, outline.bottom), (0.0, outline.top), "AXES")
    foot = (housing.left, outline.bottom)
    lower_hole, upper_hole, _, right_hole = housing.holes
    lengths = [
        Length("bottom", foot, (housing.right, outline.bottom)),
        Length("bottom", foot, (0.0, outline.bottom)),
        Length("bottom", foot, lower_hole),
        Length("bottom", lower_hole, housing.holes[2]),
        Length("left", foot, (housing.left, outline.top)),
        Length("left", foot, lower_hole),
        Length("left", lower_hole, upper_hole),
        Length("top", (-_HALF, outline.top), (_HALF, outline.top)),
        Length("right", (_HALF, outline.top - PLATE_MM), (_HALF, outline.top)),
    ]
    draw_lengths(canvas, lengths, outline)
    label = f"{len(housing.holes)}x {MEASURED}"
    beside = (outline.right, right_hole[1] - _BESIDE * canvas.text_height)
    canvas.callout("diameter", right_hole, housing.hole_diameter, beside, "right", label)
    for hole in housing.holes:
        canvas.centre_mark(hole, 0.5 * housing.hole_diameter)


def _draw_from_above(canvas: Canvas, view: View, sensor: Sensor, level: float) -> None:
    """Draw the flange, the axis of the press at a level of the sheet [mm], with its holes on their circle."""
    draw_view(canvas, view, (0.0, level))
    canvas.circle((0.0, level), 0.5 * FLANGE_CIRCLE_MM, "AXES")
    for x, y in ((0.0, 0.0), *flange_holes(sensor)):
        canvas.centre_mark((x, level + y), 0.5 * FLANGE_HOLE_MM)
    hole_x, hole_y = max(flange_holes(sensor), key=lambda hole: hole[0] - hole[1])
    below = level - _HALF - _BESIDE * canvas.text_height
    label = f"4x {MEASURED}, equal angles"
    canvas.callout("diameter", (hole_x, level + hole_y), FLANGE_HOLE_MM, (_HALF, below), "right", label)
    canvas.callout("diameter", (0.0, level), FLANGE_CIRCLE_MM, (-_HALF, below), "left")


def _draw_from_the_left(canvas: Canvas, view: View, sensor: Sensor, box: cq.BoundBox, axis: float) -> None:
    """Draw the bracket from its left, the axis of the press at x = `axis` of the sheet [mm], the front to the right."""
    draw_view(canvas, view, (axis, 0.0), hidden=True)
    canvas.line((axis, box.zmin), (axis, box.zmax), "AXES")
    back = axis - back_of(sensor)
    outer = back - PLATE_MM
    rear = axis - box.ymax
    top = box.zmax
    for level in sorted({z for _, z in sensor.housing.holes}):
        canvas.centre_line((outer, level), (back, level))
    for y in sorted({y for _, y in flange_holes(sensor)} - {0.0}):  # that of y = 0 is the axis of the press
        canvas.centre_line((axis - y, top - PLATE_MM), (axis - y, top))
    lengths = [
        Length("top", (back, top), (axis, top)),
        Length("top", (axis, top), (axis + _HALF, top)),
        Length("bottom", (outer, box.zmin), (back, box.zmin)),
    ]
    if outer - rear > NEAR_MM:
        lengths.append(Length("top", (rear, top), (axis, top)))
    draw_lengths(canvas, lengths, Box(rear, box.zmin, axis + _HALF, top))
