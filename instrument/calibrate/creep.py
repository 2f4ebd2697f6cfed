"""Creep of a printed unit, measured by weights that are read some time after they were hung.

Under a weight F [N] that has hung for the time t [s], a spring that creeps shows the deflection

    d = d0 + C F (t / t0)^n,

with the zero d0 [mm], the compliance C [mm/N] at the common time t0 [s], and the creep exponent n [1]. Plotted against
F (t / t0)^n, the readings therefore lie on a straight line. F (t / t0)^n is the force that would cause the same
deflection at the time t0, so it is the weight corrected for creep.

Readings of one weight at several times determine n, both from the dial indicator and from the counts of each tip.
Gauss-Newton iteration finds n. Each step is a linear fit of d by a constant, by F (t / t0)^n, and by the derivative of
this power with respect to n. All springs of a print share one n, which is the weighted mean over all columns.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from instrument.press.signals import count_keys
from pipeline.report.report import Report
from pipeline.tables.decoding import place_of
from pipeline.tables.measured_table import MeasuredTable
from sensor.arrays import Floats
from sensor.design.reading import WEIGHED_AFTER_S
from sensor.quantity import COVERAGE, Estimate, report_field, validation_error
from sensor.theory.creep import CreepLaw
from sensor.theory.straight_line import ROUNDED

LEAST_RATIO = 1.5
"""Smallest ratio of two reading times of the same weight from which creep is determined."""
_ITERATIONS = 4  # Gauss-Newton steps; each roughly squares the error of the exponent
_LARGEST_EXPONENT = math.log10(2.0)  # exponent of a compliance that doubles in each decade of time
_FEWEST_ROWS = 4  # minimum number of rows of a tip: zero, compliance and exponent are three unknowns
_EXTRAPOLATION_FRACTION = 0.5
"""Fraction of the process's creep error that is added in quadrature to the error of a measured creep.

Presses are shorter than the weighing, so the measured creep is extrapolated to shorter times. Creep is not exactly
proportional to the logarithm of time. By assumption, half of the spread between prints covers the resulting error.
"""


@dataclass(frozen=True, kw_only=True)
class Weighing:
    """The weights of a table, corrected for creep to one common time after hanging, and the creep law of the unit.

    `forces` (rows,) [N] are the corrected weights: at the common time `after_s` [s], each would cause the deflection
    that was read in its row. `is_measured` is True if the table determined `creep`. Otherwise `creep` is the creep of
    the process.
    """

    forces: Floats = report_field("N", "weights corrected for creep to one time", has_key=False)
    after_s: float = report_field("s", "time from hanging a weight to its reading", key="weighed_after_s")
    is_measured: bool = report_field(
        "",
        "whether the creep was measured on the unit or is that of the process",
        inline=lambda it: {"creep_of": "unit" if it.is_measured else "process"},
    )
    creep: CreepLaw = report_field(
        "1",
        "growth of the deflection per decade of time, and its standard deviation",
        inline=lambda it: {"creep_per_decade": it.creep.per_decade, "creep_error": it.creep.error},
    )
    note: str = report_field("", "why the creep measured by the table was not used", has_key=False, default="")


def correct_weights(table: MeasuredTable, report: Report, after_s: float | None) -> Weighing:
    """Correct the weights of a table for creep to one common time, and determine the creep law of the unit.

    A weight F that was read at the time t after it was hung is corrected to F (t / t0)^n, with the creep exponent n.
    The common time t0 is the geometric mean of all reading times under load. The column `t` of the table holds the
    reading times. Without this column, all weights were read after `after_s` [s], by default `WEIGHED_AFTER_S`, and
    need no correction.

    Raises InputError for invalid times, and for times given both in the table and by `after_s`. InputError is also
    raised for a compliance that decreases with time, or that at least doubles in a decade.
    """
    forces = table.numbers["force"]
    if "t" not in table.numbers:
        common_time = WEIGHED_AFTER_S if after_s is None else after_s
        return Weighing(forces=forces, after_s=common_time, creep=report.creep, is_measured=False)
    if after_s is not None:
        bound = "left out if a column t_s has the times"
        raise validation_error("--after", after_s, "s", bound, "give either the column or --after")
    _check_times(table)
    is_loaded = forces != 0.0
    if not is_loaded.any():  # there is nothing to correct, and zero deflections do not show creep
        return Weighing(forces=forces, after_s=WEIGHED_AFTER_S, creep=report.creep, is_measured=False)
    common_time = float(np.exp(np.log(table.numbers["t"][is_loaded]).mean()))  # geometric mean
    creep, is_measured, note = _choose_creep(table, report, common_time)
    corrected = forces * (table.numbers["t"] / common_time) ** creep.exponent
    return Weighing(forces=corrected, after_s=common_time, creep=creep, is_measured=is_measured, note=note)


def _choose_creep(table: MeasuredTable, report: Report, common_time: float) -> tuple[CreepLaw, bool, str]:
    """Return the creep law of a unit, whether the table determined it, and a note if the measured creep is not used.

    The creep measured by the table is used only if it is more accurate than the creep of the process. Otherwise the law
    is the creep of the process. `common_time` [s] is the time to which the weights are corrected.
    """
    process_creep = report.creep
    is_metal = report.design.process.is_metal  # metal springs do not creep, so there is nothing to measure
    measured = None if is_metal else _measure_creep(table, report, common_time)
    if measured is None:
        return process_creep, False, ""
    if not _is_more_accurate(measured, process_creep):
        reason = "no more accurate than the creep of the process"
        return process_creep, False, f"the times of {table.source} give a creep of {measured}, {reason}"
    error = math.hypot(measured.error, _EXTRAPOLATION_FRACTION * process_creep.error)
    return replace(measured, error=error), True, ""


def _is_more_accurate(measured: CreepLaw, process_creep: CreepLaw) -> bool:
    """Return whether the measured creep is more accurate than the creep of the process.

    If the error of the process's creep is unknown (0), the measured creep must exceed its own error bar.
    """
    largest_error = process_creep.error or measured.per_decade / COVERAGE
    return measured.error < largest_error


def _check_times(table: MeasuredTable) -> None:
    """Raise InputError if a reading time is negative, is 0 under load, or decreases while the same weight hangs."""
    times = table.numbers["t"].tolist()
    weights = list(zip(table.texts["tip"], table.numbers["force"].tolist(), strict=True))  # the tip and its force [N]
    for row, (t, weight) in enumerate(zip(times, weights, strict=True)):
        place = place_of(table.source, table.lines[row], "t")
        _, force = weight
        is_loaded = force != 0.0
        if t < 0.0 or (is_loaded and t == 0.0):
            bound = "greater than 0" if is_loaded else "at least 0"
            raise validation_error(place, t, "s", bound, "give the time in seconds since that weight was hung")
        still_hangs = row > 0 and weight == weights[row - 1]
        if still_hangs and is_loaded and t < times[row - 1]:
            bound = f"at least the {times[row - 1]:g} s of the same weight in the line before"
            raise validation_error(place, t, "s", bound, "correct that time, or add a row without weight in between")


def _measure_creep(table: MeasuredTable, report: Report, common_time: float) -> CreepLaw | None:
    """Return the creep law from readings of one weight at several times; None if no weight has such readings.

    The exponent of the law is the mean over the dial and count columns of all tips, weighted by their inverse
    variances. `common_time` [s] is the time to which the weights are corrected. Raises InputError for a compliance that
    decreases with time, or that at least doubles in a decade.
    """
    exponents = list(_fit_exponents(table, report, common_time))
    if not exponents:
        return None
    exponent = _weighted_mean(exponents)
    n, error = exponent.value, exponent.error
    # A compliance cannot decrease. Chance may make the exponent negative, by up to two standard errors.
    if not (n + 2.0 * error >= 0.0 and n < _LARGEST_EXPONENT):
        field = f"{table.source}: growth of the deflection per decade of time"
        hint = "check t_s, and hang each weight alone, on a spring that has rested"
        raise validation_error(field, float(f"{10.0**n - 1.0:.3g}"), "", "at least 0 and less than 1", hint)
    # The growth per decade is c = 10^n - 1, so its error is dc/dn = ln 10 (1 + c) times the error of n.
    per_decade = 10.0 ** max(n, 0.0) - 1.0
    return CreepLaw(per_decade, math.log(10.0) * (1.0 + per_decade) * error)


def _weighted_mean(exponents: Sequence[Estimate]) -> Estimate:
    """Return the mean of the exponents [1] of several columns, weighted by their inverse variances, with its error.

    If the columns scatter by more than their errors explain, the Birge ratio increases the error of the mean. The Birge
    ratio is the root of chi squared per degree of freedom.
    """
    inverse_variances = np.array([exponent.error for exponent in exponents]) ** -2.0
    values = np.array([exponent.value for exponent in exponents])
    mean = float(np.average(values, weights=inverse_variances))
    degrees_of_freedom = max(len(exponents) - 1, 1)  # a single column has none, but its chi squared is 0
    reduced_chi_squared = float(inverse_variances @ (values - mean) ** 2) / degrees_of_freedom
    error = math.sqrt(max(reduced_chi_squared, 1.0) / float(inverse_variances.sum()))
    return Estimate(mean, error)


def _fit_exponents(table: MeasuredTable, report: Report, common_time: float) -> Iterator[Estimate]:
    """Yield the creep exponents [1] of each tip: one from the dial indicator, and one from the counts of its channel.

    A tip is skipped if it has too few rows, or if no weight was read at several times. Its channel is skipped if the
    table has no counts. `common_time` [s] is the time to which the weights are corrected. The error of each exponent is
    its standard deviation.
    """
    tips = np.array(table.texts["tip"])
    keys = count_keys(len(report.tips))
    for tip, key in zip(report.tips, keys, strict=True):
        rows = np.flatnonzero(tips == tip.name)
        forces = table.numbers["force"][rows]
        times = table.numbers["t"][rows]
        if len(rows) < _FEWEST_ROWS or not _has_several_times(forces, times):
            continue
        columns = [column for column in ("deflection", key) if column in table.numbers]
        for column in columns:
            readings = table.numbers[column][rows]
            resolution = table.last_digits[column][rows]
            if np.ptp(readings) > 0.0:  # a constant channel does not work; `calibrate_channels` rejects it
                yield _fit_exponent(forces, times / common_time, readings, ROUNDED * resolution)


def _has_several_times(forces: Floats, times: Floats) -> bool:
    """Return whether any weight was read at two times whose ratio exceeds `LEAST_RATIO`, so that it shows creep."""
    times_of_weights = [times[forces == force] for force in set(forces[forces != 0.0].tolist())]
    return any(float(read_at.max()) > LEAST_RATIO * float(read_at.min()) for read_at in times_of_weights)


def _fit_exponent(forces: Floats, times: Floats, readings: Floats, rounding: Floats) -> Estimate:
    """Fit the creep exponent n [1] to the readings of one tip in one column, by Gauss-Newton iteration.

    The model is

        d = d0 + C F t^n,

    with the `readings` d [mm or counts], the weights F [N] in `forces`, and the `times` t [1] relative to the common
    time. The zero d0 and the compliance C are fitted too. The variance of a reading is the scatter about the fit plus
    the square of `rounding`, the standard deviation of its rounding error. All arrays have the shape (rows,). Returns n
    with its standard deviation.
    """
    log_times = np.log(np.where(forces != 0.0, times, 1.0))  # without weight the time has no effect, and may be 0
    exponent = 0.0
    deviation = 0.0
    for _ in range(_ITERATIONS):
        # Linearised about the current n, d = d0 + C F t^n + (C dn) F t^n ln t. The third coefficient gives the step dn.
        corrected_forces = forces * np.exp(exponent * log_times)
        columns = np.column_stack([np.ones(len(forces)), corrected_forces, corrected_forces * log_times])
        inverse = np.linalg.pinv(columns)  # (3, rows): each row yields one coefficient from the readings
        zero, compliance, step_times_compliance = inverse @ readings
        residuals = readings - columns @ [zero, compliance, step_times_compliance]
        degrees_of_freedom = len(forces) - columns.shape[1]  # at least 1, because a tip has `_FEWEST_ROWS` rows
        variances = residuals @ residuals / degrees_of_freedom + rounding**2
        # The errors of the readings propagate to the third coefficient, C dn. Divided by C, it has the error of n.
        deviation = float(np.linalg.norm(inverse[2] * np.sqrt(variances)) / abs(compliance))
        # A plausible exponent is far below 1. The limits keep a bad step from making the powers of t overflow.
        exponent = float(np.clip(exponent + step_times_compliance / compliance, -1.0, 1.0))
    return Estimate(exponent, deviation)
