"""Weights read some time after they were hung: the creep of a unit, and the forces corrected to one time.

Springs that creep deflect by d = zero + C F (t / t0)^n under a weight F that has hung for t. So the readings lie on a
straight line over F (t / t0)^n, the force with the same deflection at t0. Readings of one weight at several times
determine n, from the dial and from the counts of each tip. The method is Gauss-Newton on d over F (t / t0)^n and its
derivative with respect to n. All springs of a print share one n, the mean of all columns.
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
"""Least ratio of two times of one weight that determines creep."""
_ROUNDS = 4  # steps of Gauss-Newton; each squares the error of the exponent
_MOST = math.log10(2.0)  # exponent of a compliance that doubles in a decade
_FEWEST = 4  # rows of a tip for a zero, a compliance and an exponent
_UNSEEN = 0.5
"""Share of the process scatter that remains if a unit's own creep is extrapolated to shorter times than those weighed.

An assumption: the spread between prints is halved, because the slope over the logarithm of time is not constant.
"""


@dataclass(frozen=True, kw_only=True)
class Weighing:
    """The weights of a table corrected to readings `after_s` [s] after they were hung, and the creep of the unit.

    `forces` [N], (rows,), give the deflections of the rows at that common time. `own` is True if the table determined
    the creep; otherwise it is the creep of the process.
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


def weighing(table: MeasuredTable, report: Report, after_s: float | None) -> Weighing:
    """Return the weighing of a table, read `after_s` [s] after each weight was hung, or at its own times `t`.

    Raises InputError for invalid times, for times given in both ways, and for a compliance that falls with time.
    """
    creep = report.creep
    forces = table.numbers["force"]
    if "t" not in table.numbers:
        after = WEIGHED_AFTER_S if after_s is None else after_s
        return Weighing(forces=forces, after_s=after, creep=creep, own=False)
    if after_s is not None:
        bound = "left out if a column t_s has the times"
        raise validation_error("--after", after_s, "s", bound, "give one of the two")
    _refuse_bad_times(table)
    loaded = forces != 0.0
    if not loaded.any():
        return Weighing(forces=forces, after_s=WEIGHED_AFTER_S, creep=creep, own=False)
    after = float(np.exp(np.log(table.numbers["t"][loaded]).mean()))
    own = None if report.design.process.is_metal else _own_creep(table, report, after)
    note = ""
    if own is not None:
        # Without a creep of the process there is no spread to compare with; a creep within its own error is then
        # ignored.
        if own.error >= (creep.error or own.per_decade / COVERAGE):
            note = f"the times of {table.source} give a creep of {own}, no better known than the creep of the process"
            own = None
        else:
            creep = replace(own, error=math.hypot(own.error, _UNSEEN * creep.error))
    at_one_time = forces * (table.numbers["t"] / after) ** creep.exponent
    return Weighing(forces=at_one_time, after_s=after, creep=creep, own=own is not None, note=note)


def _refuse_bad_times(table: MeasuredTable) -> None:
    """Raise InputError for a time that is not above 0 under a weight, and for one that falls under the same weight."""
    times = table.numbers["t"]
    forces = table.numbers["force"]
    for row, (t, force) in enumerate(zip(times.tolist(), forces.tolist(), strict=True)):
        place = place_of(table.source, table.lines[row], "t")
        if t < 0.0 or (force != 0.0 and t == 0.0):
            bound = "greater than 0" if force != 0.0 else "at least 0"
            raise validation_error(place, t, "s", bound, "write the seconds since that weight was hung")
        goes_on = row > 0 and force == forces[row - 1] and table.texts["tip"][row] == table.texts["tip"][row - 1]
        if goes_on and force != 0.0 and t < times[row - 1]:
            bound = f"at least the {times[row - 1]:g} s of the same weight in the line before"
            raise validation_error(place, t, "s", bound, "correct that time, or unload between two loads")


def _own_creep(table: MeasuredTable, report: Report, after: float) -> CreepLaw | None:
    """Return the creep from rows of one weight at several times; None if no weight has them.

    Raises InputError for a compliance that falls with time, or doubles in a decade.
    """
    found = list(_exponents(table, report, after))
    if not found:
        return None
    weights = np.array([exponent.error for exponent in found]) ** -2.0
    values = np.array([exponent.value for exponent in found])
    mean = float(np.average(values, weights=weights))
    scatter = float(weights @ (values - mean) ** 2) / max(len(found) - 1, 1)
    error = math.sqrt(max(scatter, 1.0) / float(weights.sum()))
    if not (mean + 2.0 * error >= 0.0 and mean < _MOST):
        field = f"{table.source}: growth of the deflection in a decade of time"
        hint = "check t_s, and that each weight hung alone on a spring that had rested"
        raise validation_error(field, float(f"{10.0**mean - 1.0:.3g}"), "", "at least 0 and less than 1", hint)
    per_decade = 10.0 ** max(mean, 0.0) - 1.0
    return CreepLaw(per_decade, math.log(10.0) * (1.0 + per_decade) * error)


def _exponents(table: MeasuredTable, report: Report, after: float) -> Iterator[Estimate]:
    """Yield the creep exponent [1] from each column of each tip, with its standard deviation."""
    tips = np.array(table.texts["tip"])
    keys = count_keys(len(report.tips))
    for tip, key in zip(report.tips, keys, strict=True):
        rows = np.flatnonzero(tips == tip.name)
        forces, times = table.numbers["force"][rows], table.numbers["t"][rows]
        if len(rows) < _FEWEST or not _has_several_times(forces, times):
            continue
        for column in ("deflection", key):
            if column in table.numbers:
                shown, digits = table.numbers[column][rows], table.last_digits[column][rows]
                if np.ptp(shown) > 0.0:  # a dead channel is refused later
                    yield _exponent(forces, times / after, shown, ROUNDED * digits)


def _has_several_times(forces: Floats, times: Floats) -> bool:
    """Return whether one weight [N] was read at times [s] whose ratio determines creep."""
    weights = [times[forces == force] for force in set(forces[forces != 0.0].tolist())]
    return any(float(of_one.max()) > LEAST_RATIO * float(of_one.min()) for of_one in weights)


def _exponent(forces: Floats, since: Floats, shown: Floats, rounding: Floats) -> Estimate:
    """Return the exponent n of readings under forces [N], at times relative to the common one [1].

    The error of each reading is the scatter about the law and the standard deviation of its `rounding`.
    """
    logs = np.log(np.where(forces != 0.0, since, 1.0))
    exponent = 0.0
    deviation = 0.0
    for _ in range(_ROUNDS):
        grown = forces * np.exp(exponent * logs)
        columns = np.column_stack([np.ones(len(forces)), grown, grown * logs])
        inverse = np.linalg.pinv(columns)
        zero, compliance, slope = inverse @ shown
        left = shown - columns @ [zero, compliance, slope]
        scatter = left @ left / max(len(forces) - columns.shape[1], 1)
        deviation = float(np.linalg.norm(inverse[2] * np.sqrt(scatter + rounding**2)) / abs(compliance))
        exponent = float(np.clip(exponent + slope / compliance, -1.0, 1.0))
    return Estimate(exponent, deviation)
