"""The scale of another instrument: the firmness that it shows as a function of the modulus that a unit reads.

Whatever the skin, the law of flesh or the instrument, firmer fruit reads firmer. Two rising curves of the logarithms
are compared by leave-one-out cross-validation (M. Stone, J. R. Stat. Soc. B 36 (1974) 111). The simplest curve is taken
whose error is within one standard error of the smallest (L. Breiman et al., Classification and Regression Trees, 1984,
3.4.3).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

from instrument.press.contrast_press import AT_ONCE, press_reading
from instrument.press.fruit_reading import FruitReading
from instrument.press.fruit_scale import FruitScale
from instrument.press.measuring import MeasuringUnit
from instrument.press.signals import Sample, force_keys
from instrument.press.touches import cut_presses
from pipeline.storage.record_data import as_data
from pipeline.tables.decoding import place_of
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import FORCE, MODULUS, TIME, Quantity
from sensor.arrays import Floats
from sensor.quantity import report_field, validation_error
from sensor.theory.student import student

FEWEST_FRUIT = 6
PARAMETERS = 2  # fitted parameters that reduce the degrees of freedom of the half width: two of a power
_ROUND_OFF = 1e-9  # difference of logarithms due to round-off


@dataclass(frozen=True, kw_only=True)
class ScaleFit:
    """A scale, the number of fruit that it is fitted to, and its error by cross-validation.

    `left_out` is for each kind of curve the relative standard deviation of a fruit that is left out of the fit [1].
    """

    scale: FruitScale = report_field("", "the curve with its band", inline=lambda fit: as_data(fit.scale))
    fruit: int = report_field("1", "number of fruit that set the curve")
    left_out: Mapping[str, float] = report_field(
        "%",
        "error of a fruit that is left out, one standard deviation, by each curve",
        inline=lambda fit: {"left_out": {f"{curve}_percent": 100.0 * error for curve, error in fit.left_out.items()}},
    )


class _Points(NamedTuple):
    """Points of a curve, one for each fruit or press: logarithms of the modulus read, and of the firmness."""

    read: Floats
    firm: Floats

    def at(self, read: Floats) -> Floats:
        """Return the curve through the points at logarithms `read` of moduli, constant beyond its ends."""
        return np.interp(read, self.read, self.firm)


_Curve = Callable[[_Points, Floats], _Points]
"""A function that fits a curve to points, and returns the curve's points between two ends of ln E."""


def read_fruit_table(source: Path | str, tips: int, flags: ColumnFlags = NO_FLAGS) -> MeasuredTable:
    """Read a table of presses on fruit by a sensor with `tips` tips, with the firmness by another instrument.

    `flags` states columns and units that the header lacks. Raises InputError unless the table has one column of
    firmness, with numbers above 0.
    """
    keys = force_keys(tips)
    quantities = {
        "fruit": Quantity(units={}),
        "firmness": Quantity(units=FORCE, most=1e4),
        "E": Quantity(units=MODULUS, most=1e4),
        "t": Quantity(units=TIME),
    }
    quantities |= {key: Quantity(units=FORCE, most=1e3) for key in keys}
    example = ",".join(["fruit", "firmness_N", *(f"{key}_N" for key in keys)])
    table = numbers_of(source, flags.applied(quantities), [("fruit", *keys)], example)
    firmness_columns = {"firmness", "E"} & set(table.numbers)
    if len(firmness_columns) != 1:
        bound = "a header with one of firmness_N (a penetrometer) and E_MPa (a compression test)"
        raise validation_error(
            place_of(table.source, table.header), len(firmness_columns), "of them", bound, f"for instance {example}"
        )
    (name,) = firmness_columns
    for line, value in zip(table.lines, table.numbers[name].tolist(), strict=True):
        if not value > 0.0:
            raise validation_error(place_of(table.source, line, name), value, "", "greater than 0", "correct that line")
    return table


def scale_of_presses(table: MeasuredTable, sensor: MeasuringUnit) -> ScaleFit:
    """Return the scale of the instrument that measured the fruit of a table, from `read_fruit_table`.

    Raises InputError for too few fruit, for a press that determines no modulus, and if the readings do not predict the
    firmness.
    """
    moduli = _read_moduli(table, sensor)
    column, unit = ("firmness", "N") if "firmness" in table.numbers else ("E", "MPa")
    return fit_scale(table.source, table.texts["fruit"], moduli, table.numbers[column], unit)


def fit_scale(source: str, names: tuple[str, ...], moduli: Floats, firmness: Floats, unit: str) -> ScaleFit:
    """Fit the scale to the moduli read by presses (presses,) [MPa] and the firmness of their fruit [`unit`].

    `names` are the names of the presses' fruit, and `source` is the name of the table in messages. A later reading is a
    single press on a new fruit, so each press is compared with the curve of all other fruit. Raises InputError for too
    few fruit, and if the curve predicts the firmness no better than the mean of all fruit.
    """
    fruit = np.array(names)
    presses = _Points(np.log(moduli), np.log(firmness))
    groups = [_Points(*(values[fruit == name] for values in presses)) for name in dict.fromkeys(names)]  # by fruit
    if len(groups) < FEWEST_FRUIT:
        bound = f"at least {FEWEST_FRUIT}, from the softest to the firmest"
        raise validation_error(source, len(groups), "fruit", bound, "press more of them")
    means = _Points(*np.transpose([(group.read.mean(), group.firm.mean()) for group in groups]))
    ends = np.array([means.read.min(), means.read.max()])

    span = np.array([presses.read.min(), presses.read.max()])
    squares = {name: _squared_errors(curve, groups, means, span) for name, curve in _CURVES.items()}
    error_of_mean = math.sqrt(float(_squared_errors(_constant_curve, groups, means, span).mean()))
    errors = {name: float(each.mean()) for name, each in squares.items()}
    # The first, simplest curve whose error exceeds the smallest by at most one standard error.
    best = min(errors, key=errors.__getitem__)
    limit = errors[best] + float(squares[best].std(ddof=1)) / math.sqrt(len(groups))
    chosen = next(name for name in _CURVES if errors[name] <= limit)
    deviation = math.sqrt(errors[chosen])
    if not deviation < error_of_mean - _ROUND_OFF:
        percent = f"{100.0 * error_of_mean:.3g} %"
        bound = f"below the {percent} of the mean of all fruit: readings do not predict the firmness here"
        name = f"{source}: error of fruit left out"
        raise validation_error(name, 100.0 * deviation, "%", bound, "press fruit from softest to firmest")
    points = _CURVES[chosen](means, ends)
    half_width = math.expm1(student(len(groups) - PARAMETERS) * deviation)
    scale = FruitScale(
        unit=unit,
        curve=chosen,
        percent=100.0 * half_width,
        E_MPa=tuple(np.exp(points.read).tolist()),
        firmness=tuple(np.exp(points.firm).tolist()),
    )
    return ScaleFit(scale=scale, fruit=len(groups), left_out={name: math.sqrt(each) for name, each in errors.items()})


def _squared_errors(curve: _Curve, groups: Sequence[_Points], means: _Points, span: Floats) -> Floats:
    """Return for each fruit the mean square error [1] of its presses against the curve of all other fruit.

    `groups` are the presses of each fruit, and `means` (fruit,) their means. `curve` is fitted to the means, between
    the two ends of ln E in `span`.
    """
    squares = []
    for index, group in enumerate(groups):
        others = _Points(*(np.delete(values, index) for values in means))
        squares.append(np.mean((curve(others, span).at(group.read) - group.firm) ** 2))
    return np.array(squares)


def _read_moduli(table: MeasuredTable, sensor: MeasuringUnit) -> Floats:
    """Return the modulus [MPa] that the press of each row reads; the rows of one fruit are the samples of its press.

    Raises InputError for a design with relaxation, and for a press that determines no modulus.
    """
    if sensor.report.design.fruit.relaxation is not None:
        bound = "left out if presses of fruit are calibrated, because their table may have no times"
        raise validation_error("fruit.relaxation", None, "", bound, "calibrate the design without it")
    fruit = table.texts["fruit"]
    sensor.refuse_without_rise_level()
    readings = {}
    for name in dict.fromkeys(fruit):
        rows = [row for row, row_fruit in enumerate(fruit) if row_fruit == name]
        readings[name] = _read_deepest_press(table, rows, name, sensor)
    moduli = []
    for line, name in zip(table.lines, fruit, strict=True):
        reading = readings[name]
        if reading.E is None:
            bound = "a reading of a modulus"
            place = f"{place_of(table.source, line)}: fruit {name}"
            raise validation_error(place, ", ".join(reading.flags), "", bound, "press farther, or leave the fruit out")
        moduli.append(reading.E)
    return np.array(moduli)


def _read_deepest_press(table: MeasuredTable, rows: Sequence[int], name: str, sensor: MeasuringUnit) -> FruitReading:
    """Return the reading of the press with the largest total force in the `rows` of the fruit called `name`.

    It corrects creep for the duration of the press if the table has times. Raises InputError for times that do not
    rise, and for a sample that contradicts the others of its press.
    """
    keys = force_keys(len(sensor.report.tips))
    t = _times_of_rows(table, rows, name)
    samples = []
    for row, moment in zip(rows, t, strict=True):
        forces = sensor.forces_of_channels([table.numbers[key][row] for key in keys])
        samples.append(Sample(table.lines[row], moment, tuple(forces.tolist())))
    presses = list(cut_presses(sensor, samples, table.source, AT_ONCE.lag))
    for press in presses:
        if press.lines_left_out:
            place = f"{place_of(table.source, press.lines_left_out[0])}: fruit {name}"
            bound = "consistent with the other samples of its press"
            raise validation_error(place, "forces", "", bound, "correct that line, or leave it out")
    if not presses:
        return FruitReading(flags=("few_samples",))
    return press_reading(sensor, max(presses, key=lambda press: press.forces.sum(axis=1).max()))


def _times_of_rows(table: MeasuredTable, rows: Sequence[int], name: str) -> list[float]:
    """Return the times [s] of the `rows` of the fruit called `name`, nan if the table has no times.

    Raises InputError for times that do not rise.
    """
    if "t" not in table.numbers:
        return [math.nan] * len(rows)
    t = table.numbers["t"][rows]
    if (not_rising := np.flatnonzero(np.diff(t) <= 0.0)).size:
        row = int(not_rising[0]) + 1
        place = f"{place_of(table.source, table.lines[rows[row]], 't')}: fruit {name}"
        hint = "give each press a name of its own"
        raise validation_error(place, float(t[row]), "s", f"greater than {t[row - 1]:g} s", hint)
    return list(t.tolist())


def _constant_curve(fruit: _Points, ends: Floats) -> _Points:
    """Return a constant between two `ends`: the mean of the fruit."""
    return _Points(ends, np.full(2, fruit.firm.mean()))


def _power_curve(fruit: _Points, ends: Floats) -> _Points:
    """Return the least-squares line of the logarithms between two `ends`, constant if it would fall."""
    read = fruit.read - fruit.read.mean()
    slope = max(0.0, float(read @ fruit.firm) / max(float(read @ read), np.finfo(np.float64).tiny))
    return _Points(ends, fruit.firm.mean() + slope * (ends - fruit.read.mean()))


def _isotonic_curve(fruit: _Points, ends: Floats) -> _Points:
    """Return a rising curve between two `ends`, through the centres of the steps of an isotonic regression."""
    order = np.argsort(fruit.read)
    steps = isotonic_regression(fruit.firm[order])
    starts = steps.blocks[:-1]
    centres = _Points(np.add.reduceat(fruit.read[order], starts) / steps.weights, steps.x[starts])
    inside = (centres.read > ends[0]) & (centres.read < ends[1])
    at_ends = centres.at(ends)
    read = np.concatenate([ends[:1], centres.read[inside], ends[1:]])
    return _Points(read, np.concatenate([at_ends[:1], centres.firm[inside], at_ends[1:]]))


_CURVES: dict[str, _Curve] = {"power": _power_curve, "rising": _isotonic_curve}
"""The function that fits each kind of curve, simplest first."""
