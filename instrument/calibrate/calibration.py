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
from instrument.calibrate.unit_table import UnitRow, error_sources, leaf_trims, unit_table
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
from pipeline.report.report import Report
from pipeline.storage.plain import Plain
from pipeline.storage.record_data import as_data
from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import FORCE, LENGTH, TIME, Quantity
from sensor.attributes import with_attributes
from sensor.design.reading import ReadingRequirements
from sensor.quantity import COVERAGE, UNIFORM_DEVIATION, Estimate, InputError, report_field, validation_error
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
"""Time since the weight was hung. It needs its own column, because the clock of a serial monitor does not show it."""
WITHOUT_PLATE = "the design expects a press on a hard plate: without --plate firm flesh is read with a larger error"
WITHOUT_BALL = (
    "the design expects presses on a reference ball: without --ball the form errors of the domes bias all readings"
)
UNLIKE_DESIGN = 3.0
"""Largest factor between the measured and the designed stiffness of a spring; real prints differ by less."""
KNOWN_WELL_PERCENT = 0.5
"""Half width at 95 % [%] of an accurately known stiffness, which a dial indicator can determine without a plate."""
_EXAMPLE = "tip,weight_g,deflection_mm"
_BENDS = ("force_bend", "force_bend_per_N", "deflection_bend", "deflection_bend_per_N")


def _unit_data(calibration: "Calibration") -> Plain:
    """Return the fields of a unit that the JSON output contains; unit.toml contains all fields."""
    unit = as_data(calibration.unit)
    shown = {key: unit[key] for key in ("tips", "method", "K_N_per_m", "K_percent", *_BENDS)}
    return shown if calibration.unit.ball is None else {**shown, "ball": unit["ball"]}


def _trims_data(calibration: "Calibration") -> Plain:
    """Return the name and the trim of each tip; the list is empty if the design has no housing."""
    trims = zip(calibration.unit.tips, calibration.trims, strict=False)
    return {"trims": [{"tip": tip, "leaf_longer_mm": longer} for tip, longer in trims]}


def _channels_data(calibration: "Calibration") -> Plain:
    """Return the calibration of the channels, with the gain errors of the unit.

    The gain errors from the weights are replaced, because a press on a plate may determine the gains more accurately.
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
    assumed: list[str] = report_field("", "assumptions made for values that were not given", told=False)
    error_by: str = report_field("", "error sources in the table", told=False)


@in_turn()
def calibrate(
    report: Report,
    weights: str | Path,
    after_s: float | None = None,
    counts_as: Literal["unsigned", "offset"] | None = None,
) -> Calibration:
    """Calibrate a printed unit from a table of weights, as `pipeline calibrate` does.

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
    check_weighed_after("after_s", after_s)
    table = read_print_table(weights, report, counts_as=counts_as)
    if "coupon" in table.texts:
        hint = "pipeline calibrate finds the modulus of a coupon"
        raise validation_error("weights", str(weights), "", "a table with a column tip", hint)
    return calibrate_unit(report, table, after_s=after_s)


def read_print_table(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Read the table of weights and deflections of a printed unit or of a coupon.

    The table of a unit has a column `tip`, and the counts of all channels or of none; counts are returned with their
    sign. The table of a coupon has a column `coupon`. `flags` specifies columns and units that the header lacks.
    `counts_as` is the notation of the counts: "unsigned", "offset", or None for signed counts.

    Raises InputError for a table with neither or both of these columns, for the counts of only some channels, and for
    an unknown tip. It is also raised if `counts_as` is given for a table without counts, and for a count beyond the
    range of the converter.
    """
    count_names = count_keys(len(report.tips))
    quantities = flags.applied({**_OBJECTS, **_WEIGHED, "t": _SINCE, **dict.fromkeys(count_names, COUNTS)})
    table = numbers_of(source, quantities, [("tip", *_WEIGHED), ("coupon", *_WEIGHED)], _EXAMPLE)
    place = place_of(table.source, table.header)
    if len(table.texts) != 1:
        bound = "a header with one column that is named tip or coupon"
        raise validation_error(place, ", ".join(table.texts), "", bound, f"for instance {_EXAMPLE}")
    if "tip" not in table.texts:  # the table of a coupon, which has no counts
        refuse_without_counts(counts_as, table.source)
        return table
    count_columns = [name for name in count_names if name in table.numbers]
    # A column whose label begins with "counts" is probably a channel with a misspelt or unknown name.
    unknown_columns = [label for label in table.passed_over if label.lower().startswith("counts")]
    lacks_some_counts = 0 < len(count_columns) < len(count_names)
    if unknown_columns or lacks_some_counts:
        bound = f"the counts of all channels, {', '.join(count_names)}, or of none"
        found_columns = ", ".join([*count_columns, *unknown_columns])
        raise validation_error(place, found_columns, "", bound, f"for instance {','.join([_EXAMPLE, *count_names])}")
    named_table = _complete_names(table, [tip.name for tip in report.tips])
    if not count_columns:
        refuse_without_counts(counts_as, table.source)
        return named_table
    return with_signed_counts(named_table, count_names, counts_as, saturation_of(report))


def _complete_names(table: MeasuredTable, names: Sequence[str]) -> MeasuredTable:
    """Return the table of weights with each tip or leaf named exactly as in the design.

    `names` are the names in the design. The case of a written name is ignored, and an initial is accepted if it is
    unique. Raises InputError for any other name.
    """
    ((column, texts),) = table.texts.items()  # `tip` or `coupon`, the only column of texts
    initials = [name[0].casefold() for name in names]
    full_names = {name.casefold(): name for name in names}
    full_names |= {initial: name for initial, name in zip(initials, names, strict=True) if initials.count(initial) == 1}
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
    """Calibrate a unit of the design in `report` from `table`, its table of weights, which `read_print_table` returns.

    The other measurements are optional. `plate`, from `read_plate_table`, is a press on a hard plate, which determines
    the springs more accurately. `ball` holds presses on a reference ball, which determine a factor that corrects all
    readings. `fruit`, from `read_fruit_table`, holds presses on fruit, which determine the scale of another instrument.
    `after_s` [s] is the time from hanging a weight to its reading, if `table` has no times.

    Raises InputError if a table does not determine the springs or contradicts the design, and if a unit with these
    springs cannot read a modulus.
    """
    designed = MeasuringUnit(report=report, unit=nominal_unit(report))
    weighing = correct_weights(table, report, after_s)
    deflections, channels = _fit_weights(table, weighing, designed)
    notes = _notes_on_missing_presses(report, plate, ball)
    if weighing.note:
        notes.append(weighing.note)
    # A press on a plate determines the springs more accurately, so its stiffnesses replace those from the weights.
    plate_springs = None
    if plate is not None:
        plate_springs, plate_notes = _springs_on_plate(plate, table, channels, deflections, report)
        notes += plate_notes
    notes += _notes_on_bends(table, report, deflections, channels)
    springs = _calibrated_springs(report, deflections, channels, plate_springs)
    unit = _printed_unit(report, weighing, springs, channels)
    sensor = MeasuringUnit(report=report, unit=unit)
    # The presses on the ball are read with the calibrated springs. From here on, their correction is part of the unit.
    ball_presses = None
    if ball is not None:
        correction, ball_presses = measure_ball_correction(ball, sensor)
        unit = replace(unit, ball=correction)
        sensor = MeasuringUnit(report=report, unit=unit)
    designed_stiffnesses = designed.unit.stiffnesses
    try:  # springs far from the design may not allow a reading
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
        trims=leaf_trims(sensor, designed_stiffnesses),
        assumed=notes,
        error_by=error_by,
        weighing=weighing,
        stiffened=sensor.press_stiffness_ratio(),
        press_s=report.design.press_s,
        scale=scale_fit,
        channels=channels,
        ball_presses=ball_presses,
    )


def _notes_on_missing_presses(report: Report, plate: MeasuredTable | None, ball: PressedBall | None) -> list[str]:
    """Return a note for each measurement that the design expects but that is missing: a ball, and a hard plate."""
    requirements = report.design.reading or ReadingRequirements()
    notes = []
    if ball is None and requirements.calibrated_by == "ball":
        notes.append(WITHOUT_BALL)
    if plate is None and requirements.on_plate:
        notes.append(WITHOUT_PLATE)
    return notes


def _fit_weights(
    table: MeasuredTable, weighing: Weighing, designed: MeasuringUnit
) -> tuple[list[Line], ChannelCalibration | None]:
    """Fit the springs and channels of a unit to its table of weights.

    `weighing` holds the weights corrected for creep. `designed` is a unit with the designed stiffnesses, with which the
    springs must roughly agree. Returns the line of deflection [mm] against weight [N] of each tip, and the calibration
    of the channels, which is None if the table has no counts.

    Raises InputError if the table does not determine the springs, or contradicts the design.
    """
    report = designed.report
    names = [tip.name for tip in report.tips]
    count_columns = [key for key in count_keys(len(names)) if key in table.numbers]
    lines = fit_weight_lines(table, names, count_columns, weighing.forces)
    deflections = [lines[name, DEFLECTION] for name in names]
    _check_stiffnesses(table, [stiffness_of_line(line) for line in deflections], designed)
    return deflections, calibrate_channels(table, report, lines, weighing.forces)


class _CalibratedSprings(NamedTuple):
    """The springs of a unit, and the method by which they were measured.

    `calibrated_by` is "plate" or "weights". `stiffnesses` [N/mm] and `gain_percent` [%] hold one number for each tip.
    `gain_percent` is the standard deviation of a force, or of a deflection after a calibration on a plate.
    `lacks_of_fit` are the errors of the compliances.
    """

    method: str
    calibrated_by: str
    stiffnesses: Sequence[Estimate]
    gain_percent: Sequence[float]
    lacks_of_fit: Sequence[LackOfFit]


def _calibrated_springs(
    report: Report,
    deflections: Sequence[Line],
    channels: ChannelCalibration | None,
    plate_springs: Sequence[PressedSpring] | None,
) -> _CalibratedSprings:
    """Return the springs measured on a plate, or by weights if there was no plate.

    `deflections` are the fitted lines of deflection [mm] against weight [N], one for each tip. `channels` is None
    without counts, and `plate_springs` is None without a plate.
    """
    if plate_springs is not None:
        return _CalibratedSprings(
            method="counts of weights, and a hard plate",
            calibrated_by="plate",
            stiffnesses=[spring.K for spring in plate_springs],
            gain_percent=[spring.deflection_percent for spring in plate_springs],
            lacks_of_fit=[spring.lack_of_fit for spring in plate_springs],
        )
    gain_percent: Sequence[float]
    if channels:
        method = "weights and deflections, counts of the same weights"
        gain_percent = channels.gain_percent
    else:
        method = "weights and deflections"
        requirements = report.design.reading or ReadingRequirements()
        gain_percent = len(deflections) * [requirements.uncalibrated_gain_percent]
    return _CalibratedSprings(
        method=method,
        calibrated_by="weights",
        stiffnesses=[stiffness_of_line(line) for line in deflections],
        gain_percent=gain_percent,
        lacks_of_fit=[line.bend.lack_of_fit for line in deflections],
    )


def _printed_unit(
    report: Report, weighing: Weighing, springs: _CalibratedSprings, channels: ChannelCalibration | None
) -> PrintedUnit:
    """Build the unit from its calibrated springs and channels; `channels` is None without counts.

    After a calibration on a plate, the field `gain_percent` of the unit is the error of the deflection that each
    channel measures.
    """
    # The gain drift is equally likely anywhere within its bound, so UNIFORM_DEVIATION turns it into a standard
    # deviation.
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
    if not any(map(any, lacks_of_fit)):
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


def _springs_on_plate(
    plate: MeasuredTable,
    table: MeasuredTable,
    channels: ChannelCalibration | None,
    deflections: Sequence[Line],
    report: Report,
) -> tuple[list[PressedSpring], list[str]]:
    """Return the springs measured by a press on a plate, one for each tip, and notes on their accuracy.

    `plate` is the table of the press, and `table` is the table of weights, which calibrates the `channels`.
    `deflections` are the lines of deflection [mm] against weight [N], one for each tip. Raises InputError if the table
    of weights has no counts, or if the press contradicts the weights.
    """
    if channels is None:
        columns = ", ".join(count_keys(len(report.tips)))
        bound = "a table with the counts of each channel, which --plate needs"
        raise validation_error(table.source, "weights without counts", "", bound, f"add the columns {columns}")
    weight_stiffnesses = [stiffness_of_line(line) for line in deflections]
    plate_springs = fit_springs_on_plate(plate, channels, weight_stiffnesses, report)
    names = [tip.name for tip in report.tips]
    return plate_springs, _note_on_plate(plate_springs, weight_stiffnesses, names, plate)


def _note_on_plate(
    plate_springs: Sequence[PressedSpring],
    weight_stiffnesses: Sequence[Estimate],
    names: Sequence[str],
    plate: MeasuredTable,
) -> list[str]:
    """Return a list with a note if the plate determines a stiffness much less accurately than the weights do.

    Otherwise the list is empty. `weight_stiffnesses` are the stiffnesses [N/mm] that the weights determine, `names` are
    the names of the tips, and `plate` is the table of the press on the plate.
    """
    # The note names the tip with the largest ratio of the error from the plate to the error from the weights.
    error_pairs = [(spring.K.percent, K.percent) for spring, K in zip(plate_springs, weight_stiffnesses, strict=True)]
    worst = max(range(len(error_pairs)), key=lambda tip: error_pairs[tip][0] / error_pairs[tip][1])
    plate_percent, weights_percent = (COVERAGE * percent for percent in error_pairs[worst])  # half widths at 95 %
    if plate_percent <= max(2.0 * weights_percent, KNOWN_WELL_PERCENT):
        return []
    resolution = float(plate.last_digits["travel"].min())
    return [
        f"the stiffness of the {names[worst]} spring is known to ± {plate_percent:.2g} % from the plate, but to "
        f"± {weights_percent:.2g} % from the weights. The resolution of the travel is taken as {resolution:g} mm, the "
        "last digit written. Write all digits of the dial, press farther and more often, or leave out --plate."
    ]


def _notes_on_bends(
    table: MeasuredTable, report: Report, deflections: Sequence[Line], channels: ChannelCalibration | None
) -> list[str]:
    """Return a note for each calibration line whose slope changes by more than twice `KNOWN_WELL_PERCENT`.

    The lines are the deflection of each tip and the counts of each channel, both as functions of the weight.
    `deflections` are the lines of the tips, and `channels` is None if the `table` of weights has no counts.
    """
    lines = zip(report.tips, deflections, strict=True)
    changes = {f"deflection of {tip.name}": 100.0 * line.bend.significant_change for tip, line in lines}
    if channels is not None:
        changes |= zip(count_keys(len(deflections)), channels.bend_percent, strict=True)
    return [
        f"{table.source}: the slope of {name} against the weight changes by {change:+.2g} % from no weight to the "
        "largest weight. The error bars of readings include this change. Use weights no larger than the forces of a "
        "press."
        for name, change in changes.items()
        if abs(change) > 2.0 * KNOWN_WELL_PERCENT
    ]


def modulus_of_coupon(table: MeasuredTable, report: Report) -> Estimate:
    """Return the modulus of the printed material [MPa] and its standard deviation, from weights on leaves of a coupon.

    `table` holds the weights and deflections of the leaves. The result is the mean over the leaves, weighted by the
    inverse variance of each. Raises InputError for a design without a housing, for a leaf that the design does not
    have, and for weights that do not determine a stiffness.
    """
    if report.housing is None:
        hint = "run pipeline design with springs that can be printed"
        raise validation_error("coupon", None, "", "a coupon of a design with a housing", hint)
    named_table = _complete_names(table, [arm.name for arm in report.housing.arms])
    weighed_arms = [arm for arm in report.housing.arms if arm.name in named_table.texts["coupon"]]
    forces = named_table.numbers["force"]  # not corrected for creep
    lines = fit_weight_lines(named_table, [arm.name for arm in weighed_arms], [], forces)
    stiffnesses = [_stiffness_of_leaf(lines[arm.name, DEFLECTION]) for arm in weighed_arms]
    factors = np.array([modulus_factor(arm.flexure) for arm in weighed_arms])  # modulus per stiffness [1/mm]
    moduli = factors * [stiffness.value for stiffness in stiffnesses]
    weights = np.array([stiffness.relative for stiffness in stiffnesses]) ** -2.0
    E = float(np.average(moduli, weights=weights))
    # The variance of the weighted mean is 1 / sum(weights). The scatter of the leaves (chi squared) increases it.
    scatter = float(weights @ (moduli / E - 1.0) ** 2)
    return Estimate(E, E * math.sqrt((scatter + 1.0) / float(weights.sum())), "MPa")


def _stiffness_of_leaf(deflection: Line) -> Estimate:
    """Return the stiffness of a leaf [N/mm], with an error that covers any bend of its line.

    The slope of a bent line changes from the smallest to the largest weight. The stiffness under a weight may lie
    anywhere within this change.
    """
    K = stiffness_of_line(deflection)
    bound = UNIFORM_DEVIATION * 0.5 * deflection.bend.significant_change
    return replace(K, error=math.hypot(K.error, bound * K.value))
