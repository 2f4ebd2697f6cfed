"""The phases of a compression test: the loading up to failure, and the hold.

Travel and force are given signs that make both positive in compression.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from instrument.compress.specimens import LEAST_ROWS, Specimen
from sensor.arrays import Floats
from sensor.quantity import InputError, validation_error

_UNITS = {"travel": "mm", "force": "N"}
_START_ROWS = 3  # the start of a column is the median of its first rows, on which one outlier has no effect
_JITTER = 0.02  # largest backward step that jitter of the reading explains, as a fraction of the travel
# A plate that returns unloads the body. The force then falls by at least this fraction of the rise during the loading
# from the same depth to the deepest row. If it falls less, the backward step is an error of the travel.
_LEAST_UNLOADING = 0.5
_TAP = 0.2  # a first loading up to this fraction of the largest force is a tap before the test
# In compression, a force may lie below the first forces by either of these two distances.
_LARGEST_DROP = 0.1  # fraction of the force range
_LARGEST_DROP_IN_NOISE = 6.0  # standard deviations of the noise
_LEAST_SLOPE_RATIO = 0.75  # smallest ratio of a later to an earlier slope of the force; for convex fruit it exceeds 1
_LOAD_LEVELS = (0.1, 0.3, 0.6)  # fractions of the largest force between which these slopes are computed
_SMOOTH_PARTS = 30  # before its slopes are computed, the force is smoothed over a thirtieth of its points
_MOST_POINTS = 1200  # more points are averaged in groups, which speeds up the fit without loss of accuracy
_MOVING_MEAN = 0.02  # width of the moving mean as a fraction of the points
_FAILURE_IN_ERRORS = 5.0  # smallest fall of the force at failure [standard errors]
_FAILURE_FALL = 0.03  # smallest fall of the force at failure, as a fraction of the force range
_RISE_BEFORE_FAILURE = 0.1  # before the force has risen by this fraction of its range, a fall is part of the zero line
_NORMAL = 1.4826  # standard deviation divided by median absolute deviation, for normally distributed noise
_ZERO_LINE = 0.25  # fraction of the force range below which the zero line lies
_AT_REST = 2e-3  # largest motion of a plate at rest, as a fraction of the travel
# Shortest hold as a fraction of the loading time. A machine that only reverses is at rest for a shorter time.
_SHORTEST_HOLD = 0.05


@dataclass(frozen=True, kw_only=True)
class Loading:
    """The curve of a loading up to failure or to its end: travel [mm] and force [N], both (points,).

    `zero` [N] is the approximate force of the load cell without load, and `noise` [N] is the standard deviation of its
    noise. `failure` [mm] is the travel at failure, or None if the body does not fail.
    """

    travel: Floats
    force: Floats
    zero: float
    noise: float
    failure: float | None


@dataclass(frozen=True, kw_only=True)
class Phases:
    """The phases of a test whose travel and force are positive in compression.

    `specimen` contains the rows up to the first return of the plate or probe. `loading` is the curve before the hold.
    `hold` selects the rows in which the plate is at rest at its largest travel; it is None for a test without a hold.
    """

    specimen: Specimen
    loading: Loading
    hold: slice | None


def split_phases(specimen: Specimen, *, compression_negative: bool = False) -> Phases:
    """Split a test into its loading up to failure and its hold, with travel and force positive in compression.

    With `compression_negative`, a column may contain values that decrease in compression; their sign is then reversed.
    Raises InputError for too few rows, and for travel that runs backwards. InputError is also raised for a force that
    lies far below its first values, that never rises, or whose slope decreases with the travel.
    """
    _check_row_count(specimen, len(specimen.lines))
    first_loading = _cut_at_first_return(specimen)
    travel_sign = _compression_sign(first_loading.travel)
    force_sign = _compression_sign(first_loading.force)
    test = replace(first_loading, travel=travel_sign * first_loading.travel, force=force_sign * first_loading.force)
    hold = _find_hold(test)
    rows = len(test.lines) if hold is None else hold.start + 1  # the loading ends with the first row of the hold
    _check_row_count(specimen, rows)
    # The given rows are checked, so that messages show values as in the table.
    columns = {"travel": (travel_sign, specimen.travel[:rows]), "force": (force_sign, specimen.force[:rows])}
    for quantity, (sign, column) in columns.items():
        is_falling = sign < 0.0 and not compression_negative
        is_constant = np.ptp(column) == 0.0
        if is_falling or is_constant:
            raise _falling_error(specimen, quantity, column)
    return Phases(specimen=test, loading=_extract_loading(test.up_to(rows)), hold=hold)


def _compression_sign(values: Floats) -> float:
    """Return 1.0 if the values rise above their start by at least as much as they fall below it, and -1.0 otherwise."""
    start = np.median(values[:_START_ROWS])
    return 1.0 if values.max() - start >= start - values.min() else -1.0


def _falling_error(specimen: Specimen, quantity: str, values: Floats) -> InputError:
    """Return the error for a quantity that does not increase in compression.

    `values` (rows,) is the column of the loading. The message names the lowest value of the column.
    """
    lowest_row = int(np.argmin(values))
    hint = "export the whole test, or reverse the sign with --compression-negative"
    place = specimen.cell(lowest_row, quantity)
    return validation_error(place, float(values[lowest_row]), _UNITS[quantity], "increasing in compression", hint)


def _cut_at_first_return(specimen: Specimen) -> Specimen:
    """Return the rows of a curve up to the first return of the plate or probe.

    Later rows do not show the compression of intact flesh. The probe may stick or return beyond its start, or it may
    compress the flesh a second time. If a later row lies deeper, a note is added to the result. A curve without a
    return is unchanged.
    """
    # The signs of the columns are still unknown. A return may go farther than the loading, so the row with the largest
    # change in force since the start determines them.
    travel = specimen.travel - np.median(specimen.travel[:_START_ROWS])
    force = specimen.force - np.median(specimen.force[:_START_ROWS])
    peak = int(np.argmax(np.abs(force)))
    depth = specimen.travel if travel[peak] >= 0.0 else -specimen.travel
    load = specimen.force if force[peak] >= 0.0 else -specimen.force
    first_return = _find_first_return(depth, load)
    if first_return is None:
        return specimen
    deepest, end = first_return
    notes = specimen.notes
    if depth[end:].max() > depth[deepest]:
        last_line = specimen.lines[end - 1]
        note = f"{specimen.file}: a later loading goes deeper: only the first one, up to line {last_line}, is read"
        notes = (*notes, note)
    return replace(specimen.up_to(end), notes=notes)


def _find_first_return(depth: Floats, load: Floats) -> tuple[int, int] | None:
    """Return the index of the deepest row before the first return, and of the first row that belongs to the return.

    Returns None if there is no return. `depth` [mm] and `load` [N], both (rows,), increase in compression. A return is
    a backward step in which the force falls by more than an error of the travel can explain. A return from a small load
    is ignored, because it follows a tap before the test.
    """
    largest_depth = np.maximum.accumulate(depth)  # largest depth up to each row
    until_deepest = depth[: int(np.argmax(depth)) + 1]  # a return may go farther back than the start of the loading
    span = float(depth.max() - until_deepest.min())
    backward = np.flatnonzero(largest_depth - depth > _JITTER * span)
    if not backward.size:
        return None
    end = int(backward[0])
    deepest = int(np.argmax(depth[:end]))
    # Force [N] during the loading at the depth to which the plate has returned.
    loading_force = float(np.interp(depth[end], largest_depth[: deepest + 1], load[: deepest + 1]))
    is_unloading = load[end] - loading_force <= (1.0 - _LEAST_UNLOADING) * (load[deepest] - loading_force)
    is_tap = load[deepest] - load[0] < _TAP * (load.max() - load[0])
    return (deepest, end) if is_unloading and not is_tap else None


def _find_hold(test: Specimen) -> slice | None:
    """Return the rows in which the plate is at rest at its largest travel; None without a hold or without times.

    The travel of `test` is positive in compression.
    """
    travel = test.travel
    time = test.time
    if time is None:
        return None
    is_level = travel >= travel.max() - _AT_REST * np.ptp(travel)
    first_level = int(is_level.argmax())
    # `end` is the first row that is no longer level. The appended value ends a hold that lasts until the last row.
    end = first_level + int(np.append(~is_level[first_level:], True).argmax())
    # The last rows of the loading may be level too. So the hold begins where the travel reaches the median of the rows.
    level_travel = travel[first_level:end]
    start = first_level + int((level_travel >= np.median(level_travel)).argmax())  # the first row of the hold
    duration = time[end - 1] - time[start]
    loading_time = time[start] - time[0]
    is_hold = end - start >= LEAST_ROWS and duration > _SHORTEST_HOLD * loading_time
    return slice(start, end) if is_hold else None


def _extract_loading(specimen: Specimen) -> Loading:
    """Return the loading of a test up to failure, after checking that its travel and force are plausible.

    The rows of `specimen` end before a hold or a return. Raises InputError for too few rows, and for travel that runs
    backwards. InputError is also raised for a force that lies far below its first values, or whose slope decreases with
    the travel.
    """
    travel = specimen.travel
    force = specimen.force
    end = int(np.argmax(travel)) + 1  # the loading ends at the largest travel
    _check_travel_order(specimen, end)
    _check_low_force(specimen, force)
    _check_row_count(specimen, end)
    curve = _cut_at_failure(_average_groups(travel[:end]), _average_groups(force[:end]))
    if _is_concave(curve):
        columns = f"{specimen.labels['force']} against {specimen.labels['travel']}"
        bound = "a force whose slope increases with the travel, as on a convex fruit"
        hint = "correct the names of the columns if they are swapped, or remove the rows after the failure"
        raise validation_error(str(specimen), columns, "", bound, hint)
    return curve


def subtract_frame(specimen: Specimen, curve: Loading, compliance: float) -> Loading:
    """Return the loading after subtracting the deflection of frame and load cell from its travel.

    `compliance` [um/N] is the compliance of frame and load cell. Raises InputError if the corrected travel does not
    increase, because then the compliance is too large for this machine.
    """
    if compliance == 0.0:
        return curve
    travel = curve.travel - 1e-3 * compliance * (curve.force - curve.zero)  # 1e-3 converts um to mm
    backward_step = float((np.maximum.accumulate(travel) - travel).max())
    if backward_step > _JITTER * float(np.ptp(curve.travel)):
        test_compliance = 1e3 * np.ptp(curve.travel) / np.ptp(curve.force)  # body and machine together [um/N]
        bound = f"less than the compliance of the whole test, {test_compliance:.3g} um/N"
        name = f"{specimen}: compliance"
        raise validation_error(name, compliance, "um/N", bound, "measure it by pressing steel on steel")
    failure = None if curve.failure is None else float(travel[-1])  # a curve ends at its failure
    # Smaller backward steps are jitter. The largest travel up to each point replaces them.
    return replace(curve, travel=np.maximum.accumulate(travel), failure=failure)


def _check_row_count(specimen: Specimen, rows: int) -> None:
    """Raise InputError if a loading has fewer than `LEAST_ROWS` rows."""
    if rows < LEAST_ROWS:
        hint = "export all points of the test"
        raise validation_error(str(specimen), rows, "rows of load", f"at least {LEAST_ROWS}", hint)


def _check_travel_order(specimen: Specimen, end: int) -> None:
    """Raise InputError if the travel in the rows before `end` goes back by more than jitter explains."""
    travel = specimen.travel
    largest_travel = np.maximum.accumulate(travel[:end])  # up to each row
    backward = np.flatnonzero(largest_travel - travel[:end] > _JITTER * float(np.ptp(travel)))
    if backward.size:
        row = int(backward[0])
        bound = f"at least the largest travel of the rows before, {largest_travel[row]:g} mm"
        hint = "put the rows in order, with one loading per table, and check that the columns are not swapped"
        raise validation_error(specimen.cell(row, "travel"), float(travel[row]), "mm", bound, hint)


def _check_low_force(specimen: Specimen, force: Floats) -> None:
    """Raise InputError if a force (rows,) [N] lies far below the first forces, which cannot happen in compression."""
    # The zero of the force is the median of the first twentieth of the rows, but of 3 to 20 rows.
    count = max(3, min(20, round(0.05 * len(force))))
    zero = float(np.median(force[:count]))
    limit = max(_LARGEST_DROP * float(force.max() - zero), _LARGEST_DROP_IN_NOISE * noise_of(force))
    row = int(np.argmin(force))
    if force[row] < zero - limit:
        bound = f"not far below the first forces, {zero:.3g} N"
        hint = "correct this force, or leave out the row"
        raise validation_error(specimen.cell(row, "force"), float(force[row]), "N", bound, hint)


def _is_concave(curve: Loading) -> bool:
    """Return whether the slope of the force decreases with the travel, as it does in a table with swapped columns.

    The three levels `_LOAD_LEVELS` of the smoothed force divide the curve. The mean slope between the upper two levels
    is compared with the mean slope between the lower two.
    """
    width = max(1, len(curve.force) // _SMOOTH_PARTS)
    smooth = _moving_mean(curve.force, width)
    load = (smooth - smooth.min()) / np.ptp(smooth)  # from 0 to 1
    low, middle, high = _LOAD_LEVELS
    # Rows in which the load first reaches each level. A mean belongs to the row at the middle of its window.
    low_row, middle_row, high_row = (width // 2 + int(np.argmax(load >= level)) for level in _LOAD_LEVELS)
    lower_travel = float(curve.travel[middle_row]) - float(curve.travel[low_row])
    upper_travel = float(curve.travel[high_row]) - float(curve.travel[middle_row])
    # The slopes are load differences divided by these travels, either of which may be 0. To avoid a division by zero,
    # both slopes are multiplied by both travels, which does not change their ratio.
    earlier_slope = (middle - low) * upper_travel
    later_slope = (high - middle) * lower_travel
    return later_slope < _LEAST_SLOPE_RATIO * earlier_slope


def _average_groups(values: Floats) -> Floats:
    """Return the means of groups of consecutive values, so that at most `_MOST_POINTS` remain.

    The last values are dropped if they do not fill a group.
    """
    group_size = math.ceil(len(values) / _MOST_POINTS)
    count = len(values) // group_size
    return np.asarray(values[: count * group_size].reshape(count, group_size).mean(axis=1))


def _moving_mean(values: Floats, width: int) -> Floats:
    """Return the means over all windows of `width` values; the first window is centred at index width // 2."""
    return np.convolve(values, np.ones(width) / width, mode="valid")


def noise_of(force: Floats) -> float:
    """Return the standard deviation of the noise in forces (points,) [N].

    The noise is estimated from second differences, which are almost zero for a smooth curve. The result is at least the
    rounding error of the forces, whose smallest step is an estimate of their resolution.
    """
    differences = force[2:] - 2.0 * force[1:-1] + force[:-2]
    # The median absolute deviation is robust against outliers. The variance of a second difference is 1 + 4 + 1 times
    # the variance of one force.
    deviation = _NORMAL * float(np.median(np.abs(differences - np.median(differences)))) / math.sqrt(6.0)
    steps = np.abs(np.diff(force))
    resolution = float(min(steps[steps > 0.0], default=0.0))  # 0 for a constant force
    # A quantity that is rounded to a resolution has a standard deviation of resolution / sqrt(12).
    return max(deviation, resolution / math.sqrt(12.0))


def _cut_at_failure(travel: Floats, force: Floats) -> Loading:
    """Return the curve up to the largest force before failure, or the whole curve if there is no failure.

    `travel` [mm] and `force` [N], both (points,), are the curve. The failure is the first large fall of the moving mean
    of the force. A fall is large if it exceeds both the noise and a fraction of the range of the moving mean.
    """
    noise = noise_of(force)
    width = max(1, round(_MOVING_MEAN * len(force)))
    means = _moving_mean(force, width)
    span = float(np.ptp(means))
    difference_error = noise * math.sqrt(2.0 / width)  # standard error of the difference of two means
    large_fall = max(_FAILURE_FALL * span, _FAILURE_IN_ERRORS * difference_error)
    largest_mean = np.maximum.accumulate(means)  # up to each window
    has_risen = largest_mean - means[0] > _RISE_BEFORE_FAILURE * span
    has_fallen = largest_mean - means > large_fall
    failures = np.flatnonzero(has_risen & has_fallen)
    failure = None
    end = len(force)
    if failures.size:
        peak_window = int(np.argmax(means[: failures[0] + 1]))
        peak = peak_window + width // 2  # the point at the middle of this window
        failure = float(travel[peak])
        end = peak + 1
    return Loading(
        travel=travel[:end], force=force[:end], zero=_load_cell_zero(force[:end]), noise=noise, failure=failure
    )


def _load_cell_zero(force: Floats) -> float:
    """Return the force of the load cell without load [N], estimated from the start of a loading.

    `force` (points,) [N] is the force of the loading. The zero is the median over the first half of the points before
    the force has risen. Without such points, the zero is the first force.
    """
    risen = np.flatnonzero(force > force[0] + _ZERO_LINE * (force.max() - force[0]))
    count = max(1, int(risen[0]) // 2) if risen.size else 1
    return float(np.median(force[:count]))
