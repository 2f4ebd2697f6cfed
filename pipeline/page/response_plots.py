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
_PAIR = 2
_NOTHING = 1e-9


def modulus_plot(report: StoredReport, mangoes: Sequence[SeenMango]) -> Picture | None:
    """Return P [1] over the modulus [MPa] at full travel, with chord, NL and mangoes; None where no P is known."""
    curve = report.curve
    E, P = numbers(curve.E_MPa), numbers(curve.P)
    if not np.isfinite(P).any():
        return None
    axes = plot_axes("modulus of the fruit E [MPa]", "force ratio P [1]")
    for ends, words, alpha in (
        (_band(report, "as_printed"), "as printed", 0.16),
        (_band(report, "calibrated"), "after calibrating", 0.35),
    ):
        axes.fill_betweenx(P, *ends, color=SERIES[0], alpha=alpha, linewidth=0.0, label=f"E that may show P, {words}")
    start = [] if curve.P_softest is None else [curve.P_softest]
    axes.plot([0.0, *E][-len(P) - len(start) :], [*start, *P], color=SERIES[0], linewidth=2.0, label="P at full travel")
    nonlinearity = _draw_chord(axes, report, E, P)
    _draw_mangoes(axes, mangoes, float(E[-1]))
    axes.set_xlim(0.0, 1.02 * float(E[-1]))
    axes.set_ylim(0.0, 1.12 * float(np.nanmax(P)))
    plot_legend(axes, "lower right")
    caption = (
        f"At {curve.x_mm:g} mm travel, from {P[np.isfinite(P)][0]:.3g} to {P[np.isfinite(P)][-1]:.4g}{nonlinearity}. "
        "The numbers are the mangoes of the paper's Table I, bars the scatter of their own tests."
    )
    title = "Force ratio over modulus"
    return plot_picture(axes, "modulus", title, caption, f"Line plot of P over E. {caption}")


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
    """Draw the chord from no modulus to the largest and the way of P from it in the middle; return it in words."""
    start = report.curve.P_softest
    if start is None or not math.isfinite(P[-1]):
        return ""
    axes.plot([0.0, E[-1]], [start, P[-1]], color=MUTED, linestyle="--", linewidth=1.2, label="straight line")
    middle = 0.5 * E[-1]
    chord, here = 0.5 * (start + P[-1]), float(np.interp(middle, E, P))
    NL = (here - chord) / (P[-1] - start)
    axes.plot([middle, middle], [chord, here], color=BAD, linewidth=2.0)
    axes.annotate(f"NL {100.0 * NL:.3g} %", (middle, chord), (8, -14), textcoords="offset points", color=BAD)
    return f", {100.0 * NL:.3g} % of its rise off the straight line in the middle"


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
    widest = 0.0
    for place, row in enumerate(rows):
        colour = SERIES[place % len(SERIES)]
        P, error = numbers(row.P), 0.01 * numbers(row.P_error_percent)
        widest = max(widest, float(np.nanmax(100.0 * error)))
        axes.fill_between(row.x_mm, P * (1.0 - error), P * (1.0 + error), color=colour, alpha=0.3, linewidth=0.0)
        axes.plot(row.x_mm, P, color=colour, marker="o", markersize=2.5)
    travel = report.design.press.travel_mm
    axes.set_xlim(0.0, 1.22 * travel)
    axes.set_ylim(0.0, None)
    levels = _apart(np.array([row.last_P for row in rows]), 0.05 * axes.get_ylim()[1])
    for place, (row, level) in enumerate(zip(rows, levels, strict=True)):
        axes.annotate(
            f"{row.E_MPa:g} MPa",
            (1.02 * travel, float(level)),
            color=SERIES[place % len(SERIES)],
            va="center",
            fontsize=9,
        )
    spread = max(_spread(row) for row in rows)
    caption = (
        f"The paper's Fig. 11. P varies by {_percent(spread)} of its mean over the travel; "
        f"the bands are its error bars from mesh and springs, at most {widest:.2g} %."
    )
    return plot_picture(axes, "travel", "Force ratio over travel", caption, f"One line for each modulus. {caption}")


def _percent(share: float) -> str:
    return f"at most {100.0 * share:.2g} %" if share > _NOTHING else "no more than round-off"


def _spread(row: StoredResponse) -> float:
    P = [value for value in row.P if value is not None]
    return (max(P) - min(P)) * len(P) / sum(P)


def pressure_plot(report: StoredReport) -> Picture:
    """Return the mean pressure under the worst tip [MPa] over the travel [mm] at each modulus, with the limits."""
    axes = plot_axes("travel x [mm]", "mean pressure under a tip [MPa]")
    limits = report.design.fruit.bruise_limits_MPa
    travel = report.design.press.travel_mm
    lasts = []
    for place, row in enumerate(report.response):
        colour = SERIES[place % len(SERIES)]
        pressures = mean_pressures(report, row)
        lasts.append(float(pressures[-1]))
        axes.plot(row.x_mm, pressures, color=colour)
        if len(set(limits)) > 1:
            axes.plot(
                [0.9 * travel, 1.0 * travel], [limits[place]] * _PAIR, color=colour, linestyle="--", linewidth=2.0
            )
    if len(set(limits)) == 1:
        axes.axhline(limits[0], color=BAD, linestyle="--", linewidth=2.0)
        axes.annotate("limit", (0.02 * travel, limits[0]), va="bottom", color=BAD)
    axes.set_xlim(0.0, 1.22 * travel)
    axes.set_ylim(0.0, 1.08 * max([*(last for last in lasts if math.isfinite(last)), *limits], default=1.0))
    levels = _apart(np.array(sorted(lasts)), 0.05 * axes.get_ylim()[1])
    for place, level in zip(np.argsort(lasts, kind="stable"), levels, strict=True):
        words = f"{report.response[place].E_MPa:g} MPa"
        axes.annotate(words, (1.02 * travel, float(level)), color=SERIES[place % len(SERIES)], va="center", fontsize=9)
    what = "Dashed: what the fruit stands." if limits else "No limit is set for this fruit (fruit.bruise_limit_MPa)."
    caption = f"At full travel up to {max(lasts):.3g} MPa, in the pose of the design. {what}"
    return plot_picture(
        axes, "pressure", "Pressure on the skin over travel", caption, f"One line for each modulus. {caption}"
    )


def mean_pressures(report: StoredReport, row: StoredResponse) -> Floats:
    """Return the largest mean pressure under a tip over the travel at one modulus [MPa], shape (travels,)."""
    forces = np.array([numbers(force) for force in row.tip_forces])
    if report.design.tips.dome_radius_mm is None:
        return np.asarray(np.nan_to_num(forces).max(axis=0) / report.design.tips.face_mm2)
    most = np.nan_to_num(forces).max(axis=0)
    areas = [math.pi * contact_radius(report, row.E_MPa, force) ** 2 if force > 0.0 else 1.0 for force in most]
    return np.asarray(most / np.array(areas))
