"""A log-log plot of error against cost for every method, as a reproducible SVG."""

import io
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.harness import Measurement

# A fixed salt makes the names inside the file reproducible; `none` keeps text as text.
STYLE: Any = {"svg.hashsalt": "twintip", "svg.fonttype": "none", "font.size": 8.0}
_WIDTH, _HEIGHT = 6.4, 4.0  # size of a panel [inch]
_COLOURS = mpl.color_sequences["tab20"]


def error_over_cost(panels: Mapping[str, Sequence[Measurement]]) -> str:
    """Return an SVG of the largest error [1] against CPU time [s], with a panel per title and a curve per method.

    `panels` maps the title of each panel to its measurements. The plot leaves out formulas, which have no dofs, methods
    that failed, and errors of 0, which a logarithmic axis cannot show.
    """
    drawing = io.StringIO()
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH * len(panels), _HEIGHT), layout="constrained")
        for number, (title, rows) in enumerate(panels.items(), start=1):
            axes = figure.add_subplot(1, len(panels), number)
            axes.set(title=title, xlabel="CPU seconds, one thread", ylabel="relative error")
            _draw_curves(axes, [row for row in rows if row.dofs and row.errors and row.worst])
        figure.savefig(drawing, format="svg", metadata={"Date": None})  # a date would change the file in each run
    return drawing.getvalue()


def _draw_curves(axes: Axes, rows: Sequence[Measurement]) -> None:
    """Draw a curve for each method, with its legend beside the panel."""
    methods = dict.fromkeys(row.method for row in rows)
    for method, colour in zip(methods, itertools.cycle(_COLOURS), strict=False):
        curve = sorted((row.cpu, row.worst) for row in rows if row.method == method)
        axes.loglog(*zip(*curve, strict=True), "o-", color=colour, label=method)
    axes.grid(visible=True, color="#dddddd")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
