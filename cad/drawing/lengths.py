"""Lengths in rows around a view: short ones near it, long ones outside, no text on another or on a line to one."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from cad.drawing.canvas import LINE_TO_TEXT, MEASURED, Box, Canvas, DimensionText, Point

Side = Literal["top", "bottom", "left", "right"]
SIDES: tuple[Side, ...] = ("top", "bottom", "left", "right")
_FIRST_MM = 8.0  # on paper, from the view to the first row
_STEP_MM = 7.0  # on paper, between rows


class Interval(NamedTuple):
    """A stretch along one side of a view [mm]."""

    low: float
    high: float

    def holds(self, x: float) -> bool:
        """Say whether a point lies within."""
        return self.low < x < self.high

    def overlaps(self, interval: "Interval", gap: float = 0.0) -> bool:
        """Say whether two stretches are nearer to each other than a gap [mm]."""
        return self.low < interval.high + gap and interval.low < self.high + gap


@dataclass(frozen=True)
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

    @property
    def extent(self) -> Interval:
        span = self.length.span
        return Interval(min(span.low, self.text.low), max(span.high, self.text.high))

    def collides(self, placed: "_Placed", gap: float) -> bool:
        """Say whether two dimensions touch: in one row, or the text of the inner one and a line to the outer one."""
        if self.row == placed.row:
            return self.extent.overlaps(placed.extent) or self.text.overlaps(placed.text, gap)
        inner, outer = (self, placed) if self.row < placed.row else (placed, self)
        text = Interval(inner.text.low - gap, inner.text.high + gap)
        return any(text.holds(end) for end in outer.length.span)


def draw_lengths(canvas: Canvas, lengths: Sequence[Length], view: Box) -> None:
    """Draw the dimensions around a view [mm], each in the row nearest to the view that is free."""
    for side in SIDES:
        of_side = [length for length in lengths if length.side == side]
        of_side.sort(key=lambda length: (round(length.span.high - length.span.low, 6), length.span))
        placed: list[_Placed] = []
        for number, length in enumerate(of_side):
            later_ends = [end for later in of_side[number + 1 :] for end in later.span]
            placed.append(_first_free(canvas, length, placed, later_ends))
            _draw(canvas, placed[-1], view)


def _first_free(canvas: Canvas, length: Length, placed: Sequence[_Placed], later_ends: Sequence[float]) -> _Placed:
    """Return a length in the row nearest to the view where it and its text meet no dimension that is placed.

    `later_ends` [mm] are those of longer lengths, which will stand farther out: lines to them cross the rows inside.
    Of the places for the text, the one that the fewest of these lines would cross is tried first.
    """
    texts = _text_places(canvas, length)
    texts.sort(key=lambda text: sum(text.holds(end) for end in later_ends))
    outside = 1 + max((each.row for each in placed), default=-1)  # the first empty row
    for row, text in itertools.product(range(outside + 1), texts):
        candidate = _Placed(length, row, text)
        if not any(candidate.collides(each, 0.4 * canvas.text_height) for each in placed):
            return candidate
    return _Placed(length, outside, texts[0])  # a line to it crosses a text of an inner row, and would in any row


def _text_places(canvas: Canvas, length: Length) -> list[Interval]:
    """Return where the text may stand along its side [mm]: in the middle where there is room, or beyond an end."""
    low, high = length.span
    width = canvas.label_width(length.label, high - low)
    beyond = 2.0 * canvas.text_height
    places = [
        Interval(high + beyond, high + beyond + width),
        Interval(low - beyond - width, low - beyond),
    ]
    if high - low >= width + 1.2 * canvas.text_height:
        middle = 0.5 * (low + high)
        places.insert(0, Interval(middle - 0.5 * width, middle + 0.5 * width))
    return places


def _draw(canvas: Canvas, placed: _Placed, view: Box) -> None:
    """Draw a length in its row beside the view [mm]."""
    length = placed.length
    out = (_FIRST_MM + placed.row * _STEP_MM) / canvas.scale
    level = {"top": view.top + out, "bottom": view.bottom - out, "left": view.left - out, "right": view.right + out}
    line = level[length.side]
    middle = 0.5 * (placed.text.low + placed.text.high)
    over = LINE_TO_TEXT * canvas.text_height
    if length.side in ("top", "bottom"):
        text = DimensionText((middle, line + over), length.label)
        canvas.length("x", length.start, length.end, line, text)
    else:
        text = DimensionText((line - over, middle), length.label, rotation=90.0)
        canvas.length("z", length.start, length.end, line, text)
