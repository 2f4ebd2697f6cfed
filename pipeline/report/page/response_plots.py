"""Plots of what the sensor shows: P over modulus and over travel, pressure on the skin over travel."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from pipeline.report.page.contact_picture import contact_radius
from pipeline.report.page.drawing.labels import apart, write_beside
from pipeline.report.page.drawing.legend import Entry, draw_legend
from pipeline.report.page.drawing.panel import BAD, DASHED, MUTED, SERIES, Panel, Words
from pipeline.report.page.drawing.picture import Picture, plot_panel, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.page.fields import Floats
from pipeline.report.page.mangoes import SeenMango, numbers
from pipeline.report.stored import StoredReport, StoredResponse

_LABEL_STEP = 0.055  # of the width of a plot, between the numbers of mangoes
_NUMBERS_AT = 0.96  # of the height of a plot
_NOTHING = 1e-9
_MANGOES = " The numbers are the mangoes of the paper's Table I, bars the scatter of their own tests."


def modulus_plot(report: StoredReport, mangoes: Sequence[SeenMango]) -> Picture | None:
    """Return P [1] over the modulus [MPa] at full travel, with chord, NL and mangoes; None where no P is known."""
    curve = report.curve
    E, P = numbers(curve.E_MPa), numbers(curve.P)
    known = P[np.isfinite(P)]
    if not len(known):
        return None
    x, y = (Scale(start=0.0, end=float(end)) for end in (1.02 * E[-1], 1.12 * known.max()))
    panel = plot_panel("modulus", x, "modulus of the fruit E [MPa]", y, "force ratio P [1]")
    drawn = [*_draw_bands(panel, report, P), _draw_curve(panel, report, E, P)]
    drawn += [*_draw_chord(panel, report, E, P), *_draw_mangoes(panel, mangoes)]
    nonlinearity = _draw_departure(panel, report, E, P)
    draw_legend(panel, "lower right", drawn)
    shown = _MANGOES if mangoes else ""
    caption = f"At {curve.x_mm:g} mm travel, {_ends_in_words(known)}{nonlinearity}.{shown}"
    words = (caption, f"Line plot of P over E. {caption}")
    return plot_picture([panel], "modulus", "Force ratio over modulus", words)


def _ends_in_words(P: Floats) -> str:
    """Return the first and the last P in words, both as finely."""
    return f"from {P[0]:.4g} to {P[-1]:.4g}"


def _draw_bands(panel: Panel, report: StoredReport, P: Floats) -> Iterator[Entry]:
    """Draw the moduli that may show each P where they are known, and yield the entries of the legend."""
    for name, words, opacity in (("as_printed", "as printed", 0.16), ("calibrated", "after calibrating", 0.35)):
        lower, upper = _band(report, name)
        known = np.isfinite(lower + upper + P)
        if not (known[1:] & known[:-1]).any():
            continue
        panel.area((lower, P), (upper, P), SERIES[0], opacity)
        yield Entry(text=f"E that may show P, {words}", colour=SERIES[0], kind="area", opacity=opacity)


def _draw_curve(panel: Panel, report: StoredReport, E: Floats, P: Floats) -> Entry:
    """Draw P, from the softest fruit on where its P is known, and return its entry of the legend."""
    softest = report.curve.P_softest
    if softest is not None:
        E, P = np.concatenate([[0.0], E]), np.concatenate([[softest], P])
    panel.line(E, P, SERIES[0], 2.0)
    return Entry(text="P at full travel", colour=SERIES[0])


def _band(report: StoredReport, name: str) -> tuple[Floats, Floats]:
    """Return the ends of a band of moduli [MPa]; an end without a bound is drawn at the border of the plot."""
    curve = report.curve
    printed = name == "as_printed"
    lower = numbers(curve.E_lower_as_printed_MPa if printed else curve.E_lower_calibrated_MPa)
    upper = numbers(curve.E_upper_as_printed_MPa if printed else curve.E_upper_calibrated_MPa)
    known = np.isfinite(lower) | np.isfinite(upper)
    outside = 1.05 * curve.E_MPa[-1]
    least = np.where(known, np.nan_to_num(lower, nan=0.0), np.nan)
    return least, np.where(known, np.minimum(np.nan_to_num(upper, nan=outside), outside), np.nan)


def _draw_chord(panel: Panel, report: StoredReport, E: Floats, P: Floats) -> Iterator[Entry]:
    """Draw the chord from no modulus to the largest, and yield its entry of the legend; none where P has no end."""
    start = report.curve.P_softest
    if start is not None and math.isfinite(P[-1]):
        panel.line([0.0, E[-1]], [start, P[-1]], MUTED, 1.2, DASHED)
        yield Entry(text="straight line", colour=MUTED, dash=DASHED)


def _draw_departure(panel: Panel, report: StoredReport, E: Floats, P: Floats) -> str:
    """Draw how far P is off its chord where NL is taken, and return the NL judged in words; none without both."""
    start, NL = report.curve.P_softest, _judged(report, "NL")
    if NL is None or start is None or not math.isfinite(P[-1]):
        return ""
    definition, chord = report.design.nominal_targets.NL_definition, start + (P[-1] - start) * E / E[-1]
    at = 0.5 * E[-1] if definition == "mid-range" else float(E[np.nanargmax(P - chord)])
    ends = [float(np.interp(at, E, values)) for values in (chord, P)]
    panel.line([at, at], ends, BAD, 2.0)
    panel.write(f"NL {100.0 * NL:.3g} %", at, ends[0], Words(right=8.0, down=11.0, colour=BAD))
    return f", NL {100.0 * NL:.3g} % of its rise off the straight line ({definition})"


def _judged(report: StoredReport, name: str) -> float | None:
    """Return the value of a verdict of the report [unit of the verdict], None where it has none."""
    return next((verdict.value for verdict in report.verdicts if verdict.name == name), None)


def _draw_mangoes(panel: Panel, mangoes: Sequence[SeenMango]) -> Iterator[Entry]:
    """Draw the mangoes on the line, their numbers in a row above it so that none covers another; yield their entry."""
    if not mangoes:
        return
    ordered = sorted(mangoes, key=lambda one: one.mango.E_MPa)
    E = np.array([one.mango.E_MPa for one in ordered])
    places = apart(E, _LABEL_STEP * panel.x.end, (0.0, panel.x.end))
    for one, place in zip(ordered, places.tolist(), strict=True):
        _draw_mango(panel, one, place)
    panel.points(E, [one.P for one in ordered], SERIES[3], 2.2)
    yield Entry(text="mangoes of Table I", colour=SERIES[3], kind="points")


def _draw_mango(panel: Panel, seen: SeenMango, place: float) -> None:
    """Draw the scatter of a mango as a bar, and its number above a place on the scale of moduli [MPa]."""
    E, scatter, level = seen.mango.E_MPa, seen.mango.scatter_MPa, _NUMBERS_AT * panel.y.end
    panel.line([E, place], [seen.P, level - 0.03 * panel.y.end], MUTED, 0.6)
    panel.line([E - scatter, E + scatter], [seen.P, seen.P], SERIES[3], 1.0)
    panel.write(str(seen.mango.number), place, level, Words(anchor="middle", size=9.0))


def travel_plot(report: StoredReport) -> Picture | None:
    """Return P [1] over the travel [mm] at each modulus with its error bar, the paper's Fig. 11."""
    rows = [row for row in report.response if row.last_P is not None]
    if not rows:
        return None
    lasts, travel = [row.last_P or 0.0 for row in rows], report.design.press.travel_mm
    highest = max(float(np.nanmax(_highest(row))) for row in rows)
    panel = _over_travel("travel", travel, "force ratio P [1]", 1.05 * highest)
    for place, row in enumerate(rows):
        _draw_ratio(panel, row, SERIES[place % len(SERIES)])
    _label_moduli(panel, rows, lasts, travel)
    spread = _judged(report, "P_displacement_independent")
    varies = "" if spread is None else f" P varies by {_percent(spread)} of its mean over the travel."
    caption = f"The paper's Fig. 11.{varies}{_bands_in_words(rows)}"
    return plot_picture(
        [panel], "travel", "Force ratio over travel", (caption, f"One line for each modulus. {caption}")
    )


def _over_travel(name: str, travel: float, label: str, most: float) -> Panel:
    """Return an empty panel of values from 0 to `most` over the travel [mm], with room for words at its end."""
    x, y = Scale(start=0.0, end=1.22 * travel), Scale(start=0.0, end=most)
    return plot_panel(name, x, "travel x [mm]", y, label)


def _highest(row: StoredResponse) -> Floats:
    """Return the upper ends of the error bars of P over the travel [1], nan where P is not known."""
    return np.asarray(numbers(row.P) * (1.0 + 0.01 * np.nan_to_num(numbers(row.P_error_percent))))


def _draw_ratio(panel: Panel, row: StoredResponse, colour: str) -> None:
    P, error = numbers(row.P), 0.01 * numbers(row.P_error_percent)
    panel.area((row.x_mm, P * (1.0 - error)), (row.x_mm, P * (1.0 + error)), colour, 0.3)
    panel.line(row.x_mm, P, colour)
    panel.points(row.x_mm, P, colour, 1.4)


def _label_moduli(panel: Panel, rows: Sequence[StoredResponse], ends: Sequence[float], travel: float) -> None:
    """Write the modulus at the end of each line, apart from each other."""
    words = [Words(colour=SERIES[place % len(SERIES)], size=9.0) for place in range(len(rows))]
    texts = [f"{row.E_MPa:g} MPa" for row in rows]
    write_beside(panel, 1.02 * travel, ends, list(zip(texts, words, strict=True)))


def _bands_in_words(rows: Sequence[StoredResponse]) -> str:
    """Return what the bands around P are; nothing where no error of it is known."""
    widest = max((error for row in rows for error in row.P_error_percent if error is not None), default=0.0)
    return f" The bands are the error bars of P from mesh and springs, at most {widest:.2g} %." if widest > 0.0 else ""


def _percent(share: float) -> str:
    return f"at most {100.0 * share:.2g} %" if share > _NOTHING else "no more than round-off"


def pressure_plot(report: StoredReport) -> Picture:
    """Return the mean pressure under the worst tip [MPa] over the travel [mm] at each modulus, with the limits."""
    limits, travel = report.design.fruit.bruise_limits_MPa, report.design.press.travel_mm
    pressures = [mean_pressures(report, row) for row in report.response]
    lasts = [float(pressure[-1]) for pressure in pressures]
    most = 1.08 * max((*lasts, *limits)) or 1.0
    panel = _over_travel("pressure", travel, "mean pressure under a tip [MPa]", most)
    for place, (row, pressure) in enumerate(zip(report.response, pressures, strict=True)):
        panel.line(row.x_mm, pressure, SERIES[place % len(SERIES)])
    _draw_limits(panel, limits, travel)
    _label_moduli(panel, report.response, lasts, travel)
    what = "Dashed: what the fruit stands." if limits else "No limit is set for this fruit (fruit.bruise_limit_MPa)."
    caption = f"At full travel up to {max(lasts):.3g} MPa, in the pose of the design. {what}"
    title = "Pressure on the skin over travel"
    return plot_picture([panel], "pressure", title, (caption, f"One line for each modulus. {caption}"))


def _draw_limits(panel: Panel, limits: Sequence[float], travel: float) -> None:
    """Draw one limit over the whole travel, or that of each modulus at its end [MPa]."""
    if len(set(limits)) == 1:
        panel.level(limits[0], BAD, 2.0, DASHED)
        panel.write("limit", 0.02 * travel, limits[0], Words(down=-8.0, colour=BAD))
        return
    for place, limit in enumerate(limits):
        colour = SERIES[place % len(SERIES)]
        panel.line([0.9 * travel, travel], [limit, limit], colour, 2.0, DASHED)


def mean_pressures(report: StoredReport, row: StoredResponse) -> Floats:
    """Return the largest mean pressure under a tip over the travel at one modulus [MPa], shape (travels,)."""
    forces = np.array([numbers(force) for force in row.tip_forces])
    if report.design.tips.dome_radius_mm is None:
        return np.asarray(np.nan_to_num(forces).max(axis=0) / report.design.tips.face_mm2)
    most = np.nan_to_num(forces).max(axis=0)
    areas = [math.pi * contact_radius(report, row.E_MPa, force) ** 2 if force > 0.0 else 1.0 for force in most]
    return np.asarray(most / np.array(areas))
