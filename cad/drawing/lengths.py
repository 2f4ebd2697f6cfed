"""Dimensions in rows around a view: short ones inside, long ones outside, with no text on a text or a line."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from cad.drawing.canvas import LINE_TO_TEXT, MEASURED, Box, Canvas, DimensionText, Point

Side = Literal["top", "bottom", "left", "right"]
SIDES: tuple[Side, ...] = ("top", "bottom", "left", "right")
_FIRST_MM = 8.0  # distance from the view to the first row, on paper
_STEP_MM = 7.0  # distance between rows, on paper


class Interval(NamedTuple):
    """An interval of the coordinate along one side of a view [mm]."""

    low: float
    high: float

    def holds(self, x: float) -> bool:
        """Return whether a coordinate [mm] lies inside."""
        return self.low < x < self.high

    def overlaps(self, interval: "Interval", gap: float = 0.0) -> bool:
        """Return whether two intervals overlap or are nearer to each other than a gap [mm]."""
        return self.low < interval.high + gap and interval.low < self.high + gap


@dataclass(frozen=True)
class Length:
    """A length between two points of a view [mm], with the side of the view for its dimension."""

    side: Side
    start: Point
    end: Point
    label: str = MEASURED

    @property
    def span(self) -> Interval:
        """Return the interval between both ends along the side [mm]."""
        axis = 0 if self.side in ("top", "bottom") else 1
        return Interval(*sorted((self.start[axis], self.end[axis])))


@dataclass(frozen=True)
class _Placed:
    """A length in a row, with the place of its text; row 0 is next to the view."""

    length: Length
    row: int
    text: Interval

    @property
    def extent(self) -> Interval:
        span = self.length.span
        return Interval(min(span.low, self.text.low), max(span.high, self.text.high))

    def collides(self, placed: "_Placed", gap: float) -> bool:
        """Return whether two dimensions collide.

        In one row their lines or texts may overlap. In two rows an extension line of the outer one may cross the text
        of the inner one. Texts keep a gap [mm].
        """
        if self.row == placed.row:
            return self.extent.overlaps(placed.extent) or self.text.overlaps(placed.text, gap)
        inner, outer = (self, placed) if self.row < placed.row else (placed, self)
        text = Interval(inner.text.low - gap, inner.text.high + gap)
        return any(text.holds(end) for end in outer.length.span)


def draw_lengths(canvas: Canvas, lengths: Sequence[Length], view: Box) -> None:
    """Draw the dimensions around a view [mm], from short to long, each in the nearest free row."""
    for side in SIDES:
        of_side = [length for length in lengths if length.side == side]
        of_side.sort(key=lambda length: (round(length.span.high - length.span.low, 6), length.span))
        placed: list[_Placed] = []
        for number, length in enumerate(of_side):
            later_ends = [end for later in of_side[number + 1 :] for end in later.span]
            placed.append(_first_free(canvas, length, placed, later_ends))
            _draw(canvas, placed[-1], view)


def _first_free(canvas: Canvas, length: Length, placed: Sequence[_Placed], later_ends: Sequence[float]) -> _Placed:
    """Return a length in the row nearest to the view in which it collides with no placed dimension.

    `later_ends` [mm] are the ends of longer lengths, which get rows farther outside. Their extension lines cross this
    row, so places for the text are tried in the order of the number of lines that would cross them.
    """
    texts = _text_places(canvas, length)
    texts.sort(key=lambda text: sum(text.holds(end) for end in later_ends))
    outside = 1 + max((each.row for each in placed), default=-1)  # the first empty row
    for row, text in itertools.product(range(outside + 1), texts):
        candidate = _Placed(length, row, text)
        if not any(candidate.collides(each, 0.4 * canvas.text_height) for each in placed):  # a gap chosen by eye
            return candidate
    return _Placed(length, outside, texts[0])  # its extension line crosses an inner text, and would from any row


def _text_places(canvas: Canvas, length: Length) -> list[Interval]:
    """Return the possible places of the text along its side [mm]: in the middle if it fits there, or beyond an end.

    The distances, 2 x and 1.2 x text height, leave room for arrows; they were chosen by eye.
    """
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
    """Draw a placed length in its row beside the view [mm]."""
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
