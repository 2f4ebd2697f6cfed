"""The chart of a report: force ratio over modulus, beside the target and the straight line."""

from typing import Any

import pyvista as pv

from cad.quantity import fault
from pipeline.report.stored import StoredReport
from pipeline.view.stage import ACCENT

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes
Chart = Any

_TICKS = 8
_RIGHT, _BOTTOM = 2, 4  # of VTK's chart legend


def draw_response_chart(plotter: Plotter, report: StoredReport) -> None:
    """Draw the force ratio [1] over the modulus [MPa] of a report, beside its target."""
    E, P = force_ratios(report)
    P_max = report.design.nominal_targets.P_max
    ends = [0.0, max(E)]
    chart = pv.Chart2D(x_label="modulus of the fruit E [MPa]", y_label="force ratio P = F_h / F_l [1]")
    chart.line(E, P, color="#2471a3", width=4.0, label="P at full travel")
    chart.scatter(E, P, color="#2471a3", size=16)
    chart.line(ends, [P_max, P_max], color=ACCENT, style="--", width=2.0, label="target P_max")
    chart.line(ends, [1.0, P_max], color="#7f8c8d", style="-.", width=2.0, label="straight line")
    chart.x_range = [0.0, 1.03 * max(E)]
    chart.y_range = [0.0, 1.1 * max(*P, P_max)]
    chart.title = f"{report.design.name}: force ratio over modulus"
    chart.x_axis.tick_count, chart.y_axis.tick_count = _TICKS, _TICKS
    _enlarge_text(chart)
    plotter.add_chart(chart)


def _enlarge_text(chart: Chart) -> None:
    """Write a chart in letters that a printed page keeps, its legend where the line leaves room."""
    chart.legend_visible = True
    chart.background_color = "white"
    for axis in (chart.x_axis, chart.y_axis):
        axis.label_size, axis.tick_label_size = 26, 22
    chart.GetTitleProperties().SetFontSize(28)
    legend = chart.GetLegend()
    legend.SetLabelSize(22)
    legend.SetHorizontalAlignment(_RIGHT)
    legend.SetVerticalAlignment(_BOTTOM)


def force_ratios(report: StoredReport) -> tuple[list[float], list[float]]:
    """Return the moduli [MPa] and P [1] at the deepest travel where both tips are on the fruit; raises InputError."""
    known = [(row.E_MPa, row.last_P) for row in report.response]
    E, P = [E for E, P in known if P is not None], [P for _, P in known if P is not None]
    if not E:
        raise fault("report.json", "response", "", "a P at one modulus at least", "press deeper or level")
    return E, P
