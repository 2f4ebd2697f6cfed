"""The plots of a study's page, as SVG: what each key does to a number, a map of it, and points as lines."""

import io
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.study.answers.point_columns import Floats, PointColumns

MOST_DOTS = 1_000  # of the points: more hide each other
MOST_LINES = 300
_BINS = 12
_SEED = 1
_GREY, _BLUE = "#b0b0b0", "#1f6fb2"
_EXTREME = 2.0  # per cent of the points at either end of a colour scale
_SPARE = 0.05  # of the span of an axis, beyond its ends


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """Plots that stand together, each as SVG, and what they show; a `wide` one keeps its width on a small screen."""

    plots: tuple[str, ...]
    caption: str
    wide: bool = False


def drawings(columns: PointColumns, varied: Sequence[str], wanted: Sequence[str]) -> list[Drawing]:
    """Return the plots of a study; those of keys that are texts, or the same at every point, are left out."""
    keys, numbers = ([key for key in some if columns.differs(key)] for some in (varied, wanted))
    if not keys or not numbers:
        return []
    first = numbers[0]
    found = [
        Drawing(plots=tuple(_effect(columns, key, number) for key in keys), caption=f"{number} over each key")
        for number in numbers
    ]
    if len(keys) > 1:
        strongest = sorted(keys, key=lambda key: -_strength(columns, key, first))[:2]
        caption = f"{first} over the two keys that move it most"
        found.append(Drawing(plots=(_map(columns, strongest, first),), caption=caption))
    caption = f"Points as lines through their values, each axis from the least to the largest; coloured by {first}"
    lines = _lines(columns, list(dict.fromkeys((*keys, *numbers))), first)
    return [*found, Drawing(plots=(lines,), caption=caption, wide=True)]


def constants(columns: PointColumns, keys: Sequence[str]) -> dict[str, float]:
    """Return the keys whose number is the same at every point, with it [unit of the key]."""
    return {key: columns.ends(key)[0] for key in keys if key in columns.values and not columns.differs(key)}


def drawn_at_random(count: int, most: int) -> NDArray[np.int64]:
    """Return the places of at most so many points among all, in their order: the same ones every time."""
    places = np.random.default_rng(_SEED).permutation(count)[:most]
    return np.sort(places)


def bin_means(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the means of x and y (points,) over equal parts of the span of x [their units], parts without points out.

    Where x has few different values there is a mean at each of them.
    """
    known = ~(np.isnan(x) | np.isnan(y))
    x, y = x[known], y[known]
    different = np.unique(x)
    if len(different) > _BINS:
        edges = np.linspace(different[0], different[-1], _BINS + 1)
        part = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    else:
        part = np.searchsorted(different, x)
    counts = np.bincount(part)
    filled = counts > 0
    sums = (np.bincount(part, weights=values)[filled] for values in (x, y))
    means = [total / counts[filled] for total in sums]
    return means[0], means[1]


def _strength(columns: PointColumns, key: str, number: str) -> float:
    """Return how far the mean of a number moves over a key [unit of the number]."""
    return float(np.ptp(bin_means(columns.values[key], columns.values[number])[1]))


def _middle(values: Floats) -> tuple[float, float]:
    """Return the ends of a colour scale [unit of the values]: a few extreme points do not take it all."""
    ends = np.nanpercentile(values, [_EXTREME, 100.0 - _EXTREME])
    return float(ends[0]), float(ends[1])


def _short(value: float) -> str:
    """Write a number with three digits, without a power of ten where it is of everyday size."""
    return f"{float(f'{value:.3g}'):g}"


def _effect(columns: PointColumns, key: str, number: str) -> str:
    """Draw points and their mean over one key."""
    x, y = columns.values[key], columns.values[number]
    some = drawn_at_random(len(x), MOST_DOTS)
    figure = Figure(figsize=(3.6, 2.7), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(x[some], y[some], ".", markersize=2.5, color=_GREY, rasterized=True)
    axes.plot(*bin_means(x, y), color=_BLUE, marker="o", markersize=3)
    axes.set_xlabel(key)
    axes.set_ylabel(number)
    return _svg(figure)


def _map(columns: PointColumns, keys: Sequence[str], number: str) -> str:
    figure = Figure(figsize=(5.6, 4.2), layout="constrained")
    axes = figure.add_subplot()
    x, y, colour = (columns.values[key] for key in (*keys, number))
    some = drawn_at_random(len(x), MOST_DOTS)
    least, largest = _middle(colour)
    dots = axes.scatter(x[some], y[some], c=colour[some], s=9, vmin=least, vmax=largest, rasterized=True)
    figure.colorbar(dots, label=number, extend="both")
    axes.set_xlabel(keys[0])
    axes.set_ylabel(keys[1])
    return _svg(figure)


def _lines(columns: PointColumns, keys: Sequence[str], number: str) -> str:
    """Draw points as lines over the keys, each key from its least to its largest value."""
    figure = Figure(figsize=(max(6.0, 1.25 * len(keys)), 4.2), layout="constrained")
    axes = figure.add_subplot()
    some = drawn_at_random(len(columns.points), MOST_LINES)
    heights = np.stack([_shares(columns, key)[some] for key in keys], axis=1)
    places = np.broadcast_to(np.arange(len(keys)), heights.shape)
    lines = LineCollection(list(np.stack([places, heights], axis=2)), linewidths=0.6)
    lines.set_array(columns.values[number][some])
    lines.set_clim(*_middle(columns.values[number]))
    axes.add_collection(lines)
    figure.colorbar(lines, label=number, extend="both", pad=0.02)
    _draw_axes(axes, [_axis_name(columns, key) for key in keys])
    return _svg(figure)


def _draw_axes(axes: Axes, names: Sequence[str]) -> None:
    """Draw an upright line for each name."""
    axes.set_xlim(-_SPARE, len(names) - 1 + _SPARE)
    axes.set_ylim(-_SPARE, 1.0 + _SPARE)
    axes.set_yticks([])
    axes.set_xticks(range(len(names)), names, fontsize=8)
    for place in range(len(names)):
        axes.axvline(place, color="black", linewidth=0.6)


def _shares(columns: PointColumns, key: str) -> Floats:
    """Return the values of a key from 0 at the least to 1 at the largest [1], shape (points,)."""
    least, largest = columns.ends(key)
    return (columns.values[key] - least) / (largest - least)


def _axis_name(columns: PointColumns, key: str) -> str:
    """Return a key on a line for each of its words, and below it the ends of its values."""
    least, largest = columns.ends(key)
    words = key.replace(".", ".\n")
    return f"{words}\n{_short(least)} to {_short(largest)}"


def _svg(figure: Figure) -> str:
    """Return a figure as SVG inside a page: the same bytes every time, its text as text, its many dots as a picture."""
    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "twintip", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", dpi=120, metadata={"Date": None})
    drawn = text.getvalue()
    return drawn[drawn.index("<svg") :]
