"""The phases of a compression test, with positive signs: the loading up to failure, and the hold."""

import math
from dataclasses import dataclass, replace

import numpy as np

from instrument.compress.specimens import LEAST_ROWS, Specimen
from sensor.arrays import Floats
from sensor.quantity import InputError, validation_error

_UNITS = {"travel": "mm", "force": "N"}
_JITTER = 0.02  # largest backward step of a machine's reading, as a fraction of the travel
_UNLOADS = 0.5  # smallest fraction of the force that an unloading loses relative to the loading at the same depth
_FIRST = 0.2  # a first loading up to this fraction of the largest force is a tap before the test
_BELOW = 0.1  # largest distance of a force below the first ones in a compression, as a fraction of the range
_NOISE_BELOW = 6.0  # the same limit in standard deviations of noise
_CONCAVE = 0.75  # smallest ratio of the later slope of a load to the earlier one; a convex fruit has more than 1
_LOADS = (0.1, 0.3, 0.6)  # fractions of the largest force between which these slopes are taken
_MOST_POINTS = 1200  # more points are averaged in groups, which makes a fit faster and loses nothing
_MOVING_MEAN = 0.02  # width of the moving mean as a fraction of the points
_NOISE_FALLEN = 5.0  # smallest fall of a force at failure [standard errors]
_FALL = 0.03  # smallest fall at failure as a fraction of the range of forces
_RISEN = 0.1  # a fall before the force has risen by this fraction of its range belongs to the zero line
_NORMAL = 1.4826  # standard deviation over median absolute deviation, for normal noise
_QUIET = 0.25  # fraction of the range of forces below which the zero line lies
_STILL = 2e-3  # fraction of the travel within which a curve is at rest
_DWELL = 0.05  # shortest hold as a fraction of the loading time; a machine that only turns back stands still for less


@dataclass(frozen=True, kw_only=True)
class Loading:
    """A curve up to failure or to the end of the loading: travel [mm] and force [N], shape (points,).

    `zero` [N] is the approximate zero of the load cell, and `noise` [N] the standard deviation of its noise. `failure`
    is the travel at which the force fell [mm], or None.
    """

    travel: Floats
    force: Floats
    zero: float
    noise: float
    failure: float | None


@dataclass(frozen=True, kw_only=True)
class Phases:
    """The phases of a test whose travel and force are positive in compression.

    `specimen` has the rows up to the first return of the plate or probe. `loading` is the curve before the hold. `hold`
    are the rows in which the plate stands still at its largest travel, None for a test without a hold.
    """

    specimen: Specimen
    loading: Loading
    hold: slice | None


def phases(specimen: Specimen, *, compression_negative: bool = False) -> Phases:
    """Split a test into its loading up to failure and its hold, with travel and force positive in compression.

    `compression_negative` allows columns whose values fall in compression. Raises InputError for too few rows, and for
    travel that runs backwards. It is also raised for a force that is far below its first values, never rises, or rises
    ever less.
    """
    _refuse_few_rows(specimen, len(specimen.lines))
    test = _cut_at_first_return(specimen)
    signs = {quantity: _compression_sign(getattr(test, quantity)) for quantity in _UNITS}
    test = replace(test, **{quantity: sign * getattr(test, quantity) for quantity, sign in signs.items()})
    hold = _find_hold(test)
    rows = len(test.lines) if hold is None else hold.start + 1
    _refuse_few_rows(specimen, rows)
    for quantity, sign in signs.items():
        values = getattr(specimen, quantity)[:rows]
        if (sign < 0.0 and not compression_negative) or np.ptp(values) == 0.0:
            raise _falling_error(specimen, quantity, values)
    return Phases(specimen=test, loading=_loading(test.up_to(rows)), hold=hold)


def _compression_sign(values: Floats) -> float:
    """Return 1 if the values rise from their start by at least as much as they fall, and -1 otherwise."""
    start = np.median(values[:3])
    return 1.0 if values.max() - start >= start - values.min() else -1.0


def _falling_error(specimen: Specimen, quantity: str, values: Floats) -> InputError:
    """Return the error for a quantity that does not rise in compression; its message names the lowest value."""
    row = int(np.argmin(values))
    hint = "export the whole test, or reverse the sign with --compression-negative"
    place = specimen.cell(row, quantity)
    return validation_error(place, float(values[row]), _UNITS[quantity], "rising in compression", hint)


def _cut_at_first_return(specimen: Specimen) -> Specimen:
    """Return a curve up to the first return of its plate or probe, with a note if a later row lies deeper.

    Later rows do not show intact flesh: a probe that sticks, a return beyond the start, or a second bite. A curve
    without a return is returned unchanged.
    """
    # A return may go farther than the test, so the signs come from the row with the largest change of force.
    travel = specimen.travel - np.median(specimen.travel[:3])
    force = specimen.force - np.median(specimen.force[:3])
    peak = int(np.argmax(np.abs(force)))
    depth = specimen.travel if travel[peak] >= 0.0 else -specimen.travel
    load = specimen.force if force[peak] >= 0.0 else -specimen.force
    found = _find_first_return(depth, load)
    if found is None:
        return specimen
    deepest, end = found
    notes = specimen.notes
    if depth[end:].max() > depth[deepest]:
        last = specimen.lines[end - 1]
        notes = (*notes, f"{specimen.file}: a later loading goes deeper: the first one, to line {last}, is read")
    return replace(specimen.up_to(end), notes=notes)


def _find_first_return(depth: Floats, load: Floats) -> tuple[int, int] | None:
    """Return the deepest row before the first return, and the first row that is surely on it; None if there is none.

    Depth [mm] and load [N] (rows,) rise in compression. A return must lose much of the force that the loading has at
    the same depth. A return after a small load does not count, because it was a tap before the test.
    """
    largest_depth = np.maximum.accumulate(depth)  # until each row
    span = float(depth.max() - depth[: int(np.argmax(depth)) + 1].min())
    backward = np.flatnonzero(largest_depth - depth > _JITTER * span)
    if not backward.size:
        return None
    end = int(backward[0])
    deepest = int(np.argmax(depth[:end]))
    loading_force = float(np.interp(depth[end], largest_depth[: deepest + 1], load[: deepest + 1]))  # at the same depth
    is_unloading = load[end] - loading_force <= (1.0 - _UNLOADS) * (load[deepest] - loading_force)
    is_tap = load[deepest] - load[0] < _FIRST * (load.max() - load[0])
    return (deepest, end) if is_unloading and not is_tap else None


def _find_hold(test: Specimen) -> slice | None:
    """Return the rows in which a test stands still at its largest travel; None without a hold or without times."""
    travel = test.travel
    time = test.time
    if time is None:
        return None
    is_level = travel >= travel.max() - _STILL * np.ptp(travel)
    first = int(is_level.argmax())
    end = first + int(np.append(~is_level[first:], True).argmax())  # the first row that is no longer level
    # The last step of the loading may be level already; the hold begins at the median of the level rows.
    start = first + int((travel[first:end] >= np.median(travel[first:end])).argmax())
    duration = time[end - 1] - time[start]
    is_hold = end - start >= LEAST_ROWS and duration > _DWELL * (time[start] - time[0])
    return slice(start, end) if is_hold else None


def _loading(specimen: Specimen) -> Loading:
    """Return the loading of a specimen whose rows end before a hold or a return.

    Raises InputError for travel that runs backwards, for a force far below its first values, for too few rows, and for
    a force that rises ever less.
    """
    travel = specimen.travel
    force = specimen.force
    end = int(np.argmax(travel)) + 1
    _refuse_backwards(specimen, end)
    _refuse_low_force(specimen, force)
    _refuse_few_rows(specimen, end)
    curve = _cut_at_failure(_average_groups(travel[:end]), _average_groups(force[:end]))
    if _is_concave(curve):
        columns = f"{specimen.labels['force']} over {specimen.labels['travel']}"
        bound = "a force that rises ever more with the travel, as on a convex fruit"
        hint = "correct the names of the columns if they are swapped, or cut the table off at the failure"
        raise validation_error(str(specimen), columns, "", bound, hint)
    return curve


def without_frame(specimen: Specimen, curve: Loading, compliance: float) -> Loading:
    """Return a loading whose travel is reduced by the deflection of frame and load cell.

    `compliance` [um/N] is their compliance. Raises InputError if the corrected travel does not rise, because then the
    compliance does not belong to this machine.
    """
    if compliance == 0.0:
        return curve
    travel = curve.travel - 1e-3 * compliance * (curve.force - curve.zero)
    backward_step = float((np.maximum.accumulate(travel) - travel).max())
    if backward_step > _JITTER * float(np.ptp(curve.travel)):
        bound = f"less than travel over force of the test, {1e3 * np.ptp(curve.travel) / np.ptp(curve.force):.3g} um/N"
        name = f"{specimen}: compliance"
        raise validation_error(name, compliance, "um/N", bound, "measure it with steel on steel")
    failure = None if curve.failure is None else float(travel[-1])
    return replace(curve, travel=np.maximum.accumulate(travel), failure=failure)


def _refuse_few_rows(specimen: Specimen, rows: int) -> None:
    """Raise InputError if a loading has fewer than `LEAST_ROWS` rows."""
    if rows < LEAST_ROWS:
        hint = "export every point of the test"
        raise validation_error(str(specimen), rows, "rows of load", f"at least {LEAST_ROWS}", hint)


def _refuse_backwards(specimen: Specimen, end: int) -> None:
    """Raise InputError if the travel of the rows before `end` steps back by more than jitter."""
    travel = specimen.travel
    largest = np.maximum.accumulate(travel[:end])
    backward = np.flatnonzero(largest - travel[:end] > _JITTER * float(np.ptp(travel)))
    if backward.size:
        row = int(backward[0])
        bound = f"at least the travel of the rows before, {largest[row]:g} mm"
        hint = "put the rows in order, one loading for each table, or check that the columns are not swapped"
        raise validation_error(specimen.cell(row, "travel"), float(travel[row]), "mm", bound, hint)


def _refuse_low_force(specimen: Specimen, force: Floats) -> None:
    """Raise InputError if a force (rows,) [N] is far below the first ones, which no compression has."""
    count = max(3, min(20, round(0.05 * len(force))))  # number of rows that show the zero of the force
    zero = float(np.median(force[:count]))
    limit = max(_BELOW * float(force.max() - zero), _NOISE_BELOW * noise_of(force))
    row = int(np.argmin(force))
    if force[row] < zero - limit:
        bound = f"not far below the first forces, {zero:.3g} N"
        hint = "correct it, or leave the row out"
        raise validation_error(specimen.cell(row, "force"), float(force[row]), "N", bound, hint)


def _is_concave(curve: Loading) -> bool:
    """Return whether a force rises ever less with the travel, as in a table with swapped columns.

    The slopes between three levels of the smoothed force are compared.
    """
    width = max(1, len(curve.force) // 30)
    smooth = _moving_mean(curve.force, width)
    load = (smooth - smooth.min()) / np.ptp(smooth)  # from 0 to 1
    first, middle, last = (float(curve.travel[width // 2 + int(np.argmax(load >= level))]) for level in _LOADS)
    # Both slopes are multiplied by the product of their denominators, because two travels may be equal.
    earlier_slope = (_LOADS[1] - _LOADS[0]) * (last - middle)
    later_slope = (_LOADS[2] - _LOADS[1]) * (middle - first)
    return later_slope < _CONCAVE * earlier_slope


def _average_groups(values: Floats) -> Floats:
    """Return the means of groups of consecutive values, so that at most `_MOST_POINTS` remain."""
    group = math.ceil(len(values) / _MOST_POINTS)
    count = len(values) // group
    return np.asarray(values[: count * group].reshape(count, group).mean(axis=1))


def _moving_mean(values: Floats, width: int) -> Floats:
    """Return the means of all windows of `width` values; the first one belongs to the value of index width // 2."""
    return np.convolve(values, np.ones(width) / width, mode="valid")


def noise_of(force: Floats) -> float:
    """Return the standard deviation of the noise of forces (points,) [N].

    It comes from second differences, in which a smooth curve almost cancels. It is at least the rounding error of the
    resolution, for which the smallest step of the force is taken.
    """
    differences = force[2:] - 2.0 * force[1:-1] + force[:-2]
    # The median is robust against outliers. A second difference has 1 + 4 + 1 times the variance of one force.
    deviation = _NORMAL * float(np.median(np.abs(differences - np.median(differences)))) / math.sqrt(6.0)
    steps = np.abs(np.diff(force))
    resolution = float(min(steps[steps > 0.0], default=0.0))
    return deviation if deviation >= resolution else max(deviation, resolution / math.sqrt(12.0))


def _cut_at_failure(travel: Floats, force: Floats) -> Loading:
    """Return the curve up to the largest force before the failure, which is the first large fall of the force.

    A large fall exceeds both noise and a fraction of the range of the moving mean. A curve without one is whole.
    """
    noise = noise_of(force)
    width = max(1, round(_MOVING_MEAN * len(force)))
    means = _moving_mean(force, width)
    span = float(np.ptp(means))
    difference_error = noise * math.sqrt(2.0 / width)  # of two means
    large_fall = max(_FALL * span, _NOISE_FALLEN * difference_error)
    largest_mean = np.maximum.accumulate(means)
    has_risen = largest_mean - means[0] > _RISEN * span
    has_fallen = largest_mean - means > large_fall
    failures = np.flatnonzero(has_risen & has_fallen)
    failure = None
    if failures.size:
        peak = int(np.argmax(means[: failures[0] + 1])) + width // 2
        failure = float(travel[peak])
        travel = travel[: peak + 1]
        force = force[: peak + 1]
    # The zero of the load cell is the median of the first half of the points before the force has risen.
    risen = np.flatnonzero(force > force[0] + _QUIET * (force.max() - force[0]))
    zero_points = force[: max(1, int(risen[0]) // 2)] if risen.size else force[:1]
    return Loading(travel=travel, force=force, zero=float(np.median(zero_points)), noise=noise, failure=failure)
