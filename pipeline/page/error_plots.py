"""Plots of errors: what they are made of, what a tilt does to a reading, what a solve cost for its error."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from cad.design.reading import Reading
from pipeline.page.fields import Floats
from pipeline.page.live_model import LiveModel
from pipeline.page.mangoes import numbers
from pipeline.page.picture import BAD, INK, MUTED, SERIES, Picture, plot_axes, plot_legend, plot_picture
from pipeline.report.stored import StoredReport
from pipeline.report.stored_records import StoredReading

_KINDS = ("mesh", "left out of the model", "scatter of prints")
_LEAST = 1e-4  # [%] that a bar is long
_TILTS = np.linspace(-3.0, 3.0, 61)


def budget_plot(report: StoredReport) -> Picture | None:
    """Return what the error of each number is made of [%]; None where no number has a budget."""
    known = {name: budget for name, budget in report.errors.items() if budget is not None}
    if not known:
        return None
    height = 0.95 + 0.5 * len(known)
    axes = plot_axes("share of the number [%], logarithmic", "", (5.4, height))
    axes.set_position((0.16, 0.58 / height, 0.8, 1.0 - 0.95 / height))
    shares = {name: (b.discretisation_percent, b.model_percent, b.inputs_percent) for name, b in known.items()}
    _draw_shares(axes, shares)
    caption = f"Half widths. {_in_words(shares)}. Calibrating a unit settles the scatter of its springs."
    return plot_picture(axes, "budget", "What the errors are made of", caption, f"Bars. {caption}")


def _draw_shares(axes: Axes, shares: Mapping[str, Sequence[float]]) -> None:
    """Draw a bar for each kind of share [%] of each number."""
    rows = np.arange(len(shares), dtype=np.float64)
    for place, kind in enumerate(_KINDS):
        sizes = np.maximum([share[place] for share in shares.values()], _LEAST)
        axes.barh(rows + 0.26 * (place - 1), sizes, height=0.24, color=SERIES[place], label=kind)
    axes.set_xscale("log")
    axes.set_yticks(rows, list(shares))
    axes.invert_yaxis()
    plot_legend(axes, None)


def _in_words(shares: Mapping[str, Sequence[float]]) -> str:
    """Return the shares of each number [%] in words."""
    said = (f"{name}: mesh {m:.2g} %, model {left:.2g} %, prints {p:.2g} %" for name, (m, left, p) in shares.items())
    return "; ".join(said)


def pose_plot(report: StoredReport, model: LiveModel) -> Picture | None:
    """Return how far a reading is off by pose or tilt [%]; None where the report has nothing to draw it from."""
    asked = report.design.reading
    if report.reading is not None and asked is not None:
        return _reading_plot(report.reading, asked)
    return _tilt_plot(report, model) if model.linear else None


def _reading_plot(reading: StoredReading, asked: Reading) -> Picture:
    axes = plot_axes("modulus of the fruit E [MPa]", "error of the modulus read [%]")
    bias = [row.E_bias_percent for row in reading.moduli]
    scatter = [row.uncertainty_percent for row in reading.moduli]
    drawn = ((bias, "worst pose, no noise", asked.bias_limit), (scatter, "deviation, level", asked.uncertainty_limit))
    E = [row.E_MPa for row in reading.moduli]
    for colour, (values, words, limit) in zip(SERIES, drawn, strict=False):
        axes.plot(E, np.abs(numbers(values)), "o-", color=colour, label=words)
        _draw_limit(axes, 100.0 * limit, "limit", colour)
    axes.set_ylim(0.0, 1.12 * max(axes.dataLim.y1, 100.0 * asked.bias_limit, 100.0 * asked.uncertainty_limit))
    plot_legend(axes, "center right")
    caption = _of_the_worst(reading, asked.tilt_deg)
    return plot_picture(axes, "pose", "Error of the reading in the worst pose", caption, f"Two lines. {caption}")


def _of_the_worst(reading: StoredReading, tilt_deg: float) -> str:
    """Return in words how a sensor reads, in which pose worst, and when a tip lifts off."""
    worst = max(reading.moduli, key=lambda row: abs(row.E_bias_percent))
    return (
        f"Read as {reading.method}. Every pose that occurs is in it, with tilts up to {tilt_deg:g} degrees; the "
        f"worst is {worst.worst}, at {worst.E_MPa:g} MPa. The first tip lifts off at {reading.lift_deg:.3g} degrees. "
        "The deviation is one standard deviation."
    )


def _draw_limit(axes: Axes, limit: float, words: str, colour: str) -> None:
    """Draw a limit over the whole width, with its name."""
    axes.axhline(limit, color=colour, linestyle="--")
    place, across = (0.02, limit), ("axes fraction", "data")
    axes.annotate(words, place, xycoords=across, va="bottom", color=colour, fontsize=9)


def _tilt_plot(report: StoredReport, model: LiveModel) -> Picture:
    """Return the error of E read from the forces against tilt, by the linear law of the live answer."""
    axes = plot_axes("tilt along the tips [deg]", "error of the modulus read [%]")
    press, moduli = report.design.press, report.design.fruit.E_MPa
    shown = moduli[:: max(1, (len(moduli) - 1) // 2)]
    errors = [_tilt_error(model, E, press.travel_mm) for E in shown]
    for colour, E, error in zip(SERIES, shown, errors, strict=False):
        axes.plot(_TILTS, error, color=colour, label=f"E = {E:g} MPa")
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.axvspan(-press.tilt_spread_deg, press.tilt_spread_deg, color=MUTED, alpha=0.15, linewidth=0.0)
    axes.set_ylim(-100.0, 100.0)
    plot_legend(axes, "upper left")
    what = "force ratio" if model.by_ratio else "contrast"
    caption = (
        f"Layout {report.design.tips.layout}, read by the {what} of one reading: {_of_one_degree(errors)}. "
        "Tips are taken as higher or lower; the grey band is the tilt that a press may be off by."
    )
    return plot_picture(axes, "pose", "Error of the reading against tilt", caption, f"{_lines(len(errors))}. {caption}")


def _lines(count: int) -> str:
    return "One line" if count == 1 else f"{count} lines"


def _of_one_degree(errors: Sequence[Floats]) -> str:
    """Return in words how far one degree to either side moves a reading; errors over the tilts of the plot [%]."""
    one_degree = np.isclose(np.abs(_TILTS), 1.0)
    sizes = np.abs([error[one_degree] for error in errors])
    if not np.isfinite(sizes).any():
        return "no reading at one degree"
    lost = "" if np.isfinite(sizes).all() else ", and at some moduli leaves none"
    return f"one degree moves E by up to {np.nanmax(sizes):.3g} %{lost}"


def _tilt_error(model: LiveModel, E: float, travel: float) -> Floats:
    """Return the error of the modulus read at each tilt [%], shape (tilts,), at modulus E [MPa] and travel [mm]."""
    read = np.array([model.modulus_read(E, travel, tilt) for tilt in _TILTS.tolist()])
    return np.asarray(100.0 * (read / E - 1.0))


def speed_plot(report: StoredReport) -> Picture | None:
    """Return error [%] over wall time [s] of the solves of this run; None where none has both."""
    solves = _solves(report)
    if not solves:
        return None
    axes, asked = plot_axes("wall time of the solve [s]", "error bar [%]"), 100.0 * report.tolerance
    for colour, (name, seconds, percent) in zip(SERIES, solves, strict=False):
        axes.plot(seconds, percent, "o", color=colour, markersize=8)
        words = f"{name}: {percent:.2g} %"
        axes.annotate(words, (seconds, percent), (10, -3), textcoords="offset points", color=INK)
    _draw_limit(axes, asked, "asked for (--tol)", BAD)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _, times, percents = zip(*solves, strict=True)
    axes.set_xlim(0.4 * min(times), 12.0 * max(times))
    axes.set_ylim(0.3 * min(percents), 4.0 * max(asked, *percents))
    caption = f"What each solve of this run took for its error; {report.contact_solve.method} for the contact."
    return plot_picture(axes, "speed", "Speed against error", caption, f"Points. {caption}")


def _solves(report: StoredReport) -> list[tuple[str, float, float]]:
    """Return name, wall time [s] and error [%] of each solve that has both."""
    every = [("contact", report.contact_solve.seconds, report.contact.error_percent)]
    every += [
        (f"{name} spring", spring.seconds or 0.0, spring.error_percent or 0.0)
        for name, spring in report.springs.items()
    ]
    return [solve for solve in every if min(solve[1:]) > 0.0]
