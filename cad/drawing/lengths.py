"""Lengths in rows around a view: short ones near it, long ones outside, no text on another or on a line to one."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from cad.drawing.canvas import MEASURED, Box, Canvas, Point, format_length, text_width

Side = Literal["top", "bottom", "left", "right"]
SIDES: tuple[Side, ...] = ("top", "bottom", "left", "right")
_FIRST_MM, _STEP_MM = 8.0, 7.0  # on paper: from the view to the first row, and between rows


class Interval(NamedTuple):
    """A stretch along one side of a view [mm]."""

    low: float
    high: float

    def overlaps(self, interval: "Interval") -> bool:
        """Say whether two stretches share a length."""
        return self.low < interval.high and interval.low < self.high

    def around(self, interval: "Interval") -> "Interval":
        """Return the stretch from the lower to the upper end of both."""
        return Interval(min(self.low, interval.low), max(self.high, interval.high))

    def wider(self, gap: float) -> "Interval":
        """Return the stretch that reaches a gap farther at both ends [mm]."""
        return Interval(self.low - gap, self.high + gap)


@dataclass(frozen=True, kw_only=True)
class Length:
    """A length between two points of a view [mm] whose dimension shall stand on one of its sides."""

    side: Side
    start: Point
    end: Point
    label: str = MEASURED

    @property
    def span(self) -> Interval:
        """Return where it begins and ends along its side [mm]."""
        axis = 0 if self.side in ("top", "bottom") else 1
        return Interval(*sorted((self.start[axis], self.end[axis])))


@dataclass(frozen=True)
class _Placed:
    """A length in a row, counted from the view, with the place of its text."""

    length: Length
    row: int
    text: Interval

    def collides(self, placed: "_Placed", gap: float) -> bool:
        """Say whether two dimensions touch: in one row, or the text of the inner one and a line to the outer one."""
        if self.row == placed.row:
            extents = [each.length.span.around(each.text) for each in (self, placed)]
            return extents[0].overlaps(extents[1]) or self.text.wider(gap).overlaps(placed.text)
        inner, outer = sorted((self, placed), key=lambda each: each.row)
        text = inner.text.wider(gap)
        return any(text.low < end < text.high for end in outer.length.span)


def draw_lengths(canvas: Canvas, lengths: Sequence[Length], view: Box) -> None:
    """Draw the dimensions around a view [mm], each in the row nearest to the view that is free."""
    for side in SIDES:
        of_side = [length for length in lengths if length.side == side]
        line_ends = [end for length in of_side for end in length.span]
        placed: list[_Placed] = []
        for length in sorted(of_side, key=lambda each: (round(each.span.high - each.span.low, 6), each.span)):
            placed.append(_first_free(length, placed, line_ends, canvas.text_height))
            _draw(canvas, placed[-1], view)


def _first_free(length: Length, placed: Sequence[_Placed], line_ends: Sequence[float], height: float) -> _Placed:
    """Return the row nearest to the view, and the place of the text in it, that meets no other dimension.

    A text that no line to any end on this side could cross goes before one that some may.
    """
    texts = _text_places(length, height)
    texts.sort(key=lambda text: sum(text.low < end < text.high for end in line_ends))
    outside = 1 + max((each.row for each in placed), default=-1)
    for row, text in itertools.product(range(outside + 1), texts):
        candidate = _Placed(length, row, text)
        if not any(candidate.collides(each, 0.4 * height) for each in placed):
            return candidate
    return _Placed(length, outside, texts[0])  # a line to it crosses a text of an inner row, and would in any row


def _text_places(length: Length, height: float) -> list[Interval]:
    """Return where the text may stand along its side [mm]: in the middle where there is room, or beyond an end."""
    low, high = length.span
    width = text_width(length.label.replace(MEASURED, format_length(high - low)), height)
    beyond = 2.0 * height
    places = [Interval(high + beyond, high + beyond + width), Interval(low - beyond - width, low - beyond)]
    if high - low >= width + 1.2 * height:
        middle = 0.5 * (low + high)
        places.insert(0, Interval(middle - 0.5 * width, middle + 0.5 * width))
    return places


def _draw(canvas: Canvas, placed: _Placed, view: Box) -> None:
    length = placed.length
    out = (_FIRST_MM + placed.row * _STEP_MM) / canvas.scale
    level = {"top": view.top + out, "bottom": view.bottom - out, "left": view.left - out, "right": view.right + out}
    line = level[length.side]
    middle = 0.5 * (placed.text.low + placed.text.high)
    over = 0.8 * canvas.text_height
    if length.side in ("top", "bottom"):
        canvas.length("x", length.start, length.end, (middle, line + over), line, length.label)
    else:
        canvas.length("z", length.start, length.end, (line - over, middle), line, length.label, text_rotation=90.0)
