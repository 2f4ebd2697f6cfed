"""The drawing of a cover: its rim seen along the depth, the section across it, and every dimension once [mm]."""

import itertools

from cad.drawing.canvas import Box, Canvas
from cad.drawing.housing_drawing import call_out_screw_holes
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.section import draw_section, section
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
    rim = 0.5 * cover.housing.depth + 0.5 * cover.recess
    profile = section(part.shape, rim if cover.recess else rim + 0.5 * cover.plate)

    def draw_views(canvas: Canvas) -> None:
        draw_section(canvas, profile)
        _draw_front_lengths(canvas, cover)
        call_out_screw_holes(canvas, cover.housing)
        _draw_across(canvas, cover, canvas.extents().right + BETWEEN_MM / canvas.scale)

    return on_sheet(draw_views, _NOTES, title)


def _draw_front_lengths(canvas: Canvas, cover: Cover) -> None:
    """Draw the outer sizes, the places of the holes, and the widths of the rim at a post and at the bar."""
    housing = cover.housing
    left, foot, right, top = housing.left, cover.foot_level, housing.right, housing.top_level
    (x0, z0), (x1, z1) = housing.holes[0], housing.holes[-1]
    post = housing.wall_width - cover.setback
    bar = housing.cavity_level + cover.setback
    lengths = [
        Length(side="top", start=(left, top), end=(right, top)),
        Length(side="top", start=(x0, z1), end=(x1, z1)),
        Length(side="top", start=(left, top), end=(x0, z1)),
        Length(side="left", start=(left, foot), end=(left, top)),
        Length(side="left", start=(x0, z0), end=(x0, z1)),
        Length(side="left", start=(left, foot), end=(x0, z0)),
        Length(side="bottom", start=(left, foot), end=(left + post, foot), label="<> 2x"),
        Length(side="right", start=(right - post, bar), end=(right, top)),
    ]
    draw_lengths(canvas, lengths, Box(left, foot, right, top))


def _draw_across(canvas: Canvas, cover: Cover, start: float) -> None:
    """Draw the section across the middle seen from the left: plate to the left, rim to the right."""
    foot, top = cover.foot_level, cover.housing.top_level
    bar = cover.housing.cavity_level + cover.setback
    plate = start + cover.plate
    end = start + cover.thickness
    corners = [(start, foot), (plate, foot), (plate, bar), (end, bar), (end, top), (start, top), (start, foot)]
    if not cover.recess:
        corners = [(start, foot), (end, foot), (end, top), (start, top), (start, foot)]
    for a, b in itertools.pairwise(corners):
        canvas.line(a, b)
    lengths = [
        Length(side="top", start=(start, top), end=(end, top)),
        Length(side="bottom", start=(start, foot), end=(plate, foot)),
    ]
    draw_lengths(canvas, lengths, Box(start, foot, end, top))
