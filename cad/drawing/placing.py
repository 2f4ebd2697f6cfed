"""Dimensions in rows around a view: short ones near it, long ones outside, no text on another or on a line to one."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from cad.drawing.items import Box, Dimension, Point, text_width, written

Side = Literal["top", "bottom", "left", "right"]
TEXT_MM = 2.5  # height of a capital on paper, ISO 3098
_FIRST_MM, _STEP_MM = 8.0, 7.0  # on paper: from the view to the first row, and between rows


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A dimension between two points of a view [mm] that shall stand on one of its sides."""

    side: Side
    start: Point
    end: Point
    label: str = "<>"


@dataclass(frozen=True)
class _Row:
    """A dimension in a row: where it begins and ends along the side, and where its text does [mm]."""

    row: int
    ends: Point
    text: Point

    @property
    def span(self) -> Point:
        return min(*self.ends, *self.text), max(*self.ends, *self.text)


def in_rows(wanted: Sequence[Wanted], view: Box, scale: float) -> Iterator[Dimension]:
    """Yield the dimensions wanted around a view [mm], for a sheet of the scale."""
    for side in ("top", "bottom", "left", "right"):
        of_side = [one for one in wanted if one.side == side]
        rows: list[_Row] = []
        for one in sorted(of_side, key=lambda one: (round(_length(one), 6), _ends(one))):
            found = _first_free(one, rows, [end for other in of_side for end in _ends(other)], scale)
            rows.append(found)
            yield _placed(one, found, view, scale)


def _ends(one: Wanted) -> Point:
    axis = 0 if one.side in ("top", "bottom") else 1
    return min(one.start[axis], one.end[axis]), max(one.start[axis], one.end[axis])


def _length(one: Wanted) -> float:
    return _ends(one)[1] - _ends(one)[0]


def _first_free(one: Wanted, rows: Sequence[_Row], ends: Sequence[float], scale: float) -> _Row:
    """Return the row nearest to the view, and the place of the text in it, that meets no other dimension.

    A text that no line to any of the `ends` on this side [mm] could cross goes before one that some may.
    """
    height, own = TEXT_MM / scale, _ends(one)
    texts = sorted(_places(one, height), key=lambda text: sum(text[0] < end < text[1] for end in ends))
    beyond_all = 1 + max((other.row for other in rows), default=-1)
    for row in range(beyond_all + 1):
        for text in texts:
            found = _Row(row, own, text)
            if not any(_meet(found, other, 0.4 * height) for other in rows):
                return found
    return _Row(beyond_all, own, texts[0])  # a line to it crosses a text of an inner row, and would in any row


def _places(one: Wanted, height: float) -> list[Point]:
    """Return where the text may begin and end along its side [mm]: in the middle where there is room, or beyond."""
    a, b = _ends(one)
    width = text_width(one.label.replace("<>", written(b - a)), height)
    beyond, middle = 2.0 * height, 0.5 * (a + b)
    outside = [(b + beyond, b + beyond + width), (a - beyond - width, a - beyond)]
    fits = b - a >= width + 1.2 * height
    return [(middle - 0.5 * width, middle + 0.5 * width), *outside] if fits else outside


def _meet(one: _Row, other: _Row, gap: float) -> bool:
    """Say whether two dimensions touch: in one row, or the text of the inner one and a line to the outer one."""
    if one.row == other.row:
        (a, b), (c, d) = one.span, other.span
        return (a < d + gap and c < b + gap and not (b <= c or d <= a)) or _texts_touch(one, other, gap)
    inner, outer = (one, other) if one.row < other.row else (other, one)
    return any(inner.text[0] - gap < end < inner.text[1] + gap for end in outer.ends)


def _texts_touch(one: _Row, other: _Row, gap: float) -> bool:
    """Say whether a text is nearer than a gap to the text or to an end of the other dimension."""
    pairs = ((one.text, other.text), (one.text, other.ends), (one.ends, other.text))
    return any(a < d + gap and c < b + gap for (a, b), (c, d) in pairs)


def _placed(one: Wanted, found: _Row, view: Box, scale: float) -> Dimension:
    left, bottom, right, top = view
    height = TEXT_MM / scale
    out = (_FIRST_MM + found.row * _STEP_MM) / scale
    level = {"top": top + out, "bottom": bottom - out, "left": left - out, "right": right + out}[one.side]
    middle, over = 0.5 * sum(found.text), 0.8 * height
    drawn = Dimension(
        kind="x",
        start=one.start,
        end=one.end,
        label=one.label,
        text_at=(middle, level + over),
        height=height,
        level=level,
    )
    if one.side in ("top", "bottom"):
        return drawn
    return replace(drawn, kind="z", text_at=(level - over, middle), turn=90.0)


@dataclass(frozen=True, kw_only=True)
class Callout:
    """A radius or a diameter whose text stands apart: centre, radius and direction [deg] of the arrow on the arc.

    The text begins or ends, by its `side`, at a place from which the sheet leaves it a gap.
    """

    kind: Literal["radius", "diameter"]
    centre: Point
    radius: float
    turn: float
    label: str
    beside: Point
    side: Literal["left", "right"]


def called_out(one: Callout, scale: float) -> Dimension:
    """Return the dimension of a callout, for a sheet of the scale."""
    height, turn = TEXT_MM / scale, math.radians(one.turn)
    (x, z), r = one.centre, one.radius
    width = text_width(one.label.replace("<>", "R" + written(2.0 * r)), height)
    way = -1.0 if one.side == "left" else 1.0
    at = (one.beside[0] + way * (2.0 * height + 0.5 * width), one.beside[1])
    end = (x + r * math.cos(turn), z + r * math.sin(turn))
    return Dimension(kind=one.kind, start=one.centre, end=end, label=one.label, text_at=at, height=height)
