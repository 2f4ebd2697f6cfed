"""Linear dimensions in rows around a view, placed so that no text covers a line or another text."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from cad.drawing.canvas import LINE_TO_TEXT, MEASURED, Box, Canvas, DimensionText, Point

Side = Literal["top", "bottom", "left", "right"]
SIDES: tuple[Side, ...] = ("top", "bottom", "left", "right")
_FIRST_ROW_MM = 8.0  # distance from the view to the first row of dimensions, on paper
_ROW_STEP_MM = 7.0  # distance between rows of dimensions, on paper


class Interval(NamedTuple):
    """An interval of the coordinate along a side of a view [mm]."""

    low: float
    high: float

    def contains(self, x: float) -> bool:
        """Return whether a coordinate [mm] lies strictly inside the interval."""
        return self.low < x < self.high

    def overlaps(self, interval: "Interval", gap: float = 0.0) -> bool:
        """Return whether two intervals overlap, or are less than `gap` [mm] apart."""
        return self.low < interval.high + gap and interval.low < self.high + gap


@dataclass(frozen=True)
class LinearDimension:
    """A dimension between two points of a view [mm], to be drawn on one side of the view."""

    side: Side
    start: Point
    end: Point
    label: str = MEASURED

    @property
    def span(self) -> Interval:
        """Return the interval between the two points, in the coordinate along the side [mm]."""
        axis = 0 if self.side in ("top", "bottom") else 1
        return Interval(*sorted((self.start[axis], self.end[axis])))


@dataclass(frozen=True)
class _PlacedDimension:
    """A dimension, the number of its row (0 is next to the view), and the interval of its text along the side [mm]."""

    dimension: LinearDimension
    row: int
    text: Interval

    @property
    def extent(self) -> Interval:
        """Return the interval that the dimension line and its text occupy along the side [mm]."""
        span = self.dimension.span
        return Interval(min(span.low, self.text.low), max(span.high, self.text.high))

    def collides(self, other: "_PlacedDimension", gap: float) -> bool:
        """Return whether two dimensions collide.

        Dimensions in the same row collide if a line or text of one overlaps a line or text of the other, or if their
        texts are less than `gap` [mm] apart. The extension lines of an outer dimension cross the inner rows. So
        dimensions in different rows collide if such a line comes within `gap` of the text of the inner dimension.
        """
        if self.row == other.row:
            return self.extent.overlaps(other.extent) or self.text.overlaps(other.text, gap)
        inner, outer = (self, other) if self.row < other.row else (other, self)
        text = Interval(inner.text.low - gap, inner.text.high + gap)
        return any(text.contains(end) for end in outer.dimension.span)


def draw_dimensions(canvas: Canvas, dimensions: Sequence[LinearDimension], view: Box) -> None:
    """Draw dimensions around a view, whose bounding box is `view` [mm].

    On each side, the dimensions are placed from the shortest to the longest. Each dimension gets the row nearest to the
    view in which it does not collide with the dimensions already placed. So long dimensions are outside short ones, and
    their extension lines cross few dimension lines.
    """
    for side in SIDES:
        side_dimensions = [dimension for dimension in dimensions if dimension.side == side]
        # Dimensions whose lengths differ only by round-off are sorted by their positions.
        side_dimensions.sort(key=lambda dimension: (round(dimension.span.high - dimension.span.low, 6), dimension.span))
        placed_dimensions: list[_PlacedDimension] = []
        for number, dimension in enumerate(side_dimensions):
            later_dimensions = side_dimensions[number + 1 :]
            later_ends = [end for later in later_dimensions for end in later.span]
            placed_dimensions.append(_place_dimension(canvas, dimension, placed_dimensions, later_ends))
            _draw_dimension(canvas, placed_dimensions[-1], view)


def _place_dimension(
    canvas: Canvas, dimension: LinearDimension, placed: Sequence[_PlacedDimension], later_ends: Sequence[float]
) -> _PlacedDimension:
    """Place a dimension in the nearest row in which it collides with none of the dimensions already `placed`.

    `later_ends` [mm] are the ends of longer dimensions, which are placed later, in outer rows. The extension lines of
    these longer dimensions may cross the text. So the text positions that the fewest lines cross are tried first. If
    the dimension collides even in the first empty row, it is placed in this row.
    """
    texts = _text_positions(canvas, dimension)
    # The sort is stable, so equally good positions stay in their order of preference.
    texts.sort(key=lambda text: sum(text.contains(end) for end in later_ends))
    gap = 0.4 * canvas.text_height  # chosen by eye
    first_empty_row = 1 + max((neighbour.row for neighbour in placed), default=-1)  # row 0 if none is placed
    for row, text in itertools.product(range(first_empty_row + 1), texts):
        candidate = _PlacedDimension(dimension, row, text)
        if not any(candidate.collides(neighbour, gap) for neighbour in placed):
            return candidate
    # Even in an empty row, the extension lines of the dimension come too close to the text of an inner row.
    return _PlacedDimension(dimension, first_empty_row, texts[0])


def _text_positions(canvas: Canvas, dimension: LinearDimension) -> list[Interval]:
    """Return the possible intervals of the text of a dimension along its side [mm], the preferred one first.

    The preferred position is the middle of the dimension line, if the text fits there. The other positions are beyond
    the upper or right end, and beyond the lower or left end. The distances of 2 and 1.2 text heights leave room for
    arrows, and were chosen by eye.
    """
    low, high = dimension.span
    width = canvas.label_width(dimension.label, high - low)
    offset = 2.0 * canvas.text_height
    positions = [
        Interval(high + offset, high + offset + width),
        Interval(low - offset - width, low - offset),
    ]
    if high - low >= width + 1.2 * canvas.text_height:
        middle = 0.5 * (low + high)
        positions.insert(0, Interval(middle - 0.5 * width, middle + 0.5 * width))
    return positions


def _draw_dimension(canvas: Canvas, placed: _PlacedDimension, view: Box) -> None:
    """Draw a dimension in its row beside a view, whose bounding box is `view` [mm].

    Row 0 is nearest to the view. The text is above a horizontal dimension line, and to the left of a vertical one,
    rotated by 90 degrees.
    """
    dimension = placed.dimension
    distance = (_FIRST_ROW_MM + placed.row * _ROW_STEP_MM) / canvas.scale
    line_positions = {
        "top": view.top + distance,
        "bottom": view.bottom - distance,
        "left": view.left - distance,
        "right": view.right + distance,
    }
    line_position = line_positions[dimension.side]  # z of a horizontal dimension line, or x of a vertical one
    text_middle = 0.5 * (placed.text.low + placed.text.high)
    text_offset = LINE_TO_TEXT * canvas.text_height
    if dimension.side in ("top", "bottom"):
        text = DimensionText((text_middle, line_position + text_offset), dimension.label)
        canvas.add_linear_dimension("x", dimension.start, dimension.end, line_position, text)
    else:
        text = DimensionText((line_position - text_offset, text_middle), dimension.label, rotation=90.0)
        canvas.add_linear_dimension("z", dimension.start, dimension.end, line_position, text)
