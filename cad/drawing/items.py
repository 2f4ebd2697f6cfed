"""What a drawing consists of, in millimetres of the part: lines, arcs, words, and dimensions that know their value."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float]
Box = tuple[float, float, float, float]
"""Left, bottom, right, top."""
LAYERS = {"PART": 7, "DIMENSIONS": 5, "NOTES": 3, "SHEET": 8}  # with the colour of each, by AutoCAD's index
FULL_DEG = 360.0
LETTER = 0.83  # width of a monospaced letter over the height of a capital: DejaVu Sans Mono, 0.602 / 0.729
DECIMALS = 3
MEASURED = "<>"


@dataclass(frozen=True, kw_only=True)
class Line:
    """A straight line from one point to another on a layer."""

    start: Point
    end: Point
    layer: str = "PART"

    @property
    def box(self) -> Box:
        """Return the box around the line [mm]."""
        (a, b), (c, d) = self.start, self.end
        return min(a, c), min(b, d), max(a, c), max(b, d)


@dataclass(frozen=True, kw_only=True)
class Arc:
    """A circular arc, counter-clockwise from one angle to another [deg]; a circle goes from 0 to 360."""

    centre: Point
    radius: float
    start: float
    end: float
    layer: str = "PART"

    @property
    def closed(self) -> bool:
        """Say whether this is a whole circle."""
        return self.end - self.start >= FULL_DEG

    @property
    def ends(self) -> tuple[Point, Point]:
        """Return the points at both ends [mm]."""
        return self._at(self.start), self._at(self.end)

    def _at(self, turn: float) -> Point:
        (x, y), r = self.centre, self.radius
        return x + r * math.cos(math.radians(turn)), y + r * math.sin(math.radians(turn))

    @property
    def box(self) -> Box:
        """Return the box around the arc [mm]."""
        quarters = range(math.ceil(self.start / 90.0), math.floor(self.end / 90.0) + 1)
        points = [*self.ends, *(self._at(90.0 * quarter) for quarter in quarters)]
        x, y = zip(*points, strict=True)
        return min(x), min(y), max(x), max(y)


@dataclass(frozen=True, kw_only=True)
class Words:
    """A line of text about its middle, or from its left end; turned by 0 or 90 degrees."""

    text: str
    at: Point
    height: float
    turn: float = 0.0
    centred: bool = True
    layer: str = "DIMENSIONS"

    @property
    def box(self) -> Box:
        """Return the box around the letters [mm]."""
        along, across = 0.5 * text_width(self.text, self.height), 0.5 * self.height
        x, y = self.at if self.centred else (self.at[0] + along, self.at[1])
        if self.turn:
            along, across = across, along
        return x - along, y - across, x + along, y + across


@dataclass(frozen=True, kw_only=True)
class Dimension:
    """A dimension of a part: what it measures, where its line and its text stand.

    Along x or z it goes from `start` to `end`, with its line at the height or the place `level`; a radius or a diameter
    goes from the centre `start` to a point `end` of the arc. `label` holds `<>` where the measured value stands, with R
    or Ø before it for the round ones.
    `text_at` is the middle of the text, whose height is that of the sheet.
    """

    kind: Literal["x", "z", "radius", "diameter"]
    start: Point
    end: Point
    label: str
    text_at: Point
    height: float
    level: float = 0.0
    turn: float = 0.0

    @property
    def measured(self) -> float:
        """Return the length that is measured [mm]."""
        across, up = self.end[0] - self.start[0], self.end[1] - self.start[1]
        lengths = {"x": abs(across), "z": abs(up), "radius": math.hypot(across, up)}
        return lengths.get(self.kind, 2.0 * math.hypot(across, up))

    @property
    def words(self) -> Words:
        """Return the text with its value."""
        sign = {"radius": "R", "diameter": "Ø"}.get(self.kind, "")
        text = self.label.replace(MEASURED, sign + written(self.measured))
        return Words(text=text, at=self.text_at, height=self.height, turn=self.turn)

    @property
    def box(self) -> Box:
        """Return the box around text and ends [mm]."""
        boxes = [self.words.box, *(line.box for line in self.lines)]
        return union(boxes)

    @property
    def lines(self) -> tuple[Line, ...]:
        """Return the dimension line, the lines to what is measured, and the strokes of the arrows."""
        return _radial_lines(self) if self.kind in ("radius", "diameter") else _linear_lines(self)


Item = Line | Arc | Words | Dimension


def written(value: float) -> str:
    """Return a length [mm] as a drawing shows it."""
    return f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")


def text_width(text: str, height: float) -> float:
    """Return how long a line of text of a height is [mm]."""
    return LETTER * height * len(text)


def union(boxes: list[Box]) -> Box:
    """Return the box around boxes [mm]."""
    left, bottom, right, top = zip(*boxes, strict=True)
    return min(left), min(bottom), max(right), max(top)


def overlap(one: Box, other: Box) -> bool:
    """Say whether two boxes share an area."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _linear_lines(item: Dimension) -> tuple[Line, ...]:
    """Return the lines of a dimension along x or z, which is drawn along x and mirrored for z."""

    def turned(point: Point) -> Point:
        return (point[1], point[0]) if item.kind == "z" else point

    feet = sorted((turned(item.start), turned(item.end)))
    strokes = [*_witnesses(item, feet), *_arrows(item, (feet[0][0], feet[1][0]), turned(item.text_at)[0])]
    return tuple(_thin(turned(start), turned(end)) for start, end in strokes)


def _witnesses(item: Dimension, feet: list[Point]) -> Iterator[tuple[Point, Point]]:
    """Yield the lines from what is measured to a dimension line along x."""
    past = 0.4 * item.height
    for place, foot in feet:
        if abs(item.level - foot) > past:
            away = math.copysign(past, item.level - foot)
            yield (place, foot + away), (place, item.level + away)


def _arrows(item: Dimension, ends: Point, text: float) -> Iterator[tuple[Point, Point]]:
    """Yield a dimension line along x with its arrows, from outside where there is no room, and as far as its text."""
    (a, b), arrow, level = ends, 0.8 * item.height, item.level
    inside = b - a >= 3.0 * arrow
    reach, way = (0.0, 1.0) if inside else (2.0 * arrow, -1.0)
    yield (min(a - reach, text), level), (max(b + reach, text), level)
    for tip, barb in ((a, a + way * arrow), (b, b - way * arrow)):
        for side in (-0.2, 0.2):
            yield (tip, level), (barb, level + side * arrow)


def _radial_lines(item: Dimension) -> tuple[Line, ...]:
    """Return the line from the arc to the end of the text that is nearer, with an arrow on the arc."""
    left, _, right, _ = item.words.box
    gap = 0.4 * item.height
    end = min(
        ((left - gap, item.text_at[1]), (right + gap, item.text_at[1])), key=lambda point: math.dist(point, item.end)
    )
    length = math.dist(item.end, end)
    if length == 0.0:
        return ()
    (x, z), arrow = item.end, 0.8 * item.height
    u, v = (end[0] - x) / length, (end[1] - z) / length
    barbs = [(x + arrow * (u - side * 0.2 * v), z + arrow * (v + side * 0.2 * u)) for side in (-1.0, 1.0)]
    return (_thin(end, item.end), *(_thin(item.end, barb) for barb in barbs))


def _thin(start: Point, end: Point) -> Line:
    return Line(start=start, end=end, layer="DIMENSIONS")
