"""Calibration of springs and channels by weights on one tip after another, with a straight line for each column."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instrument.press.signals import count_keys
from pipeline.reading.bench_uncertainty import LEAST_ERROR
from pipeline.report.report import Report
from pipeline.tables.decoding import place_of
from pipeline.tables.measured_table import MeasuredTable
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, UNIFORM_DEVIATION, Estimate, report_field, validation_error
from sensor.theory.straight_line import FEWEST, LEAST_SPAN, LackOfFit, Line, Outlier, fit_line

DEFLECTION = "deflection"
_LEAST_COMPLIANCE = 1e-6  # smallest compliance of a spring [mm/N]; below it, the tip did not move
# Largest condition number of the matrix of relative slopes. Above this number, the channels do not separate the forces
# of the tips.
_WORST_CONDITION = 100.0

Lines = Mapping[tuple[str, str], Line]
"""The fitted line of each column against the weights on each tip of a unit, or on each leaf of a coupon.

Its key consists of the name of the tip or leaf, and the name of the column.
"""


@dataclass(frozen=True, kw_only=True)
class ChannelCalibration:
    """The calibration of the channels by weights, in the order of the tips.

    `counts_per_N` (channels, tips) holds the slope of each channel against the weight on each tip. `zero_counts`
    (channels,) are the counts without weight, and `saturation` is the largest count of the converter. `gain_percent` is
    the relative standard deviation of each tip's force. `bend_percent` is the change of a channel's slope from no
    weight to the largest weight; it is 0 if scatter explains the change. `lacks_of_fit` are the errors that a straight
    line makes because of this change.

    `crosstalk_percent` is the largest slope of a channel against the weight on another tip, relative to the slope for
    its own tip. `hysteresis_percent` is the largest difference between readings of the same weight. `drift_percent` is
    the last reading without weight minus the first one. Hysteresis and drift are relative to the counts of the largest
    weight.
    """

    counts_per_N: Floats
    zero_counts: Floats
    saturation: int
    gain_percent: tuple[float, ...]
    lacks_of_fit: tuple[LackOfFit, ...] = report_field("", "errors caused by bent lines, as in the unit", has_key=False)
    bend_percent: tuple[float, ...]
    crosstalk_percent: tuple[float, ...]
    hysteresis_percent: tuple[float, ...]
    drift_percent: tuple[float, ...]

    @property
    def newtons_per_count(self) -> tuple[tuple[float, ...], ...]:
        """Return the matrix (tips, channels) that converts counts above the tare to forces [N]."""
        return tuple(map(tuple, np.linalg.inv(self.counts_per_N).tolist()))


def saturation_of(report: Report) -> int:
    """Return the largest count of the converter in the design's read-out."""
    return report.read_out.channels.saturation_counts


def counts_of(table: MeasuredTable, keys: Sequence[str]) -> Floats:
    """Return the counts of all channels as an array (rows, channels)."""
    return np.column_stack([table.numbers[key] for key in keys])


def fit_weight_lines(table: MeasuredTable, names: Sequence[str], columns: Sequence[str], forces: Floats) -> Lines:
    """Fit straight lines to a table of weights: the deflection and the counts against the weight on each tip or leaf.

    `names` are the names of the tips or leaves, and `columns` are the names of the columns of counts. `forces` (rows,)
    [N] are the weights corrected for creep to one common time.

    Raises InputError for a tip or leaf with fewer than three rows or only one weight. InputError is also raised for a
    deflection that does not fit a line, does not increase with the weight, or is too uncertain.
    """
    lines = {}
    for name in names:
        rows = _rows_of(table, name)
        loads = table.numbers["force"][rows]
        _check_weights(table, name, loads)
        for column in (DEFLECTION, *columns):
            resolution = table.last_digits[column][rows]
            # `levels` are the weights before correction, because the correction turns one weight into several forces.
            lines[name, column] = fit_line(forces[rows], table.numbers[column][rows], resolution, levels=loads)
        _check_deflection(table, name, lines[name, DEFLECTION])
    return lines


def stiffness_of_line(deflection: Line) -> Estimate:
    """Return the stiffness [N/mm] and its standard deviation, from the line of deflection [mm] against force [N]."""
    K = 1.0 / deflection.slope.value
    # K has the relative error of the slope, its reciprocal, but no dial and no balance is better than LEAST_ERROR.
    return Estimate(K, max(deflection.slope.relative, LEAST_ERROR) * K, "N/mm")


def calibrate_channels(table: MeasuredTable, report: Report, lines: Lines, forces: Floats) -> ChannelCalibration | None:
    """Calibrate the channels by a table of weights; return None if the table has no counts.

    `lines` are the lines from `fit_weight_lines`, and `forces` (rows,) [N] are the weights corrected for creep. Each
    tip has one channel of its own, but the weight on a tip may also change the counts of other channels.

    Raises InputError for a tip whose first row has a weight, because this row is the tare. InputError is also raised
    for an outlier, for a channel that does not respond to its own tip, and for channels that do not separate the tip
    forces.
    """
    names = [tip.name for tip in report.tips]
    keys = count_keys(len(names))
    if keys[0] not in table.numbers:
        return None
    own_lines = [lines[name, key] for name, key in zip(names, keys, strict=True)]  # each channel with its own tip
    _check_channels(table, names, keys, lines)
    counts_per_N = np.array([[lines[name, key].slope.value for name in names] for key in keys])
    hysteresis = []  # [%], one value per channel
    drift = []  # [%], one value per channel
    for name, key, line in zip(names, keys, own_lines, strict=True):
        loop_width, zero_drift = _hysteresis_and_drift(table, name, key, line.slope.value, forces)
        hysteresis.append(loop_width)
        drift.append(zero_drift)
    # The force is equally likely anywhere within the width of the hysteresis loop (JCGM 100:2008, 4.3.7).
    hysteresis_deviations = [UNIFORM_DEVIATION * 0.5 * loop_width for loop_width in hysteresis]
    slope_deviations = [line.slope.percent for line in own_lines]
    has_no_weight = table.numbers["force"] == 0.0
    return ChannelCalibration(
        counts_per_N=counts_per_N,
        zero_counts=counts_of(table, keys)[has_no_weight].mean(axis=0),
        saturation=saturation_of(report),
        gain_percent=tuple(map(math.hypot, slope_deviations, hysteresis_deviations)),
        lacks_of_fit=tuple(line.bend.lack_of_fit for line in own_lines),
        bend_percent=tuple(100.0 * line.bend.significant_change for line in own_lines),
        crosstalk_percent=_crosstalk_percent(table, names, keys, counts_per_N),
        hysteresis_percent=tuple(hysteresis),
        drift_percent=tuple(drift),
    )


def _hysteresis_and_drift(
    table: MeasuredTable, name: str, key: str, counts_per_N: float, forces: Floats
) -> tuple[float, float]:
    """Return the hysteresis and the drift of a channel [%], relative to the counts of the largest weight on its tip.

    The hysteresis is the largest difference between readings of the same weight. The drift is the last reading without
    weight minus the first one. `name` is the tip, `key` is the count column of its channel, `counts_per_N` is the slope
    of the channel, and `forces` (rows,) [N] are the weights corrected for creep.
    """
    rows = _rows_of(table, name)
    loads = table.numbers["force"][rows]  # weights before the correction for creep
    # Creep is neither hysteresis nor drift, so the counts that it adds are subtracted.
    counts = table.numbers[key][rows] - counts_per_N * (forces[rows] - loads)
    percent_per_count = 100.0 / (abs(counts_per_N) * float(np.ptp(loads)))
    zeros = counts[loads == 0.0]  # never empty, because the first row of a tip has no weight
    loop_widths = [float(np.ptp(counts[loads == load])) for load in set(loads.tolist())]
    return percent_per_count * max(loop_widths), percent_per_count * float(zeros[-1] - zeros[0])


def _rows_of(table: MeasuredTable, name: str) -> NDArray[np.intp]:
    """Return the indices of the rows that hold the weights on the tip or leaf called `name`."""
    (names,) = table.texts.values()  # the only column of texts
    return np.flatnonzero(np.array(names) == name)


def _check_weights(table: MeasuredTable, name: str, loads: Floats) -> None:
    """Raise InputError if the weights on a tip or leaf do not determine a line.

    `loads` (rows,) [N] are the weights on the tip or leaf called `name`. Three rows are needed for the error of the
    line, and two different weights to separate its zero from its slope.
    """
    weight_count = len(set(loads.tolist()))
    if len(loads) < FEWEST or weight_count == 1 or not np.ptp(loads) > LEAST_SPAN:
        load_range = np.ptp(loads) if weight_count else 0.0  # np.ptp raises ValueError for a tip without rows
        unit = f"rows with {weight_count} different weights within {load_range:.2g} N"
        bound = (
            f"at least {FEWEST} rows with 2 weights, because one weight does not separate a zero error from the slope"
        )
        field = f"{table.source}: compliance of {name}"
        raise validation_error(field, len(loads), unit, bound, "add a row without weight")


def _check_deflection(table: MeasuredTable, name: str, line: Line) -> None:
    """Raise InputError if the deflection of a tip or leaf has an outlier, or an implausible or uncertain compliance.

    `line` is the fitted line of deflection [mm] against weight [N], so its slope is the compliance [mm/N].
    """
    _check_outlier(table, name, DEFLECTION, line.outlier())  # comes first, because an outlier distorts the line
    field = f"{table.source}: compliance of {name}"
    compliance = line.slope
    if not compliance.value > _LEAST_COMPLIANCE:
        hint = "swap the columns, reverse the sign of the deflection, or correct a unit"
        raise validation_error(field, compliance.value, "mm/N", f"more than {_LEAST_COMPLIANCE:g}", hint)
    if compliance.error > compliance.value:  # the half width at 95 % is twice this error
        bound = f"known to within 200 %, but its error is ± {COVERAGE * compliance.error:.2g} mm/N"
        raise validation_error(field, compliance.value, "mm/N", bound, "repeat the weighing")


def _check_outlier(table: MeasuredTable, name: str, column: str, outlier: Outlier | None) -> None:
    """Raise InputError if there is an outlier: a row that is far from the line through the other rows of `name`."""
    if outlier is not None:
        row = int(_rows_of(table, name)[outlier.index])  # the index counts only the rows of this tip or leaf
        place = place_of(table.source, table.lines[row], column)
        unit = "mm" if column == DEFLECTION else "counts"
        bound = f"about {outlier.expected:.6g}, on the line through the other rows"
        hint = "measure that row again, or leave it out"
        raise validation_error(place, float(table.numbers[column][row]), unit, bound, hint)


def _check_channels(table: MeasuredTable, names: Sequence[str], keys: Sequence[str], lines: Lines) -> None:
    """Raise InputError for a missing tare, an outlier, or a channel that does not respond to its own tip.

    `names` are the names of the tips, `keys` are the count columns of their channels, and `lines` are the lines from
    `fit_weight_lines`. The tare is the first row of each tip, so this row must be without weight.
    """
    own_lines = [lines[name, key] for name, key in zip(names, keys, strict=True)]  # each channel with its own tip
    for name, key, line in zip(names, keys, own_lines, strict=True):
        first = int(_rows_of(table, name)[0])
        load = float(table.numbers["force"][first])
        if load != 0.0:
            place = place_of(table.source, table.lines[first], "tip")
            raise validation_error(place, load, "N", "0 in the first row of a tip", "begin with a row without weight")
        _check_outlier(table, name, key, line.outlier())
        # The sign of a slope is only certain if its error bar does not contain 0.
        slope = line.slope
        if not COVERAGE * slope.error < abs(slope.value):
            field = f"{table.source}: {key} against the weight on {name}"
            bound = f"known to within 100 %, but its error is ± {COVERAGE * slope.error:.2g} counts/N"
            raise validation_error(field, slope.value, "counts/N", bound, "check the channel and its wiring")
    # A channel responds little to other tips, so the threshold for outliers is relative to the span for its own tip.
    for name in names:
        for key, own_line in zip(keys, own_lines, strict=True):
            _check_outlier(table, name, key, lines[name, key].outlier(own_line.span))


def _crosstalk_percent(
    table: MeasuredTable, names: Sequence[str], keys: Sequence[str], counts_per_N: Floats
) -> tuple[float, ...]:
    """Return the crosstalk of each channel [%]: its largest response to the weight on another tip.

    The crosstalk is relative to the response to the channel's own tip. `counts_per_N` (channels, tips) are the slopes,
    with a channel and its own tip at the same index. `names` are the names of the tips, and `keys` are the count
    columns of the channels. Raises InputError for channels that do not separate the forces of the tips.
    """
    relative_slopes = counts_per_N / np.diag(counts_per_N)[:, None]  # 1 for the channel's own tip
    crosstalk = np.abs(relative_slopes - np.eye(len(names))).max(axis=1)  # the identity removes the own tip
    _check_separation(table, names, keys, relative_slopes, crosstalk)
    return tuple((100.0 * crosstalk).tolist())


def _check_separation(
    table: MeasuredTable, names: Sequence[str], keys: Sequence[str], relative_slopes: Floats, crosstalk: Floats
) -> None:
    """Raise InputError for channels that do not separate the forces of the tips.

    `relative_slopes` (channels, tips) [1] are the slopes divided by the slope for the channel's own tip, and
    `crosstalk` (channels,) [1] is the largest of them for another tip. `names` are the names of the tips, and `keys`
    are the count columns of the channels.
    """
    if not crosstalk.max() < 1.0:
        channel = int(crosstalk.argmax())
        field = f"{table.source}: largest counts/N of {keys[channel]} for another tip, relative to {names[channel]}"
        bound = "below 1, because each channel must respond most to its own tip"
        hint = "check the order of the channels and their wiring"
        raise validation_error(field, float(f"{crosstalk[channel]:.4g}"), "", bound, hint)
    if not np.linalg.cond(relative_slopes) < _WORST_CONDITION:
        field = f"{table.source}: condition number of the relative counts/N"
        bound = f"below {_WORST_CONDITION:g}, so that the channels separate the forces of the tips"
        hint = "check the order of the channels and their wiring"
        raise validation_error(field, float(np.linalg.cond(relative_slopes)), "", bound, hint)
