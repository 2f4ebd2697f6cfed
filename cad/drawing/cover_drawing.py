"""The drawing of a cover: its rim seen along the depth, the view from the left, and every dimension once [mm]."""

from cad.drawing.canvas import MEASURED, Box, Canvas
from cad.drawing.housing_drawing import call_out_screw_holes
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.drawing.view import draw_view, views_of
from cad.parts.cover import COVER_MM, PLATE_MM
from cad.parts.housing import SETBACK_MM, Housing
from cad.parts.part import Part

_NOTES = (
    "Millimetres. View of the rim, and view from the left.",
    "MAKE TWO: front and back are equal. Made flat, rim up.",
    "The rim rests on the frame alone; what moves stays free below.",
)


def cover_drawing(part: Part, housing: Housing, title: Title) -> Sheet:
    """Return the sheet of a cover: its rim seen along +y, and to the right the view from its left."""
    (front,) = views_of([part.shape], "front")
    (from_left,) = views_of([part.shape], "left")

    def draw_views(canvas: Canvas) -> None:
        draw_view(canvas, front)
        _draw_front_lengths(canvas, housing)
        call_out_screw_holes(canvas, housing)
        for hole in housing.holes:
            canvas.centre_mark(hole, 0.5 * housing.hole_diameter)
        start = canvas.extents().right + BETWEEN_MM / canvas.scale
        outside = 0.5 * housing.depth + COVER_MM  # y of the face that the rim is turned from
        draw_view(canvas, from_left, (start + outside, 0.0), hidden=True)
        end = start + COVER_MM
        for level in sorted({z for _, z in housing.holes}):
            canvas.centre_line((start, level), (end, level))
        top = housing.top_level
        lengths = [
            Length("top", (start, top), (end, top)),
            Length("bottom", (start, housing.cover_level), (start + PLATE_MM, housing.cover_level)),
        ]
        draw_lengths(canvas, lengths, Box(start, housing.cover_level, end, top))

    return on_sheet(draw_views, _NOTES, title)


def _draw_front_lengths(canvas: Canvas, housing: Housing) -> None:
    """Draw the outer sizes, the places of the holes, and the widths of the rim at a post and at the bar."""
    outline = Box(housing.left, housing.cover_level, housing.right, housing.top_level)
    bottom_left = (outline.left, outline.bottom)
    top_left = (outline.left, outline.top)
    top_right = (outline.right, outline.top)
    lower_hole, upper_hole, _, right_hole = housing.holes
    post = housing.wall_width - SETBACK_MM
    rim_corner = (outline.right - post, housing.cavity_level + SETBACK_MM)
    lengths = [
        Length("top", top_left, top_right),
        Length("top", upper_hole, right_hole),
        Length("top", top_left, upper_hole),
        Length("left", bottom_left, top_left),
        Length("left", lower_hole, upper_hole),
        Length("left", bottom_left, lower_hole),
        Length("bottom", bottom_left, (outline.left + post, outline.bottom), f"2x {MEASURED}"),
        Length("right", rim_corner, top_right),
    ]
    draw_lengths(canvas, lengths, outline)
