"""Plots of errors: what they are made of, what a tilt does to a reading, what a solve cost for its error."""

from collections.abc import Mapping, Sequence

import numpy as np

from cad.design.reading import Reading
from pipeline.report.page.drawing.labels import write_beside
from pipeline.report.page.drawing.legend import Entry, draw_legend
from pipeline.report.page.drawing.panel import BAD, DASHED, INK, MUTED, SERIES, Box, Panel, Words
from pipeline.report.page.drawing.picture import SIZE, Picture, plot_panel, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.page.fields import Floats
from pipeline.report.page.live_model import LiveModel
from pipeline.report.stored import StoredReport
from pipeline.report.stored_records import StoredReading
from pipeline.storage.plain import first_largest

_KINDS = tuple(
    Entry(text=kind, colour=colour, kind="area")
    for kind, colour in zip(("mesh", "left out of the model", "scatter of prints"), SERIES, strict=False)
)
_LEAST = 1e-4  # [%] that a bar is long
_ERROR_READ = "error of the modulus read [%]"
_LARGEST_SHOWN = 100.0  # [%] error over tilt
_TILTS = np.linspace(-3.0, 3.0, 61)
_TILT_SCALE = Scale(start=-3.15, end=3.15)


def budget_plot(report: StoredReport) -> Picture | None:
    """Return what the error of each number is made of [%]; None where no number has a budget."""
    known = {name: budget for name, budget in report.errors.items() if budget is not None}
    if not known:
        return None
    shares = {name: (b.discretisation_percent, b.model_percent, b.inputs_percent) for name, b in known.items()}
    panel = _shares(shares)
    caption = f"Half widths. {_in_words(shares)}. Calibrating a unit settles the scatter of its springs."
    size = (SIZE[0], panel.box.top + panel.box.height + 38.0)
    return plot_picture([panel], "budget", "What the errors are made of", (caption, f"Bars. {caption}"), size)


def _shares(shares: Mapping[str, Sequence[float]]) -> Panel:
    """Return a panel with a bar for each kind of share [%] of each number."""
    sizes = np.maximum(np.array(list(shares.values())), _LEAST)
    x = Scale(start=0.7 * float(sizes.min()), end=1.4 * float(sizes.max()), logarithmic=True)
    rows = len(shares)
    y, box = Scale(start=0.5 - rows, end=0.5, steps=rows), Box(left=62.0, top=26.0, width=315.0, height=36.0 * rows)
    label = "share of the number [%], logarithmic"
    panel = Panel(name="budget", box=box, x=x, y=y, x_label=label, y_label=None)
    for row, name in enumerate(shares):
        panel.write(name, x.start, -row, Words(anchor="end", right=-6.0))
        for place, size in enumerate(sizes[row].tolist()):
            _draw_bar(panel, size, -row - 0.26 * (place - 1), SERIES[place])
    draw_legend(panel, "above", _KINDS)
    return panel


def _draw_bar(panel: Panel, size: float, level: float, colour: str) -> None:
    """Draw a bar at a level, as long as its size [%]."""
    ends = [panel.x.start, size]
    panel.area((ends, [level - 0.12] * 2), (ends, [level + 0.12] * 2), colour, 1.0)


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
    bias = [abs(row.E_bias_percent) for row in reading.moduli]
    scatter = [row.uncertainty_percent for row in reading.moduli]
    limits, E = [100.0 * asked.bias_limit, 100.0 * asked.uncertainty_limit], [row.E_MPa for row in reading.moduli]
    y = Scale(start=0.0, end=1.12 * max(*bias, *scatter, *limits))
    panel = plot_panel("pose", _around(E), "modulus of the fruit E [MPa]", y, _ERROR_READ)
    for colour, values, limit in zip(SERIES, (bias, scatter), limits, strict=False):
        panel.line(E, values, colour)
        panel.points(E, values, colour, 3.0)
        _draw_limit(panel, limit, "limit", colour)
    texts = zip(("worst pose, no noise", "deviation, level"), SERIES, strict=False)
    draw_legend(panel, "center right", [Entry(text=text, colour=colour, kind="points") for text, colour in texts])
    caption = _of_the_worst(reading, asked.tilt_deg)
    return plot_picture([panel], "pose", "Error of the reading in the worst pose", (caption, f"Two lines. {caption}"))


def _around(values: Sequence[float]) -> Scale:
    """Return a scale that shows all values with a margin, also of a single one [unit of the values]."""
    least, most = min(values), max(values)
    margin = 0.05 * (most - least or abs(most) or 1.0)
    return Scale(start=least - margin, end=most + margin)


def _of_the_worst(reading: StoredReading, tilt_deg: float) -> str:
    """Return in words how a sensor reads, in which pose worst, and when a tip lifts off."""
    worst = reading.moduli[first_largest((abs(row.E_bias_percent) for row in reading.moduli), least=100.0)]
    return (
        f"Read as {reading.method}. Every pose that occurs is in it, with tilts up to {tilt_deg:g} degrees; the "
        f"worst is {worst.worst}, at {worst.E_MPa:g} MPa. The first tip lifts off at {reading.lift_deg:.3g} degrees. "
        "The deviation is one standard deviation."
    )


def _draw_limit(panel: Panel, limit: float, text: str, colour: str) -> None:
    """Draw a limit over the whole width, with its name."""
    panel.level(limit, colour, dash=DASHED)
    panel.write(text, panel.x.start, limit, Words(right=7.0, down=-7.0, colour=colour, size=9.0))


def _tilt_plot(report: StoredReport, model: LiveModel) -> Picture:
    """Return the error of E read from the forces against tilt, by the linear law of the live answer."""
    press, moduli = report.design.press, report.design.fruit.E_MPa
    shown = moduli[:: max(1, (len(moduli) - 1) // 2)]
    errors = [_tilt_error(model, E, press.travel_mm) for E in shown]
    y = Scale(start=-_LARGEST_SHOWN, end=_LARGEST_SHOWN)
    panel = plot_panel("pose", _TILT_SCALE, "tilt along the tips [deg]", y, _ERROR_READ)
    _draw_spread(panel, press.tilt_spread_deg)
    for colour, error in zip(SERIES, errors, strict=False):
        panel.line(_TILTS, error, colour)
    lines = zip(shown, SERIES, strict=False)
    draw_legend(panel, "upper left", [Entry(text=f"E = {E:g} MPa", colour=colour) for E, colour in lines])
    what = "force ratio" if model.by_ratio else "contrast"
    caption = (
        f"Layout {report.design.tips.layout}, read by the {what} of one reading: {_of_one_degree(errors)}. "
        "Tips are taken as higher or lower; the grey band is the tilt that a press may be off by."
    )
    words = (caption, f"{_lines(len(errors))}. {caption}")
    return plot_picture([panel], "pose", "Error of the reading against tilt", words)


def _draw_spread(panel: Panel, spread: float) -> None:
    """Draw the band of tilts up to a spread [deg] to either side, and the line of no error."""
    band = [-spread, spread]
    panel.area((band, [panel.y.start] * 2), (band, [panel.y.end] * 2), MUTED, 0.15)
    panel.level(0.0, INK, 0.8)


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
    asked = 100.0 * report.tolerance
    _, times, percents = zip(*solves, strict=True)
    x = Scale(start=0.4 * min(times), end=12.0 * max(times), logarithmic=True)
    y = Scale(start=0.3 * min(percents), end=4.0 * max(asked, *percents), logarithmic=True)
    panel = plot_panel("speed", x, "wall time of the solve [s]", y, "error bar [%]")
    _draw_solves(panel, solves)
    _draw_limit(panel, asked, "asked for (--tol)", BAD)
    caption = f"What each solve of this run took for its error; {report.contact_solve.method} for the contact."
    return plot_picture([panel], "speed", "Speed against error", (caption, f"Points. {caption}"))


def _draw_solves(panel: Panel, solves: Sequence[tuple[str, float, float]]) -> None:
    """Draw a point for each solve, named beside it."""
    for colour, (_, seconds, percent) in zip(SERIES, solves, strict=False):
        panel.points([seconds], [percent], colour, 4.0)
    names, times, percents = zip(*solves, strict=True)
    texts = (f"{name}: {percent:.2g} %" for name, percent in zip(names, percents, strict=True))
    write_beside(panel, times, percents, [(text, Words(right=9.0)) for text in texts])


def _solves(report: StoredReport) -> list[tuple[str, float, float]]:
    """Return name, wall time [s] and error [%] of each solve that has both."""
    every = [("contact", report.contact_solve.seconds, report.contact.error_percent)]
    every += [
        (f"{name} spring", spring.seconds or 0.0, spring.error_percent or 0.0)
        for name, spring in report.springs.items()
    ]
    return [solve for solve in every if min(solve[1:]) > 0.0]
