"""The page of a study, one file that needs no network: effects of each key, all points as lines, the best ten."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, FileSystemLoader
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cad.design.design_file import design_as_toml
from cad.quantity import fault
from pipeline.storage.placed_files import place_files, refuse_taken
from pipeline.study.points import design_of
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study
from pipeline.study.tasks import PointResult

Floats = NDArray[np.float64]

FLAG = "--html"
TEMPLATE = "page.html.j2"
BEST = 10
MOST_DRAWN = 2_000  # of the points: more hide each other
_BINS = 12


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A plot as SVG and what it shows."""

    svg: str
    caption: str


@dataclass(frozen=True, kw_only=True)
class BestRow:
    """A line of the table of the best points: its number, its design file as the page names it, and its cells."""

    number: int
    design: str
    cells: tuple[str, ...]


def refuse_page(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where no page of the study of a folder can be written, before anything is solved."""
    if path.suffix != ".html":
        raise fault(FLAG, str(path), "", "a file name that ends in .html", "change its ending")
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise fault(FLAG, str(path), "", "a file in a folder that is there", "make that folder first")
    if not force:
        refuse_taken(path.parent, [path.name], FLAG)


def write_page(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the page of a study to a file, and the design files of its best ten points beside its store.

    Raises InputError where a foreign file is there and `force` does not keep it as NAME.bak, or none can be written.
    """
    done = [point for point in store.rows() if point.status == "done"]
    numbers = {key: _numbers(done, key) for key in (*study.vary, *study.wanted)}
    shown = {key: values for key, values in numbers.items() if values is not None}
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True)
    text = environment.get_template(TEMPLATE).render(
        name=study.name,
        level=study.level,
        counts=store.counts(),
        figures=_drawings(study, shown),
        first=study.wanted[0],
        header=[*study.vary, *study.wanted],
        best=_best_rows(store, study, done, path, force=force),
        messages=store.messages(),
    )
    place_files(path.parent, {path.name: text.encode()}, FLAG, force=force)


def _best_rows(
    store: StudyStore, study: Study, done: Sequence[PointResult], page: Path, *, force: bool
) -> list[BestRow]:
    """Return the best ten points, their design files written beside the store."""
    best = sorted(done, key=lambda point: _first(study, point))[:BEST]
    designs = {
        f"point-{point.number}.toml": design_as_toml(design_of(study, point.settings)).encode() for point in best
    }
    paths = place_files(store.path.parent / "best-designs", designs, "--out", force=force)
    keys = (*study.vary, *study.wanted)
    return [
        BestRow(
            number=point.number,
            design=_link(path, page.parent),
            cells=tuple(_cell({**point.settings, **point.values}.get(key)) for key in keys),
        )
        for point, path in zip(best, paths, strict=True)
    ]


def _link(target: Path, page: Path) -> str:
    """Return how a page in a folder names a design file."""
    near = target.resolve().is_relative_to(page.resolve())
    return str(target.resolve().relative_to(page.resolve())) if near else target.resolve().as_uri()


def _first(study: Study, point: PointResult) -> float:
    value = point.values[study.wanted[0]]
    return float(value) if isinstance(value, int | float) else np.inf


def _numbers(points: Sequence[PointResult], key: str) -> Floats | None:
    """Return the values of a key at some points (points,) [unit of the key]; None for texts and truth values."""
    values = [{**point.settings, **point.values}.get(key) for point in points]
    if not values or any(isinstance(value, bool) or not isinstance(value, int | float) for value in values):
        return None
    return np.array(values, dtype=np.float64)


def _cell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)


def _drawings(study: Study, shown: dict[str, Floats]) -> list[Drawing]:
    varied = [key for key in study.vary if key in shown]
    wanted = [key for key in study.wanted if key in shown]
    if not varied or not wanted:
        return []
    effects = [Drawing(svg=_effects(shown, varied, key), caption=f"Main effects: mean of {key}") for key in wanted]
    caption = "All points, each a line through its values, from the least to the largest of each key"
    drawings = [*effects, Drawing(svg=_parallel(shown, [*varied, *wanted]), caption=caption)]
    if len(varied) > 1:
        drawings.append(Drawing(svg=_map(shown, varied, wanted[0]), caption=f"Map of {wanted[0]}"))
    return drawings


def _effects(shown: dict[str, Floats], varied: Sequence[str], wanted: str) -> str:
    """Draw the points and their mean in bins of each key that varies."""
    figure = Figure(figsize=(3.2 * len(varied), 3.0), layout="constrained")
    for place, key in enumerate(varied, 1):
        axes = figure.add_subplot(1, len(varied), place)
        x, y = shown[key], shown[wanted]
        axes.plot(x[:MOST_DRAWN], y[:MOST_DRAWN], ".", markersize=2, color="#b8b8b8")
        edges = np.linspace(x.min(), x.max(), _BINS + 1)
        bins = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
        filled = [one for one in range(_BINS) if (bins == one).any()]
        axes.plot([x[bins == one].mean() for one in filled], [y[bins == one].mean() for one in filled], color="#1f6fb2")
        axes.set_xlabel(key)
        axes.set_ylabel(wanted if place == 1 else "")
    return _svg(figure)


def _parallel(shown: dict[str, Floats], keys: Sequence[str]) -> str:
    figure = Figure(figsize=(max(6.0, 1.6 * len(keys)), 3.6), layout="constrained")
    axes = figure.add_subplot()
    spans = [(shown[key].min(), np.ptp(shown[key]) or 1.0) for key in keys]
    columns = np.stack([(shown[key] - least) / span for key, (least, span) in zip(keys, spans, strict=True)])
    colours = mpl.colormaps["viridis"](columns[-1, :MOST_DRAWN])
    for line, colour in zip(columns[:, :MOST_DRAWN].T, colours, strict=True):
        axes.plot(line, color=colour, linewidth=0.5, alpha=0.6)
    axes.set_xticks(range(len(keys)), [key.replace(".", ".\n") for key in keys], fontsize=7)
    axes.set_ylabel("share of its span [1]")
    return _svg(figure)


def _map(shown: dict[str, Floats], varied: Sequence[str], wanted: str) -> str:
    figure = Figure(figsize=(5.6, 4.2), layout="constrained")
    axes = figure.add_subplot()
    x, y = shown[varied[0]], shown[varied[1]]
    dots = axes.scatter(x[:MOST_DRAWN], y[:MOST_DRAWN], c=shown[wanted][:MOST_DRAWN], s=9)
    figure.colorbar(dots, label=wanted)
    axes.set_xlabel(varied[0])
    axes.set_ylabel(varied[1])
    return _svg(figure)


def _svg(figure: Figure) -> str:
    """Return a figure as SVG inside a page: the same bytes every time."""
    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "twintip", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    drawn = text.getvalue()
    return drawn[drawn.index("<svg") :]
