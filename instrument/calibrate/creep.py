"""The creep of a unit from weights that are read some time after they were hung, and the forces corrected to one time.

Springs that creep deflect by d = zero + C F (t / t0)^n under a weight F that has hung for t. So the readings lie on a
straight line against F (t / t0)^n, the force with the same deflection at t0. Readings of one weight at several times
determine n, from the dial and from the counts of each tip. The method is Gauss-Newton: d is fitted linearly by F (t /
t0)^n and its derivative with respect to n. All springs of a print share one n, the mean of all columns.
"""

import math
from collections.abc import Iterator
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
"""Smallest ratio of two times of one weight that determines creep."""
_ROUNDS = 4  # steps of Gauss-Newton; each squares the error of the exponent
_LARGEST_EXPONENT = math.log10(2.0)  # of a compliance that doubles in a decade
_FEWEST = 4  # minimum number of rows of a tip for a zero, a compliance and an exponent
_EXTRAPOLATED = 0.5
"""Fraction of the process's scatter in the error of a unit's own creep, which presses extrapolate to shorter times.

An assumption: the spread between prints is halved, because the slope against the logarithm of time is not constant.
"""


@dataclass(frozen=True, kw_only=True)
class Weighing:
    """The weights of a table, corrected for creep to one time after hanging, and the creep of the unit.

    At the common time `after_s` [s], each of the `forces` (rows,) [N] causes the deflection that was read in its row.
    `own` is True if the table determined the creep; otherwise it is the creep of the process.
    """

    forces: Floats = report_field("N", "weights as of one time", told=False)
    after_s: float = report_field("s", "time from the hanging of a weight to its reading", key="weighed_after_s")
    own: bool = report_field("", "whose creep it is", inline=lambda it: {"creep_of": "unit" if it.own else "process"})
    creep: CreepLaw = report_field(
        "1",
        "growth of the deflection in a decade of time, and its standard deviation",
        inline=lambda it: {"creep_per_decade": it.creep.per_decade, "creep_error": it.creep.error},
    )
    note: str = report_field("", "why the creep of the table was not taken", told=False, default="")


def correct_weights(table: MeasuredTable, report: Report, after_s: float | None) -> Weighing:
    """Return the weights of a table corrected for creep, and the creep of the unit.

    The time from hanging a weight to its reading is `after_s` [s] for all rows, or the column `t` of the table. Raises
    InputError for invalid times, for times given in both ways, and for a compliance that falls with time.
    """
    creep = report.creep
    forces = table.numbers["force"]
    if "t" not in table.numbers:
        common_time = WEIGHED_AFTER_S if after_s is None else after_s
        return Weighing(forces=forces, after_s=common_time, creep=creep, own=False)
    if after_s is not None:
        bound = "left out if a column t_s has the times"
        raise validation_error("--after", after_s, "s", bound, "give one of the two")
    _refuse_bad_times(table)
    is_loaded = forces != 0.0
    if not is_loaded.any():
        return Weighing(forces=forces, after_s=WEIGHED_AFTER_S, creep=creep, own=False)
    common_time = float(np.exp(np.log(table.numbers["t"][is_loaded]).mean()))  # geometric mean
    measured = None if report.design.process.is_metal else _measured_creep(table, report, common_time)
    note = ""
    if measured is not None:
        # The measured creep is only used if it is more accurate than the creep of the process. If the process has no
        # error, a measured creep is ignored that lies within its own error.
        if measured.error >= (creep.error or measured.per_decade / COVERAGE):
            advice = "no more accurate than the creep of the process"
            note = f"the times of {table.source} give a creep of {measured}, {advice}"
            measured = None
        else:
            creep = replace(measured, error=math.hypot(measured.error, _EXTRAPOLATED * creep.error))
    corrected = forces * (table.numbers["t"] / common_time) ** creep.exponent
    return Weighing(forces=corrected, after_s=common_time, creep=creep, own=measured is not None, note=note)


def _refuse_bad_times(table: MeasuredTable) -> None:
    """Raise InputError for a time that is not above 0 under a weight, and for one that falls under the same weight."""
    times = table.numbers["t"]
    forces = table.numbers["force"]
    for row, (t, force) in enumerate(zip(times.tolist(), forces.tolist(), strict=True)):
        place = place_of(table.source, table.lines[row], "t")
        if t < 0.0 or (force != 0.0 and t == 0.0):
            bound = "greater than 0" if force != 0.0 else "at least 0"
            raise validation_error(place, t, "s", bound, "write the seconds since that weight was hung")
        is_same_weight = row > 0 and force == forces[row - 1] and table.texts["tip"][row] == table.texts["tip"][row - 1]
        if is_same_weight and force != 0.0 and t < times[row - 1]:
            bound = f"at least the {times[row - 1]:g} s of the same weight in the line before"
            raise validation_error(place, t, "s", bound, "correct that time, or unload between two loads")


def _measured_creep(table: MeasuredTable, report: Report, common_time: float) -> CreepLaw | None:
    """Return the creep from readings of one weight at several times; None if no weight has them.

    It is the weighted mean of all columns. `common_time` [s] is the time to which the weights are corrected. Raises
    InputError for a compliance that falls with time, or doubles in a decade.
    """
    exponents = list(_fit_exponents(table, report, common_time))
    if not exponents:
        return None
    weights = np.array([exponent.error for exponent in exponents]) ** -2.0
    values = np.array([exponent.value for exponent in exponents])
    mean = float(np.average(values, weights=weights))
    # Columns that scatter by more than their errors increase the error of the mean (Birge ratio).
    scatter = float(weights @ (values - mean) ** 2) / max(len(exponents) - 1, 1)
    error = math.sqrt(max(scatter, 1.0) / float(weights.sum()))
    if not (mean + 2.0 * error >= 0.0 and mean < _LARGEST_EXPONENT):
        field = f"{table.source}: growth of the deflection in a decade of time"
        hint = "check t_s, and that each weight hung alone on a spring that had rested"
        raise validation_error(field, float(f"{10.0**mean - 1.0:.3g}"), "", "at least 0 and less than 1", hint)
    per_decade = 10.0 ** max(mean, 0.0) - 1.0
    return CreepLaw(per_decade, math.log(10.0) * (1.0 + per_decade) * error)


def _fit_exponents(table: MeasuredTable, report: Report, common_time: float) -> Iterator[Estimate]:
    """Yield the creep exponent [1] with its standard deviation, from the dial and the channel of each tip.

    Tips without readings of one weight at several times are skipped. `common_time` [s] is the time to which the weights
    are corrected.
    """
    tips = np.array(table.texts["tip"])
    keys = count_keys(len(report.tips))
    for tip, key in zip(report.tips, keys, strict=True):
        rows = np.flatnonzero(tips == tip.name)
        forces, times = table.numbers["force"][rows], table.numbers["t"][rows]
        if len(rows) < _FEWEST or not _has_several_times(forces, times):
            continue
        for column in ("deflection", key):
            if column in table.numbers:
                readings, resolution = table.numbers[column][rows], table.last_digits[column][rows]
                if np.ptp(readings) > 0.0:  # a dead channel is refused later
                    yield _fit_exponent(forces, times / common_time, readings, ROUNDED * resolution)


def _has_several_times(forces: Floats, times: Floats) -> bool:
    """Return whether one weight [N] was read at times [s] whose ratio determines creep."""
    times_of_weights = [times[forces == force] for force in set(forces[forces != 0.0].tolist())]
    return any(float(each.max()) > LEAST_RATIO * float(each.min()) for each in times_of_weights)


def _fit_exponent(forces: Floats, times: Floats, readings: Floats, rounding: Floats) -> Estimate:
    """Return the creep exponent n [1] of one column, with its standard deviation, by Gauss-Newton.

    The readings of dial or counts were taken under `forces` [N] at `times`, relative to the common time [1]. The error
    of each reading is the scatter about the law, and its `rounding` as a standard deviation. All have shape (rows,).
    """
    logs = np.log(np.where(forces != 0.0, times, 1.0))
    exponent = 0.0
    deviation = 0.0
    for _ in range(_ROUNDS):
        # The readings are linear in zero, compliance, and compliance times the change of n.
        grown = forces * np.exp(exponent * logs)
        columns = np.column_stack([np.ones(len(forces)), grown, grown * logs])
        inverse = np.linalg.pinv(columns)
        zero, compliance, slope = inverse @ readings
        residuals = readings - columns @ [zero, compliance, slope]
        scatter = residuals @ residuals / max(len(forces) - columns.shape[1], 1)
        deviation = float(np.linalg.norm(inverse[2] * np.sqrt(scatter + rounding**2)) / abs(compliance))
        exponent = float(np.clip(exponent + slope / compliance, -1.0, 1.0))
    return Estimate(exponent, deviation)
