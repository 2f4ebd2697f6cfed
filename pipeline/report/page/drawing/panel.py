"""One panel of a plot: its scales, and lines, areas and words at places in them, as SVG.

Colours are variables of the page's style sheet, so that one plot serves light and dark. Words are text in the page's
own font, which a reader can search and select.
"""

from dataclasses import dataclass, field
from html import escape
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from pipeline.report.page.drawing.scale import Floats, Scale

INK, MUTED, LINE, GOOD, BAD = (f"var(--{name})" for name in ("ink", "muted", "line", "good", "bad"))
SERIES = tuple(f"var(--c{number})" for number in range(1, 8))
DASHED = "4 2.5"
DOTTED = "1.2 2"
Anchor = Literal["start", "middle", "end"]

_TICK = 3.5  # [pt] long
_UNDER_MIDDLE = 0.35  # [em] from the middle of a digit down to its foot
_LABEL_FALL = 31.0  # [pt] from the foot of a panel to the words of its scale


@dataclass(frozen=True, kw_only=True)
class Box:
    """A rectangle in a picture [pt], from its upper left corner."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True, kw_only=True)
class Words:
    """How words are written: where their place is in them, how far from it [pt], their colour and size [pt]."""

    anchor: Anchor = "start"
    right: float = 0.0
    down: float = 0.0
    colour: str = INK
    size: float = 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """A panel of a plot, whose name is given once in a page: its box, its scales, and what is drawn so far.

    What lies beyond the scales is cut off, words are not. A scale whose label is None has ticks and no numbers.
    """

    name: str
    box: Box
    x: Scale
    y: Scale
    x_label: str | None = ""
    y_label: str | None = ""
    grid: bool = True
    drawn: list[str] = field(default_factory=list)
    written: list[str] = field(default_factory=list)

    def places(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """Return places in the picture [pt], shape (n, 2), of values on both scales (n,)."""
        across, up = np.broadcast_arrays(self.x.shares(x), self.y.shares(y))
        box = self.box
        return np.stack([box.left + box.width * across, box.top + box.height * (1.0 - up)], axis=-1).reshape(-1, 2)

    def line(self, x: ArrayLike, y: ArrayLike, colour: str, width: float = 1.5, dash: str = "") -> None:
        """Draw a line through values (n,), broken at nan, of a width [pt]."""
        self._stroke("".join(_path(run) for run in _known_runs(self.places(x, y))), colour, width, dash)

    def polygons(self, corners: Floats, colour: str, opacity: float = 1.0) -> None:
        """Fill polygons of as many corners each, values (polygons, corners, 2)."""
        points = self.places(corners[..., 0], corners[..., 1]).reshape(corners.shape)
        path = "".join(f"{_path(polygon)}Z" for polygon in points)
        self.drawn.append(f'<path d="{path}" style="fill:{colour};fill-opacity:{opacity:g}"/>')

    def _stroke(self, path: str, colour: str, width: float, dash: str) -> None:
        dashes = f";stroke-dasharray:{dash}" if dash else ""
        self.drawn.append(f'<path d="{path}" style="fill:none;stroke:{colour};stroke-width:{width:g}{dashes}"/>')

    def points(self, x: ArrayLike, y: ArrayLike, colour: str, radius: float) -> None:
        """Draw points at values (n,), of a radius [pt]; none at nan."""
        known = self.places(x, y)
        circles = (f'<circle cx="{a:.2f}" cy="{b:.2f}" r="{radius:g}"/>' for a, b in known[np.isfinite(known).all(1)])
        self.drawn.append(f'<g style="fill:{colour}">{"".join(circles)}</g>')

    def area(
        self, x1: ArrayLike, y1: ArrayLike, x2: ArrayLike, y2: ArrayLike, colour: str, opacity: float = 1.0
    ) -> None:
        """Fill the area between two lines of values x and y, shape (n,); broken where either is nan."""
        both = np.concatenate([self.places(x1, y1), self.places(x2, y2)], axis=1)
        outlines = (np.concatenate([run[:, :2], run[::-1, 2:]]) for run in _known_runs(both))
        shape = "".join(f"{_path(outline)}Z" for outline in outlines)
        self.drawn.append(f'<path d="{shape}" style="fill:{colour};fill-opacity:{opacity:g}"/>')

    def level(self, y: float, colour: str, width: float = 1.5, dash: str = "") -> None:
        """Draw a line at a value [unit of the scale] over the whole width."""
        self.line([self.x.start, self.x.end], [y, y], colour, width, dash)

    def write(self, text: str, x: float, y: float, words: Words) -> None:
        """Write a text at values on both scales [units of the scales]."""
        ((left, top),) = self.places(x, y).tolist()
        self.write_at(text, left, top, words)

    def write_at(self, text: str, left: float, top: float, words: Words) -> None:
        """Write a text at a place of the picture [pt], the middle of its digits at that level."""
        down = top + words.down + _UNDER_MIDDLE * words.size
        self.written.append(_text(text, left + words.right, down, words))

    def svg(self) -> str:
        """Return the panel as elements of SVG: grid, what is drawn, scales, words."""
        box = self.box
        corner = f'x="{box.left:.2f}" y="{box.top:.2f}" width="{box.width:.2f}" height="{box.height:.2f}"'
        clip = f'<clipPath id="{self.name}-clip"><rect {corner}/></clipPath>'
        inside = f'<g clip-path="url(#{self.name}-clip)">{"".join(self.drawn)}</g>'
        return "\n".join([clip, self._grid() if self.grid else "", inside, self._scales(), *self.written])

    def _grid(self) -> str:
        lines = "".join((*map(self._upright, _numbered(self.x)), *map(self._across, _numbered(self.y))))
        return f'<path d="{lines}" style="stroke:{LINE};stroke-width:0.6"/>'

    def _upright(self, share: float) -> str:
        return f"M{self.box.left + share * self.box.width:.2f} {self.box.top:.2f}v{self.box.height:.2f}"

    def _across(self, share: float) -> str:
        return f"M{self.box.left:.2f} {self._foot - share * self.box.height:.2f}h{self.box.width:.2f}"

    @property
    def _foot(self) -> float:
        return self.box.top + self.box.height

    def _scales(self) -> str:
        """Return both scales: their lines, ticks, numbers and labels."""
        box = self.box
        foot = self._foot
        frame = f"M{box.left:.2f} {box.top:.2f}v{box.height:.2f}h{box.width:.2f}"
        below = "".join(f"M{box.left + share * box.width:.2f} {foot:.2f}v{size:.2f}" for share, size in _ticks(self.x))
        beside = "".join(
            f"M{box.left:.2f} {foot - share * box.height:.2f}h{-size:.2f}" for share, size in _ticks(self.y)
        )
        lines = f'<path d="{frame}{below}{beside}" style="fill:none;stroke:{MUTED};stroke-width:0.8"/>'
        return "\n".join([lines, *self._numbers_of_x(), *self._numbers_of_y()])

    def _numbers_of_x(self) -> list[str]:
        if self.x_label is None:
            return []
        box = self.box
        words = Words(anchor="middle")
        found = [
            _text(text, box.left + share * box.width, self._foot + 14.0, words)
            for share, (_, text) in zip(_numbered(self.x), self.x.ticks, strict=True)
        ]
        label = self.x.named(self.x_label)
        return [*found, _text(label, box.left + 0.5 * box.width, self._foot + _LABEL_FALL, words)]

    def _numbers_of_y(self) -> list[str]:
        if self.y_label is None:
            return []
        box = self.box
        words = Words(anchor="end")
        found = [
            _text(text, box.left - 6.0, self._foot - share * box.height + _UNDER_MIDDLE * words.size, words)
            for share, (_, text) in zip(_numbered(self.y), self.y.ticks, strict=True)
        ]
        turned = f'transform="translate({box.left - 37.0:.2f} {box.top + 0.5 * box.height:.2f}) rotate(-90)"'
        label = escape(self.y.named(self.y_label))
        return [*found, f'<text {turned} text-anchor="middle" style="fill:{INK}">{label}</text>']


def _numbered(scale: Scale) -> list[float]:
    """Return the shares at which a scale has numbers [1]."""
    shares: list[float] = scale.shares([value for value, _ in scale.ticks]).tolist()
    return shares


def _ticks(scale: Scale) -> list[tuple[float, float]]:
    """Return the shares at which a scale has ticks [1], and how long each is [pt]."""
    small = scale.shares(scale.small_ticks).tolist()
    return [*((share, _TICK) for share in _numbered(scale)), *((share, 0.6 * _TICK) for share in small)]


def _text(text: str, left: float, foot: float, words: Words) -> str:
    style = f"fill:{words.colour};font-size:{words.size:g}px"
    place = f'x="{left:.2f}" y="{foot:.2f}" text-anchor="{words.anchor}"'
    return f'<text {place} style="{style}">{escape(text)}</text>'


def _path(places: Floats) -> str:
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in places.tolist())


def _known_runs(places: Floats) -> list[Floats]:
    """Return the runs of rows (n, ...) that have no nan, each of two rows or more."""
    known = np.concatenate([[False], np.isfinite(places).all(axis=1), [False]])
    ends = np.flatnonzero(np.diff(known))
    return [places[start:end] for start, end in ends.reshape(-1, 2).tolist() if end > start + 1]
