"""The drawing of a cover: its rim seen along the depth, the section across it, and every dimension once [mm]."""

import itertools
from collections.abc import Iterator, Sequence

from cad.drawing.housing_drawing import screw_holes
from cad.drawing.items import Box, Item, Line, union
from cad.drawing.placing import Wanted, called_out, in_rows
from cad.drawing.section import section
from cad.drawing.sheet import Sheet, Title, on_sheet, rectangle
from cad.parts.cover import Cover
from cad.parts.part import Part

_BETWEEN_MM = 14.0  # on paper, between the dimensions of the section and the view from the left


def cover_drawing(part: Part, cover: Cover, title: Title) -> Sheet:
    """Return the sheet of a cover: the section through its rim along +y, and to the right the section across it."""
    rim = 0.5 * cover.housing.depth + 0.5 * cover.recess
    profile = tuple(section(part.shape, rim if cover.recess else rim + 0.5 * cover.plate))

    def views(scale: float) -> Sequence[Item]:
        return tuple(_views(profile, cover, scale))

    notes = (
        "Millimetres. Section through the rim; section across the middle from the left.",
        "MAKE TWO: front and back are equal. Made flat, rim up.",
        "The rim rests on the frame alone; what moves stays free below.",
    )
    return on_sheet(views, notes, title)


def _views(profile: Sequence[Item], cover: Cover, scale: float) -> Iterator[Item]:
    housing, foot = cover.housing, cover.foot_level
    outline: Box = (housing.left, foot, housing.right, housing.top_level)
    front = [
        *profile,
        *in_rows([*_wanted(cover), *_rim(cover)], outline, scale),
        called_out(screw_holes(cover.housing, scale), scale),
    ]
    yield from front
    yield from _across(cover, union([item.box for item in front])[2] + _BETWEEN_MM / scale, scale)


def _wanted(cover: Cover) -> Iterator[Wanted]:
    """Yield the outer sizes and the places of the holes."""
    housing, foot, top = cover.housing, cover.foot_level, cover.housing.top_level
    left, (x0, z0), (x1, z1) = housing.left, housing.holes[0], housing.holes[-1]
    yield Wanted(side="top", start=(left, top), end=(housing.right, top))
    yield Wanted(side="top", start=(x0, z1), end=(x1, z1))
    yield Wanted(side="top", start=(left, top), end=(x0, z1))
    yield Wanted(side="left", start=(left, foot), end=(left, top))
    yield Wanted(side="left", start=(x0, z0), end=(x0, z1))
    yield Wanted(side="left", start=(left, foot), end=(x0, z0))


def _rim(cover: Cover) -> Iterator[Wanted]:
    """Yield the widths of the rim, at a post and at the bar."""
    housing, foot = cover.housing, cover.foot_level
    wall, bar = housing.wall_width - cover.setback, housing.cavity_level + cover.setback
    yield Wanted(side="bottom", start=(housing.left, foot), end=(housing.left + wall, foot), label="<> 2x")
    yield Wanted(side="right", start=(housing.right - wall, bar), end=(housing.right, housing.top_level))


def _across(cover: Cover, start: float, scale: float) -> Iterator[Item]:
    """Yield the section across the middle seen from the left: plate to the left, rim to the right."""
    foot, top, bar = cover.foot_level, cover.housing.top_level, cover.housing.cavity_level + cover.setback
    plate, end = start + cover.plate, start + cover.thickness
    if not cover.recess:
        yield from rectangle((start, foot, end, top), "PART")
    else:
        corners = [(start, foot), (plate, foot), (plate, bar), (end, bar), (end, top), (start, top), (start, foot)]
        for a, b in itertools.pairwise(corners):
            yield Line(start=a, end=b)
    wanted = [
        Wanted(side="top", start=(start, top), end=(end, top)),
        Wanted(side="bottom", start=(start, foot), end=(plate, foot)),
    ]
    yield from in_rows(wanted, (start, foot, end, top), scale)
