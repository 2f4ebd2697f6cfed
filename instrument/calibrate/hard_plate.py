"""Stiffnesses of the springs from a press on a hard flat plate, on which all tips have the same travel.

A modulus follows from small differences between the deflections F / K of the tips. If only weights calibrate a unit,
the stiffness K of each tip has its own error of the dial indicator. On a plate, all tips have the same travel, so an
error of the dial is common to them. The deflection of a tip is this travel minus the Hertzian flattening of its dome.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from instrument.calibrate.weights import ChannelCalibration, counts_of, saturation_of
from instrument.press.count_codes import with_signed_counts
from instrument.press.signals import COUNTS, count_keys
from pipeline.reading.bench_uncertainty import deflections_on_plate, flattening, springs_on_plate
from pipeline.report.report import Report
from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import LENGTH, Quantity
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate, validation_error
from sensor.theory.straight_line import FEWEST, LEAST_SPAN, LackOfFit, Line, fit_line

# Largest relative deviation of the mean stiffness from the weights [1]. A dial and a balance are more accurate, and a
# wrong unit causes a larger deviation.
_LARGEST_MEAN_DEVIATION = 0.1
# Largest relative difference between the tips [1]. A dial is more accurate, and a late contact or swapped channels
# cause a larger difference.
_LARGEST_DIFFERENCE = 0.03
# Largest relative change of a slope during a press [1]. The nonlinearity of Hall sensors is smaller, and a tip that
# touches late causes a larger change.
_LARGEST_BEND = 0.1
_LARGEST_TRAVEL_MM = 100.0  # a larger travel is probably in another unit


def read_plate_table(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Read the table of a press on a hard plate: the travels [mm] and the signed counts of all channels.

    `source` is the file, and `flags` specifies columns and units that its header lacks. `counts_as` is the notation of
    the counts: "unsigned", "offset", or None for signed counts. Raises InputError if the table lacks the travel or the
    counts of a channel, and for a count beyond the range of the converter.
    """
    keys = count_keys(len(report.tips))
    travel = Quantity(units=LENGTH, most=_LARGEST_TRAVEL_MM, words=tuple(WORDS["words"]["travel"]))
    quantities = flags.applied({"travel": travel, **dict.fromkeys(keys, COUNTS)})
    table = numbers_of(source, quantities, [("travel", *keys)], ",".join(["travel_mm", *keys]))
    return with_signed_counts(table, keys, counts_as, saturation_of(report))


class PressedSpring(NamedTuple):
    """A spring measured by a press on a plate: its stiffness K [N/mm] and the errors that remain.

    `deflection_percent` is the standard deviation [%] of a deflection that the channel of the tip measures.
    `lack_of_fit` is the error made by assuming that the compliance is independent of the force.
    """

    K: Estimate
    deflection_percent: float
    lack_of_fit: LackOfFit


class _PlatePress(NamedTuple):
    """The measurements in a press on a plate: the travel (rows,) [mm], and arrays (rows, tips) for each tip.

    `forces` [N] are the forces from the counts, and `force_resolutions` [N] is their change by one step in the last
    digit of the counts. `flattened` [mm] is the flattening of the domes.
    """

    travel: Floats
    forces: Floats
    force_resolutions: Floats
    flattened: Floats

    @property
    def deflections(self) -> Floats:
        """Return the deflection of each spring (rows, tips) [mm]: the travel minus the flattening of the dome."""
        return self.travel[:, None] - self.flattened


def fit_springs_on_plate(
    table: MeasuredTable, channels: ChannelCalibration, weight_stiffnesses: Sequence[Estimate], report: Report
) -> list[PressedSpring]:
    """Determine each spring from a press on a glass plate, with all tips in contact in every row of `table`.

    The stiffness K of a spring is the slope of the straight line

        F = F0 + K (x - w),

    with the force F [N] from the calibrated `channels`, the travel x [mm], and the flattening w [mm] of the dome on the
    plate. So x - w is the deflection of the spring. `weight_stiffnesses` are the stiffnesses [N/mm] from the weights
    and the dial indicator, with which the result must agree. Returns one spring for each tip.

    Raises InputError for fewer than three different travels, for an outlier, for a tip that touches late, and for
    stiffnesses that contradict the weights.
    """
    _check_travels(table)
    press = _convert_press(table, channels, report)
    lines = _fit_force_lines(press, table.last_digits["travel"])
    K = np.array([line.slope.value for line in lines])
    ratios = K / [spring.value for spring in weight_stiffnesses]
    _check_outliers(table, lines, press.forces)
    _check_agreement(table, ratios, weight_stiffnesses, report)
    _check_bends(table, lines)
    travel_error, slope_errors = _relative_errors(press, lines, table.last_digits["travel"])
    flattening_changes = np.ptp(press.flattened, axis=0)
    deflection_errors = deflections_on_plate(
        slope_errors, flattening_changes, report.design, float(np.ptp(press.travel))
    )
    errors = K * _stiffness_errors(ratios, channels, deflection_errors, travel_error)
    return [
        PressedSpring(
            K=Estimate(float(K[tip]), float(errors[tip]), "N/mm"),
            deflection_percent=100.0 * float(deflection_errors[tip]),
            lack_of_fit=_compliance_lack_of_fit(lines[tip], channels.lacks_of_fit[tip]),
        )
        for tip in range(len(lines))
    ]


def _stiffness_errors(
    ratios: Floats, channels: ChannelCalibration, deflection_errors: Floats, travel_error: float
) -> Floats:
    """Return the relative standard error of each stiffness from a press on a plate (tips,) [1].

    `deflection_errors` (tips,) [1] and `travel_error` [1] are the relative errors of the deflections and of the travel.
    `ratios` (tips,) [1] are the stiffnesses divided by the stiffnesses from weights. The deviations of these ratios
    from 1 are treated as errors, split into a common part and differences between the tips.
    """
    mean_ratio = float(ratios.mean())
    return springs_on_plate(
        gains=0.01 * np.array(channels.gain_percent),
        deflections=deflection_errors,
        travel=travel_error,
        mean_difference=abs(mean_ratio - 1.0),
        differences_from_mean=np.abs(ratios / mean_ratio - 1.0),
    )


def _convert_press(table: MeasuredTable, channels: ChannelCalibration, report: Report) -> _PlatePress:
    """Convert the counts in the `table` of a press to forces, and compute the flattening of the domes under them."""
    keys = count_keys(len(report.tips))
    forces = (counts_of(table, keys) - channels.zero_counts) @ np.array(channels.newtons_per_count).T
    count_steps = np.column_stack([table.last_digits[key] for key in keys])
    return _PlatePress(
        travel=table.numbers["travel"],
        forces=forces,
        force_resolutions=np.diag(channels.newtons_per_count) * count_steps,
        flattened=np.column_stack([flattening(report.design, force) for force in forces.T]),
    )


def _fit_force_lines(press: _PlatePress, travel_resolutions: Floats) -> list[Line]:
    """Fit the line of force [N] against deflection [mm] of each tip.

    `travel_resolutions` (rows,) [mm] are the resolutions to which the travels are written.
    """
    # The mean stiffness converts the resolution of a travel to a resolution of the force [N].
    mean_stiffnesses = np.ptp(press.forces, axis=0) / np.ptp(press.deflections, axis=0)
    resolutions = np.hypot(press.force_resolutions, mean_stiffnesses * travel_resolutions[:, None])
    columns = zip(press.deflections.T, press.forces.T, resolutions.T, strict=True)
    return [fit_line(deflection, force, resolution) for deflection, force, resolution in columns]


def _check_travels(table: MeasuredTable) -> None:
    """Raise InputError for too few different travels, which do not determine a line and its error."""
    travel = table.numbers["travel"]
    travel_count = len(set(travel.tolist()))
    if travel_count < FEWEST or not np.ptp(travel) > LEAST_SPAN:
        unit = f"different travels within {np.ptp(travel):.2g} mm"
        raise validation_error(table.source, travel_count, unit, f"at least {FEWEST}", "press in five equal steps")


def _relative_errors(press: _PlatePress, lines: Sequence[Line], travel_resolutions: Floats) -> tuple[float, Floats]:
    """Return the relative standard error of the travel [1], and of the deflection from each channel (tips,) [1].

    `lines` are the fitted lines of force against deflection, by which each channel measures a deflection.
    `travel_resolutions` (rows,) [mm] are the resolutions to which the travels are written.

    An error in the travel is the same for all tips, so the mean residual of all channels estimates it. The scatter that
    remains after correcting the travel is the error of the deflection from each channel.
    """
    K = np.array([line.slope.value for line in lines])
    channel_deflections = (press.forces - [line.zero for line in lines]) / K  # (rows, tips) [mm]
    channel_resolutions = np.abs(press.force_resolutions / K)
    travel_errors = (channel_deflections - press.deflections).mean(axis=1)  # mean over the tips
    corrected_travel = press.travel + travel_errors
    # All these travels are equal except for errors, so the slopes are about 1, and their errors are relative errors.
    travel_line = fit_line(press.travel, corrected_travel, travel_resolutions)
    channel_travels = channel_deflections + press.flattened  # the travel that each channel measures
    columns = zip(channel_travels.T, channel_resolutions.T, strict=True)
    channel_lines = [fit_line(corrected_travel, travel, resolution) for travel, resolution in columns]
    return travel_line.slope.error, np.array([line.slope.error for line in channel_lines])


def _check_outliers(table: MeasuredTable, lines: Sequence[Line], forces: Floats) -> None:
    """Raise InputError for the first row that does not fit the line of its channel.

    `lines` are the fitted lines of force against deflection, one for each channel. `forces` (rows, tips) [N] are the
    forces that the channels measured; the message shows the force in the row.
    """
    for line, force, key in zip(lines, forces.T, count_keys(len(lines)), strict=True):
        outlier = line.outlier()
        if outlier is not None:
            place = place_of(table.source, table.lines[outlier.index], key)
            bound = f"about {outlier.expected:.4g} N, on the line through the other rows"
            hint = "check the travel of that row, and that all tips touch the plate; or leave out the row"
            raise validation_error(place, float(f"{force[outlier.index]:.4g}"), "N from its counts", bound, hint)


def _check_bends(table: MeasuredTable, lines: Sequence[Line]) -> None:
    """Raise InputError for a channel whose slope changes by more than `_LARGEST_BEND`, because its tip touched late."""
    for line, key in zip(lines, count_keys(len(lines)), strict=True):
        if line.bend.unexplained_change > _LARGEST_BEND:
            field = f"{table.source}: change of the slope of {key} from the first row to the last"
            hint = "leave out the rows before all tips touch the plate, and fix the plate and the sensor"
            raise validation_error(field, float(f"{line.bend.change:.3g}"), "", f"within +-{_LARGEST_BEND:g}", hint)


def _compliance_lack_of_fit(line: Line, force_lack_of_fit: LackOfFit) -> LackOfFit:
    """Return the lack of fit of a spring's compliance as a function of its force [N].

    `line` is the fitted line of force against deflection, and `force_lack_of_fit` is the lack of fit of the force
    itself, from the weights. A lack of fit that is common to both cancels in the compliance.
    """
    # The lack of fit of `line` is per mm of deflection. The line itself converts it to a lack of fit per newton:
    # deflection = (force - zero) / slope.
    deflection_lack_of_fit = line.bend.lack_of_fit
    per_N = deflection_lack_of_fit.per_x / line.slope.value
    at_zero = deflection_lack_of_fit.at_zero - per_N * line.zero
    return LackOfFit(at_zero=force_lack_of_fit.at_zero - at_zero, per_x=force_lack_of_fit.per_x - per_N)


def _check_agreement(
    table: MeasuredTable, ratios: Floats, weight_stiffnesses: Sequence[Estimate], report: Report
) -> None:
    """Raise InputError if the stiffnesses from the plate contradict the stiffnesses from the weights.

    `ratios` (tips,) [1] are the stiffnesses from the plate divided by `weight_stiffnesses`, the stiffnesses from the
    weights [N/mm]. The mean of the ratios must be close to 1. The ratios of two tips must not differ by more than the
    errors of the weights allow.
    """
    field = f"{table.source}: stiffness from the plate divided by stiffness from weights"
    hint = "check travel_mm and its unit, the order of the columns, and that all tips touch the plate in every row"
    mean = float(ratios.mean())
    if not abs(mean - 1.0) < _LARGEST_MEAN_DEVIATION:
        mean_field = f"{field}, mean of all tips"
        raise validation_error(mean_field, float(f"{mean:.4g}"), "", f"1 within {_LARGEST_MEAN_DEVIATION:g}", hint)
    order = np.argsort(ratios)
    smallest, largest = int(order[0]), int(order[-1])  # the tips whose ratios differ most
    error_of_both = float(np.hypot(weight_stiffnesses[smallest].relative, weight_stiffnesses[largest].relative))
    allowed = _LARGEST_DIFFERENCE + COVERAGE * error_of_both
    if not ratios[largest] / ratios[smallest] - 1.0 < allowed:
        # The tip whose ratio differs more from 1 is probably the faulty one.
        is_smallest_faulty = abs(ratios[largest] - 1.0) <= abs(ratios[smallest] - 1.0)
        faulty, good = (smallest, largest) if is_smallest_faulty else (largest, smallest)
        tip_field = f"{field}, {report.tips[faulty].name}"
        bound = f"within {allowed:.2g} of {ratios[good]:.4g}, the ratio of {report.tips[good].name}"
        raise validation_error(tip_field, float(f"{ratios[faulty]:.4g}"), "", bound, hint)
