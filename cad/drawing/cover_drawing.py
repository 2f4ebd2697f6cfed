"""The drawing of a cover: its rim seen along the depth, the section across it, and every dimension once [mm]."""

import itertools

from cad.drawing.canvas import MEASURED, Box, Canvas
from cad.drawing.housing_drawing import call_out_screw_holes
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.section import draw_section, hatch_section, section
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.parts.cover import Cover
from cad.parts.part import Part

_NOTES = (
    "Millimetres. Section through the rim; section across the middle from the left.",
    "MAKE TWO: front and back are equal. Made flat, rim up.",
    "The rim rests on the frame alone; what moves stays free below.",
)


def cover_drawing(part: Part, cover: Cover, title: Title) -> Sheet:
    """Return the sheet of a cover: the section through its rim along +y, and to the right the section across it."""
    cut = 0.5 * (cover.housing.depth + cover.recess)
    profile = section(part.shape, cut)

    def draw_views(canvas: Canvas) -> None:
        draw_section(canvas, profile)
        _draw_front_lengths(canvas, cover)
        call_out_screw_holes(canvas, cover.housing)
        for hole in cover.housing.holes:
            canvas.centre_mark(hole, 0.5 * cover.housing.hole_diameter)
        hatch_section(canvas, part.shape, cut)
        _draw_across(canvas, cover, canvas.extents().right + BETWEEN_MM / canvas.scale)

    return on_sheet(draw_views, _NOTES, title)


def _draw_front_lengths(canvas: Canvas, cover: Cover) -> None:
    """Draw the outer sizes, the places of the holes, and the widths of the rim at a post and at the bar."""
    housing = cover.housing
    outline = Box(housing.left, cover.foot_level, housing.right, housing.top_level)
    bottom_left = (outline.left, outline.bottom)
    top_left = (outline.left, outline.top)
    top_right = (outline.right, outline.top)
    lower_hole, upper_hole, _, right_hole = housing.holes
    post = housing.wall_width - cover.setback
    rim_corner = (outline.right - post, housing.cavity_level + cover.setback)
    lengths = [
        Length("top", top_left, top_right),
        Length("top", upper_hole, right_hole),
        Length("top", top_left, upper_hole),
        Length("left", bottom_left, top_left),
        Length("left", lower_hole, upper_hole),
        Length("left", bottom_left, lower_hole),
        Length("bottom", bottom_left, (outline.left + post, outline.bottom), f"{MEASURED} 2x"),
        Length("right", rim_corner, top_right),
    ]
    draw_lengths(canvas, lengths, outline)


def _draw_across(canvas: Canvas, cover: Cover, start: float) -> None:
    """Draw the section across the middle seen from the left: plate to the left, rim to the right."""
    foot = cover.foot_level
    top = cover.housing.top_level
    bar = cover.housing.cavity_level + cover.setback
    plate = start + cover.plate
    end = start + cover.thickness
    corners = [(start, top), (start, foot), (plate, foot), (plate, bar), (end, bar), (end, top), (start, top)]
    for corner, next_corner in itertools.pairwise(corners):
        canvas.line(corner, next_corner)
    lengths = [
        Length("top", (start, top), (end, top)),
        Length("bottom", (start, foot), (plate, foot)),
    ]
    draw_lengths(canvas, lengths, Box(start, foot, end, top))
