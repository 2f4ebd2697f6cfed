"""The page of a study, one file that needs no network: effects of each key, a map, the best ten."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, FileSystemLoader
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cad.design.design_file import design_as_toml
from cad.quantity import validation_error
from pipeline.study.columns import Floats, PointColumns, point_columns
from pipeline.study.outputs import refuse_no_folder, refuse_taken, write_output
from pipeline.study.points import design_of
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

FLAG = "--html"
BEST = 10
MOST_DOTS = 1_000  # of the points: more hide each other
_FOLDER = "best-designs"
_TEMPLATE = "study.html.j2"
_BINS = 12
_SEED = 1
_GREY = "#b0b0b0"
_BLUE = "#1f6fb2"
_EXTREME = 2.0  # per cent of the points at either end of a colour scale


@dataclass(frozen=True, kw_only=True)
class BestRow:
    """A line of the table of the best points: its number, its cells, and its design file as the page names it."""

    number: int
    design: str | None
    cells: tuple[str, ...]


def refuse_page(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where no page of the study of a folder can be written, before anything is solved."""
    if path.suffix != ".html":
        raise validation_error(FLAG, str(path), "", "a file name that ends in .html", "change its ending")
    refuse_no_folder(path, folder, FLAG)
    if not force:
        refuse_taken(folder, [path], FLAG)
        refuse_taken(folder, (folder / _FOLDER).glob("point-*.toml"), "--out")


def write_page(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the page of a study to a file, and the design files of its best ten points beside its store.

    Means are over all points that are done; of many points some, drawn at random, are shown as dots. Raises InputError
    as `write_output`.
    """
    columns = point_columns(store, study.keys)
    constants = {}
    for key in study.keys:
        if key in columns.values and not columns.differs(key):
            constants[key] = _cell(float(np.nanmin(columns.values[key])))
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True)
    text = environment.get_template(_TEMPLATE).render(
        study=study,
        counts=store.counts(),
        plots=_plots(columns, study),
        dots=MOST_DOTS,
        constants=constants,
        header=[key.split(".") for key in study.keys],
        best=_best_rows(store, study, columns, path, force=force),
        messages=store.messages(),
    )
    write_output(store, path, text.encode(), FLAG, force=force)


def _best_rows(store: StudyStore, study: Study, columns: PointColumns, page: Path, *, force: bool) -> list[BestRow]:
    """Return the best ten points, their design files written beside the store; prints that miss have none."""
    rows = []
    for point in list(store.rows(columns.best(study.wanted[0], BEST))):
        link = None
        if not study.prints_vary:
            design = store.path.parent / _FOLDER / f"point-{point.number}.toml"
            content = design_as_toml(design_of(study, point.settings)).encode()
            write_output(store, design, content, "--out", force=force)
            target = design.resolve()
            near = target.is_relative_to(page.parent.resolve())
            link = str(target.relative_to(page.parent.resolve())) if near else target.as_uri()
        values: Mapping[str, object] = {**point.settings, **point.values}
        cells = tuple(_cell(values.get(key)) for key in study.keys)
        rows.append(BestRow(number=point.number, design=link, cells=cells))
    return rows


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return "" if value is None else str(value)


def _plots(columns: PointColumns, study: Study) -> dict[str, list[str]]:
    """Return plots as SVG by their caption; those of keys that are texts, or the same at every point, are left out."""
    keys = [key for key in study.vary if columns.differs(key)]
    numbers = [key for key in study.wanted if columns.differs(key)]
    plots = {}
    if keys:
        for number in numbers:
            plots[f"{number} over each key"] = [_effect(columns, key, number) for key in keys]
    if len(keys) > 1 and numbers:
        strength = {key: np.ptp(bin_means(columns.values[key], columns.values[numbers[0]])[1]) for key in keys}
        strongest = sorted(keys, key=lambda key: -strength[key])
        plots[f"{numbers[0]} over the two keys that move it most"] = [_map(columns, strongest[:2], numbers[0])]
    return plots


def _effect(columns: PointColumns, key: str, number: str) -> str:
    """Draw points and their mean over one key."""
    x = columns.values[key]
    y = columns.values[number]
    some = drawn_at_random(len(x), MOST_DOTS)
    figure = Figure(figsize=(3.6, 2.7), layout="constrained")
    axes = figure.add_subplot(xlabel=key, ylabel=number)
    axes.plot(x[some], y[some], ".", markersize=2.5, color=_GREY, rasterized=True)
    axes.plot(*bin_means(x, y), color=_BLUE, marker="o", markersize=3)
    return as_svg(figure)


def _map(columns: PointColumns, keys: Sequence[str], number: str) -> str:
    values = columns.values[number]
    low, high = np.nanpercentile(values, [_EXTREME, 100.0 - _EXTREME])  # a few extremes do not take all colours
    some = drawn_at_random(len(values), MOST_DOTS)
    figure = Figure(figsize=(5.6, 4.2), layout="constrained")
    axes = figure.add_subplot(xlabel=keys[0], ylabel=keys[1])
    x = columns.values[keys[0]][some]
    y = columns.values[keys[1]][some]
    dots = axes.scatter(x, y, c=values[some], s=9, vmin=low, vmax=high, rasterized=True)
    figure.colorbar(dots, label=number, extend="both")
    return as_svg(figure)


def as_svg(figure: Figure) -> str:
    """Return a figure as SVG inside a page: the same bytes every time, its text as text, its many dots as a picture."""
    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "twintip", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", dpi=120, metadata={"Date": None})
    drawing = text.getvalue()
    return drawing[drawing.index("<svg") :]


def drawn_at_random(count: int, most: int) -> NDArray[np.int64]:
    """Return the indices of at most so many points among all, in their order: the same ones every time."""
    return np.sort(np.random.default_rng(_SEED).permutation(count)[:most])


def bin_means(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the means of x and y (points,) over equal parts of the span of x [their units], parts without points out.

    Where x has few different values there is a mean at each of them.
    """
    known = ~(np.isnan(x) | np.isnan(y))
    x = x[known]
    y = y[known]
    different = np.unique(x)
    if len(different) > _BINS:
        edges = np.linspace(different[0], different[-1], _BINS + 1)
        part = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    else:
        part = np.searchsorted(different, x)
    counts = np.bincount(part)
    filled = counts > 0
    mean_x = np.bincount(part, weights=x)[filled] / counts[filled]
    mean_y = np.bincount(part, weights=y)[filled] / counts[filled]
    return mean_x, mean_y
