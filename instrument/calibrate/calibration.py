"""Calibration of a print: its unit from weights on its tips, or its modulus from a coupon."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from cad.parts.coupon import modulus_factor
from instrument.calibrate.creep import Weighing, correct_weights
from instrument.calibrate.fruit_presses import ScaleFit, scale_of_presses
from instrument.calibrate.hard_plate import PressedSpring, pressed_springs
from instrument.calibrate.reference_presses import BallPresses, PressedBall, correction_by_ball
from instrument.calibrate.unit_table import UnitRow, error_sources, trims, unit_table
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
from sensor.quantity import BOUNDED, COVERAGE, Estimate, InputError, report_field, validation_error
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
"""The time since a weight was hung needs its own column, because the clock of a serial monitor does not show it."""
WITHOUT_PLATE = "the design expects a press on a hard plate: without --plate firm flesh is read with a larger error"
WITHOUT_BALL = "the design expects presses on a reference ball: without --ball the form of the domes moves all readings"
UNLIKE_DESIGN = 3.0
"""Largest ratio of a spring's stiffness to its design, either way; prints differ by less."""
KNOWN_WELL_PERCENT = 0.5
"""Half width at 95 % [%] of a stiffness that is well known: about what a dial gives without a plate."""
_EXAMPLE = "tip,weight_g,deflection_mm"
_BENDS = ("force_bend", "force_bend_per_N", "deflection_bend", "deflection_bend_per_N")


def _unit_data(calibration: "Calibration") -> Plain:
    """Return the part of a unit that the answer contains; unit.toml has all of it."""
    unit = as_data(calibration.unit)
    shown = {key: unit[key] for key in ("tips", "method", "K_N_per_m", "K_percent", *_BENDS)}
    return shown if calibration.unit.ball is None else {**shown, "ball": unit["ball"]}


def _trims_data(calibration: "Calibration") -> Plain:
    """Return the trim of each tip with the tip's name; the list is empty if the design has no housing."""
    trims = zip(calibration.unit.tips, calibration.trims, strict=False)
    return {"trims": [{"tip": tip, "leaf_longer_mm": longer} for tip, longer in trims]}


def _channels_data(calibration: "Calibration") -> Plain:
    """Return the calibration of the channels, with the unit's gain errors in place of its own.

    They differ if a press on a plate determined the gains.
    """
    return {"channels": {**as_data(calibration.channels), "gain_percent": [*calibration.unit.gain_percent]}}


@with_attributes
@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The calibration of a printed unit: the unit, verdicts on its targets, and trims of its leaves.

    `pipeline calibrate` prints the same numbers. What JSON leaves out is None or empty here.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # of pipeline run --out outputs/mine
    >>> calibration = twintip.calibrate(report, "weights.csv")
    >>> [round(K) for K in calibration.unit.K_N_per_m]
    [1000, 22000]
    """

    unit: PrintedUnit = report_field(
        "",
        "the unit, as in unit.toml; its bends are null if all lines are straight, and `ball` is left out without a "
        "reference ball",
        key="`tips`, `method`, `K_N_per_m`, `K_percent`, `force_bend`, `force_bend_per_N`, `deflection_bend`, "
        "`deflection_bend_per_N`, `ball`",
        inline=_unit_data,
    )
    nominal: tuple[float, ...] = report_field(
        "N/m", "stiffness of each spring in the design", key="design_K_N_per_m", times=1e3, attribute_unit="N/mm"
    )
    weighing: Weighing = report_field(
        "",
        "time from the hanging of a weight to its reading; whose creep it is, `unit` or `process`; growth of the "
        "deflection in a decade of time, and its standard deviation",
        key="`weighed_after_s`, `creep_of`, `creep_per_decade`, `creep_error`",
        inline=lambda it: as_data(it.weighing),
    )
    press_s: float = report_field("s", "duration of a press")
    stiffened: float = report_field(
        "1", "stiffness in a press over the stiffness under a weight", key="K_press_over_weighed"
    )
    table: tuple[UnitRow, ...] = report_field(
        "",
        "for moduli over the range of the design: force of each tip, P, half width of the error bar of E, and error of "
        "E with the stiffnesses of the design",
    )
    verdicts: list[Verdict] = report_field(
        "", "whether the unit meets the targets of its design, as in [report.json](report-json.md#verdicts)"
    )
    trims: list[float | None] = report_field(
        "",
        "for each tip, the change of length that gives its leaves the stiffness of the design; null if the error of "
        "K holds it",
        inline=_trims_data,
        attribute_unit="mm",
    )
    channels: ChannelCalibration | None = report_field(
        "",
        "slopes, zeros, gain, bend, crosstalk, hysteresis and drift of the channels; left out without counts",
        inline=_channels_data,
        left_out=True,
        default=None,
    )
    scale: ScaleFit | None = report_field(
        "",
        "the scale as in unit.toml, the number of its fruit, and the error of a fruit that is left out, one standard "
        "deviation, by each curve; left out without `--fruit`",
        left_out=True,
        default=None,
    )
    ball_presses: BallPresses | None = report_field(
        "",
        "number of presses on the ball that count, number of all, and flags of the others; left out without `--ball`",
        left_out=True,
        default=None,
    )
    assumed: list[str] = report_field("", "assumptions for values that were not given", told=False)
    error_by: str = report_field("", "error sources in the table", told=False)


@in_turn()
def calibrate(
    report: Report,
    weights: str | Path,
    after_s: float | None = None,
    counts_as: Literal["unsigned", "offset"] | None = None,
) -> Calibration:
    """Return the calibration of a printed unit by a table of weights, as `pipeline calibrate` does.

    Parameters
    ----------
    report : Report
        The report of the design, from `read_report`.
    weights : str or Path
        A table of weights on each tip and the deflections.
    after_s : float, optional
        Time from hanging a weight to its reading [s], if the table has no times.
    counts_as : "unsigned" or "offset", optional
        How the table writes counts, as in `read_press`.

    Returns
    -------
    Calibration
        The unit, its verdicts, and the trims of its leaves.

    Raises
    ------
    InputError
        If the table does not measure springs of this design.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # of pipeline run --out outputs/mine
    >>> calibration = twintip.calibrate(report, "weights.csv")
    >>> len(calibration.unit.K_N_per_m)  # of each tip
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
    """Read the table of weights and deflections of a print.

    Its column of texts is `tip` for a unit, with the signed counts of all channels or of none, or `coupon`. `flags`
    states columns and units that the header lacks. `counts_as` is the notation of the counts, as in `signed_counts`.
    Raises InputError for a table that has neither column or only some of the counts, and for an unknown tip.
    """
    counts = count_keys(len(report.tips))
    quantities = flags.applied({**_OBJECTS, **_WEIGHED, "t": _SINCE, **dict.fromkeys(counts, COUNTS)})
    table = numbers_of(source, quantities, [("tip", *_WEIGHED), ("coupon", *_WEIGHED)], _EXAMPLE)
    place = place_of(table.source, table.header)
    if len(table.texts) != 1:
        bound = "a header with one column that is named tip or coupon"
        raise validation_error(place, ", ".join(table.texts), "", bound, f"for instance {_EXAMPLE}")
    if "tip" not in table.texts:
        refuse_without_counts(counts_as, table.source)
        return table
    count_columns = [key for key in counts if key in table.numbers]
    unknown_columns = [label for label in table.passed_over if label.lower().startswith("counts")]
    if unknown_columns or 0 < len(count_columns) < len(counts):
        bound = f"the counts of all channels, {', '.join(counts)}, or of none"
        text = ", ".join([*count_columns, *unknown_columns])
        raise validation_error(place, text, "", bound, f"for instance {','.join([_EXAMPLE, *counts])}")
    table = _complete_names(table, [tip.name for tip in report.tips])
    if not count_columns:
        refuse_without_counts(counts_as, table.source)
        return table
    return with_signed_counts(table, counts, counts_as, saturation_of(report))


def _complete_names(table: MeasuredTable, names: Sequence[str]) -> MeasuredTable:
    """Return a table whose tips or leaves have the `names` of the design.

    Case is ignored, and a unique initial is accepted. Raises InputError for another name.
    """
    ((column, texts),) = table.texts.items()
    initials = [name[0].casefold() for name in names]
    full_names = {name.casefold(): name for name in names}
    full_names |= {initial: name for initial, name in zip(initials, names, strict=True) if initials.count(initial) == 1}
    for line, text in zip(table.lines, texts, strict=True):
        if text.casefold() not in full_names:
            place = place_of(table.source, line, column)
            raise validation_error(place, text, "", f"one of {', '.join(names)}", "take the names in report.json")
    return replace(table, texts={column: tuple(full_names[text.casefold()] for text in texts)})


def calibrate_unit(
    report: Report,
    table: MeasuredTable,
    fruit: MeasuredTable | None = None,
    plate: MeasuredTable | None = None,
    after_s: float | None = None,
    ball: PressedBall | None = None,
) -> Calibration:
    """Return the calibration of a unit from a table of weights, from `read_print_table`.

    `fruit` are presses of fruit for a scale, from `read_fruit_table`. `plate` is a press on a hard plate, from
    `read_plate_table`. `after_s` [s] is the time from hanging a weight to its reading, if the table has no times.
    Presses on a reference `ball` give a factor that corrects all readings. Raises InputError if a table does not
    determine the springs or contradicts the design, and if a unit with these springs reads no modulus.
    """
    # The springs and the channels from the weights.
    designed = MeasuringUnit(report=report, unit=nominal_unit(report))
    weighed = correct_weights(table, report, after_s)
    names = [tip.name for tip in report.tips]
    counts = [key for key in count_keys(len(names)) if key in table.numbers]
    lines = fit_weight_lines(table, names, counts, weighed.forces)
    deflections = [lines[name, DEFLECTION] for name in names]
    springs = [stiffness_of_line(line) for line in deflections]
    _refuse_unlike_design(table, springs, designed)
    channels = calibrate_channels(table, report, lines, weighed.forces)
    assumed = [weighed.note] if weighed.note else []
    # A press on a plate determines the springs more accurately.
    plate_springs = None
    requirements = report.design.reading or ReadingRequirements()
    if plate is not None:
        plate_springs = _springs_on_plate(plate, table, channels, springs, report)
        assumed += _note_on_plate(plate_springs, springs, names, plate)
    elif requirements.on_plate:
        assumed = [WITHOUT_PLATE, *assumed]
    assumed += _notes_on_bends(table, report, deflections, channels)
    unit = _printed_unit(report, weighed, deflections, channels, plate_springs)
    sensor = MeasuringUnit(report=report, unit=unit)
    if ball is None and requirements.calibrated_by == "ball":
        assumed = [WITHOUT_BALL, *assumed]
    # The ball is read by the calibrated springs, and its correction is part of the unit from here on.
    ball_presses = None
    if ball is not None:
        correction, ball_presses = correction_by_ball(ball, sensor)
        unit = replace(unit, ball=correction)
        sensor = MeasuringUnit(report=report, unit=unit)
    # The readings of the unit over the range of its design, and the verdicts on them.
    nominal = designed.unit.stiffnesses
    try:
        scale = None if fruit is None else scale_of_presses(fruit, sensor)
        rows = unit_table(sensor, designed)
        verdicts = unit_verdicts(sensor, rows)
        error_by = error_sources(sensor)
    except ReadingError as error:
        msg = f"{table.source}: {error}"
        raise InputError(msg) from error
    return Calibration(
        unit=unit if scale is None else replace(unit, scale=scale.scale),
        nominal=nominal,
        table=rows,
        verdicts=verdicts,
        trims=trims(sensor, nominal),
        assumed=assumed,
        error_by=error_by,
        weighing=weighed,
        stiffened=sensor.press_over_weighed(),
        press_s=report.design.press_s,
        scale=scale,
        channels=channels,
        ball_presses=ball_presses,
    )


def _printed_unit(
    report: Report,
    weighed: Weighing,
    deflections: Sequence[Line],
    channels: ChannelCalibration | None,
    plate_springs: Sequence[PressedSpring] | None,
) -> PrintedUnit:
    """Return the unit from its deflections under weights, its channels, and the springs measured on a plate.

    `deflections` are the lines of deflection [mm] against weight [N], one for each tip. With a plate, its springs
    replace those from the weights, and `gain_percent` is the error of each channel's deflection.
    """
    if plate_springs is not None:
        method = "counts of weights, and a hard plate"
        springs = [spring.K for spring in plate_springs]
        gain_errors: Sequence[float] = [spring.left_percent for spring in plate_springs]
        spring_bends = [spring.lack_of_fit for spring in plate_springs]
    else:
        method = "weights and deflections" + (", counts of the same weights" if channels else "")
        springs = [stiffness_of_line(line) for line in deflections]
        gain_percent = (report.design.reading or ReadingRequirements()).uncalibrated_gain_percent
        gain_errors = channels.gain_percent if channels else len(springs) * [gain_percent]
        spring_bends = [line.bend.lack_of_fit for line in deflections]
    drifts = report.read_out.channels.gain_drift_percent
    force_bend, force_bend_per_N = _split_bends(channels.lacks_of_fit if channels else ())
    deflection_bend, deflection_bend_per_N = _split_bends(spring_bends)
    return PrintedUnit(
        design=report.design.name,
        design_sha256=design_digest(report.design),
        tips=tuple(tip.name for tip in report.tips),
        method=method,
        K_N_per_m=tuple(1e3 * spring.value for spring in springs),
        K_percent=tuple(spring.percent for spring in springs),
        gain=(1.0,) * len(springs),
        # A gain drift lies anywhere within its bound.
        gain_percent=tuple(math.hypot(*errors) for errors in zip(gain_errors, BOUNDED * np.array(drifts), strict=True)),
        newtons_per_count=channels.newtons_per_count if channels else (),
        zero_counts=tuple(channels.zero_counts.tolist()) if channels else (),
        saturation_counts=channels.saturation if channels else 0,
        calibrated_by="weights" if plate_springs is None else "plate",
        weighed_after_s=weighed.after_s,
        creep_per_decade=weighed.creep.per_decade if weighed.own else None,
        creep_error=weighed.creep.error if weighed.own else None,
        force_bend=force_bend,
        force_bend_per_N=force_bend_per_N,
        deflection_bend=deflection_bend,
        deflection_bend_per_N=deflection_bend_per_N,
    )


def _split_bends(lacks_of_fit: Sequence[LackOfFit]) -> tuple[tuple[float, ...] | None, tuple[float, ...] | None]:
    """Return the relative error of each tip's slope at zero force [1], and its change with the force [1/N].

    Both are None if all calibration lines are straight.
    """
    if not any(map(any, lacks_of_fit)):
        return None, None
    at_zero, per_N = zip(*lacks_of_fit, strict=True)
    return at_zero, per_N


def _refuse_unlike_design(table: MeasuredTable, springs: Sequence[Estimate], designed: MeasuringUnit) -> None:
    """Raise InputError for a spring whose stiffness differs from its design by a factor that no print has."""
    nominal = designed.unit.stiffnesses
    for tip, spring, K in zip(designed.report.tips, springs, nominal, strict=True):
        ratio = spring.value / K
        if not 1.0 / UNLIKE_DESIGN < ratio < UNLIKE_DESIGN:
            field = f"{table.source}: stiffness of {tip.name} divided by its stiffness in the design"
            bound = f"from {1.0 / UNLIKE_DESIGN:.2g} to {UNLIKE_DESIGN:g}"
            raise validation_error(field, float(f"{ratio:.3g}"), "", bound, "check names of tips, and the units")


def _springs_on_plate(
    plate: MeasuredTable,
    table: MeasuredTable,
    channels: ChannelCalibration | None,
    weighed: Sequence[Estimate],
    report: Report,
) -> list[PressedSpring]:
    """Return the springs measured by a press on a plate; `weighed` are their stiffnesses from the weights [N/mm].

    Raises InputError if the table of weights has no counts, and for a press that contradicts the weights.
    """
    if channels is None:
        columns = ", ".join(count_keys(len(weighed)))
        bound = "a table with counts of each channel, which --plate needs"
        raise validation_error(table.source, "weights without counts", "", bound, f"add the columns {columns}")
    return pressed_springs(plate, channels, weighed, report)


def _note_on_plate(
    plate_springs: Sequence[PressedSpring], weighed: Sequence[Estimate], names: Sequence[str], plate: MeasuredTable
) -> list[str]:
    """Return a note if the plate determines a spring much less accurately than the weights; empty otherwise.

    `weighed` are the stiffnesses from the weights [N/mm].
    """
    percents = [(spring.K.percent, K.percent) for spring, K in zip(plate_springs, weighed, strict=True)]
    worst = max(range(len(percents)), key=lambda tip: percents[tip][0] / percents[tip][1])
    from_plate, from_weights = (COVERAGE * percent for percent in percents[worst])
    if from_plate <= max(2.0 * from_weights, KNOWN_WELL_PERCENT):
        return []
    resolution = float(plate.last_digits["travel"].min())
    return [
        f"the spring of {names[worst]} is known to ± {from_plate:.2g} % from the plate, to ± {from_weights:.2g} % "
        f"from the weights. Its travel is taken as read to {resolution:g} mm, the last digit written. Write all digits "
        "of the dial, press farther and more often, or leave --plate out."
    ]


def _notes_on_bends(
    table: MeasuredTable, report: Report, deflections: Sequence[Line], channels: ChannelCalibration | None
) -> list[str]:
    """Return a note for each calibration line whose slope changes by more than twice `KNOWN_WELL_PERCENT`.

    The lines are the deflection of each tip and the counts of each channel, against the weights.
    """
    lines = zip(report.tips, deflections, strict=True)
    changes = {f"deflection of {tip.name}": 100.0 * line.bend.significant_change for tip, line in lines}
    if channels is not None:
        changes |= zip(count_keys(len(deflections)), channels.bend_percent, strict=True)
    return [
        f"{table.source}: the slope of {name} against the weight changes by {change:+.2g} % from no weight to the "
        "largest. The error bars of readings include this change. Take weights no larger than the forces of a press."
        for name, change in changes.items()
        if abs(change) > 2.0 * KNOWN_WELL_PERCENT
    ]


def modulus_of_coupon(table: MeasuredTable, report: Report) -> Estimate:
    """Return the modulus of a print [MPa] with its standard deviation, from weights on the leaves of its coupon.

    The mean of the leaves is weighted by their accuracy. Raises InputError for a design without a housing, for a leaf
    that the design lacks, and for weights that do not determine a stiffness.
    """
    if report.housing is None:
        hint = "run pipeline design with springs that print"
        raise validation_error("coupon", None, "", "a coupon of a design with a housing", hint)
    table = _complete_names(table, [arm.name for arm in report.housing.arms])
    arms = [arm for arm in report.housing.arms if arm.name in table.texts["coupon"]]
    lines = fit_weight_lines(table, [arm.name for arm in arms], [], table.numbers["force"])
    springs = [_stiffness_of_leaf(lines[arm.name, DEFLECTION]) for arm in arms]
    factors = np.array([modulus_factor(arm.flexure) for arm in arms])
    moduli = factors * [spring.value for spring in springs]
    weights = np.array([spring.relative for spring in springs]) ** -2.0
    E = float(np.average(moduli, weights=weights))
    # The variance of the weighted mean, increased by the scatter of the leaves beyond their own errors.
    scatter = float(weights @ (moduli / E - 1.0) ** 2)
    return Estimate(E, E * math.sqrt((scatter + 1.0) / float(weights.sum())), "MPa")


def _stiffness_of_leaf(deflection: Line) -> Estimate:
    """Return the stiffness of a leaf [N/mm], with an error that includes the change of its slope over the weights.

    The stiffness under any weight lies anywhere within this change.
    """
    K = stiffness_of_line(deflection)
    bound = BOUNDED * 0.5 * deflection.bend.significant_change
    return replace(K, error=math.hypot(K.error, bound * K.value))
