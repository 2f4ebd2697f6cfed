"""Springs from a press on a hard flat plate, which moves all tips by the same travel.

A modulus depends on small differences of deflections. With weights only, a deflection F / K contains the error of the
dial that determined K. On a plate all tips have one travel, less the Hertzian flattening of each dome on glass.
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
from sensor.theory.straight_line import FEWEST, LEAST_SPAN, LackOfFit, Line, fitted

_UNLIKE = 0.1  # largest mean deviation from the weights [1]; a dial or a balance is better, a wrong unit is worse
_APART = 0.03  # largest deviation between tips [1]; a dial is better, a late touch or swapped channels are worse
# largest change of a slope over a press [1]; Hall sensors bend less, a tip that touches late bends more
_MOST_BENT = 0.1


def measured_plate(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Return the press of a sensor on a hard plate, as travels and signed counts; raises InputError.

    `counts_as` is the notation of the counts, as in `signed_counts`.
    """
    keys = count_keys(len(report.tips))
    travel = Quantity(units=LENGTH, most=100.0, words=tuple(WORDS["words"]["travel"]))
    quantities = flags.applied({"travel": travel, **dict.fromkeys(keys, COUNTS)})
    table = numbers_of(source, quantities, [("travel", *keys)], ",".join(["travel_mm", *keys]))
    return with_signed_counts(table, keys, counts_as, saturation_of(report))


class PressedSpring(NamedTuple):
    """A spring measured on a plate: its force over its deflection K [N/mm].

    `left_percent` is the standard deviation of the deflection that its channel shows. `lack_of_fit` describes the
    compliance over the force. Errors are standard deviations.
    """

    K: Estimate
    left_percent: float
    lack_of_fit: LackOfFit


def pressed_springs(
    table: MeasuredTable, channels: ChannelCalibration, weighed: Sequence[Estimate], report: Report
) -> list[PressedSpring]:
    """Return each spring from a press on a plate of glass, on which all tips stand in every row.

    `weighed` are the stiffnesses from weights and dial [N/mm]. Raises InputError for fewer than three different travels
    and for a row that does not fit. It also refuses a tip that touches late, and stiffnesses that contradict the
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

    # The last digits of counts and travel are rounded; both are expressed as forces.
    digits = np.diag(channels.newtons_per_count) * np.column_stack([table.last_digits[key] for key in keys])  # [N]
    steps = np.ptp(forces, axis=0) / np.ptp(deflections, axis=0) * table.last_digits["travel"][:, None]  # [N]
    columns = zip(deflections.T, forces.T, np.hypot(digits, steps).T, strict=True)
    lines = [fitted(*column) for column in columns]
    K = np.array([line.slope.value for line in lines])
    ratios = K / [spring.value for spring in weighed]
    _refuse_odd_rows(table, lines, forces)
    _refuse_unlike(table, ratios, weighed, report)
    _refuse_bent(table, lines)

    # A wrong reading of the travel is wrong for all tips, so the common residual of all channels is its error.
    shown = (forces - [line.zero for line in lines]) / K  # deflections by the channels [mm]
    read_wrong = (shown - deflections).mean(axis=1)
    of_travel = fitted(travel, travel + read_wrong, table.last_digits["travel"])
    of_channels = zip((shown + flattened).T, np.abs(digits / K).T, strict=True)
    left = np.array([fitted(travel + read_wrong, *column).slope.error for column in of_channels])
    left = deflections_on_plate(left, np.ptp(flattened, axis=0), report.design, float(np.ptp(travel)))
    mean_ratio = float(ratios.mean())
    errors = K * springs_on_plate(
        gains=0.01 * np.array(channels.gain_percent),
        deflections=left,
        travel=of_travel.slope.error,
        alike=abs(mean_ratio - 1.0),
        apart=np.abs(ratios / mean_ratio - 1.0),
    )
    return [
        PressedSpring(
            K=Estimate(float(K[tip]), float(errors[tip]), "N/mm"),
            left_percent=100.0 * float(left[tip]),
            lack_of_fit=_lack_of_compliance(lines[tip], channels.lacks_of_fit[tip]),
        )
        for tip in range(len(keys))
    ]


def _refuse_odd_rows(table: MeasuredTable, lines: Sequence[Line], forces: Floats) -> None:
    """Raise InputError for a row that does not fit the straight line of a channel; the message names the row."""
    for line, force, key in zip(lines, forces.T, count_keys(len(lines)), strict=True):
        found = line.odd_row()
        if found is not None:
            place = place_of(table.source, table.lines[found.index], key)
            bound = f"about {found.expected:.4g} N, where the line of the other rows is"
            hint = "check that all tips stand on the plate in that row, and its travel; or leave the row out"
            raise validation_error(place, float(f"{force[found.index]:.4g}"), "N by its counts", bound, hint)


def _refuse_bent(table: MeasuredTable, lines: Sequence[Line]) -> None:
    """Raise InputError for a channel whose slope changes by more than a tenth, because its tip touched late."""
    for line, key in zip(lines, count_keys(len(lines)), strict=True):
        if line.bend.excess > _MOST_BENT:
            field = f"{table.source}: change of the slope of {key} from the first row to the last"
            hint = "leave out the rows before all tips stand on the plate, and hold plate and sensor still"
            raise validation_error(field, float(f"{line.bend.change:.3g}"), "", f"within +-{_MOST_BENT:g}", hint)


def _lack_of_compliance(line: Line, of_force: LackOfFit) -> LackOfFit:
    """Return the lack of fit of a compliance over the force, from the line of a force over its deflection.

    `of_force` is the lack of fit of the force itself. A common lack of fit of both cancels in the compliance.
    """
    of_deflection = line.bend.lack_of_fit
    per_N = of_deflection.per_x / line.slope.value
    at_zero = of_deflection.at_zero - per_N * line.zero
    return LackOfFit(at_zero=of_force.at_zero - at_zero, per_x=of_force.per_x - per_N)


def _refuse_unlike(table: MeasuredTable, ratios: Floats, weighed: Sequence[Estimate], report: Report) -> None:
    """Raise InputError if stiffnesses on a plate contradict the weights [N/mm], in their mean or between two tips.

    `ratios` are stiffnesses on the plate over stiffnesses from weights [1], (tips,).
    """
    mean = float(ratios.mean())
    hint = "check travel_mm and its unit, the order of the columns, and that all tips stand on the plate in every row"
    if not abs(mean - 1.0) < _UNLIKE:
        field = f"{table.source}: stiffness on the plate over stiffness from weights, mean of all tips"
        raise validation_error(field, float(f"{mean:.4g}"), "", f"1 within {_UNLIKE:g}", hint)
    order = np.argsort(ratios)
    low, high = int(order[0]), int(order[-1])
    allowed = _APART + COVERAGE * float(np.hypot(weighed[low].relative, weighed[high].relative))
    if not ratios[high] / ratios[low] - 1.0 < allowed:
        odd, other = (high, low) if abs(ratios[high] - 1.0) > abs(ratios[low] - 1.0) else (low, high)
        field = f"{table.source}: stiffness on the plate over stiffness from weights, {report.tips[odd].name}"
        bound = f"within {allowed:.2g} of {ratios[other]:.4g}, the ratio of {report.tips[other].name}"
        raise validation_error(field, float(f"{ratios[odd]:.4g}"), "", bound, hint)
