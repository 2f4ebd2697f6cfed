"""Dimensions in rows around a view: short ones inside, long ones outside, with no text on another text or a line."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from cad.drawing.canvas import LINE_TO_TEXT, MEASURED, Box, Canvas, DimensionText, Point

Side = Literal["top", "bottom", "left", "right"]
SIDES: tuple[Side, ...] = ("top", "bottom", "left", "right")
_FIRST_MM = 8.0  # distance from the view to the first row of dimensions, on paper
_STEP_MM = 7.0  # distance between rows of dimensions, on paper


class Interval(NamedTuple):
    """An interval of the coordinate along one side of a view [mm]."""

    low: float
    high: float

    def contains(self, x: float) -> bool:
        """Return whether a coordinate [mm] lies strictly inside the interval."""
        return self.low < x < self.high

    def overlaps(self, interval: "Interval", gap: float = 0.0) -> bool:
        """Return whether two intervals overlap or are separated by less than `gap` [mm]."""
        return self.low < interval.high + gap and interval.low < self.high + gap


@dataclass(frozen=True)
class Length:
    """A dimension of the length between two points of a view [mm], and the side of the view on which it is drawn."""

    side: Side
    start: Point
    end: Point
    label: str = MEASURED

    @property
    def span(self) -> Interval:
        """Return the interval between the ends of the length, in the coordinate along the side [mm]."""
        axis = 0 if self.side in ("top", "bottom") else 1
        return Interval(*sorted((self.start[axis], self.end[axis])))


@dataclass(frozen=True)
class _PlacedLength:
    """A dimension in a row, with the interval of its text along the side [mm]; row 0 is next to the view."""

    length: Length
    row: int
    text: Interval

    @property
    def extent(self) -> Interval:
        """Return the interval that the dimension line and the text occupy along the side [mm]."""
        span = self.length.span
        return Interval(min(span.low, self.text.low), max(span.high, self.text.high))

    def collides(self, placed: "_PlacedLength", gap: float) -> bool:
        """Return whether two dimensions collide.

        In one row, their lines or their texts may overlap; texts must be at least `gap` [mm] apart. In two rows, an
        extension line of the outer dimension may cross the text of the inner one, or pass it within the gap.
        """
        if self.row == placed.row:
            return self.extent.overlaps(placed.extent) or self.text.overlaps(placed.text, gap)
        inner, outer = (self, placed) if self.row < placed.row else (placed, self)
        text = Interval(inner.text.low - gap, inner.text.high + gap)
        return any(text.contains(end) for end in outer.length.span)


def draw_lengths(canvas: Canvas, lengths: Sequence[Length], view: Box) -> None:
    """Draw the dimensions around a view, from short to long, each in the row nearest to the view that is free.

    `view` is the bounding box of the view [mm].
    """
    for side in SIDES:
        side_lengths = [length for length in lengths if length.side == side]
        # Lengths that differ only by round-off are sorted by their position.
        side_lengths.sort(key=lambda length: (round(length.span.high - length.span.low, 6), length.span))
        placed_lengths: list[_PlacedLength] = []
        for number, length in enumerate(side_lengths):
            later_ends = [end for later in side_lengths[number + 1 :] for end in later.span]
            placed_lengths.append(_place_length(canvas, length, placed_lengths, later_ends))
            _draw_length(canvas, placed_lengths[-1], view)


def _place_length(
    canvas: Canvas, length: Length, placed: Sequence[_PlacedLength], later_ends: Sequence[float]
) -> _PlacedLength:
    """Return a dimension in the nearest row in which it collides with none of the dimensions already `placed`.

    `later_ends` [mm] are the ends of longer lengths, which get rows farther outside. Their extension lines cross this
    row, so positions of the text are tried in ascending order of the number of these lines that cross it.
    """
    texts = _text_positions(canvas, length)
    texts.sort(key=lambda text: sum(text.contains(end) for end in later_ends))
    outermost = 1 + max((each.row for each in placed), default=-1)  # the first empty row
    for row, text in itertools.product(range(outermost + 1), texts):
        candidate = _PlacedLength(length, row, text)
        if not any(candidate.collides(each, 0.4 * canvas.text_height) for each in placed):  # a gap chosen by eye
            return candidate
    # Its extension line crosses the text of an inner row, as it would from any other row.
    return _PlacedLength(length, outermost, texts[0])


def _text_positions(canvas: Canvas, length: Length) -> list[Interval]:
    """Return the possible intervals of the text of a length along its side [mm].

    The text is in the middle if it fits there, or otherwise beyond an end; the preferred position comes first. The
    distances of 2 and 1.2 text heights leave room for arrows, and were chosen by eye.
    """
    low, high = length.span
    width = canvas.label_width(length.label, high - low)
    offset = 2.0 * canvas.text_height
    positions = [
        Interval(high + offset, high + offset + width),
        Interval(low - offset - width, low - offset),
    ]
    if high - low >= width + 1.2 * canvas.text_height:
        middle = 0.5 * (low + high)
        positions.insert(0, Interval(middle - 0.5 * width, middle + 0.5 * width))
    return positions


def _draw_length(canvas: Canvas, placed: _PlacedLength, view: Box) -> None:
    """Draw a dimension in its row beside the view, whose bounding box is `view` [mm]."""
    length = placed.length
    distance = (_FIRST_MM + placed.row * _STEP_MM) / canvas.scale
    levels = {
        "top": view.top + distance,
        "bottom": view.bottom - distance,
        "left": view.left - distance,
        "right": view.right + distance,
    }
    level = levels[length.side]
    middle = 0.5 * (placed.text.low + placed.text.high)
    text_offset = LINE_TO_TEXT * canvas.text_height
    if length.side in ("top", "bottom"):
        text = DimensionText((middle, level + text_offset), length.label)
        canvas.length("x", length.start, length.end, level, text)
    else:
        text = DimensionText((level - text_offset, middle), length.label, rotation=90.0)
        canvas.length("z", length.start, length.end, level, text)
