"""Calibration of a printed sensor from weights on its tips, and of its material's modulus from weights on a coupon."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from cad.parts.coupon import modulus_factor
from instrument.calibrate.creep import Weighing, correct_weights
from instrument.calibrate.fruit_presses import ScaleFit, scale_of_presses
from instrument.calibrate.hard_plate import PressedSpring, fit_springs_on_plate
from instrument.calibrate.reference_presses import BallPresses, PressedBall, measure_ball_correction
from instrument.calibrate.unit_table import UnitRow, compute_leaf_trims, error_sources, unit_table
from instrument.calibrate.unit_verdicts import unit_verdicts
from instrument.calibrate.weights import (
    DEFLECTION,
    ChannelCalibration,
    calibrate_channels,
    fit_weight_lines,
    saturation_of,
    stiffness_of_line,
)
from instrument.press.count_codes import refuse_without_counts, with_signed_counts
from instrument.press.measuring import MeasuringUnit
from instrument.press.printed_unit import (
    WEIGHED_AFTER,
    PrintedUnit,
    check_weighed_after,
    design_digest,
    nominal_unit,
)
from instrument.press.signals import COUNTS, count_keys
from pipeline.report.report import Report, check_report
from pipeline.storage.plain import Plain
from pipeline.storage.record_data import as_data
from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import FORCE, LENGTH, TIME, Quantity
from sensor.attributes import with_attributes
from sensor.design.reading import ReadingRequirements
from sensor.input_file import path_of
from sensor.quantity import (
    COVERAGE,
    UNIFORM_DEVIATION,
    Estimate,
    InputError,
    python_numbers,
    report_field,
    validation_error,
)
from sensor.theory.contrast_law import ReadingError
from sensor.theory.straight_line import LackOfFit, Line
from sensor.turns import in_turn
from sensor.verdict import Verdict

_OBJECTS = {"tip": Quantity(units={}, words=tuple(WORDS["calibration"]["tip"])), "coupon": Quantity(units={})}
_WEIGHED = {
    "force": Quantity(units=FORCE, most=1e3, words=(*WORDS["calibration"]["weight"], *WORDS["words"]["force"])),
    "deflection": Quantity(units=LENGTH, most=100.0, words=tuple(WORDS["words"]["travel"])),
}
_SINCE = Quantity(units=TIME, default="s", most=WEIGHED_AFTER.at_most or math.inf)
"""Time since the weight was hung, in a column of its own: the clock of a serial monitor does not show this time."""
WITHOUT_PLATE = "the design expects a press on a hard plate: without --plate firm flesh is read with a larger error"
WITHOUT_BALL = (
    "the design expects presses on a reference ball: without --ball the form errors of the domes bias all readings"
)
UNLIKE_DESIGN = 3.0
"""Largest factor between the measured and the designed stiffness of a spring; real prints differ by less."""
_MUCH_LESS_ACCURATE = 2.0  # ratio of two error bars, by judgement: above it, the wider one is worth a note
KNOWN_WELL_PERCENT = 0.5
"""Half width at 95 % [%] of an accurately known stiffness, which a dial indicator can determine without a plate."""
_EXAMPLE = "tip,weight_g,deflection_mm"  # header of the smallest table of weights, for messages
# Fields of a unit that describe how its calibration lines deviate from straight lines.
_BENDS = ("force_bend", "force_bend_per_N", "deflection_bend", "deflection_bend_per_N")


def _unit_data(calibration: "Calibration") -> Plain:
    """Return the part of a unit that the JSON output shows; unit.toml holds the whole unit."""
    unit = as_data(calibration.unit)
    shown = {key: unit[key] for key in ("tips", "method", "K_N_per_m", "K_percent", *_BENDS)}
    return shown if calibration.unit.ball is None else {**shown, "ball": unit["ball"]}


def _trims_data(calibration: "Calibration") -> Plain:
    """Return the name and the trim of each tip for the JSON output."""
    trims = zip(calibration.unit.tips, calibration.trims, strict=False)  # a design without a housing has no trims
    return {"trims": [{"tip": tip, "leaf_longer_mm": longer} for tip, longer in trims]}


def _channels_data(calibration: "Calibration") -> Plain:
    """Return the calibration of the channels for the JSON output.

    The gain errors of the unit replace the gain errors from the weights, because a press on a plate may determine the
    gains more accurately.
    """
    return {"channels": {**as_data(calibration.channels), "gain_percent": [*calibration.unit.gain_percent]}}


@with_attributes
@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The result of calibrating a printed unit: the unit, which targets it meets, and corrections to its leaves.

    `pipeline calibrate` prints the same numbers. Values that its JSON output omits are None or empty here.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run --out outputs/mine
    >>> calibration = twintip.calibrate(report, "weights.csv")
    >>> [round(K) for K in calibration.unit.K_N_per_m]
    [1000, 22000]
    """

    unit: PrintedUnit = report_field(
        "",
        "the unit, as in unit.toml; its bends are null if all calibration lines are straight, and `ball` is left out "
        "without a reference ball",
        key="`tips`, `method`, `K_N_per_m`, `K_percent`, `force_bend`, `force_bend_per_N`, `deflection_bend`, "
        "`deflection_bend_per_N`, `ball`",
        inline=_unit_data,
    )
    nominal: tuple[float, ...] = report_field(
        "N/m", "stiffness of each spring in the design", key="design_K_N_per_m", times=1e3, attribute_unit="N/mm"
    )
    weighing: Weighing = report_field(
        "",
        "time from hanging a weight to its reading; whether the creep is that of the `unit` or of the `process`; "
        "growth of the deflection per decade of time, and its standard deviation",
        key="`weighed_after_s`, `creep_of`, `creep_per_decade`, `creep_error`",
        inline=lambda it: as_data(it.weighing),
    )
    press_s: float = report_field("s", "duration of a press")
    stiffened: float = report_field(
        "1", "stiffness in a press divided by the stiffness under a weight", key="K_press_over_weighed"
    )
    table: tuple[UnitRow, ...] = report_field(
        "",
        "for moduli that span the range of the design: force of each tip, P, half width of the error bar of E, and "
        "error of E if it is read with the designed stiffnesses",
    )
    verdicts: list[Verdict] = report_field(
        "", "whether the unit meets the targets of its design, as in [report.json](report-json.md#verdicts)"
    )
    trims: list[float | None] = report_field(
        "",
        "for each tip, the change in leaf length that gives its spring the designed stiffness; null if the designed "
        "stiffness lies within the error of K",
        inline=_trims_data,
        attribute_unit="mm",
    )
    channels: ChannelCalibration | None = report_field(
        "",
        "slopes, zeros, gain, bend, crosstalk, hysteresis and drift of the channels; left out if the table has no "
        "counts",
        inline=_channels_data,
        left_out=True,
        default=None,
    )
    scale: ScaleFit | None = report_field(
        "",
        "the scale as in unit.toml, the number of its fruit, and for each curve its cross-validation error (one "
        "standard deviation) for fruit left out of the fit; left out without `--fruit`",
        left_out=True,
        default=None,
    )
    ball_presses: BallPresses | None = report_field(
        "",
        "number of accepted presses on the ball, number of all presses, and flags of the rejected presses; left out "
        "without `--ball`",
        left_out=True,
        default=None,
    )
    assumed: list[str] = report_field("", "assumptions made for values that were not given", has_key=False)
    error_by: str = report_field("", "error sources in the table", has_key=False)


@in_turn()
def calibrate(
    report: Report,
    weights: str | Path,
    after_s: float | None = None,
    counts_as: Literal["unsigned", "offset"] | None = None,
) -> Calibration:
    """Calibrate a printed unit from a table of weights, as `pipeline calibrate` does without further tables.

    The command also takes a press on a hard plate, presses on a reference ball, and fruit of known firmness. It takes
    the table of a coupon, ripeness classes, and names and units of columns too.

    Parameters
    ----------
    report : Report
        The report of the design, from `read_report`.
    weights : str or Path
        Table of the weights hung on each tip and the resulting deflections.
    after_s : float, optional
        Time from hanging a weight to its reading [s], if the table has no times.
    counts_as : "unsigned" or "offset", optional
        How the table writes counts, if it writes them without signs.

    Returns
    -------
    Calibration
        The calibrated unit, which targets it meets, and the corrections to the lengths of its leaves.

    Raises
    ------
    InputError
        If the table is invalid, or does not fit the springs of this design.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run --out outputs/mine
    >>> calibration = twintip.calibrate(report, "weights.csv")
    >>> len(calibration.unit.K_N_per_m)  # one stiffness per tip
    2
    """
    check_report(report)
    after_s = python_numbers(after_s)
    check_weighed_after("after_s", after_s)
    table = read_print_table(path_of(weights, "weights"), report, counts_as=counts_as)
    if "coupon" in table.texts:
        hint = "pipeline calibrate finds the modulus of a coupon"
        raise validation_error("weights", str(weights), "", "a table with a column tip", hint)
    return calibrate_unit(report, table, after_s=after_s)


def read_print_table(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Read the table of weights and deflections of a printed unit or of a coupon.

    The table of a unit has a column `tip`, and may have one column of counts for each channel. The returned counts are
    signed. The table of a coupon has a column `coupon` instead. `flags` specifies columns and units that the header
    lacks. `counts_as` is the notation of the counts: "unsigned", "offset", or None for signed counts.

    Raises InputError unless the table has exactly one of the columns `tip` and `coupon`. InputError is also raised if a
    tip is unknown, if only some channels have counts, and if a count is beyond the range of the converter. A table
    without counts is refused if `counts_as` is given.
    """
    count_names = count_keys(len(report.tips))
    quantities = flags.applied({**_OBJECTS, **_WEIGHED, "t": _SINCE, **dict.fromkeys(count_names, COUNTS)})
    table = numbers_of(source, quantities, [("tip", *_WEIGHED), ("coupon", *_WEIGHED)], _EXAMPLE)
    if len(table.texts) != 1:
        place = place_of(table.source, table.header)
        bound = "a header with one column that is named tip or coupon"
        raise validation_error(place, ", ".join(table.texts), "", bound, f"for instance {_EXAMPLE}")
    if "tip" not in table.texts:  # the table of a coupon, which has no counts
        refuse_without_counts(counts_as, table.source)
        return table
    has_counts = _has_counts_of_all_channels(table, count_names)
    named_table = _complete_names(table, [tip.name for tip in report.tips])
    if not has_counts:
        refuse_without_counts(counts_as, table.source)
        return named_table
    return with_signed_counts(named_table, count_names, counts_as, saturation_of(report))


def _has_counts_of_all_channels(table: MeasuredTable, count_names: Sequence[str]) -> bool:
    """Return whether a table has the counts of all channels (True) or of no channel (False).

    `count_names` are the names of the count columns, one for each channel. Raises InputError if only some channels have
    counts, and for counts of an unknown channel.
    """
    count_columns = [name for name in count_names if name in table.numbers]
    # A column whose label begins with "counts" is probably a channel with a misspelt or unknown name.
    unknown_columns = [label for label in table.passed_over if label.lower().startswith("counts")]
    lacks_some_counts = 0 < len(count_columns) < len(count_names)
    if unknown_columns or lacks_some_counts:
        place = place_of(table.source, table.header)
        found_columns = ", ".join([*count_columns, *unknown_columns])
        bound = f"the counts of all channels, {', '.join(count_names)}, or of none"
        raise validation_error(place, found_columns, "", bound, f"for instance {','.join([_EXAMPLE, *count_names])}")
    return bool(count_columns)


def _complete_names(table: MeasuredTable, names: Sequence[str]) -> MeasuredTable:
    """Return the table of weights with each tip or leaf named exactly as in the design.

    `names` are the names in the design. A table may write a name in any case, or only its first letter if no other name
    begins with this letter. Raises InputError for any other name.
    """
    ((column, texts),) = table.texts.items()  # `tip` or `coupon`, the only column of texts
    initials = [name[0].casefold() for name in names]
    full_names = {name.casefold(): name for name in names}
    for initial, name in zip(initials, names, strict=True):
        if initials.count(initial) == 1:
            full_names[initial] = name
    for line, text in zip(table.lines, texts, strict=True):
        if text.casefold() not in full_names:
            place = place_of(table.source, line, column)
            raise validation_error(place, text, "", f"one of {', '.join(names)}", "use the names in report.json")
    return replace(table, texts={column: tuple(full_names[text.casefold()] for text in texts)})


def calibrate_unit(
    report: Report,
    table: MeasuredTable,
    fruit: MeasuredTable | None = None,
    plate: MeasuredTable | None = None,
    after_s: float | None = None,
    ball: PressedBall | None = None,
) -> Calibration:
    """Calibrate a printed unit from its table of weights and from optional further measurements.

    `report` holds the design of the unit. `table` holds the weights and comes from `read_print_table`. `after_s` [s] is
    the time from hanging a weight to its reading, if `table` has no times. The optional measurements are:

    - `plate`, from `read_plate_table`: a press on a hard plate, which determines the springs more accurately;
    - `ball`: presses on a reference ball, which determine a factor that corrects all readings;
    - `fruit`, from `read_fruit_table`: presses on fruit, which determine the scale of another instrument.

    Raises InputError if a table does not determine the springs or contradicts the design, and if a unit with these
    springs cannot read a modulus.
    """
    designed = MeasuringUnit(report=report, unit=nominal_unit(report))
    weighing = correct_weights(table, report, after_s)
    springs, channels, spring_notes = _measure_springs(table, weighing, plate, designed)
    unit, ball_presses = _correct_by_ball(_build_unit(report, weighing, springs, channels), ball, report)
    sensor = MeasuringUnit(report=report, unit=unit)
    designed_stiffnesses = designed.unit.stiffnesses
    try:  # a unit whose springs differ too much from the design cannot read a modulus
        scale_fit = None if fruit is None else scale_of_presses(fruit, sensor)
        table_rows = unit_table(sensor, designed)
        verdicts = unit_verdicts(sensor, table_rows)
        error_by = error_sources(sensor)
    except ReadingError as error:
        msg = f"{table.source}: {error}"
        raise InputError(msg) from error
    return Calibration(
        unit=unit if scale_fit is None else replace(unit, scale=scale_fit.scale),
        nominal=designed_stiffnesses,
        table=table_rows,
        verdicts=verdicts,
        trims=compute_leaf_trims(sensor, designed_stiffnesses),
        assumed=[*_notes_on_missing_presses(report, plate, ball), *spring_notes],
        error_by=error_by,
        weighing=weighing,
        stiffened=sensor.press_stiffness_ratio(),
        press_s=report.design.press_s,
        scale=scale_fit,
        channels=channels,
        ball_presses=ball_presses,
    )


def _correct_by_ball(
    unit: PrintedUnit, ball: PressedBall | None, report: Report
) -> tuple[PrintedUnit, BallPresses | None]:
    """Return the unit with its correction by presses on a reference ball, and the numbers of these presses.

    Without a `ball`, the unit is returned unchanged, and there are no numbers. Raises InputError if the presses do not
    determine a correction.
    """
    if ball is None:
        return unit, None
    # The presses are read with the calibrated springs, but without the correction that they determine.
    correction, ball_presses = measure_ball_correction(ball, MeasuringUnit(report=report, unit=unit))
    return replace(unit, ball=correction), ball_presses


def _notes_on_missing_presses(report: Report, plate: MeasuredTable | None, ball: PressedBall | None) -> list[str]:
    """Return a note for each measurement that the design expects but that is missing: a ball, and a hard plate."""
    requirements = report.design.reading or ReadingRequirements()
    notes = []
    if ball is None and requirements.calibrated_by == "ball":
        notes.append(WITHOUT_BALL)
    if plate is None and requirements.on_plate:
        notes.append(WITHOUT_PLATE)
    return notes


def _measure_springs(
    table: MeasuredTable, weighing: Weighing, plate: MeasuredTable | None, designed: MeasuringUnit
) -> tuple["_CalibratedSprings", ChannelCalibration | None, list[str]]:
    """Measure the springs and channels of a unit by weights, and the springs also on a plate if `plate` is given.

    `weighing` holds the weights of `table` corrected for creep, and `designed` is a unit with the designed stiffnesses.
    Returns the springs, the calibration of the channels (None if the table has no counts), and notes on the accuracy.
    Raises InputError if a table does not determine the springs or contradicts the design.
    """
    report = designed.report
    notes = [weighing.note] if weighing.note else []
    deflection_lines, channels = _fit_weights(table, weighing, designed)
    plate_springs = None
    if plate is not None:
        plate_springs, plate_notes = _measure_springs_on_plate(plate, table, channels, deflection_lines, report)
        notes += plate_notes
    notes += _notes_on_bends(table, report, deflection_lines, channels)
    return _choose_springs(report, deflection_lines, channels, plate_springs), channels, notes


def _fit_weights(
    table: MeasuredTable, weighing: Weighing, designed: MeasuringUnit
) -> tuple[list[Line], ChannelCalibration | None]:
    """Fit straight lines to the table of weights, which give the compliances of the springs and the channel slopes.

    `weighing` holds the weights corrected for creep. `designed` is a unit with the designed stiffnesses, with which the
    measured stiffnesses must agree within the factor `UNLIKE_DESIGN`. Returns the line of deflection [mm] against
    weight [N] of each tip, and the calibration of the channels (None if the table has no counts).

    Raises InputError if the table does not determine the springs, or contradicts the design.
    """
    report = designed.report
    names = [tip.name for tip in report.tips]
    count_columns = [key for key in count_keys(len(names)) if key in table.numbers]
    lines = fit_weight_lines(table, names, count_columns, weighing.forces)
    deflection_lines = [lines[name, DEFLECTION] for name in names]
    _check_stiffnesses(table, [stiffness_of_line(line) for line in deflection_lines], designed)
    return deflection_lines, calibrate_channels(table, report, lines, weighing.forces)


class _CalibratedSprings(NamedTuple):
    """The springs of a unit, and the method by which they were measured.

    `method` describes the measurement for a person, and `calibrated_by` is its short name, "plate" or "weights". The
    other fields hold one entry for each tip: the stiffness [N/mm], the gain error [%], and the error of assuming a
    straight line for the deflection. A gain error is the standard deviation of the force that the channel measures.
    After a calibration on a plate, it is the standard deviation of the deflection instead.
    """

    method: str
    calibrated_by: str
    stiffnesses: Sequence[Estimate]
    gain_percent: Sequence[float]
    lacks_of_fit: Sequence[LackOfFit]


def _choose_springs(
    report: Report,
    deflection_lines: Sequence[Line],
    channels: ChannelCalibration | None,
    plate_springs: Sequence[PressedSpring] | None,
) -> _CalibratedSprings:
    """Choose the most accurate measurement of the springs: the plate, or the weights if there was no plate.

    `deflection_lines` are the fitted lines of deflection [mm] against weight [N], one for each tip. `channels` is None
    if the table of weights has no counts. `plate_springs` is None if there was no press on a plate.
    """
    if plate_springs is None:
        return _springs_by_weights(report, deflection_lines, channels)
    return _CalibratedSprings(
        method="counts of weights, and a hard plate",
        calibrated_by="plate",
        stiffnesses=[spring.K for spring in plate_springs],
        gain_percent=[spring.deflection_percent for spring in plate_springs],
        lacks_of_fit=[spring.lack_of_fit for spring in plate_springs],
    )


def _springs_by_weights(
    report: Report, deflection_lines: Sequence[Line], channels: ChannelCalibration | None
) -> _CalibratedSprings:
    """Return the springs that the weights determine, from the line of deflection [mm] against weight [N] of each tip.

    `channels` is None if the table of weights has no counts. Nothing is then known of the channels, so the design's
    error for uncalibrated channels applies.
    """
    gain_percent: Sequence[float]
    if channels:
        method = "weights and deflections, counts of the same weights"
        gain_percent = channels.gain_percent
    else:
        method = "weights and deflections"
        requirements = report.design.reading or ReadingRequirements()
        gain_percent = len(deflection_lines) * [requirements.uncalibrated_gain_percent]
    return _CalibratedSprings(
        method=method,
        calibrated_by="weights",
        stiffnesses=[stiffness_of_line(line) for line in deflection_lines],
        gain_percent=gain_percent,
        lacks_of_fit=[line.bend.lack_of_fit for line in deflection_lines],
    )


def _build_unit(
    report: Report, weighing: Weighing, springs: _CalibratedSprings, channels: ChannelCalibration | None
) -> PrintedUnit:
    """Build the record of the unit that later readings use, from its calibrated springs and channels.

    `channels` is None if the table of weights has no counts. The unit then has no conversion from counts to forces, and
    its `saturation_counts` is 0. The gain errors of the unit combine the errors of the calibration with the later drift
    of the gains.
    """
    # The drift of a gain is given as a bound, within which all values are equally likely.
    drifts = UNIFORM_DEVIATION * np.array(report.read_out.channels.gain_drift_percent)
    force_bend, force_bend_per_N = _split_bends(channels.lacks_of_fit if channels else ())
    deflection_bend, deflection_bend_per_N = _split_bends(springs.lacks_of_fit)
    return PrintedUnit(
        design=report.design.name,
        design_sha256=design_digest(report.design),
        tips=tuple(tip.name for tip in report.tips),
        method=springs.method,
        K_N_per_m=tuple(1e3 * K.value for K in springs.stiffnesses),  # from N/mm
        K_percent=tuple(K.percent for K in springs.stiffnesses),
        gain=(1.0,) * len(springs.stiffnesses),  # the calibrated channels need no further correction
        gain_percent=tuple(math.hypot(*errors) for errors in zip(springs.gain_percent, drifts, strict=True)),
        newtons_per_count=channels.newtons_per_count if channels else (),
        zero_counts=tuple(channels.zero_counts.tolist()) if channels else (),
        saturation_counts=channels.saturation if channels else 0,
        calibrated_by=springs.calibrated_by,
        weighed_after_s=weighing.after_s,
        creep_per_decade=weighing.creep.per_decade if weighing.is_measured else None,
        creep_error=weighing.creep.error if weighing.is_measured else None,
        force_bend=force_bend,
        force_bend_per_N=force_bend_per_N,
        deflection_bend=deflection_bend,
        deflection_bend_per_N=deflection_bend_per_N,
    )


def _split_bends(lacks_of_fit: Sequence[LackOfFit]) -> tuple[tuple[float, ...] | None, tuple[float, ...] | None]:
    """Return each tip's relative slope error at zero force [1], and the change of this error per newton [1/N].

    `lacks_of_fit` holds both numbers for each tip. Both results are None if all calibration lines are straight.
    """
    all_straight = not any(map(any, lacks_of_fit))  # both numbers of every tip are 0
    if all_straight:
        return None, None
    at_zero, per_N = zip(*lacks_of_fit, strict=True)
    return at_zero, per_N


def _check_stiffnesses(table: MeasuredTable, stiffnesses: Sequence[Estimate], designed: MeasuringUnit) -> None:
    """Raise InputError if a stiffness differs from the design by more than the factor `UNLIKE_DESIGN`."""
    nominal = designed.unit.stiffnesses
    for tip, stiffness, K in zip(designed.report.tips, stiffnesses, nominal, strict=True):
        ratio = stiffness.value / K
        if not 1.0 / UNLIKE_DESIGN < ratio < UNLIKE_DESIGN:
            field = f"{table.source}: stiffness of {tip.name} divided by its stiffness in the design"
            bound = f"from {1.0 / UNLIKE_DESIGN:.2g} to {UNLIKE_DESIGN:g}"
            hint = "check the names of the tips, and the units"
            raise validation_error(field, float(f"{ratio:.3g}"), "", bound, hint)


def _measure_springs_on_plate(
    plate: MeasuredTable,
    table: MeasuredTable,
    channels: ChannelCalibration | None,
    deflection_lines: Sequence[Line],
    report: Report,
) -> tuple[list[PressedSpring], list[str]]:
    """Measure the springs by a press on a plate, and return one spring for each tip and notes on their accuracy.

    `plate` is the table of the press. The `channels`, calibrated by the `table` of weights, convert its counts to
    forces; they are None if the weights have no counts. `deflection_lines` are the lines of deflection [mm] against
    weight [N], one for each tip. Raises InputError if there are no counts, and if the stiffnesses from the weights
    contradict the press.
    """
    if channels is None:
        columns = ", ".join(count_keys(len(report.tips)))
        bound = "a table with the counts of each channel, which --plate needs"
        raise validation_error(table.source, "weights without counts", "", bound, f"add the columns {columns}")
    weight_stiffnesses = [stiffness_of_line(line) for line in deflection_lines]
    plate_springs = fit_springs_on_plate(plate, channels, weight_stiffnesses, report)
    names = [tip.name for tip in report.tips]
    return plate_springs, _notes_on_plate(plate_springs, weight_stiffnesses, names, plate)


def _notes_on_plate(
    plate_springs: Sequence[PressedSpring],
    weight_stiffnesses: Sequence[Estimate],
    names: Sequence[str],
    plate: MeasuredTable,
) -> list[str]:
    """Return one note if the plate determines a stiffness much less accurately than the weights do, otherwise none.

    `weight_stiffnesses` are the stiffnesses [N/mm] that the weights determine, `names` are the names of the tips, and
    `plate` is the table of the press on the plate.
    """
    plate_errors = [COVERAGE * spring.K.percent for spring in plate_springs]  # half widths at 95 % [%]
    weight_errors = [COVERAGE * K.percent for K in weight_stiffnesses]
    # The note is about one tip: the one for which the plate compares worst with the weights.
    worst = int(np.argmax(np.divide(plate_errors, weight_errors)))
    if plate_errors[worst] <= max(_MUCH_LESS_ACCURATE * weight_errors[worst], KNOWN_WELL_PERCENT):
        return []
    resolution = float(plate.last_digits["travel"].min())
    return [
        f"the stiffness of the {names[worst]} spring is known to ± {plate_errors[worst]:.2g} % from the plate, but to "
        f"± {weight_errors[worst]:.2g} % from the weights. The resolution of the travel is taken as {resolution:g} mm, "
        "the last digit written. Write all digits of the dial, press farther and more often, or leave out --plate."
    ]


def _notes_on_bends(
    table: MeasuredTable, report: Report, deflection_lines: Sequence[Line], channels: ChannelCalibration | None
) -> list[str]:
    """Return a note for each calibration line that is noticeably bent.

    The lines are the deflection of each tip and the counts of each channel, both as functions of the weight.
    `deflection_lines` are the lines of the tips, and `channels` is None if the `table` of weights has no counts.
    """
    changes = {}  # change of each line's slope from no weight to the largest weight [%]
    for tip, line in zip(report.tips, deflection_lines, strict=True):
        changes[f"deflection of {tip.name}"] = 100.0 * line.bend.significant_change
    if channels is not None:
        changes |= zip(count_keys(len(deflection_lines)), channels.bend_percent, strict=True)
    # At either end of a line, the slope differs from its mean by half of the change.
    largest_change = 2.0 * KNOWN_WELL_PERCENT
    return [
        f"{table.source}: the slope of {name} against the weight changes by {change:+.2g} % from no weight to the "
        "largest weight. The error bars of readings include this change. Use weights no larger than the forces of a "
        "press."
        for name, change in changes.items()
        if abs(change) > largest_change
    ]


def modulus_of_coupon(table: MeasuredTable, report: Report) -> Estimate:
    """Return the modulus of the printed material [MPa] and its standard deviation, from weights on leaves of a coupon.

    The coupon is a test beam with one leaf for each arm of the housing in `report`. `table` holds the weights on these
    leaves and their deflections. The modulus is the mean over the leaves, weighted by the inverse variance of each.

    Raises InputError for a design without a housing, for a leaf that the design lacks, and for weights that do not
    determine a stiffness.
    """
    if report.housing is None:
        hint = "run pipeline design with springs that can be printed"
        raise validation_error("coupon", None, "", "a coupon of a design with a housing", hint)
    named_table = _complete_names(table, [arm.name for arm in report.housing.arms])
    weighed_arms = [arm for arm in report.housing.arms if arm.name in named_table.texts["coupon"]]
    forces = named_table.numbers["force"]  # not corrected for creep
    lines = fit_weight_lines(named_table, [arm.name for arm in weighed_arms], [], forces)
    stiffnesses = [_stiffness_of_leaf(lines[arm.name, DEFLECTION]) for arm in weighed_arms]
    factors = np.array([modulus_factor(arm.flexure) for arm in weighed_arms])  # modulus divided by stiffness [1/mm]
    moduli = factors * [stiffness.value for stiffness in stiffnesses]
    # A modulus has the same relative error as its stiffness. All variances here are relative.
    inverse_variances = np.array([stiffness.relative for stiffness in stiffnesses]) ** -2.0
    E = float(np.average(moduli, weights=inverse_variances))
    # The relative variance of the weighted mean is 1 / sum(weights). The scatter of the leaves increases this variance.
    chi_squared = float(inverse_variances @ (moduli / E - 1.0) ** 2)
    return Estimate(E, E * math.sqrt((chi_squared + 1.0) / float(inverse_variances.sum())), "MPa")


def _stiffness_of_leaf(deflection: Line) -> Estimate:
    """Return the stiffness of a leaf [N/mm], with an error that covers any bend of its line.

    The slope of a bent line changes from the smallest to the largest weight. The stiffness under a weight may lie
    anywhere within this change.
    """
    K = stiffness_of_line(deflection)
    # The change extends by half of its size to either side of the mean slope.
    bend_deviation = UNIFORM_DEVIATION * 0.5 * deflection.bend.significant_change
    return replace(K, error=math.hypot(K.error, bend_deviation * K.value))
