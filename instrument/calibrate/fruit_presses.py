"""The scale of another instrument, from presses of fruit that it measured: its firmness over the modulus read.

Whatever skin, law of flesh or instrument, firmer fruit reads firmer. Two rising curves over the logarithms of both are
tried and judged by leaving out each fruit in turn (M. Stone, J. R. Stat. Soc. B 36 (1974) 111). The simplest curve is
taken whose error is within one standard error of the least (L. Breiman et al., Classification and Regression Trees,
1984, 3.4.3).
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
from instrument.press.touches import presses_of
from pipeline.storage.told import as_data
from pipeline.tables.decoding import place_of
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import FORCE, MODULUS, TIME, Quantity
from sensor.arrays import Floats
from sensor.quantity import report_field, validation_error
from sensor.theory.student import student

FEWEST_FRUIT = 6
PARAMETERS = 2  # fitted parameters that reduce the degrees of freedom of the band: two of a power
_ROUND_OFF = 1e-9  # difference of logarithms that is round-off


@dataclass(frozen=True, kw_only=True)
class ScaleFit:
    """A scale, the number of fruits it is fitted to, and the standard deviation of left-out fruit by each curve [1]."""

    scale: FruitScale = report_field("", "the curve with its band", inline=lambda fit: as_data(fit.scale))
    fruit: int = report_field("1", "number of fruit that set the curve")
    left_out: Mapping[str, float] = report_field(
        "%",
        "error of a fruit that is left out, one standard deviation, by each curve",
        inline=lambda fit: {"left_out": {f"{curve}_percent": 100.0 * error for curve, error in fit.left_out.items()}},
    )


class _Points(NamedTuple):
    """Points of a curve, or fruits: logarithms of the modulus read and of the firmness."""

    read: Floats
    firm: Floats

    def at(self, read: Floats) -> Floats:
        """Return the curve through the points at logarithms of E, constant beyond its ends."""
        return np.interp(read, self.read, self.firm)


_Curve = Callable[[_Points, Floats], _Points]
"""A function from fruits and the ends of their moduli to the points of a curve."""


def measured_fruit(source: Path | str, tips: int, flags: ColumnFlags = NO_FLAGS) -> MeasuredTable:
    """Return presses of fruit by a sensor with a number of tips, and the firmness by another instrument.

    Raises InputError for an invalid table.
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
    measured = {"firmness", "E"} & set(table.numbers)
    if len(measured) != 1:
        bound = "a header with one of firmness_N (a penetrometer) and E_MPa (a compression test)"
        raise validation_error(
            place_of(table.source, table.header), len(measured), "of them", bound, f"for instance {example}"
        )
    (name,) = measured
    for line, value in zip(table.lines, table.numbers[name].tolist(), strict=True):
        if not value > 0.0:
            raise validation_error(place_of(table.source, line, name), value, "", "greater than 0", "correct that line")
    return table


def scale_of_presses(table: MeasuredTable, sensor: MeasuringUnit) -> ScaleFit:
    """Return the scale of the instrument that measured the fruit of a table.

    Raises InputError for too few fruits, for forces without a modulus, and if readings do not predict the firmness.
    """
    read = _moduli_read(table, sensor)
    column, unit = ("firmness", "N") if "firmness" in table.numbers else ("E", "MPa")
    return fitted_scale(table.source, table.texts["fruit"], read, table.numbers[column], unit)


def fitted_scale(source: str, names: tuple[str, ...], read: Floats, firmness: Floats, unit: str) -> ScaleFit:
    """Return the scale of fruits from presses that read as moduli [MPa], (presses,), and their firmness.

    `names` are the fruits of the presses. A later reading is one press on a new fruit, so each press is judged by the
    curve of all other fruits. Raises InputError.
    """
    fruit = np.array(names)
    presses = _Points(np.log(read), np.log(firmness))
    of_fruit = [_Points(*(values[fruit == name] for values in presses)) for name in dict.fromkeys(names)]
    if len(of_fruit) < FEWEST_FRUIT:
        bound = f"at least {FEWEST_FRUIT}, from the softest to the firmest"
        raise validation_error(source, len(of_fruit), "fruit", bound, "press more of them")
    means = _Points(*np.transpose([(each.read.mean(), each.firm.mean()) for each in of_fruit]))
    ends = np.array([means.read.min(), means.read.max()])

    span = np.array([presses.read.min(), presses.read.max()])
    squares = {name: _squares_left_out(curve, of_fruit, means, span) for name, curve in _CURVES.items()}
    by_mean = math.sqrt(float(_squares_left_out(_mean, of_fruit, means, span).mean()))
    errors = {name: float(each.mean()) for name, each in squares.items()}
    # The first, simplest curve whose error exceeds the least by at most one standard error.
    best = min(errors, key=errors.__getitem__)
    allowed = errors[best] + float(squares[best].std(ddof=1)) / math.sqrt(len(of_fruit))
    chosen = next(name for name in _CURVES if errors[name] <= allowed)
    deviation = math.sqrt(errors[chosen])
    if not deviation < by_mean - _ROUND_OFF:
        bound = f"below the {100.0 * by_mean:.3g} % of the mean of all fruit: readings do not predict the firmness here"
        name = f"{source}: error of fruit left out"
        raise validation_error(name, 100.0 * deviation, "%", bound, "press fruit from softest to firmest")
    points = _CURVES[chosen](means, ends)
    half_width = math.expm1(student(len(of_fruit) - PARAMETERS) * deviation)
    scale = FruitScale(
        unit=unit,
        curve=chosen,
        percent=100.0 * half_width,
        E_MPa=tuple(np.exp(points.read).tolist()),
        firmness=tuple(np.exp(points.firm).tolist()),
    )
    return ScaleFit(scale=scale, fruit=len(of_fruit), left_out={name: math.sqrt(each) for name, each in errors.items()})


def _squares_left_out(curve: _Curve, of_fruit: Sequence[_Points], means: _Points, span: Floats) -> Floats:
    """Return the mean square error [1] of each fruit against the curve of all others, (fruit,)."""
    of_each = []
    for index, left_out in enumerate(of_fruit):
        others = _Points(*(np.delete(values, index) for values in means))
        of_each.append(np.mean((curve(others, span).at(left_out.read) - left_out.firm) ** 2))
    return np.array(of_each)


def _moduli_read(table: MeasuredTable, sensor: MeasuringUnit) -> Floats:
    """Return the modulus [MPa] of each row: the reading of its fruit, whose rows are the samples of one press."""
    if sensor.report.design.fruit.relaxation is not None:
        bound = "left out where presses of fruit are calibrated: they may have no times"
        raise validation_error("fruit.relaxation", None, "", bound, "calibrate the design without it")
    fruit = table.texts["fruit"]
    sensor.refuse_without_rise_level()
    readings = {}
    for name in dict.fromkeys(fruit):
        rows = [row for row, each in enumerate(fruit) if each == name]
        readings[name] = _reading_of(table, rows, name, sensor)
    moduli = []
    for line, name in zip(table.lines, fruit, strict=True):
        reading = readings[name]
        if reading.E is None:
            bound = "a reading of a modulus"
            place = f"{place_of(table.source, line)}: fruit {name}"
            raise validation_error(place, ", ".join(reading.flags), "", bound, "press farther, or leave the fruit out")
        moduli.append(reading.E)
    return np.array(moduli)


def _reading_of(table: MeasuredTable, rows: Sequence[int], name: str, sensor: MeasuringUnit) -> FruitReading:
    """Return the reading of the deepest press in the rows of a fruit, with its duration if the table has times."""
    keys = force_keys(len(sensor.report.tips))
    t = _times(table, rows, name)
    samples = []
    for row, moment in zip(rows, t, strict=True):
        forces = sensor.forces_of_channels([table.numbers[key][row] for key in keys])
        samples.append(Sample(table.lines[row], moment, tuple(forces.tolist())))
    presses = list(presses_of(sensor, samples, table.source, AT_ONCE.lag))
    for press in presses:
        if press.lines_left_out:
            place = f"{place_of(table.source, press.lines_left_out[0])}: fruit {name}"
            bound = "as the other samples of its press"
            raise validation_error(place, "forces", "", bound, "correct that line, or leave it out")
    if not presses:
        return FruitReading(flags=("few_samples",))
    return press_reading(sensor, max(presses, key=lambda press: press.forces.sum(axis=1).max()))


def _times(table: MeasuredTable, rows: Sequence[int], name: str) -> list[float]:
    """Return the times of some rows [s], nan if the table has none; raises InputError for times that do not rise."""
    if "t" not in table.numbers:
        return [math.nan] * len(rows)
    t = table.numbers["t"][rows]
    if (stays := np.flatnonzero(np.diff(t) <= 0.0)).size:
        row = int(stays[0]) + 1
        place = f"{place_of(table.source, table.lines[rows[row]], 't')}: fruit {name}"
        hint = "give each press a name of its own"
        raise validation_error(place, float(t[row]), "s", f"greater than {t[row - 1]:g} s", hint)
    return list(t.tolist())


def _mean(fruit: _Points, ends: Floats) -> _Points:
    """Return a constant through the mean of the fruits, from end to end."""
    return _Points(ends, np.full(2, fruit.firm.mean()))


def _power(fruit: _Points, ends: Floats) -> _Points:
    """Return the least-squares line from end to end, constant if it would fall."""
    read = fruit.read - fruit.read.mean()
    slope = max(0.0, float(read @ fruit.firm) / max(float(read @ read), np.finfo(np.float64).tiny))
    return _Points(ends, fruit.firm.mean() + slope * (ends - fruit.read.mean()))


def _rising(fruit: _Points, ends: Floats) -> _Points:
    """Return the curve from end to end through the centres of the steps of an isotonic regression."""
    order = np.argsort(fruit.read)
    steps = isotonic_regression(fruit.firm[order])
    starts = steps.blocks[:-1]
    centres = _Points(np.add.reduceat(fruit.read[order], starts) / steps.weights, steps.x[starts])
    inside = (centres.read > ends[0]) & (centres.read < ends[1])
    at_ends = centres.at(ends)
    read = np.concatenate([ends[:1], centres.read[inside], ends[1:]])
    return _Points(read, np.concatenate([at_ends[:1], centres.firm[inside], at_ends[1:]]))


_CURVES: dict[str, _Curve] = {"power": _power, "rising": _rising}
