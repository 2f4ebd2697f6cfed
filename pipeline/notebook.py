"""The answer on a sensor in a notebook: a sentence, the verdicts, the springs, and a plot of P against the modulus.

The answer is HTML that contains an SVG, and needs neither a network nor a further package.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from pipeline.springs.spring import MadeSpring
from pipeline.verdicts.in_words import (
    NUMERICAL,
    failed_or_undecided,
    in_display_units,
    is_on_the_part,
    limit_text,
    measured,
    overall_sentence,
    tolerance_text,
)
from sensor.arrays import Flags, Floats
from sensor.verdict import Verdict
from sensor.words import OUTCOMES, round_below, value_with_bar

_COLOURS = {True: "#2e7d32", False: "#c62828", None: "#b26a00"}  # by outcome: passed, failed, undecided
_SIZE = (420, 240)  # width and height of the plot with its margins [px]
_MARGINS = (48, 12, 12, 38)  # left, top, right, bottom [px]; the left and bottom margins hold the numbers and titles
_MIN_TICKS = 5  # minimum number of ticks on an axis
_BLUE = "#1f6fb2"


def answer_html(
    name: str,
    verdicts: Sequence[Verdict],
    springs: Mapping[str, MadeSpring],
    E: Floats,
    P: Floats,
    moduli: Iterable[float],
) -> str:
    """Return the answer on a design as HTML: a sentence, tables of verdicts and springs, and a plot.

    The reason for each verdict that did not pass is listed below the table of verdicts. `name` is the name of the
    design. `springs` are the springs by name; without springs, their table is omitted. The plot shows the force ratio P
    (n,) [1] at full travel against the modulus E (n,) [MPa]. P is nan if a tip is out of contact. The `moduli` of the
    design [MPa] are shown as dots on this curve.
    """
    parts = [f"<p><strong>{escape(overall_sentence(name, verdicts))}</strong></p>", _verdict_table(verdicts)]
    reasons = []
    for verdict in failed_or_undecided(verdicts):
        reason = f"{verdict.name}: {verdict.remedy or verdict.reference}"  # what to do, or else what was compared
        reasons.append(f"<li>{_outcome(verdict)} {escape(reason)}</li>")
    if reasons:
        parts.append(f"<ul>{''.join(reasons)}</ul>")
    if springs:
        parts.append(_spring_table(springs))
    parts += _plot(E, P, list(moduli))
    return f"<div>{''.join(parts)}</div>"


def _verdict_table(verdicts: Sequence[Verdict]) -> str:
    """Return an HTML table of the verdicts on targets and readings, with a row for each.

    The verdicts on the geometry and the print share one last row. This row states how many of them there are, and how
    many of them passed.
    """
    rows = []
    for verdict in verdicts:
        if not is_on_the_part(verdict):
            in_units = in_display_units(verdict)
            limit = limit_text(in_units, in_units.unit)
            cells = (in_units.name, measured(in_units), limit, tolerance_text(in_units))
            rows.append(f"{_cells(cells)}<td>{_outcome(verdict)}</td>")
    part_outcomes = [verdict.passed for verdict in verdicts if is_on_the_part(verdict)]
    if part_outcomes:
        passed = f"{part_outcomes.count(True)} passed"
        rows.append(_cells((f"{len(part_outcomes)} on geometry and print", "", "", "", passed)))
    return _table(("verdict", f"value, {NUMERICAL}", "target", "tolerance", ""), rows)


def _spring_table(springs: Mapping[str, MadeSpring]) -> str:
    """Return an HTML table of the springs by name: their stiffness with an error bar, and the size of their leaves.

    The cell of the size is empty if a spring is not printed.
    """
    rows = []
    for name, spring in springs.items():
        leaf = spring.flexure
        size = "" if leaf is None else f"{leaf.length:g} x {leaf.thickness:g} x {leaf.depth:g} mm"
        rows.append(_cells((name, value_with_bar(1e3 * spring.stiffness, 1e3 * spring.error, "N/m"), size)))
    return _table(("spring", f"stiffness, {NUMERICAL}", "leaves"), rows)


def _table(headings: Iterable[str], rows: Iterable[str]) -> str:
    """Return an HTML table with the given column headings; each row is the HTML of its cells."""
    header = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    return f"<table><tr>{header}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}</table>"


def _cells(texts: Iterable[str]) -> str:
    """Return texts as the cells of an HTML row, with special characters escaped."""
    return "".join(f"<td>{escape(text)}</td>" for text in texts)


def _outcome(verdict: Verdict) -> str:
    """Return the outcome of a verdict as coloured HTML text."""
    return f'<span style="color:{_COLOURS[verdict.passed]}">{OUTCOMES[verdict.passed]}</span>'


class _Scale(NamedTuple):
    """The scale of an axis: its ticks in ascending order, and the positions [px] of the first and the last tick."""

    ticks: Floats
    first_px: float
    last_px: float

    def positions(self, values: Floats) -> Floats:
        """Return the positions [px] of values on the axis."""
        fraction = (values - self.ticks[0]) / (self.ticks[-1] - self.ticks[0])
        return np.asarray(self.first_px + fraction * (self.last_px - self.first_px))

    def placed_ticks(self) -> Iterator[tuple[float, float]]:
        """Return the pairs of a tick and its position [px]."""
        return zip(self.ticks, self.positions(self.ticks), strict=True)


def _plot(E: Floats, P: Floats, moduli: Sequence[float]) -> Iterator[str]:
    """Yield the elements of an SVG plot of P (n,) [1] against the modulus E (n,) [MPa], with dots at `moduli` [MPa].

    The curve has gaps where P is nan because a tip is out of contact. Nothing is yielded if fewer than two values of P
    are known.
    """
    is_known = np.isfinite(P)
    if np.count_nonzero(is_known) < 2:  # noqa: PLR2004 - a line has two ends
        return
    width, height = _SIZE
    left, top, right, bottom = _MARGINS
    x_scale = _Scale(_ticks(0.0, float(E.max())), left, width - right)
    # in SVG, vertical positions are counted downwards from the top
    y_scale = _Scale(_ticks(float(P[is_known].min()), float(P[is_known].max())), height - bottom, top)
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="11" fill="currentColor" role="img">'
        "<title>force ratio P against the modulus of the fruit</title>"
    )
    yield from _axes(x_scale, y_scale)
    for known in _known_slices(is_known):
        pixels = zip(x_scale.positions(E[known]), y_scale.positions(P[known]), strict=True)
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in pixels)
        yield f'<polyline points="{points}" fill="none" stroke="{_BLUE}" stroke-width="2"/>'
    dots = np.asarray(moduli, dtype=np.float64)
    for x, y in zip(x_scale.positions(dots), y_scale.positions(np.interp(dots, E, P)), strict=True):
        if np.isfinite(y):  # no dot in a gap of the curve
            yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{_BLUE}"/>'
    yield "</svg>"


def _axes(x_scale: _Scale, y_scale: _Scale) -> Iterator[str]:
    """Yield the grid lines, the numbers and the titles of both axes as SVG.

    The small numbers added to positions are the distances [px] of the texts from the lines and the edges.
    """
    width, height = _SIZE
    left, top, right, bottom = _MARGINS
    for tick, x in x_scale.placed_ticks():
        yield _line((x, top), (x, height - bottom))
        yield f'<text x="{x:.1f}" y="{height - bottom + 14}" text-anchor="middle">{tick:g}</text>'
    for tick, y in y_scale.placed_ticks():
        yield _line((left, y), (width - right, y))
        yield f'<text x="{left - 6}" y="{y + 4.0:.1f}" text-anchor="end">{tick:g}</text>'
    centre = 0.5 * (left + width - right)
    yield f'<text x="{centre:.1f}" y="{height - 6}" text-anchor="middle">modulus E of the fruit [MPa]</text>'
    rotation = f"translate(12 {0.5 * (top + height - bottom):.1f}) rotate(-90)"
    yield f'<text transform="{rotation}" text-anchor="middle">force ratio P [1]</text>'


def _known_slices(is_known: Flags) -> Iterator[slice]:
    """Yield the slices of consecutive known values, in order."""
    # A slice of known values begins where the flag changes from 0 to 1, and ends where it changes back. A 0 is added at
    # both ends, so that a slice at an end of the array has both changes too.
    edges = np.flatnonzero(np.diff(np.concatenate([[0], is_known.astype(int), [0]])))
    for start, end in edges.reshape(-1, 2).tolist():
        yield slice(start, end)


def _line(start: tuple[float, float], end: tuple[float, float]) -> str:
    """Return a grid line between two points [px] as SVG."""
    (x1, y1), (x2, y2) = start, end
    ends = f'x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
    return f'<line {ends} stroke="currentColor" stroke-opacity="0.15"/>'


def _ticks(low: float, high: float) -> Floats:
    """Return round numbers at equal steps as ticks, the smallest at most `low` and the largest at least `high`.

    There are at least `_MIN_TICKS` numbers, or two if `low` and `high` are equal.
    """
    span = high - low or abs(high) or 1.0  # a span of 0 is replaced by the magnitude of the value, or by 1
    step = round_below(span / (_MIN_TICKS - 1))
    first, last = np.floor(low / step), np.ceil(high / step)  # multiples of the step
    end = max(last, first + 1.0) + 0.5  # half a step beyond the last tick, because `arange` excludes its end
    return np.arange(first, end) * step
