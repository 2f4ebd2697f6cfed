"""The plot of compression tests: force over travel with the fitted law, and stress over strain as in the paper."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.measure.compression.modulus import CompressionResult

_MOST_NAMED = 8  # curves with a name of their own in the legend
_STEPS = 200


def plotted(results: Sequence[CompressionResult], kind: str) -> bytes:
    """Return the plot of all results as a file of a kind, "svg" or "png"; the same bytes every time."""
    with rc_context({"svg.hashsalt": "twintip", "svg.fonttype": "none", "font.size": 9.0}):
        figure = Figure(figsize=(10.0, 4.2), layout="constrained")
        FigureCanvasAgg(figure)
        loads, stresses = figure.subplots(1, 2)
        for index, result in enumerate(results):
            _draw_load(loads, result, f"C{index % 10}", named=index < _MOST_NAMED)
            _draw_stress(stresses, result, f"C{index % 10}")
        loads.set(xlabel="travel [mm]", ylabel="force [N]", title="force, and the law where it is fitted")
        stresses.set(xlabel="strain: travel / height [%]", ylabel="stress: force / plate area [MPa]")
        stresses.set_title("stress over strain, and the secant")
        loads.legend(fontsize=7.0)
        content = io.BytesIO()
        figure.savefig(content, format=kind, dpi=150, metadata={"Date": None} if kind == "svg" else None)
    return content.getvalue()


def _draw_load(axes: Axes, result: CompressionResult, colour: str, *, named: bool) -> None:
    curve = result.curve
    chosen = result.chosen
    axes.plot(curve.travel, curve.force, ".", color=colour, markersize=2.0, alpha=0.4)
    travel = np.linspace(float(curve.travel[0]), chosen.last, _STEPS)
    name = f"{Path(result.specimen.file).stem} {result.specimen.name}"
    label = f"{name}: {result.E_MPa:.3g} MPa ± {result.u_percent:.2g} %" if named else None
    axes.plot(travel, chosen.fit.force(travel, float(curve.force.max())), color=colour, label=label)
    axes.axvline(chosen.touch.value, color=colour, linewidth=0.6, linestyle=":")
    if curve.failure is not None:
        axes.axvline(curve.failure, color=colour, linewidth=0.6, linestyle="--")


def _draw_stress(axes: Axes, result: CompressionResult, colour: str) -> None:
    curve = result.curve
    strain = 100.0 * (curve.travel - result.chosen.touch.value) / result.geometry.height_mm
    stress = (curve.force - result.chosen.fit.zero_line(curve.travel)) / result.geometry.plate_area_mm2
    axes.plot(strain, stress, ".", color=colour, markersize=2.0, alpha=0.4)
    secant = result.secants[0]
    ends = np.array([0.0, secant.strain_percent])
    axes.plot(ends, 0.01 * ends * secant.E_secant_MPa, color=colour, linewidth=1.0)
