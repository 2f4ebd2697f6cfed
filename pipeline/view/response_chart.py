"""The chart of a report: force ratio over modulus, beside the target and the straight line."""

from typing import Any

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cad.quantity import validation_error
from pipeline.report.stored import StoredReport
from pipeline.view.scenes.stage import ACCENT, picture_size

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes

_DOTS_PER_INCH = 100
_WIDEST = 9.0  # inches: beyond, letters grow with the picture
_CURVE, _CHORD = "#2471a3", "#5f6a6a"


def draw_response_chart(plotter: Plotter, report: StoredReport) -> None:
    """Draw the force ratio [1] over the modulus [MPa] of a report, beside its target, to fill the picture."""
    width, height = picture_size(plotter)
    pixels = chart_pixels(report, width, height)
    vista: Any = pv  # its textures have no types that strict mode takes
    sheet = vista.Plane(i_size=width, j_size=height)
    plotter.add_mesh(sheet, texture=vista.numpy_to_texture(pixels), lighting=False)
    plotter.enable_parallel_projection()
    plotter.view_xy()
    plotter.camera.parallel_scale = 0.5 * height


def chart_pixels(report: StoredReport, width: int, height: int) -> NDArray[np.uint8]:
    """Return the chart as a picture, shape (height, width, 3); raises InputError where there is nothing to draw."""
    inches = min(_WIDEST, width / _DOTS_PER_INCH)
    figure = Figure(figsize=(inches, inches * height / width), dpi=width / inches, layout="constrained")
    _plot(figure.add_subplot(), report)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _plot(axes: Axes, report: StoredReport) -> None:
    """Plot P over E with what is aimed at, where there are targets."""
    E, P = force_ratios(report)
    targets = report.design.targets
    axes.plot(E, P, "o-", color=_CURVE, linewidth=2.5, label="P at full travel")
    if targets is not None:
        E_max, P_max = report.design.fruit.E_max_MPa, targets.P_max
        axes.axhline(P_max, color=ACCENT, linestyle="--", label="target P_max")
        axes.plot([0.0, E_max], [1.0, P_max], color=_CHORD, linestyle="-.", label="straight line to the target")
    axes.set(xlabel="modulus of the fruit E [MPa]", ylabel="force ratio P = F_h / F_l [1]", xlim=(0.0, 1.03 * max(E)))
    axes.set_ylim(0.0, 1.1 * max(P if targets is None else [*P, targets.P_max]))
    axes.set_title(f"{report.design.name}: force ratio over modulus")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")


def force_ratios(report: StoredReport) -> tuple[list[float], list[float]]:
    """Return the moduli [MPa] and P [1] at the deepest travel where both tips are on the fruit; raises InputError."""
    known = [(row.E_MPa, row.last_P) for row in report.response]
    E, P = [E for E, P in known if P is not None], [P for _, P in known if P is not None]
    if not E:
        raise validation_error("report.json", "response", "", "a P at one modulus at least", "press deeper or level")
    return E, P
