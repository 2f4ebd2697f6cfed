"""Plots of errors: what they are made of, what a tilt does to a reading, what a solve cost for its error."""

import numpy as np

from pipeline.report.page.drawing.labels import write_beside
from pipeline.report.page.drawing.legend import Entry, draw_legend
from pipeline.report.page.drawing.panel import BAD, DASHED, INK, MUTED, SERIES, Box, Panel, Words
from pipeline.report.page.drawing.picture import SIZE, Picture, Size, plot_panel, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.page.live_model import LiveModel
from pipeline.report.stored import StoredReport
from pipeline.storage.plain import first_largest

_CONTRIBUTIONS = ("mesh", "left out of the model", "scatter of prints")
_SHORTEST = 1e-4  # [%] that a bar is long
_ERROR_READ = "error of the modulus read [%]"
_TILTS = np.linspace(-3.0, 3.0, 61)  # [deg]
_LARGEST_ERROR = 100.0  # [%] that the plot over tilt shows


def budget_plot(report: StoredReport) -> Picture:
    """Return what the error of each number is made of [%]; raises ValueError where no number has a budget."""
    errors = {}
    for name, budget in report.errors.items():
        if budget is not None:
            errors[name] = tuple(budget[f"{part}_percent"] for part in ("discretisation", "model", "inputs"))
    if not errors:
        msg = "no number has a budget"
        raise ValueError(msg)
    sizes = np.maximum(list(errors.values()), _SHORTEST)
    x = Scale(start=0.7 * float(sizes.min()), end=1.4 * float(sizes.max()), logarithmic=True)
    y = Scale(start=0.5 - len(errors), end=0.5, steps=len(errors))
    box = Box(left=62.0, top=26.0, width=315.0, height=36.0 * len(errors))
    label = "part of the number [%], logarithmic"
    panel = Panel(name="budget", box=box, x=x, y=y, x_label=label, y_label=None)
    for row, name in enumerate(errors):
        panel.write(name, x.start, -row, Words(anchor="end", right=-6.0))
        for index, size in enumerate(sizes[row].tolist()):
            level = -row - 0.26 * (index - 1)
            panel.area([x.start, size], [level - 0.12] * 2, [x.start, size], [level + 0.12] * 2, SERIES[index])
    legend = zip(_CONTRIBUTIONS, SERIES, strict=False)
    draw_legend(panel, "above", [Entry(text=text, colour=colour, kind="area") for text, colour in legend])
    words = [f"{name}: mesh {a:.2g} %, model {b:.2g} %, prints {c:.2g} %" for name, (a, b, c) in errors.items()]
    caption = f"Half widths. {'; '.join(words)}. Calibrating a unit settles the scatter of its springs."
    size = Size(SIZE.width, box.top + box.height + 38.0)
    return plot_picture([panel], "budget", "What the errors are made of", caption, size)


def pose_plot(report: StoredReport, model: LiveModel) -> Picture:
    """Return how far a reading is off by pose or tilt [%]; raises ValueError where the report has nothing on it."""
    if report.reading is not None:
        return _reading_plot(report)
    if not model.linear:
        msg = "the scene is not linear and the design has no [reading], so that no tilted press was solved"
        raise ValueError(msg)
    return _tilt_plot(report, model)


def _reading_plot(report: StoredReport) -> Picture:
    """Return bias in the worst pose and scatter of the modulus read [%], with their limits."""
    reading = report.reading
    asked = report.design.reading
    if reading is None or asked is None or not reading.moduli:
        msg = "no modulus is read in every pose"
        raise ValueError(msg)
    E = [row.E_MPa for row in reading.moduli]
    bias = [abs(row.E_bias_percent) for row in reading.moduli]
    scatter = [row.uncertainty_percent for row in reading.moduli]
    limits = (100.0 * asked.bias_limit, 100.0 * asked.uncertainty_limit)
    margin = 0.05 * (max(E) - min(E) or max(E))
    x = Scale(start=min(E) - margin, end=max(E) + margin)
    y = Scale(start=0.0, end=1.12 * max(*bias, *scatter, *limits))
    panel = plot_panel("pose", x, "modulus of the fruit E [MPa]", y, _ERROR_READ)
    entries = []
    lines = (("worst pose, no noise", bias, limits[0]), ("deviation, level", scatter, limits[1]))
    for colour, (text, values, limit) in zip(SERIES, lines, strict=False):
        panel.line(E, values, colour)
        panel.points(E, values, colour, 3.0)
        _draw_limit(panel, limit, "limit", colour)
        entries.append(Entry(text=text, colour=colour, kind="points"))
    draw_legend(panel, "center right", entries)
    worst = reading.moduli[first_largest(bias, least=100.0)]
    caption = (
        f"Read as {reading.method}. Every pose that occurs is in it, with tilts up to {asked.tilt_deg:g} degrees; the "
        f"worst is {worst.worst}, at {worst.E_MPa:g} MPa. The first tip lifts off at {reading.lift_deg:.3g} degrees. "
        "The deviation is one standard deviation."
    )
    return plot_picture([panel], "pose", "Error of the reading in the worst pose", caption)


def _draw_limit(panel: Panel, limit: float, text: str, colour: str) -> None:
    """Draw a limit over the whole width, with its name."""
    panel.level(limit, colour, dash=DASHED)
    panel.write(text, panel.x.start, limit, Words(right=7.0, down=-7.0, colour=colour, size=9.0))


def _tilt_plot(report: StoredReport, model: LiveModel) -> Picture:
    """Return the error of E read from the forces [%] against tilt [deg], by the linear law of the sliders."""
    press = report.design.press
    moduli = report.design.fruit.E_MPa
    y = Scale(start=-_LARGEST_ERROR, end=_LARGEST_ERROR)
    panel = plot_panel("pose", Scale(start=-3.15, end=3.15), "tilt along the tips [deg]", y, _ERROR_READ)
    spread = press.tilt_spread_deg
    panel.area([-spread, spread], [y.start, y.start], [-spread, spread], [y.end, y.end], MUTED, 0.15)
    panel.level(0.0, INK, 0.8)
    entries = []
    at_one_degree = []
    for colour, E in zip(SERIES, moduli[:: max(1, (len(moduli) - 1) // 2)], strict=False):
        read = np.array([model.modulus_read(E, press.travel_mm, tilt) for tilt in _TILTS.tolist()])
        error = 100.0 * (read / E - 1.0)
        panel.line(_TILTS, error, colour)
        entries.append(Entry(text=f"E = {E:g} MPa", colour=colour))
        at_one_degree += np.abs(error[np.isclose(np.abs(_TILTS), 1.0)]).tolist()
    draw_legend(panel, "upper left", entries)
    readings = [error for error in at_one_degree if np.isfinite(error)]
    words = f"one degree moves E by up to {max(readings):.3g} %" if readings else "no reading at one degree"
    if 0 < len(readings) < len(at_one_degree):
        words += ", and at some moduli leaves none"
    what = "force ratio" if model.by_ratio else "contrast"
    caption = (
        f"Layout {report.design.tips.layout}, read by the {what} of one reading: {words}. "
        "Tips are taken as higher or lower; the grey band is the tilt that a press may be off by."
    )
    return plot_picture([panel], "pose", "Error of the reading against tilt", caption)


def speed_plot(report: StoredReport) -> Picture:
    """Return error [%] over wall time [s] of the solves of this run; raises ValueError where none has both."""
    solves = [("contact", report.contact.seconds, report.contact.error_percent)]
    for name, spring in report.flexures.items():
        solves.append((f"{name} spring", spring.seconds or 0.0, spring.error_percent or 0.0))
    solves = [solve for solve in solves if min(solve[1:]) > 0.0]
    if not solves:
        msg = "nothing was solved"
        raise ValueError(msg)
    asked = 100.0 * report.accuracy["tolerance"]
    _, times, percents = zip(*solves, strict=True)
    x = Scale(start=0.4 * min(times), end=12.0 * max(times), logarithmic=True)
    y = Scale(start=0.3 * min(percents), end=4.0 * max(asked, *percents), logarithmic=True)
    panel = plot_panel("speed", x, "wall time of the solve [s]", y, "error bar [%]")
    texts = []
    for colour, (name, seconds, percent) in zip(SERIES, solves, strict=False):
        panel.points([seconds], [percent], colour, 4.0)
        texts.append(f"{name}: {percent:.2g} %")
    write_beside(panel, times, percents, texts, [Words(right=9.0)] * len(texts))
    _draw_limit(panel, asked, "asked for (--tol)", BAD)
    caption = f"What each solve of this run took for its error; {report.contact.method} for the contact."
    return plot_picture([panel], "speed", "Speed against error", caption)
