"""Fit of a scale: the firmness shown by another instrument, as a function of the modulus that a unit reads.

Firmer fruit gives a higher reading, whatever the skin, the material law of the flesh or the instrument. So ln firmness
is fitted by an increasing function of ln E. This function is either a straight line, which represents a power law,
or an isotonic regression. Leave-one-out cross-validation compares the two (M. Stone, J. R. Stat. Soc. B 36 (1974)
111). The chosen curve is the simplest one whose error exceeds the smallest error by at most one standard error (L.
Breiman et al., Classification and Regression Trees, 1984, 3.4.3).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

from instrument.press.contrast_press import SIMULTANEOUS, press_reading
from instrument.press.fruit_reading import FruitReading
from instrument.press.fruit_scale import FruitScale
from instrument.press.measuring import MeasuringUnit
from instrument.press.signals import Sample, force_keys
from instrument.press.touches import PressSamples, split_presses
from pipeline.storage.record_data import as_data
from pipeline.tables.decoding import place_of
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import FORCE, MODULUS, TIME, Quantity
from sensor.arrays import Floats
from sensor.quantity import report_field, validation_error
from sensor.theory.student import student_quantile

FEWEST_FRUIT = 6  # minimum number of fruit for a scale, by judgement: enough for a curve and for its error
PARAMETERS = 2  # fitted parameters of a power law; they reduce the degrees of freedom of the half width
_ROUND_OFF = 1e-9  # upper limit of the difference between logarithms that round-off causes
# Larger values are probably in another unit.
_LARGEST_FIRMNESS = 1e4  # force of a penetrometer [N], or modulus of a compression test [MPa]
_LARGEST_TIP_FORCE_N = 1e3


@dataclass(frozen=True, kw_only=True)
class ScaleFit:
    """A scale, the number of fruit that it was fitted to, and its cross-validation error.

    For each kind of curve, `left_out` holds the relative standard deviation [1] of the firmness that is predicted for
    fruit left out of the fit.
    """

    scale: FruitScale = report_field("", "the curve with its error band", inline=lambda fit: as_data(fit.scale))
    fruit: int = report_field("1", "number of fruit to which the curve is fitted")
    left_out: Mapping[str, float] = report_field(
        "%",
        "for each curve, the cross-validation error (one standard deviation) for fruit left out of the fit",
        inline=lambda fit: {"left_out": {f"{curve}_percent": 100.0 * error for curve, error in fit.left_out.items()}},
    )


class _Points(NamedTuple):
    """Logarithms of the modulus read and of the firmness, one pair for each fruit, press or point of a curve."""

    ln_E: Floats
    ln_firmness: Floats

    def at(self, ln_E: Floats) -> Floats:
        """Interpolate ln firmness linearly at `ln_E`; beyond the first and last point it is constant."""
        return np.interp(ln_E, self.ln_E, self.ln_firmness)


_Curve = Callable[[_Points, Floats], _Points]
"""A function that fits a curve to points.

The second argument holds the two values of ln E at the ends of the curve. The function returns the points that define
the curve.
"""


def read_fruit_table(source: Path | str, tips: int, flags: ColumnFlags = NO_FLAGS) -> MeasuredTable:
    """Read a table of presses on fruit by a sensor with `tips` tips, and of the fruit's firmness by another instrument.

    Each row holds the forces of the tips at one moment of a press. The firmness is either a force, from a penetrometer,
    or a modulus, from a compression test. `flags` specifies columns and units that the header lacks. Raises InputError
    unless the table has exactly one column of firmness, and all values in it are positive.
    """
    keys = force_keys(tips)
    quantities = {
        "fruit": Quantity(units={}),
        "firmness": Quantity(units=FORCE, most=_LARGEST_FIRMNESS),
        "E": Quantity(units=MODULUS, most=_LARGEST_FIRMNESS),
        "t": Quantity(units=TIME),
    }
    quantities |= {key: Quantity(units=FORCE, most=_LARGEST_TIP_FORCE_N) for key in keys}
    example = ",".join(["fruit", "firmness_N", *(f"{key}_N" for key in keys)])
    table = numbers_of(source, flags.applied(quantities), [("fruit", *keys)], example)
    firmness_columns = {"firmness", "E"} & set(table.numbers)
    if len(firmness_columns) != 1:
        place = place_of(table.source, table.header)
        bound = "exactly one, firmness_N (a penetrometer) or E_MPa (a compression test)"
        raise validation_error(place, len(firmness_columns), "firmness columns", bound, f"for instance {example}")
    (column,) = firmness_columns  # the only one
    for line, firmness in zip(table.lines, table.numbers[column].tolist(), strict=True):
        if not firmness > 0.0:  # its logarithm is fitted
            place = place_of(table.source, line, column)
            raise validation_error(place, firmness, "", "greater than 0", "correct that line")
    return table


def scale_of_presses(table: MeasuredTable, sensor: MeasuringUnit) -> ScaleFit:
    """Fit the scale of the other instrument to a table of presses on fruit, which `read_fruit_table` returns.

    Raises InputError for too few fruit, if the modulus cannot be determined from a press, and if the readings do not
    predict the firmness.
    """
    moduli = _read_moduli(table, sensor)
    column, unit = ("firmness", "N") if "firmness" in table.numbers else ("E", "MPa")
    return fit_scale(table.source, table.texts["fruit"], moduli, table.numbers[column], unit)


def fit_scale(source: str, names: tuple[str, ...], moduli: Floats, firmness: Floats, unit: str) -> ScaleFit:
    """Fit the scale of another instrument to the moduli that a unit read in presses, and choose the kind of its curve.

    `moduli` [MPa] are the readings of the unit, and `firmness` [`unit`] are the readings of the other instrument on the
    same fruit, both of shape (presses,). `names` are the names of the fruit, one for each press, and `source` is the
    name of the table in messages. Each curve is fitted to the means of the fruit. The error of the scale is the error
    for a single press on a fruit outside the fit, as in later use.

    Raises InputError for too few fruit, and if the curve predicts the firmness no better than the mean of all fruit.
    """
    presses = _Points(np.log(moduli), np.log(firmness))
    groups = _group_by_fruit(presses, names)
    if len(groups) < FEWEST_FRUIT:
        bound = f"at least {FEWEST_FRUIT}, from the softest to the firmest"
        raise validation_error(source, len(groups), "fruit", bound, "press more fruit")
    means = _Points(*np.transpose([(group.ln_E.mean(), group.ln_firmness.mean()) for group in groups]))

    # In the cross-validation, the curves span all presses, not just the means of the fruit in the fit.
    span = np.array([presses.ln_E.min(), presses.ln_E.max()])
    squared_errors = {name: _leave_one_out_errors(curve, groups, means, span) for name, curve in _CURVES.items()}
    deviations = {name: math.sqrt(float(errors.mean())) for name, errors in squared_errors.items()}
    chosen_curve = _simplest_good_curve(squared_errors)
    error_of_mean = math.sqrt(float(_leave_one_out_errors(_constant_curve, groups, means, span).mean()))
    _check_prediction(source, deviations[chosen_curve], error_of_mean)
    scale = _scale_of_curve(chosen_curve, means, deviations[chosen_curve], unit)
    return ScaleFit(scale=scale, fruit=len(groups), left_out=deviations)


def _scale_of_curve(name: str, means: _Points, deviation: float, unit: str) -> FruitScale:
    """Fit the curve called `name` to the means of all fruit, and return it as a scale with its error band.

    `deviation` [1] is the standard deviation of the ln firmness that the curve predicts for fruit left out of the fit.
    `unit` is the unit of the firmness.
    """
    ends = np.array([means.ln_E.min(), means.ln_E.max()])
    points = _CURVES[name](means, ends)
    # A half width d of ln firmness means that the firmness is larger or smaller by the factor exp(d).
    half_width = math.expm1(student_quantile(len(means.ln_E) - PARAMETERS) * deviation)
    return FruitScale(
        unit=unit,
        curve=name,
        percent=100.0 * half_width,
        E_MPa=tuple(np.exp(points.ln_E).tolist()),
        firmness=tuple(np.exp(points.ln_firmness).tolist()),
    )


def _group_by_fruit(presses: _Points, names: Sequence[str]) -> list[_Points]:
    """Return the presses of each fruit, in the order in which the fruit first appear.

    `names` are the names of the fruit, one for each press.
    """
    fruit_of_press = np.array(names)
    groups = []
    for name in dict.fromkeys(names):  # each name once
        is_of_fruit = fruit_of_press == name
        groups.append(_Points(presses.ln_E[is_of_fruit], presses.ln_firmness[is_of_fruit]))
    return groups


def _check_prediction(source: str, deviation: float, error_of_mean: float) -> None:
    """Raise InputError if a curve predicts the firmness no better than the mean of all fruit does.

    The curve and the mean predict the ln firmness of fruit left out of the fit, with the standard deviations
    `deviation` [1] and `error_of_mean` [1]. `source` is the name of the table.
    """
    if not deviation < error_of_mean - _ROUND_OFF:
        percent = f"{100.0 * error_of_mean:.3g} %"
        bound = f"below {percent}, the error of the mean of all fruit: here the readings do not predict the firmness"
        name = f"{source}: error of the firmness of fruit left out of the fit"
        raise validation_error(name, 100.0 * deviation, "%", bound, "press fruit from the softest to the firmest")


def _simplest_good_curve(squared_errors: Mapping[str, Floats]) -> str:
    """Return the name of the simplest curve whose mean square error exceeds the smallest by at most one standard error.

    `squared_errors` holds the square error (fruit,) [1] of each curve, the simplest curve first.
    """
    variances = {name: float(errors.mean()) for name, errors in squared_errors.items()}
    best = min(variances, key=variances.__getitem__)
    standard_error = float(squared_errors[best].std(ddof=1)) / math.sqrt(len(squared_errors[best]))
    limit = variances[best] + standard_error
    return next(name for name, variance in variances.items() if variance <= limit)


def _leave_one_out_errors(fit_curve: _Curve, groups: Sequence[_Points], means: _Points, span: Floats) -> Floats:
    """Return the mean square error of ln firmness [1] of each fruit if it is predicted from all other fruit.

    `groups` holds the presses of each fruit, and `means` the mean of each group. For each fruit, `fit_curve` fits a
    curve between the two values of ln E in `span` to the means of the other fruit. The squared errors of this curve are
    averaged over the presses of the fruit. The result has the shape (fruit,).
    """
    mean_squares = []
    for index, group in enumerate(groups):
        others = _Points(np.delete(means.ln_E, index), np.delete(means.ln_firmness, index))
        predicted = fit_curve(others, span).at(group.ln_E)
        mean_squares.append(np.mean((predicted - group.ln_firmness) ** 2))
    return np.array(mean_squares)


def _read_moduli(table: MeasuredTable, sensor: MeasuringUnit) -> Floats:
    """Return the modulus [MPa] of the fruit in each row, read from the press on this fruit, shape (rows,).

    The rows of one fruit are the samples of its press, so they all get the same modulus. Raises InputError for a design
    with relaxation, and if the modulus cannot be determined from a press.
    """
    if sensor.report.design.fruit.relaxation is not None:
        # A reading of flesh that relaxes depends on the time of each sample.
        bound = "left out if presses of fruit are calibrated, because their table may have no times"
        raise validation_error("fruit.relaxation", None, "", bound, "calibrate the design without it")
    fruit = table.texts["fruit"]
    sensor.refuse_without_rise_level()  # raises InputError if the report lacks level readings, which a press needs
    readings = {}
    for name in dict.fromkeys(fruit):  # each name once
        rows = [row for row, row_fruit in enumerate(fruit) if row_fruit == name]
        readings[name] = _read_deepest_press(table, rows, name, sensor)
    moduli = []
    for line, name in zip(table.lines, fruit, strict=True):
        reading = readings[name]
        if reading.E is None:
            bound = "a reading of a modulus"
            place = f"{place_of(table.source, line)}: fruit {name}"
            raise validation_error(place, ", ".join(reading.flags), "", bound, "press farther, or leave out the fruit")
        moduli.append(reading.E)
    return np.array(moduli)


def _read_deepest_press(table: MeasuredTable, rows: Sequence[int], name: str, sensor: MeasuringUnit) -> FruitReading:
    """Read the press with the largest total force in the `rows` of the fruit called `name`.

    If the table has times, the creep of the springs is corrected for the duration of the press. If the rows contain no
    press, the reading has no modulus and only the flag "few_samples". Raises InputError for times that do not increase,
    and for a sample that is inconsistent with the other samples of its press.
    """
    keys = force_keys(len(sensor.report.tips))
    times = _times_of_rows(table, rows, name)
    samples = []  # one for each row
    for row, t in zip(rows, times, strict=True):
        forces = sensor.forces_of_channels([table.numbers[key][row] for key in keys])
        samples.append(Sample(table.lines[row], t, tuple(forces.tolist())))
    # A row holds the forces of all tips at the same time, so a bad conversion affects only one sample.
    presses = list(split_presses(sensor, samples, table.source, SIMULTANEOUS.lag))
    _check_consistency(presses, table.source, name)
    if not presses:
        return FruitReading(flags=("few_samples",))
    deepest = max(presses, key=lambda press: press.forces.sum(axis=1).max())  # forces (samples, tips)
    return press_reading(sensor, deepest)


def _check_consistency(presses: Sequence[PressSamples], source: str, name: str) -> None:
    """Raise InputError for a sample of the fruit called `name` that is inconsistent with the others of its press.

    `source` is the name of the table. Such a sample was left out when the samples were split into `presses`.
    """
    for press in presses:
        if press.lines_left_out:
            place = f"{place_of(source, press.lines_left_out[0])}: fruit {name}"
            bound = "consistent with the other samples of its press"
            raise validation_error(place, "forces", "", bound, "correct that line, or leave it out")


def _times_of_rows(table: MeasuredTable, rows: Sequence[int], name: str) -> list[float]:
    """Return the times [s] in the `rows` of the fruit called `name`, or NaN for each row if the table has no times.

    Raises InputError for times that do not increase.
    """
    if "t" not in table.numbers:
        return [math.nan] * len(rows)
    t = table.numbers["t"][rows]
    not_rising = np.flatnonzero(np.diff(t) <= 0.0)  # index of each sample whose successor is not later
    if not_rising.size:
        previous = int(not_rising[0])
        faulty = previous + 1
        place = f"{place_of(table.source, table.lines[rows[faulty]], 't')}: fruit {name}"
        hint = "give each press its own name in the column fruit"
        raise validation_error(place, float(t[faulty]), "s", f"greater than {t[previous]:g} s", hint)
    return list(t.tolist())


def _constant_curve(fruit: _Points, ends: Floats) -> _Points:
    """Return the mean ln firmness of the fruit as a constant curve between the two values of ln E in `ends`."""
    return _Points(ends, np.full(2, fruit.ln_firmness.mean()))


def _power_curve(fruit: _Points, ends: Floats) -> _Points:
    """Return the least-squares line of ln firmness against ln E, with a slope of at least zero.

    `ends` holds the two values of ln E at the ends of the line.
    """
    centred = fruit.ln_E - fruit.ln_E.mean()
    # The sum of squares is 0 if all fruit have the same modulus. The tiny number then prevents a division by zero.
    sum_of_squares = max(float(centred @ centred), np.finfo(np.float64).tiny)
    slope = max(0.0, float(centred @ fruit.ln_firmness) / sum_of_squares)
    return _Points(ends, fruit.ln_firmness.mean() + slope * (ends - fruit.ln_E.mean()))


def _isotonic_curve(fruit: _Points, ends: Floats) -> _Points:
    """Return a nondecreasing curve of ln firmness against ln E, from an isotonic regression on the means of the fruit.

    The regression is a step function. The curve connects the centres of its steps, so that it is continuous. `ends`
    holds the two values of ln E at the ends of the curve.
    """
    order = np.argsort(fruit.ln_E)
    steps = isotonic_regression(fruit.ln_firmness[order])
    starts = steps.blocks[:-1]  # index of the first fruit of each step; the last entry is the number of fruit
    # The centre of a step is the mean ln E of its fruit. `weights` are the numbers of fruit in the steps.
    centres = _Points(np.add.reduceat(fruit.ln_E[order], starts) / steps.weights, steps.x[starts])
    inside = (centres.ln_E > ends[0]) & (centres.ln_E < ends[1])  # whether a centre lies between the two ends
    firmness_at_ends = centres.at(ends)
    ln_E = np.concatenate([ends[:1], centres.ln_E[inside], ends[1:]])
    ln_firmness = np.concatenate([firmness_at_ends[:1], centres.ln_firmness[inside], firmness_at_ends[1:]])
    return _Points(ln_E, ln_firmness)


_CURVES: dict[str, _Curve] = {"power": _power_curve, "rising": _isotonic_curve}
"""The function that fits each kind of curve, the simplest curve first."""
