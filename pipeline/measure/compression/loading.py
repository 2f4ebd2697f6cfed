"""The loading of a compression test: its rows up to the failure of the flesh. What cannot be one is refused."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import InputError, validation_error
from pipeline.measure.compression.specimens import Specimen
from pipeline.measure.measured_table import place_of

Floats = NDArray[np.float64]

LEAST_ROWS = 12
_JITTER = 0.02  # of the travel: a machine's reading steps back by less
_BELOW = 0.1  # of the forces' range: a force so far below the first ones is none of a compression
_NOISE_BELOW = 6.0  # standard deviations of noise
_CONCAVE = 0.75  # later slope of a load over the earlier one: a convex fruit has more than 1
_LOADS = (0.1, 0.3, 0.6)  # of the largest force, between which the slopes are taken
_MOST_POINTS = 1200  # more are averaged in groups: a fit takes no longer, and loses nothing
_MOVING_MEAN = 0.02  # of the points
_NOISE_FALLEN = 5.0  # standard errors by which a force has fallen
_FALL = 0.03  # of the largest force: a smaller fall is no failure
_RISEN = 0.1  # of the range of forces: a fall before is one of the zero line
_NORMAL = 1.4826  # standard deviation over median absolute deviation
_QUIET = 0.25  # of the range of forces: the zero line lies below


@dataclass(frozen=True, kw_only=True)
class Loading:
    """A curve up to failure, or to the end of the load: travel [mm] and force [N], shape (points,).

    `zero` [N] is about where the load cell begins, `noise` [N] its standard deviation, `failure` the travel at which
    the force fell [mm], None where it did not.
    """

    travel: Floats
    force: Floats
    zero: float
    noise: float
    failure: float | None


def loading(specimen: Specimen, *, compression_negative: bool = False) -> Loading:
    """Return the loading of a specimen; with `compression_negative` the signs of columns that fall are turned.

    Raises InputError for too few rows, time or travel that runs backwards, a force below the zero line, one that never
    rises, and one that rises ever less.
    """
    travel, force = specimen.travel, specimen.force
    _refuse_few_rows(specimen, len(travel))
    _refuse_backwards_time(specimen)
    if compression_negative:
        travel = _turned(travel)
        force = _turned(force)
    _refuse_falling(specimen, travel, "travel", "mm")
    _refuse_falling(specimen, force, "force", "N")
    _refuse_backwards_travel(specimen, travel, force)
    _refuse_low_force(specimen, force)
    end = int(np.argmax(travel)) + 1
    _refuse_few_rows(specimen, end)
    curve = _up_to_failure(_averaged(travel[:end]), _averaged(force[:end]))
    _refuse_concave(specimen, curve)
    return curve


def name_of(specimen: Specimen) -> str:
    """Return how an error names a specimen."""
    return f"{specimen.file}, specimen {specimen.name!r}"


def _cell(specimen: Specimen, row: int, quantity: str) -> str:
    return place_of(specimen.file, specimen.lines[row], specimen.labels[quantity])


def _refuse_few_rows(specimen: Specimen, rows: int) -> None:
    if rows < LEAST_ROWS:
        hint = "export every point of the test"
        raise validation_error(name_of(specimen), rows, "rows of load", f"at least {LEAST_ROWS}", hint)


def _refuse_backwards_time(specimen: Specimen) -> None:
    time = specimen.time
    if time is None:
        return
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        row = int(back[0]) + 1
        bound = f"at least that of the row before, {time[row - 1]:g} s"
        place = _cell(specimen, row, "time")
        raise validation_error(place, float(time[row]), "s", bound, "put the rows in order of time")


def _turned(values: Floats) -> Floats:
    moved = values - np.median(values[:3])
    return -values if abs(moved.min()) > abs(moved.max()) else values


def _refuse_falling(specimen: Specimen, values: Floats, quantity: str, unit: str) -> None:
    moved = values - np.median(values[:3])
    row = int(np.argmin(moved))
    value = float(values[row])
    if moved[row] < 0.0 and -moved[row] > moved.max():
        hint = "with --compression-negative its sign is turned"
        raise validation_error(_cell(specimen, row, quantity), value, unit, "rising in compression", hint)
    if value == float(values.max()):
        bound = "one that rises, and all are alike"
        raise validation_error(_cell(specimen, 0, quantity), value, unit, bound, "export the whole test")


def _refuse_backwards_travel(specimen: Specimen, travel: Floats, force: Floats) -> None:
    rising = travel[: int(np.argmax(travel)) + 1]
    behind = np.maximum.accumulate(rising) - rising
    back = np.flatnonzero(behind > _JITTER * float(travel.max() - travel.min()))
    if not back.size:
        return
    if bool((np.diff(force) > 0.0).all()):
        raise _swapped(specimen)
    row = int(back[0])
    bound = "rising up to its largest value: one loading for each table"
    hint = "cut the table where the plate turns back, or check that the columns are not swapped"
    raise validation_error(_cell(specimen, row, "travel"), float(travel[row]), "mm", bound, hint)


def _refuse_low_force(specimen: Specimen, force: Floats) -> None:
    first = max(3, min(20, round(0.05 * len(force))))  # rows that show where the force begins
    zero = float(np.median(force[:first]))
    limit = max(_BELOW * float(force.max() - zero), _NOISE_BELOW * noise_of(force))
    row = int(np.argmin(force))
    if force[row] < zero - limit:
        bound = f"not below where the force begins, {zero:.3g} N"
        place = _cell(specimen, row, "force")
        raise validation_error(place, float(force[row]), "N", bound, "correct it, or leave the row out")


def _refuse_concave(specimen: Specimen, curve: Loading) -> None:
    """Raise InputError where a force rises ever less with the travel, as in a table whose columns are swapped."""
    smooth, middle = _smoothed(curve.force, max(1, len(curve.force) // 30))
    load = (smooth - smooth.min()) / max(float(np.ptp(smooth)), np.finfo(float).tiny)
    reached = [float(curve.travel[middle + int(np.argmax(load >= fraction))]) for fraction in _LOADS]
    earlier = (_LOADS[1] - _LOADS[0]) * (reached[2] - reached[1])
    later = (_LOADS[2] - _LOADS[1]) * (reached[1] - reached[0])
    if later < _CONCAVE * earlier:
        raise _swapped(specimen)


def _swapped(specimen: Specimen) -> InputError:
    columns = f"{specimen.labels['force']} over {specimen.labels['travel']}"
    bound = "a force that rises ever more with the travel, as on a convex fruit"
    hint = "swap the names of the columns if they are swapped, or cut the table at the failure"
    return validation_error(name_of(specimen), columns, "", bound, hint)


def _up_to_failure(travel: Floats, force: Floats) -> Loading:
    noise = noise_of(force)
    peak = _failure(force, noise)
    end = len(travel) if peak is None else peak + 1
    failure = None if peak is None else float(travel[peak])
    return Loading(travel=travel[:end], force=force[:end], zero=_zero(force[:end]), noise=noise, failure=failure)


def noise_of(force: Floats) -> float:
    """Return the standard deviation of the noise of forces (points,) [N].

    Taken from second differences, which a smooth curve hardly has. At least what the last digit hides.
    """
    curvature = force[2:] - 2.0 * force[1:-1] + force[:-2]
    spread = _NORMAL * float(np.median(np.abs(curvature - np.median(curvature)))) / math.sqrt(6.0)
    steps = np.abs(np.diff(force))
    digit = float(steps[steps > 0.0].min()) if bool((steps > 0.0).any()) else 0.0
    return max(spread, digit / math.sqrt(12.0)) if spread < digit else spread


def _averaged(values: Floats) -> Floats:
    group = -(-len(values) // _MOST_POINTS)
    count = len(values) // group
    return np.asarray(values[: count * group].reshape(count, group).mean(axis=1))


def _smoothed(values: Floats, width: int) -> tuple[Floats, int]:
    """Return moving means over so many values, and the index of the value in the middle of the first one."""
    return np.convolve(values, np.ones(width) / width, mode="valid"), width // 2


def _failure(force: Floats, noise: float) -> int | None:
    """Return the index of the largest force before the first fall that is neither noise nor small; None for none."""
    width = max(1, round(_MOVING_MEAN * len(force)))
    smooth, middle = _smoothed(force, width)
    highest = np.maximum.accumulate(smooth)
    span = float(np.ptp(smooth))
    limit = max(_FALL * span, _NOISE_FALLEN * noise * math.sqrt(2.0 / width))
    fallen = np.flatnonzero((highest - smooth > limit) & (highest - smooth[0] > _RISEN * span))
    if not fallen.size:
        return None
    peak = int(np.argmax(smooth[: fallen[0] + 1]))
    return min(peak + middle, len(force) - 1)


def _zero(force: Floats) -> float:
    """Return about where the load cell begins [N]: the median of the first points that are low."""
    rising = np.flatnonzero(force > force[0] + _QUIET * (force.max() - force[0]))
    low = force[: max(1, int(rising[0]) // 2)] if rising.size else force[:1]
    return float(np.median(low))
