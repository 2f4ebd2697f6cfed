"""A plot of two numbers that pull against each other: no candidate on the front is beaten in both."""

import io
import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.storage.files import place_files
from pipeline.study.search.optimum import Candidate
from pipeline.study.study_file import Study

PLOT = "pareto.svg"
AGAINST = ("verdicts.bruise.value", "verdicts.bruise.limit")

Place = tuple[float, float]


def front(places: Sequence[Place]) -> tuple[Place, ...]:
    """Return the places that no other one beats in both numbers, both the less the better [any unit]."""
    kept: list[Place] = []
    for place in sorted(set(places)):
        if not kept or place[1] < kept[-1][1]:
            kept.append(place)
    return tuple(kept)


def write_pareto(study: Study, candidates: Sequence[Candidate], folder: Path, *, force: bool = False) -> None:
    """Plot into a folder (SVG) the number made least against the pressure on the skin over its limit, with its front.

    Nothing is written where the verdict on bruising is not among those of the goal. Raises InputError where a foreign
    file is there and `force` does not keep it as NAME.bak.
    """
    if any(key not in study.wanted for key in AGAINST):
        return
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    axes = figure.add_subplot()
    _draw(axes, candidates)
    axes.set_xlabel("pressure on the skin over its limit [1]")
    axes.set_ylabel(f"{study.goal.minimise.removeprefix('verdicts.').removesuffix('.value')} [1]")
    axes.legend(frameon=False)
    # The same bytes every time, and text that can be searched.
    with mpl.rc_context({"svg.hashsalt": "twintip", "svg.fonttype": "none"}):
        content = io.BytesIO()
        figure.savefig(content, format="svg", metadata={"Date": None})
    place_files(folder, {PLOT: content.getvalue()}, "--out", force=force)


def _draw(axes: Axes, candidates: Sequence[Candidate]) -> None:
    passing = [_place(one) for one in candidates if one.violation == 0.0]
    failing = [_place(one) for one in candidates if one.violation > 0.0 and one.result.status == "done"]
    _dots(axes, [place for place in failing if math.isfinite(place[1])], "#b8b8b8", "a verdict fails")
    _dots(axes, passing, "#1f6fb2", "verdicts pass")
    best = front(passing)
    axes.step([x for x, _ in best], [y for _, y in best], where="post", color="#c0392b", label="front")
    axes.axvline(1.0, color="black", linewidth=0.8, linestyle=":")


def _dots(axes: Axes, places: Sequence[Place], colour: str, label: str) -> None:
    axes.scatter([x for x, _ in places], [y for _, y in places], s=12, color=colour, label=label)


def _place(one: Candidate) -> Place:
    pressure, limit = (one.result.values[key] for key in AGAINST)
    known = isinstance(pressure, int | float) and isinstance(limit, int | float)
    return (float(str(pressure)) / float(str(limit)) if known else math.nan), one.value
