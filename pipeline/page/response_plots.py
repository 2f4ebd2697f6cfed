"""Plots of what the sensor shows: P over modulus and over travel, pressure on the skin over travel."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from pipeline.page.field_plots import contact_radius
from pipeline.page.fields import Floats
from pipeline.page.mangoes import SeenMango, numbers
from pipeline.page.picture import BAD, INK, MUTED, SERIES, Picture, plot_axes, plot_legend, plot_picture
from pipeline.report.stored import StoredReport, StoredResponse

_LABEL_STEP = 0.055  # of the width of a plot, between the numbers of mangoes
_NOTHING = 1e-9


def modulus_plot(report: StoredReport, mangoes: Sequence[SeenMango]) -> Picture | None:
    """Return P [1] over the modulus [MPa] at full travel, with chord, NL and mangoes; None where no P is known."""
    curve = report.curve
    E, P = numbers(curve.E_MPa), numbers(curve.P)
    known = P[np.isfinite(P)]
    if not len(known):
        return None
    axes = plot_axes("modulus of the fruit E [MPa]", "force ratio P [1]")
    _draw_curve(axes, report, E, P)
    nonlinearity = _draw_chord(axes, report, E, P)
    _draw_mangoes(axes, mangoes, float(E[-1]))
    axes.set_xlim(0.0, 1.02 * float(E[-1]))
    axes.set_ylim(0.0, 1.12 * float(known.max()))
    plot_legend(axes, "lower right")
    caption = (
        f"At {curve.x_mm:g} mm travel, from {known[0]:.3g} to {known[-1]:.4g}{nonlinearity}. "
        "The numbers are the mangoes of the paper's Table I, bars the scatter of their own tests."
    )
    title = "Force ratio over modulus"
    return plot_picture(axes, "modulus", title, caption, f"Line plot of P over E. {caption}")


def _draw_curve(axes: Axes, report: StoredReport, E: Floats, P: Floats) -> None:
    """Draw P with its bands of moduli, from the softest fruit on where its P is known."""
    for name, words, alpha in (("as_printed", "as printed", 0.16), ("calibrated", "after calibrating", 0.35)):
        words = f"E that may show P, {words}"
        axes.fill_betweenx(P, *_band(report, name), color=SERIES[0], alpha=alpha, linewidth=0.0, label=words)
    softest = report.curve.P_softest
    if softest is not None:
        E, P = np.concatenate([[0.0], E]), np.concatenate([[softest], P])
    axes.plot(E, P, color=SERIES[0], linewidth=2.0, label="P at full travel")


def _band(report: StoredReport, name: str) -> tuple[Floats, Floats]:
    """Return the ends of a band of moduli [MPa]; an end without a bound is drawn at the border of the plot."""
    curve = report.curve
    printed = name == "as_printed"
    lower = numbers(curve.E_lower_as_printed_MPa if printed else curve.E_lower_calibrated_MPa)
    upper = numbers(curve.E_upper_as_printed_MPa if printed else curve.E_upper_calibrated_MPa)
    known = np.isfinite(lower) | np.isfinite(upper)
    outside = 1.05 * curve.E_MPa[-1]
    low = np.where(known, np.nan_to_num(lower, nan=0.0), np.nan)
    return low, np.where(known, np.minimum(np.nan_to_num(upper, nan=outside), outside), np.nan)


def _draw_chord(axes: Axes, report: StoredReport, E: Floats, P: Floats) -> str:
    """Draw the chord from no modulus to the largest and where NL is taken; return the NL judged in words."""
    start = report.curve.P_softest
    if start is None or not math.isfinite(P[-1]):
        return ""
    axes.plot([0.0, E[-1]], [start, P[-1]], color=MUTED, linestyle="--", linewidth=1.2, label="straight line")
    NL = _judged(report, "NL")
    if NL is None:
        return ""
    definition = report.design.nominal_targets.NL_definition
    _draw_departure(axes, NL, definition, (E, P, start + (P[-1] - start) * E / E[-1]))
    return f", NL {100.0 * NL:.3g} % of its rise off the straight line ({definition})"


def _draw_departure(axes: Axes, NL: float, definition: str, curves: tuple[Floats, Floats, Floats]) -> None:
    """Draw how far P is off its chord where NL [1] is taken; curves are E [MPa], P and chord [1]."""
    E, P, chord = curves
    at = 0.5 * E[-1] if definition == "mid-range" else float(E[np.nanargmax(P - chord)])
    ends = [float(np.interp(at, E, values)) for values in (chord, P)]
    axes.plot([at, at], ends, color=BAD, linewidth=2.0)
    axes.annotate(f"NL {100.0 * NL:.3g} %", (at, ends[0]), (8, -14), textcoords="offset points", color=BAD)


def _judged(report: StoredReport, name: str) -> float | None:
    """Return the value of a verdict of the report [unit of the verdict], None where it has none."""
    return next((verdict.value for verdict in report.verdicts if verdict.name == name), None)


def _draw_mangoes(axes: Axes, mangoes: Sequence[SeenMango], E_max: float) -> None:
    """Draw the mangoes on the line, their numbers in a row above it so that none covers another."""
    if not mangoes:
        return
    E, P = np.array([one.mango.E_MPa for one in mangoes]), np.array([one.P for one in mangoes])
    scatter = [one.mango.scatter_MPa for one in mangoes]
    axes.errorbar(
        E,
        P,
        xerr=scatter,
        fmt="o",
        markersize=4.0,
        color=SERIES[3],
        elinewidth=1.0,
        capsize=2.0,
        label="mangoes of Table I",
    )
    order = np.argsort(E, kind="stable")
    places = _apart(E[order], _LABEL_STEP * E_max)
    level = 1.05 * float(axes.dataLim.y1)
    for place, index in zip(places, order, strict=True):
        number = str(mangoes[index].mango.number)
        arrow = {"arrowstyle": "-", "color": MUTED, "linewidth": 0.6, "shrinkB": 3.0}
        axes.annotate(
            number, (E[index], P[index]), (float(place), level), ha="center", fontsize=9.0, color=INK, arrowprops=arrow
        )


def _apart(places: Floats, step: float) -> Floats:
    """Return ascending places moved so that neighbours are at least a step apart."""
    moved = places.copy()
    for _ in range(200):
        short = step - np.diff(moved)
        for i in np.flatnonzero(short > 1e-6 * step):
            moved[i] -= 0.5 * short[i]
            moved[i + 1] += 0.5 * short[i]
    return moved


def travel_plot(report: StoredReport) -> Picture | None:
    """Return P [1] over the travel [mm] at each modulus with its error bar, the paper's Fig. 11."""
    rows = [row for row in report.response if row.last_P is not None]
    if not rows:
        return None
    axes = plot_axes("travel x [mm]", "force ratio P [1]")
    for place, row in enumerate(rows):
        _draw_ratio(axes, row, SERIES[place % len(SERIES)])
    axes.set_ylim(0.0, None)
    _label_moduli(axes, rows, [row.last_P or 0.0 for row in rows], report.design.press.travel_mm)
    spread = _judged(report, "P_displacement_independent")
    widest = max((error for row in rows for error in _errors(row)), default=0.0)
    varies = "" if spread is None else f" P varies by {_percent(spread)} of its mean over the travel."
    caption = (
        f"The paper's Fig. 11.{varies} The bands are the error bars of P from mesh and springs, at most {widest:.2g} %."
    )
    return plot_picture(axes, "travel", "Force ratio over travel", caption, f"One line for each modulus. {caption}")


def _draw_ratio(axes: Axes, row: StoredResponse, colour: str) -> None:
    P, error = numbers(row.P), 0.01 * numbers(row.P_error_percent)
    axes.fill_between(row.x_mm, P * (1.0 - error), P * (1.0 + error), color=colour, alpha=0.3, linewidth=0.0)
    axes.plot(row.x_mm, P, color=colour, marker="o", markersize=2.5)


def _label_moduli(axes: Axes, rows: Sequence[StoredResponse], ends: Sequence[float], travel: float) -> None:
    """Write the modulus at the end of each line, apart from each other."""
    axes.set_xlim(0.0, 1.22 * travel)
    order = np.argsort(ends, kind="stable")
    levels = _apart(np.array(ends)[order], 0.05 * axes.get_ylim()[1])
    for place, level in zip(order.tolist(), levels.tolist(), strict=True):
        colour = SERIES[place % len(SERIES)]
        axes.annotate(f"{rows[place].E_MPa:g} MPa", (1.02 * travel, level), color=colour, va="center", fontsize=9)


def _errors(row: StoredResponse) -> list[float]:
    return [error for error in row.P_error_percent if error is not None]


def _percent(share: float) -> str:
    return f"at most {100.0 * share:.2g} %" if share > _NOTHING else "no more than round-off"


def pressure_plot(report: StoredReport) -> Picture:
    """Return the mean pressure under the worst tip [MPa] over the travel [mm] at each modulus, with the limits."""
    axes = plot_axes("travel x [mm]", "mean pressure under a tip [MPa]")
    limits, travel = report.design.fruit.bruise_limits_MPa, report.design.press.travel_mm
    pressures = [mean_pressures(report, row) for row in report.response]
    for place, (row, pressure) in enumerate(zip(report.response, pressures, strict=True)):
        axes.plot(row.x_mm, pressure, color=SERIES[place % len(SERIES)])
    _draw_limits(axes, limits, travel)
    lasts = [float(pressure[-1]) for pressure in pressures]
    axes.set_ylim(0.0, 1.08 * max((*lasts, *limits)) or 1.0)
    _label_moduli(axes, report.response, lasts, travel)
    what = "Dashed: what the fruit stands." if limits else "No limit is set for this fruit (fruit.bruise_limit_MPa)."
    caption = f"At full travel up to {max(lasts):.3g} MPa, in the pose of the design. {what}"
    title = "Pressure on the skin over travel"
    return plot_picture(axes, "pressure", title, caption, f"One line for each modulus. {caption}")


def _draw_limits(axes: Axes, limits: Sequence[float], travel: float) -> None:
    """Draw one limit over the whole travel, or that of each modulus at its end [MPa]."""
    if len(set(limits)) == 1:
        axes.axhline(limits[0], color=BAD, linestyle="--", linewidth=2.0)
        axes.annotate("limit", (0.02 * travel, limits[0]), va="bottom", color=BAD)
        return
    for place, limit in enumerate(limits):
        colour = SERIES[place % len(SERIES)]
        axes.hlines(limit, 0.9 * travel, travel, color=colour, linestyle="--", linewidth=2.0)


def mean_pressures(report: StoredReport, row: StoredResponse) -> Floats:
    """Return the largest mean pressure under a tip over the travel at one modulus [MPa], shape (travels,)."""
    forces = np.array([numbers(force) for force in row.tip_forces])
    if report.design.tips.dome_radius_mm is None:
        return np.asarray(np.nan_to_num(forces).max(axis=0) / report.design.tips.face_mm2)
    most = np.nan_to_num(forces).max(axis=0)
    areas = [math.pi * contact_radius(report, row.E_MPa, force) ** 2 if force > 0.0 else 1.0 for force in most]
    return np.asarray(most / np.array(areas))
