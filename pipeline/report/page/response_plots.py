"""Plots of what the sensor shows: P over modulus and over travel, pressure on the skin over travel."""

import math
from collections.abc import Sequence

import numpy as np

from pipeline.report.page.drawing.labels import apart, write_beside
from pipeline.report.page.drawing.legend import Entry, draw_legend
from pipeline.report.page.drawing.panel import BAD, DASHED, MUTED, SERIES, Panel, Words
from pipeline.report.page.drawing.picture import Picture, plot_panel, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.page.field_pictures import contact_radius
from pipeline.report.page.mangoes import SeenMango, numbers
from pipeline.report.stored import StoredReport, StoredResponse
from solve.arrays import Floats

_LABEL_STEP = 0.055  # of the width of a plot, between the numbers of mangoes
_NUMBERS_AT = 0.96  # of the height of a plot
_OFF = "a tip is off the fruit at every modulus"


def modulus_plot(report: StoredReport, mangoes: Sequence[SeenMango]) -> Picture:
    """Return P [1] over the modulus [MPa] at full travel, with chord, NL and mangoes; raises ValueError without P."""
    curve = report.curve
    E = numbers(curve.E_MPa)
    P = numbers(curve.P)
    finite = P[np.isfinite(P)]
    if not len(finite):
        raise ValueError(_OFF)
    x = Scale(start=0.0, end=1.02 * float(E[-1]))
    y = Scale(start=0.0, end=1.12 * float(finite.max()))
    panel = plot_panel("modulus", x, "modulus of the fruit E [MPa]", y, "force ratio P [1]")
    entries = [
        *_draw_band(panel, P, curve.E_lower_as_printed_MPa, curve.E_upper_as_printed_MPa, "as printed", 0.16),
        *_draw_band(panel, P, curve.E_lower_calibrated_MPa, curve.E_upper_calibrated_MPa, "after calibrating", 0.35),
        Entry(text="P at full travel", colour=SERIES[0]),
    ]
    caption = f"At {curve.x_mm:g} mm travel, from {finite[0]:.4g} to {finite[-1]:.4g}"
    if curve.P_softest is None:
        panel.line(E, P, SERIES[0], 2.0)
    else:
        panel.line(np.append(0.0, E), np.append(curve.P_softest, P), SERIES[0], 2.0)
        if math.isfinite(P[-1]):
            panel.line([0.0, E[-1]], [curve.P_softest, P[-1]], MUTED, 1.2, DASHED)
            entries.append(Entry(text="straight line", colour=MUTED, dash=DASHED))
            caption += _draw_nonlinearity(panel, report, E, P)
    if mangoes:
        _draw_mangoes(panel, mangoes)
        entries.append(Entry(text="mangoes of Table I", colour=SERIES[3], kind="points"))
        caption += ". The numbers are the mangoes of the paper's Table I, bars the scatter of their tests"
    draw_legend(panel, "lower right", entries)
    return plot_picture([panel], "modulus", "Force ratio over modulus", f"{caption}.")


def _draw_band(
    panel: Panel,
    P: Floats,
    E_lower: Sequence[float | None],
    E_upper: Sequence[float | None],
    words: str,
    opacity: float,
) -> list[Entry]:
    """Draw the moduli [MPa] that may show each P, one without a bound at the border; return the entry."""
    lower = numbers(E_lower)
    upper = numbers(E_upper)
    bounded = np.isfinite(lower) | np.isfinite(upper)
    lower = np.where(bounded, np.nan_to_num(lower, nan=0.0), np.nan)
    upper = np.where(bounded, np.minimum(np.nan_to_num(upper, nan=panel.x.end), panel.x.end), np.nan)
    drawn = np.isfinite(lower + P)
    if not (drawn[1:] & drawn[:-1]).any():
        return []
    panel.area(lower, P, upper, P, SERIES[0], opacity)
    return [Entry(text=f"E that may show P, {words}", colour=SERIES[0], kind="area", opacity=opacity)]


def _draw_nonlinearity(panel: Panel, report: StoredReport, E: Floats, P: Floats) -> str:
    """Draw how far P is off its chord where NL is taken, and return it in words; nothing where it has no verdict."""
    NL = _verdict_value(report, "NL")
    if NL is None:
        return ""
    start = report.curve.P_softest or 1.0
    chord = start + (P[-1] - start) * E / E[-1]
    definition = report.design.nominal_targets.NL_definition
    at = 0.5 * float(E[-1]) if definition == "mid-range" else float(E[np.nanargmax(P - chord)])
    on_chord = float(np.interp(at, E, chord))
    panel.line([at, at], [on_chord, float(np.interp(at, E, P))], BAD, 2.0)
    panel.write(f"NL {100.0 * NL:.3g} %", at, on_chord, Words(right=8.0, down=11.0, colour=BAD))
    return f", NL {100.0 * NL:.3g} % of its rise off the straight line ({definition})"


def _verdict_value(report: StoredReport, name: str) -> float | None:
    """Return the value of a verdict of the report [unit of the verdict], None where it has none."""
    return next((verdict.value for verdict in report.verdicts if verdict.name == name), None)


def _draw_mangoes(panel: Panel, mangoes: Sequence[SeenMango]) -> None:
    """Draw the mangoes on the line, their numbers in a row above it so that none covers another."""
    ordered = sorted(mangoes, key=lambda seen: seen.mango.E_MPa)
    E = np.array([seen.mango.E_MPa for seen in ordered])
    level = _NUMBERS_AT * panel.y.end
    label_at = apart(E, _LABEL_STEP * panel.x.end, 0.0, panel.x.end).tolist()
    for seen, label in zip(ordered, label_at, strict=True):
        modulus = seen.mango.E_MPa
        scatter = seen.mango.scatter_MPa
        panel.line([modulus, label], [seen.P, level - 0.03 * panel.y.end], MUTED, 0.6)
        panel.line([modulus - scatter, modulus + scatter], [seen.P, seen.P], SERIES[3], 1.0)
        panel.write(str(seen.mango.number), label, level, Words(anchor="middle", size=9.0))
    panel.points(E, [seen.P for seen in ordered], SERIES[3], 2.2)


def travel_plot(report: StoredReport) -> Picture:
    """Return P [1] over the travel [mm] at each modulus with its error bar; raises ValueError without P."""
    rows = [row for row in report.response if row.last_P is not None]
    if not rows:
        raise ValueError(_OFF)
    ratios = [numbers(row.P) for row in rows]
    errors = [0.01 * np.nan_to_num(numbers(row.P_error_percent)) for row in rows]
    upper_ends = [P * (1.0 + error) for P, error in zip(ratios, errors, strict=True)]
    panel = _panel_over_travel(report, "travel", "force ratio P [1]", 1.05 * float(np.nanmax(upper_ends)))
    for index, (row, P, error) in enumerate(zip(rows, ratios, errors, strict=True)):
        colour = SERIES[index % len(SERIES)]
        panel.area(row.x_mm, P * (1.0 - error), row.x_mm, P * (1.0 + error), colour, 0.3)
        panel.line(row.x_mm, P, colour)
        panel.points(row.x_mm, P, colour, 1.4)
    _label_moduli(panel, report, rows, [row.last_P or 0.0 for row in rows])
    caption = "The paper's Fig. 11."
    spread = _verdict_value(report, "P_displacement_independent")
    if spread is not None:
        caption += f" P varies by at most {100.0 * spread:.2g} % of its mean over the travel."
    widest = 100.0 * float(np.max(errors))
    caption += f" The bands are the error bars of P from mesh and springs, at most {widest:.2g} %."
    return plot_picture([panel], "travel", "Force ratio over travel", caption)


def _panel_over_travel(report: StoredReport, name: str, label: str, highest: float) -> Panel:
    """Return an empty panel of values from 0 to the highest over the travel [mm], with room for words at its end."""
    x = Scale(start=0.0, end=1.22 * report.design.press.travel_mm)
    return plot_panel(name, x, "travel x [mm]", Scale(start=0.0, end=highest), label)


def _label_moduli(panel: Panel, report: StoredReport, rows: Sequence[StoredResponse], ends: Sequence[float]) -> None:
    """Write the modulus at the end of each line, apart from each other."""
    texts = [f"{row.E_MPa:g} MPa" for row in rows]
    words = [Words(colour=SERIES[index % len(SERIES)], size=9.0) for index in range(len(rows))]
    write_beside(panel, 1.02 * report.design.press.travel_mm, ends, texts, words)


def pressure_plot(report: StoredReport) -> Picture:
    """Return the mean pressure under the worst tip [MPa] over the travel [mm] at each modulus, with the limits."""
    limits = report.design.fruit.bruise_limits_MPa
    travel = report.design.press.travel_mm
    pressures = [mean_pressures(report, row) for row in report.response]
    ends = [float(pressure[-1]) for pressure in pressures]
    highest = 1.08 * max((*ends, *limits)) or 1.0
    panel = _panel_over_travel(report, "pressure", "mean pressure under a tip [MPa]", highest)
    for index, (row, pressure) in enumerate(zip(report.response, pressures, strict=True)):
        panel.line(row.x_mm, pressure, SERIES[index % len(SERIES)])
    for index, limit in enumerate(limits):
        panel.line([0.9 * travel, travel], [limit, limit], SERIES[index % len(SERIES)], 2.0, DASHED)
    _label_moduli(panel, report, report.response, ends)
    what = "Dashed: what the fruit stands." if limits else "No limit is set for this fruit (fruit.bruise_limit_MPa)."
    caption = f"At full travel up to {max(ends):.3g} MPa, in the pose of the design. {what}"
    return plot_picture([panel], "pressure", "Pressure on the skin over travel", caption)


def mean_pressures(report: StoredReport, row: StoredResponse) -> Floats:
    """Return the largest mean pressure under a tip over the travel at one modulus [MPa], shape (travels,)."""
    force = np.nan_to_num([numbers(forces) for forces in row.tip_forces]).max(axis=0)
    if report.design.tips.dome_radius_mm is None:
        return np.asarray(force / report.design.tips.face_mm2)
    radius = [contact_radius(report, row.E_MPa, F) if F > 0.0 else 1.0 for F in force.tolist()]
    return np.asarray(force / (math.pi * np.square(radius)))
