"""Plots of errors: what they are made of, what a tilt does to a reading, what a solve cost for its error."""

import numpy as np

from pipeline.page.live_model import LiveModel
from pipeline.page.mangoes import numbers
from pipeline.page.picture import BAD, INK, MUTED, SERIES, Picture, plot_axes, plot_legend, plot_picture
from pipeline.report.stored import StoredReport

_KINDS = ("mesh", "left out of the model", "scatter of prints")
_TILTS = np.linspace(-3.0, 3.0, 61)


def budget_plot(report: StoredReport) -> Picture | None:
    """Return what the error of each number is made of [%]; None where no number has a budget."""
    known = {name: budget for name, budget in report.errors.items() if budget is not None}
    if not known:
        return None
    height = 0.95 + 0.5 * len(known)
    axes = plot_axes("share of the number [%], logarithmic", "", (5.4, height))
    axes.set_position((0.16, 0.58 / height, 0.8, 1.0 - 0.95 / height))
    rows = np.arange(len(known), dtype=np.float64)
    for place, kind in enumerate(_KINDS):
        sizes = [(b.discretisation_percent, b.model_percent, b.inputs_percent)[place] for b in known.values()]
        axes.barh(rows + 0.26 * (place - 1), np.maximum(sizes, 1e-4), height=0.24, color=SERIES[place], label=kind)
    axes.set_xscale("log")
    axes.set_yticks(rows, list(known))
    axes.invert_yaxis()
    plot_legend(axes, None)
    said = [
        f"{name}: mesh {b.discretisation_percent:.2g} %, model {b.model_percent:.2g} %, prints {b.inputs_percent:.2g} %"
        for name, b in known.items()
    ]
    caption = f"Half widths. {'; '.join(said)}. Calibrating a unit settles the scatter of its springs."
    return plot_picture(axes, "budget", "What the errors are made of", caption, f"Bars. {caption}")


def pose_plot(report: StoredReport, model: LiveModel) -> Picture | None:
    """Return how far a reading is off by pose or tilt [%]; None where the report has nothing to draw it from."""
    if report.reading is not None:
        return _reading_plot(report)
    return _tilt_plot(report, model) if model.linear else None


def _reading_plot(report: StoredReport) -> Picture | None:
    reading, asked = report.reading, report.design.reading
    if reading is None or asked is None:
        return None
    axes = plot_axes("modulus of the fruit E [MPa]", "error of the modulus read [%]")
    E = [row.E_MPa for row in reading.moduli]
    bias = np.abs(numbers([row.E_bias_percent for row in reading.moduli]))
    axes.plot(E, bias, "o-", color=SERIES[0], label="worst pose, no noise")
    scatter = numbers([row.uncertainty_percent for row in reading.moduli])
    axes.plot(E, scatter, "s-", color=SERIES[1], label="standard deviation, level")
    for limit, colour, words in ((asked.bias_limit, SERIES[0], "limit"), (asked.uncertainty_limit, SERIES[1], "limit")):
        axes.axhline(100.0 * limit, color=colour, linestyle="--")
        axes.annotate(words, (E[0], 100.0 * limit), va="bottom", color=colour, fontsize=9)
    axes.set_ylim(0.0, 118.0 * max(asked.bias_limit, asked.uncertainty_limit))
    plot_legend(axes, "center right")
    worst = max(reading.moduli, key=lambda row: abs(row.E_bias_percent or 0.0))
    caption = (
        f"Read as {reading.method}. Every pose that occurs is in it, with tilts up to {asked.tilt_deg:g} degrees; the "
        f"worst is {worst.worst}, at {worst.E_MPa:g} MPa. The first tip lifts off at {reading.lift_deg:.3g} degrees."
    )
    return plot_picture(axes, "pose", "Error of the reading in the worst pose", caption, f"Two lines. {caption}")


def _tilt_plot(report: StoredReport, model: LiveModel) -> Picture:
    """Return the error of E read from the forces against tilt, by the linear law of the live answer."""
    axes = plot_axes("tilt along the tips [deg]", "error of the modulus read [%]")
    travel, moduli = report.design.press.travel_mm, report.design.fruit.E_MPa
    shown = (moduli[0], moduli[len(moduli) // 2], moduli[-1])
    at_one = []
    for place, E in enumerate(shown):
        read = np.array([model.modulus_read(E, travel, float(tilt)) for tilt in _TILTS])
        error = 100.0 * (read / E - 1.0)
        axes.plot(_TILTS, error, color=SERIES[place], label=f"E = {E:g} MPa")
        at_one.append(float(np.interp(1.0, _TILTS, error)))
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.axvspan(
        -report.design.press.tilt_spread_deg,
        report.design.press.tilt_spread_deg,
        color=MUTED,
        alpha=0.15,
        linewidth=0.0,
    )
    axes.set_ylim(-100.0, 100.0)
    plot_legend(axes, "upper left")
    what = "the force ratio of one reading" if model.by_ratio else "the contrast of one reading"
    size = max(map(abs, at_one))
    caption = (
        f"Layout {report.design.tips.layout}, read by {what}: one degree moves E by up to {size:.3g} %. Tips are taken "
        f"as standing higher or lower; the grey band is the tilt that a press may be off by."
    )
    return plot_picture(axes, "pose", "Error of the reading against tilt", caption, f"Three lines. {caption}")


def speed_plot(report: StoredReport) -> Picture | None:
    """Return error [%] over wall time [s] of the solves of this run."""
    solves = [("contact", report.contact_solve.seconds, report.contact.error_percent)]
    for name, spring in report.springs.items():
        if spring.seconds is not None and spring.error_percent is not None:
            solves.append((f"{name} spring", spring.seconds, spring.error_percent))
    solves = [one for one in solves if min(one[1:]) > 0.0]
    if not solves:
        return None
    axes = plot_axes("wall time of the solve [s]", "error bar [%]")
    for place, (name, seconds, percent) in enumerate(solves):
        axes.plot(seconds, percent, "o", color=SERIES[place], markersize=8)
        axes.annotate(f"{name}: {percent:.2g} %", (seconds, percent), (10, -3), textcoords="offset points", color=INK)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axhline(100.0 * report.tolerance, color=BAD, linestyle="--")
    axes.annotate(
        "asked for (--tol)",
        (0.02, 100.0 * report.tolerance),
        xycoords=("axes fraction", "data"),
        va="bottom",
        color=BAD,
    )
    times, percents = [one[1] for one in solves], [one[2] for one in solves]
    axes.set_xlim(0.4 * min(times), 12.0 * max(times))
    axes.set_ylim(0.3 * min(percents), 4.0 * max(100.0 * report.tolerance, *percents))
    caption = f"What each solve of this run took for its error; {report.contact_solve.method} for the contact."
    return plot_picture(axes, "speed", "Speed against error", caption, f"Points. {caption}")
