"""Springs from a press on a hard flat plate, which moves all tips by the same travel.

A modulus depends on small differences of deflections. With weights only, a deflection F / K contains the error of the
dial that determined K. On a plate all tips have one travel, minus the Hertzian flattening of each dome on glass.
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

# largest mean deviation from the weights [1]; a dial or a balance is more accurate, and a wrong unit deviates more
_LARGEST_MEAN_DEVIATION = 0.1
# largest deviation between tips [1]; a dial is more accurate, and a late touch or swapped channels deviate more
_LARGEST_DIFFERENCE = 0.03
# largest change of a slope during a press [1]; Hall sensors bend less, and a tip that touches late bends more
_LARGEST_BEND = 0.1
_LARGEST_TRAVEL_MM = 100.0  # a larger one has a wrong unit


def read_plate_table(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Read the table of a press on a hard plate, which calibrates the springs: travels and signed counts.

    `source` is the file, and `flags` states columns and units that its header lacks. `counts_as` is the notation of the
    counts, as in `signed_counts`. Raises InputError unless the table has a travel and the counts of all channels.
    """
    keys = count_keys(len(report.tips))
    travel = Quantity(units=LENGTH, most=_LARGEST_TRAVEL_MM, words=tuple(WORDS["words"]["travel"]))
    quantities = flags.applied({"travel": travel, **dict.fromkeys(keys, COUNTS)})
    table = numbers_of(source, quantities, [("travel", *keys)], ",".join(["travel_mm", *keys]))
    return with_signed_counts(table, keys, counts_as, saturation_of(report))


class PressedSpring(NamedTuple):
    """A spring measured on a plate, with its stiffness K [N/mm].

    `left_percent` is the standard deviation of the deflection that its channel shows [%]. `lack_of_fit` is the error of
    a compliance that does not depend on the force.
    """

    K: Estimate
    left_percent: float
    lack_of_fit: LackOfFit


def pressed_springs(
    table: MeasuredTable, channels: ChannelCalibration, weighed: Sequence[Estimate], report: Report
) -> list[PressedSpring]:
    """Return each spring from a press on a plate of glass, on which all tips stand in every row.

    The stiffness is the slope of the force by the channels against the deflection, which is the travel minus the
    flattening of the dome. `weighed` are the stiffnesses from weights and dial [N/mm]. Raises InputError for fewer than
    three different travels, for an outlier, for a tip that touches late, and for stiffnesses that contradict the
    weights.
    """
    travel = table.numbers["travel"]
    travels = len(set(travel.tolist()))
    if travels < FEWEST or not np.ptp(travel) > LEAST_SPAN:
        within = f"travels within {np.ptp(travel):.2g} mm"
        raise validation_error(table.source, travels, within, f"at least {FEWEST}", "press in five equal steps")
    keys = count_keys(len(weighed))
    forces = (counts_of(table, keys) - channels.zero_counts) @ np.array(channels.newtons_per_count).T
    flattened = np.column_stack([flattening(report.design, force) for force in forces.T])
    deflections = travel[:, None] - flattened

    # The resolutions of counts and travel, both expressed as forces [N].
    resolutions = np.diag(channels.newtons_per_count) * np.column_stack([table.last_digits[key] for key in keys])
    travel_resolutions = np.ptp(forces, axis=0) / np.ptp(deflections, axis=0) * table.last_digits["travel"][:, None]
    columns = zip(deflections.T, forces.T, np.hypot(resolutions, travel_resolutions).T, strict=True)
    lines = [fit_line(*column) for column in columns]
    K = np.array([line.slope.value for line in lines])
    ratios = K / [spring.value for spring in weighed]
    _refuse_outliers(table, lines, forces)
    _refuse_contradiction(table, ratios, weighed, report)
    _refuse_bends(table, lines)

    # A wrong reading of the travel is wrong for all tips, so the common residual of all channels is its error.
    channel_deflections = (forces - [line.zero for line in lines]) / K  # [mm]
    travel_errors = (channel_deflections - deflections).mean(axis=1)
    travel_line = fit_line(travel, travel + travel_errors, table.last_digits["travel"])
    travels_by_channels = zip((channel_deflections + flattened).T, np.abs(resolutions / K).T, strict=True)
    channel_lines = [fit_line(travel + travel_errors, *column) for column in travels_by_channels]
    deflection_errors = np.array([line.slope.error for line in channel_lines])
    travel_span = float(np.ptp(travel))
    deflection_errors = deflections_on_plate(deflection_errors, np.ptp(flattened, axis=0), report.design, travel_span)
    # The deviations from the weights count as errors: the common one, and what differs between the tips.
    mean_ratio = float(ratios.mean())
    errors = K * springs_on_plate(
        gains=0.01 * np.array(channels.gain_percent),
        deflections=deflection_errors,
        travel=travel_line.slope.error,
        alike=abs(mean_ratio - 1.0),
        apart=np.abs(ratios / mean_ratio - 1.0),
    )
    return [
        PressedSpring(
            K=Estimate(float(K[tip]), float(errors[tip]), "N/mm"),
            left_percent=100.0 * float(deflection_errors[tip]),
            lack_of_fit=_compliance_lack_of_fit(lines[tip], channels.lacks_of_fit[tip]),
        )
        for tip in range(len(keys))
    ]


def _refuse_outliers(table: MeasuredTable, lines: Sequence[Line], forces: Floats) -> None:
    """Raise InputError for an outlier: a row that does not fit the line of force against deflection of a channel.

    `forces` (rows, tips) [N] are the forces by the channels. The message names the row.
    """
    for line, force, key in zip(lines, forces.T, count_keys(len(lines)), strict=True):
        outlier = line.outlier()
        if outlier is not None:
            place = place_of(table.source, table.lines[outlier.index], key)
            bound = f"about {outlier.expected:.4g} N, where the line of the other rows is"
            hint = "check that all tips stand on the plate in that row, and its travel; or leave the row out"
            raise validation_error(place, float(f"{force[outlier.index]:.4g}"), "N by its counts", bound, hint)


def _refuse_bends(table: MeasuredTable, lines: Sequence[Line]) -> None:
    """Raise InputError for a channel whose slope changes by more than a tenth, because its tip touched late."""
    for line, key in zip(lines, count_keys(len(lines)), strict=True):
        if line.bend.excess > _LARGEST_BEND:
            field = f"{table.source}: change of the slope of {key} from the first row to the last"
            hint = "leave out the rows before all tips stand on the plate, and hold plate and sensor still"
            raise validation_error(field, float(f"{line.bend.change:.3g}"), "", f"within +-{_LARGEST_BEND:g}", hint)


def _compliance_lack_of_fit(line: Line, force_lack_of_fit: LackOfFit) -> LackOfFit:
    """Return the lack of fit of a spring's compliance as a function of its force.

    `line` is the line of force against deflection, and `force_lack_of_fit` the lack of fit of the force itself. A
    common lack of fit of both cancels in the compliance.
    """
    # The deflection is (force - zero) / slope, which turns a change per mm into a change per N.
    deflection_lack_of_fit = line.bend.lack_of_fit
    per_N = deflection_lack_of_fit.per_x / line.slope.value
    at_zero = deflection_lack_of_fit.at_zero - per_N * line.zero
    return LackOfFit(at_zero=force_lack_of_fit.at_zero - at_zero, per_x=force_lack_of_fit.per_x - per_N)


def _refuse_contradiction(table: MeasuredTable, ratios: Floats, weighed: Sequence[Estimate], report: Report) -> None:
    """Raise InputError if stiffnesses from the plate contradict those from the weights.

    `ratios` (tips,) are stiffnesses on the plate divided by `weighed`, the stiffnesses from the weights [N/mm]. Their
    mean must be nearly 1, and the ratios of two tips must differ by no more than the errors of the weights allow.
    """
    mean = float(ratios.mean())
    hint = "check travel_mm and its unit, the order of the columns, and that all tips stand on the plate in every row"
    if not abs(mean - 1.0) < _LARGEST_MEAN_DEVIATION:
        field = f"{table.source}: stiffness on the plate over stiffness from weights, mean of all tips"
        raise validation_error(field, float(f"{mean:.4g}"), "", f"1 within {_LARGEST_MEAN_DEVIATION:g}", hint)
    order = np.argsort(ratios)
    low, high = int(order[0]), int(order[-1])
    allowed = _LARGEST_DIFFERENCE + COVERAGE * float(np.hypot(weighed[low].relative, weighed[high].relative))
    if not ratios[high] / ratios[low] - 1.0 < allowed:
        # The tip whose ratio is farther from 1 is probably the wrong one.
        wrong, other = (high, low) if abs(ratios[high] - 1.0) > abs(ratios[low] - 1.0) else (low, high)
        field = f"{table.source}: stiffness on the plate over stiffness from weights, {report.tips[wrong].name}"
        bound = f"within {allowed:.2g} of {ratios[other]:.4g}, the ratio of {report.tips[other].name}"
        raise validation_error(field, float(f"{ratios[wrong]:.4g}"), "", bound, hint)
