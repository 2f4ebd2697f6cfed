"""Springs from a press on a hard flat plate, which lowers all tips alike: what each channel shows of a deflection.

A modulus follows from small differences of deflections. Weights calibrate forces. A deflection that follows from a
force, as F / K, has the error of the dial too that told K. On a plate all tips move by one travel, but for what glass
flattens of each dome, as Hertz has it.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from instrument.calibrate.channels import ChannelCalibration, counts_of, saturation_of
from instrument.calibrate.line_checks import LEAST_SPAN, LackOfFit, bend_of, odd_row
from instrument.calibrate.weighing import FEWEST, LEAST_ERROR, line_through
from instrument.press.count_codes import with_signed_counts
from instrument.press.signals import COUNTS, count_keys
from pipeline.report.report import Report
from pipeline.tables.files import place_of
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import LENGTH, Quantity
from pipeline.tables.words import WORDS
from sensor.arrays import Floats
from sensor.quantity import BOUNDED, COVERAGE, Estimate, validation_error
from sensor.theory.hertz import force_factor

_GLASS_MPA = 70e3 / (1.0 - 0.2**2)  # E / (1 - nu^2) of float glass: EN 572-1
_UNLIKE = 0.1  # of all stiffnesses: a dial or a balance is less wrong, a unit is more
_APART = 0.03  # of one against another: a dial is less wrong, a tip that touches late or another channel is more
_MOST_BENT = 0.1  # of a slope over a press: Hall sensors bend by less, a tip that touches late by more
_STEEPEST = 1.5  # E goes at most with this power of all deflections: Hertz


def measured_plate(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Return the press of a sensor on a hard plate: travels and signed counts; raises InputError.

    `counts_as` is how the counts are written, as in `signed_counts`.
    """
    keys = count_keys(len(report.tips))
    travel = Quantity(units=LENGTH, most=100.0, words=tuple(WORDS["words"]["travel"]))
    quantities = flags.applied({"travel": travel, **dict.fromkeys(keys, COUNTS)})
    table = numbers_of(source, quantities, [("travel", *keys)], ",".join(["travel_mm", *keys]))
    return with_signed_counts(table, keys, counts_as, saturation_of(report))


def pressed_springs(
    table: MeasuredTable, channels: ChannelCalibration, weighed: Sequence[Estimate], report: Report
) -> tuple[list[Estimate], list[float], list[LackOfFit]]:
    """Return the stiffness of each spring [N/mm], its force over its deflection on a plate of glass.

    Beside them are the standard deviation of each channel's deflection [%], and the lack of fit of each compliance over
    its force. All tips stand on the plate in every row.
    `weighed` are the stiffnesses from weights and dial [N/mm]; the error of each is its standard deviation, as that of
    those returned. Raises InputError for fewer than three different travels, for saturated counts, and for stiffnesses
    that are not those from weights.
    """
    travel = table.numbers["travel"]
    travels = len(set(travel.tolist()))
    if travels < FEWEST or not np.ptp(travel) > LEAST_SPAN:
        within = f"travels within {np.ptp(travel):.2g} mm"
        raise validation_error(table.source, travels, within, f"at least {FEWEST}", "press in five equal steps")
    keys = count_keys(len(weighed))
    counts = counts_of(table, keys) - channels.zero_counts
    forces = counts @ np.array(channels.newtons_per_count).T
    flattened = np.column_stack([flattening(report, force) for force in forces.T])
    deflections = travel[:, None] - flattened

    for key, deflection, force in zip(keys, deflections.T, forces.T, strict=True):
        _refuse_bad_row(table, deflection, force, key)
    lines = [np.polyfit(deflection, force, 1) for deflection, force in zip(deflections.T, forces.T, strict=True)]
    stiffnesses = np.array([line[0] for line in lines])
    ratios = stiffnesses / [spring.value for spring in weighed]
    mean_ratio = float(ratios.mean())
    _refuse_unlike(table, ratios, weighed, report)
    lacks_of_fit = []
    bends = _bends(table, deflections, forces, channels)
    for of_force, of_deflection, (stiffness, zero) in zip(channels.lacks_of_fit, bends, lines, strict=True):
        # The same over the force that the channel shows. What force and deflection share leaves the compliance right.
        per_N = of_deflection.per_x / stiffness
        at_zero = of_deflection.at_zero - per_N * zero
        lacks_of_fit.append(LackOfFit(at_zero=of_force.at_zero - at_zero, per_x=of_force.per_x - per_N))
    # A travel that is read wrong is so for all tips: what all channels show alike beside their lines is its error.
    shown = (forces - [line[1] for line in lines]) / stiffnesses
    read_wrong = (shown - deflections).mean(axis=1)
    of_travel = line_through(f"{table.source}: travel", travel, travel + read_wrong, table.last_digits["travel"], "1")

    springs = []
    left_percent = []
    for tip, key in enumerate(keys):
        last_digit = channels.newtons_per_count[tip][tip] / stiffnesses[tip] * table.last_digits[key]
        field = f"{table.source}: deflection of {report.tips[tip].name}"
        line = line_through(field, travel + read_wrong, shown[:, tip] + flattened[:, tip], np.abs(last_digit), "1")
        # The modulus of a print scatters, and the flattening is proportional to its power of two thirds.
        by_modulus = 2.0 / 3.0 * report.design.process.E_scatter * float(np.ptp(flattened[:, tip]) / np.ptp(travel))
        left_percent.append(100.0 * max(float(np.hypot(line.slope.error, by_modulus)), LEAST_ERROR))
        # Springs count as off apart, by the root of their squares; the travel moves all of them.
        by_travel = _STEEPEST * np.sqrt(len(keys)) * of_travel.slope.error
        by_scale = _STEEPEST * np.sqrt(len(keys)) * (BOUNDED * abs(mean_ratio - 1.0))
        causes = [0.01 * channels.gain_percent[tip], 0.01 * left_percent[tip], by_travel, by_scale]
        # Within this bound it may lie anywhere (JCGM 100:2008, 4.3.7).
        causes.append(BOUNDED * abs(ratios[tip] / mean_ratio - 1.0))
        error = float(np.linalg.norm(causes))
        springs.append(Estimate(float(stiffnesses[tip]), float(stiffnesses[tip]) * error, "N/mm"))
    return springs, left_percent, lacks_of_fit


def _refuse_bad_row(table: MeasuredTable, deflection: Floats, force: Floats, key: str) -> None:
    """Raise InputError, which names its line, for a row that does not fit the straight line of a channel."""
    step = table.last_digits["travel"] * np.ptp(force) / np.ptp(deflection)
    found = odd_row(deflection, force, step, float(np.ptp(force)))
    if found is not None:
        row = found.index
        place = place_of(table.source, table.lines[row], key)
        bound = f"about {found.expected:.4g} N, where the line of the other rows is"
        hint = "check that all tips stand on the plate in that row, and its travel; or leave the row out"
        raise validation_error(place, float(f"{force[row]:.4g}"), "N by its counts", bound, hint)


def _bends(table: MeasuredTable, deflections: Floats, forces: Floats, channels: ChannelCalibration) -> list[LackOfFit]:
    """Return the lack of fit of each channel over its deflection [mm].

    Raises InputError for a channel whose slope changes by more than a tenth: its tip touched late.
    """
    bends = []
    for tip, key in enumerate(count_keys(forces.shape[1])):
        stiffness = np.ptp(forces[:, tip]) / np.ptp(deflections[:, tip])
        digit = channels.newtons_per_count[tip][tip] * table.last_digits[key]
        bend = bend_of(deflections[:, tip], forces[:, tip], np.hypot(digit, stiffness * table.last_digits["travel"]))
        if bend.excess > _MOST_BENT:
            field = f"{table.source}: change of the slope of {key} from the first row to the last"
            hint = "leave out the rows before all tips stand on the plate, and hold plate and sensor still"
            raise validation_error(field, float(f"{bend.change:.3g}"), "", f"within +-{_MOST_BENT:g}", hint)
        bends.append(bend.lack_of_fit)
    return bends


def _refuse_unlike(table: MeasuredTable, ratios: Floats, weighed: Sequence[Estimate], report: Report) -> None:
    """Raise InputError where stiffnesses on a plate are not those from weights [N/mm], all of them or two of them.

    `ratios` are those on the plate over those from weights [1], (tips,).
    """
    mean = float(ratios.mean())
    hint = "check travel_mm and its unit, the order of the columns, and that all tips stand on the plate in every row"
    if not abs(mean - 1.0) < _UNLIKE:
        field = f"{table.source}: stiffness over that from weights, mean of all tips"
        raise validation_error(field, float(f"{mean:.4g}"), "", f"1 within {_UNLIKE:g}", hint)
    order = np.argsort(ratios)
    low, high = int(order[0]), int(order[-1])
    allowed = _APART + COVERAGE * float(np.hypot(weighed[low].relative, weighed[high].relative))
    if not ratios[high] / ratios[low] - 1.0 < allowed:
        odd, other = (high, low) if abs(ratios[high] - 1.0) > abs(ratios[low] - 1.0) else (low, high)
        field = f"{table.source}: stiffness over that from weights, {report.tips[odd].name}"
        bound = f"within {allowed:.2g} of that of {report.tips[other].name}, {ratios[other]:.4g}"
        raise validation_error(field, float(f"{ratios[odd]:.4g}"), "", bound, hint)


def flattening(report: Report, forces: Floats) -> Floats:
    """Return the flattening of a tip on glass [mm] by forces [N]; 0 for a flat face.

    Two elastic bodies: K. L. Johnson, Contact Mechanics (1985), (4.23), doi:10.1017/CBO9781139171731.
    """
    radius = report.design.tips.dome_radius_mm
    if radius is None:
        return np.zeros(len(forces))
    process = report.design.process
    reduced = 1.0 / ((1.0 - process.poisson**2) / process.E_MPa + 1.0 / _GLASS_MPA)
    return np.asarray((np.maximum(forces, 0.0) / force_factor(reduced, radius)) ** (2.0 / 3.0))
