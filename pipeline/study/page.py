"""The page of a study, one file that needs no network: effects of each key, a map, the best ten."""

import io
from pathlib import Path

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, FileSystemLoader
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import binned_statistic

from cad.design.design_file import design_as_toml
from pipeline.storage.files import refuse_taken, write_files
from pipeline.study.columns import Floats, PointColumns, point_columns
from pipeline.study.outputs import refuse_output
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
_EXTREME = 2.0  # per cent of the points at either end of a colour scale: a few extremes do not take all colours


def refuse_page(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where no page of the study of a folder can be written, before anything is solved."""
    refuse_output(path, [".html"], folder, FLAG, force=force)
    if not force:
        refuse_taken((folder / _FOLDER).glob("point-*.toml"), "--out", renew=True)


def write_page(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the page of a study to a file, and the design files of its best ten points beside its store.

    Means are over all points that are done; of many points some, drawn at random, are shown as dots. Raises InputError
    as `write_files`.
    """
    columns = point_columns(store, study.keys)
    constants = {}
    for key, values in columns.values.items():
        if not columns.differs(key):
            constants[key] = _cell(float(np.nanmin(values)))
    best = list(store.rows(columns.best(study.wanted[0], BEST)))
    links = {}
    if not study.prints_vary:  # prints that miss their drawing have no design files
        folder = store.path.parent / _FOLDER
        designs = {}
        for point in best:
            design = folder / f"point-{point.number}.toml"
            designs[design] = design_as_toml(design_of(study, point.settings)).encode()
            links[point.number] = _link(design, path)
        write_files(designs, "--out", force=force, renew=True)
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True)
    text = environment.get_template(_TEMPLATE).render(
        study=study,
        counts=store.counts(),
        plots=_plots(columns, study),
        dots=MOST_DOTS,
        constants=constants,
        header=[key.split(".") for key in study.keys],
        best=best,
        links=links,
        cell=_cell,
        messages=store.messages(),
    )
    write_files({path: text.encode()}, FLAG, force=force, renew=True)


def _link(design: Path, page: Path) -> str:
    """Return how a page names a design file: from its own folder where it can, so that both may be moved."""
    folder = page.parent.resolve()
    target = design.resolve()
    return str(target.relative_to(folder)) if target.is_relative_to(folder) else target.as_uri()


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
        movement = {key: float(np.ptp(bin_means(columns.values[key], columns.values[numbers[0]])[1])) for key in keys}
        strongest = sorted(keys, key=lambda key: -movement[key])[:2]
        plots[f"{numbers[0]} over the two keys that move it most"] = [
            _map(columns, strongest[0], strongest[1], numbers[0])
        ]
    return plots


def _effect(columns: PointColumns, key: str, number: str) -> str:
    """Draw points and their mean over one key."""
    x = columns.values[key]
    y = columns.values[number]
    dots = drawn_at_random(len(x), MOST_DOTS)
    figure = Figure(figsize=(3.6, 2.7), layout="constrained")
    axes = figure.add_subplot(xlabel=key, ylabel=number)
    axes.plot(x[dots], y[dots], ".", markersize=2.5, color=_GREY, rasterized=True)
    axes.plot(*bin_means(x, y), color=_BLUE, marker="o", markersize=3)
    return as_svg(figure)


def _map(columns: PointColumns, key_x: str, key_y: str, number: str) -> str:
    """Draw points over two keys in the colours of a number."""
    values = columns.values[number]
    low, high = np.nanpercentile(values, [_EXTREME, 100.0 - _EXTREME])
    dots = drawn_at_random(len(values), MOST_DOTS)
    figure = Figure(figsize=(5.6, 4.2), layout="constrained")
    axes = figure.add_subplot(xlabel=key_x, ylabel=key_y)
    x = columns.values[key_x][dots]
    y = columns.values[key_y][dots]
    coloured = axes.scatter(x, y, c=values[dots], s=9, vmin=low, vmax=high, rasterized=True)
    figure.colorbar(coloured, label=number, extend="both")
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
    """Return the means of x and y (points,) over equal parts of the span of x [their units], empty parts left out."""
    known = ~np.isnan(y)
    means = binned_statistic(x[known], [x[known], y[known]], bins=_BINS).statistic
    mean_x, mean_y = means[:, ~np.isnan(means[0])]
    return mean_x, mean_y
