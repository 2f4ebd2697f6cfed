"""A log-log plot of error against cost as SVG, so that no plotting library is needed."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

_WIDTH, _HEIGHT, _LEFT, _TOP, _BOTTOM, _LEGEND = 380.0, 300.0, 64.0, 34.0, 46.0, 180.0
_COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c564b", "#7f7f7f", "#6a3d9a",
)  # fmt: skip
_LINE = 15.0
_INK = "#333333"


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One method: its points (cost, error), both above 0."""

    name: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One plot: title, axis labels, curves."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]


def svg(panels: Sequence[Panel]) -> str:
    """Return panels side by side as one SVG drawing; points at or below 0 have no place on a log axis and are left out.

    Raises ValueError for a panel without a point.
    """
    step = _LEFT + _WIDTH + _LEGEND
    height = _TOP + _HEIGHT + _BOTTOM
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {step * len(panels):g} {height:g}" '
        f'width="{step * len(panels):g}" height="{height:g}" font-family="sans-serif" font-size="11">',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for place, panel in enumerate(panels):
        parts.append(f'<g transform="translate({place * step + _LEFT:g} {_TOP:g})">')
        parts += _panel(panel)
        parts.append("</g>")
    return "\n".join([*parts, "</svg>"]) + "\n"


def _panel(panel: Panel) -> Iterable[str]:
    drawn = [Curve(name=c.name, points=tuple(sorted(p for p in c.points if min(p) > 0.0))) for c in panel.curves]
    points = [point for curve in drawn for point in curve.points]
    if not points:
        msg = f"panel {panel.title!r}: must have at least one point above 0; measure something first"
        raise ValueError(msg)
    x_decades, y_decades = (_decades([point[axis] for point in points]) for axis in (0, 1))

    def at(point: tuple[float, float]) -> tuple[float, float]:
        x, y = (math.log10(value) for value in point)
        across = (x - x_decades[0]) / (x_decades[1] - x_decades[0])
        up = (y - y_decades[0]) / (y_decades[1] - y_decades[0])
        return _WIDTH * across, _HEIGHT * (1.0 - up)

    yield _text(0.5 * _WIDTH, -14.0, panel.title, "middle", "font-weight='bold'")
    yield _text(0.5 * _WIDTH, _HEIGHT + 36.0, panel.x_label, "middle")
    yield _text(-0.5 * _HEIGHT, -48.0, panel.y_label, "middle", "transform='rotate(-90)'")
    yield from _grid(x_decades, y_decades)
    for index, curve in enumerate(drawn):
        colour = _COLOURS[index % len(_COLOURS)]
        places = [at(point) for point in curve.points]
        if len(places) > 1:
            line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
            yield f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
        for x, y in places:
            yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.2" fill="{colour}"/>'
        level = 8.0 + _LINE * index
        yield f'<circle cx="{_WIDTH + 12:g}" cy="{level - 4:g}" r="3.2" fill="{colour}"/>'
        yield _text(_WIDTH + 20.0, level, curve.name, "start")


def _decades(values: Sequence[float]) -> tuple[int, int]:
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return low, max(high, low + 1)


def _grid(x_decades: tuple[int, int], y_decades: tuple[int, int]) -> Iterable[str]:
    yield f'<rect width="{_WIDTH:g}" height="{_HEIGHT:g}" fill="none" stroke="{_INK}"/>'
    for decade in range(x_decades[0], x_decades[1] + 1):
        x = _WIDTH * (decade - x_decades[0]) / (x_decades[1] - x_decades[0])
        yield f'<line x1="{x:.1f}" y1="0" x2="{x:.1f}" y2="{_HEIGHT:g}" stroke="#dddddd"/>'
        yield _text(x, _HEIGHT + 16.0, _power(decade), "middle")
    for decade in range(y_decades[0], y_decades[1] + 1):
        y = _HEIGHT * (1.0 - (decade - y_decades[0]) / (y_decades[1] - y_decades[0]))
        yield f'<line x1="0" y1="{y:.1f}" x2="{_WIDTH:g}" y2="{y:.1f}" stroke="#dddddd"/>'
        yield _text(-6.0, y + 4.0, _power(decade), "end")


def _power(decade: int) -> str:
    return f"{10.0**decade:g}"


def _text(x: float, y: float, words: str, anchor: str, extra: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{_INK}" {extra}>{escape(words)}</text>'
