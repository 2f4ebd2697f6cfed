"""From what was measured of a print to its unit: springs by weights, or its modulus."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cad.parts.coupon import modulus_factor
from instrument.calibrate.creep import Weighing, weighing
from instrument.calibrate.fruit_presses import ScaleFit, scale_of_presses
from instrument.calibrate.lines import LackOfFit, Line
from instrument.calibrate.plate import pressed_springs
from instrument.calibrate.unit_table import UnitRow, error_sources, trims, unit_table
from instrument.calibrate.unit_verdicts import unit_verdicts
from instrument.calibrate.weights import (
    DEFLECTION,
    ChannelCalibration,
    saturation_of,
    spring_of,
    weighed_channels,
    weighed_lines,
)
from instrument.press.count_codes import refuse_without_counts, with_signed_counts
from instrument.press.measuring import MeasuringUnit
from instrument.press.printed_unit import WEIGHED_AFTER, PrintedUnit, nominal_unit, unit_of
from instrument.press.signals import COUNTS, count_keys
from pipeline.report.report import Report
from pipeline.tables.files import place_of
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.tables.measured_table import MeasuredTable, numbers_of
from pipeline.tables.units import FORCE, LENGTH, TIME, Quantity
from pipeline.tables.words import WORDS
from sensor.quantity import BOUNDED, COVERAGE, Estimate, InputError, validation_error
from sensor.theory.contrast_law import ReadingError
from sensor.verdict import Verdict

_OBJECTS = {"tip": Quantity(units={}, words=tuple(WORDS["calibration"]["tip"])), "coupon": Quantity(units={})}
_WEIGHED = {
    "force": Quantity(units=FORCE, most=1e3, words=(*WORDS["calibration"]["weight"], *WORDS["words"]["force"])),
    "deflection": Quantity(units=LENGTH, most=100.0, words=tuple(WORDS["words"]["travel"])),
}
_SINCE = Quantity(units=TIME, default="s", most=WEIGHED_AFTER.at_most or math.inf)
"""Since a weight was hung: a column of its own, which the clock of a serial monitor is not."""
WITHOUT_PLATE = "the design expects a press on a hard plate: without --plate firm flesh is read with a larger error"
UNLIKE_DESIGN = 3.0
"""Times the stiffness of a design, or a part of it: a print is off by less."""
KNOWN_WELL_PERCENT = 0.5
"""Of a stiffness, what holds 95 %: a dial hides as much, which is what a plate is for."""
_EXAMPLE = "tip,weight_g,deflection_mm"


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A unit with what it shows, whether it meets the targets of its design, and how to trim it where it does not.

    `nominal` are the stiffnesses of the design [N/mm]. `trims` are by how much longer leaves must be to have them [mm],
    for each tip, None where its error holds its target. `assumed` is what was taken for granted, `error_by` says what
    the errors of the table count. `scale` is that of the unit, where fruit was pressed with it; `channels` are what
    counts told, None where none were given. `weighing` is when weights were read, and how springs creep; `stiffened`
    the stiffness in a press of `press_s` [s] over that of the weighing [1].
    """

    unit: PrintedUnit
    nominal: tuple[float, ...]
    table: tuple[UnitRow, ...]
    verdicts: list[Verdict]
    trims: list[float | None]
    assumed: list[str]
    error_by: str
    weighing: Weighing
    stiffened: float
    press_s: float
    scale: ScaleFit | None = None
    channels: ChannelCalibration | None = None


def measured_print(
    source: Path | str, report: Report, flags: ColumnFlags = NO_FLAGS, counts_as: str | None = None
) -> MeasuredTable:
    """Return what was measured of a print of a design; its column of texts is tip or coupon.

    Its counts are signed; `counts_as` is how they are written, as in `signed_counts`. Raises InputError.
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
    counted = [key for key in counts if key in table.numbers]
    others = [label for label in table.passed_over if label.lower().startswith("counts")]
    if others or 0 < len(counted) < len(counts):
        bound = f"the counts of all channels, {', '.join(counts)}, or of none"
        text = ", ".join([*counted, *others])
        raise validation_error(place, text, "", bound, f"for instance {','.join([_EXAMPLE, *counts])}")
    table = replace(table, texts={"tip": _names_of_tips(table, [tip.name for tip in report.tips])})
    if not counted:
        refuse_without_counts(counts_as, table.source)
        return table
    return with_signed_counts(table, counts, counts_as, saturation_of(report))


def _names_of_tips(table: MeasuredTable, names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of tips in a table as the design has them; an initial that only one has stands for it.

    Raises InputError for another name.
    """
    initials = [name[0].casefold() for name in names]
    known = {name.casefold(): name for name in names}
    known |= {initial: name for initial, name in zip(initials, names, strict=True) if initials.count(initial) == 1}
    for line, text in zip(table.lines, table.texts["tip"], strict=True):
        if text.casefold() not in known:
            place = place_of(table.source, line, "tip")
            raise validation_error(place, text, "", f"one of {', '.join(names)}", "take the names in report.json")
    return tuple(known[text.casefold()] for text in table.texts["tip"])


def calibrate_unit(
    report: Report,
    table: MeasuredTable,
    fruit: MeasuredTable | None = None,
    plate: MeasuredTable | None = None,
    after_s: float | None = None,
) -> Calibration:
    """Return the calibration of a unit, with the scale of `fruit` that was pressed with it, as `measured_fruit` has it.

    `plate` is a press on a hard plate, as `measured_plate` has it. Each weight was read `after_s` [s] after it was
    hung, where the table has no times. Raises InputError, also for springs that read nothing.
    """
    as_designed = MeasuringUnit(report=report, unit=nominal_unit(report))
    weighed = weighing(table, report, after_s)
    names = [tip.name for tip in report.tips]
    counts = [key for key in count_keys(len(names)) if key in table.numbers]
    lines = weighed_lines(table, names, counts, weighed.forces)
    deflections = [lines[name, DEFLECTION] for name in names]
    springs = [spring_of(line) for line in deflections]
    _refuse_unlike_design(table, springs, as_designed)
    channels = weighed_channels(table, report, lines, weighed.forces)
    unit = unit_of(
        report,
        stiffnesses=[spring.value for spring in springs],
        percent=[spring.percent for spring in springs],
        method="weights and deflections",
    )
    unit = replace(unit, weighed_after_s=weighed.after_s)
    unit = _with_bent_deflections(unit, [line.bend.lack_of_fit for line in deflections])
    if weighed.own:
        unit = replace(unit, creep_per_decade=weighed.creep.per_decade, creep_error=weighed.creep.error)
    if channels is not None:
        unit = _with_channels(unit, channels, report)
    reading = report.design.reading
    counts_on_plate = reading is not None and reading.calibrated_by == "plate"
    assumed = [WITHOUT_PLATE] if counts_on_plate and plate is None else []
    assumed += [weighed.note] if weighed.note else []
    if plate is not None:
        by_weights = unit
        unit = _on_plate(unit, plate, table, channels, springs, report)
        assumed += _worse_on_plate(unit, by_weights, plate)
    assumed += _bent(table, report, deflections, channels)
    sensor = MeasuringUnit(report=report, unit=unit)
    nominal = as_designed.unit.stiffnesses
    try:
        scale = None if fruit is None else scale_of_presses(fruit, sensor)
        shown = unit_table(sensor, as_designed)
        verdicts = unit_verdicts(sensor, shown)
        error_by = error_sources(sensor)
    except ReadingError as error:
        msg = f"{table.source}: {error}"
        raise InputError(msg) from error
    return Calibration(
        unit=unit if scale is None else replace(unit, scale=scale.scale),
        nominal=nominal,
        table=shown,
        verdicts=verdicts,
        trims=trims(sensor, nominal),
        assumed=assumed,
        error_by=error_by,
        weighing=weighed,
        stiffened=sensor.press_over_weighed(),
        press_s=report.design.press_s,
        scale=scale,
        channels=channels,
    )


def _refuse_unlike_design(table: MeasuredTable, springs: Sequence[Estimate], designed: MeasuringUnit) -> None:
    """Raise InputError for a spring that is none of its design: no print is three times too stiff or too soft."""
    nominal = designed.unit.stiffnesses
    for tip, spring, K in zip(designed.report.tips, springs, nominal, strict=True):
        ratio = spring.value / K
        if not 1.0 / UNLIKE_DESIGN < ratio < UNLIKE_DESIGN:
            field = f"{table.source}: stiffness of {tip.name} over that of its design"
            bound = f"from {1.0 / UNLIKE_DESIGN:.2g} to {UNLIKE_DESIGN:g}"
            raise validation_error(field, float(f"{ratio:.3g}"), "", bound, "check names of tips, and the units")


def _worse_on_plate(unit: PrintedUnit, by_weights: PrintedUnit, plate: MeasuredTable) -> list[str]:
    """Return a note where a press on a plate leaves springs much less well known than the weights did."""
    worst = max(range(len(unit.tips)), key=lambda tip: unit.K_percent[tip] / by_weights.K_percent[tip])
    on_plate, before = (COVERAGE * each.K_percent[worst] for each in (unit, by_weights))
    if on_plate <= max(2.0 * before, KNOWN_WELL_PERCENT):
        return []
    step = float(plate.last_digits["travel"].min())
    return [
        f"the plate tells the spring of {unit.tips[worst]} to ± {on_plate:.2g} %, the weights to ± {before:.2g} %. "
        f"Its travel is taken as read to {step:g} mm, the last digit written. Write all that the dial shows, "
        "press farther and oftener, or leave --plate out."
    ]


def _with_channels(unit: PrintedUnit, channels: ChannelCalibration, report: Report) -> PrintedUnit:
    """Return a unit with the channels that weights told: what they leave of the gains, and what drifts beside it."""
    at_zero, per_N = _columns_of(channels.lacks_of_fit)
    return replace(
        unit,
        method=f"{unit.method}, counts of the same weights",
        newtons_per_count=channels.newtons_per_count,
        zero_counts=tuple(channels.zero_counts.tolist()),
        saturation_counts=channels.saturation,
        gain_percent=_drifted(channels.gain_percent, report),
        force_bend=at_zero,
        force_bend_per_N=per_N,
    )


def _columns_of(lacks_of_fit: Sequence[LackOfFit]) -> tuple[tuple[float, ...] | None, tuple[float, ...] | None]:
    """Return what lines lack at no force, and per newton, of all tips each; None for both where all fit."""
    at_zero, per_N = (tuple(column) for column in zip(*lacks_of_fit, strict=True))
    return (at_zero, per_N) if any(map(any, lacks_of_fit)) else (None, None)


def _with_bent_deflections(unit: PrintedUnit, lacks_of_fit: Sequence[LackOfFit]) -> PrintedUnit:
    """Return a unit whose compliances lack fit."""
    at_zero, per_N = _columns_of(lacks_of_fit)
    return replace(unit, deflection_bend=at_zero, deflection_bend_per_N=per_N)


def _bent(
    table: MeasuredTable, report: Report, deflections: Sequence[Line], channels: ChannelCalibration | None
) -> list[str]:
    """Return a note for each column of a tip that is bent by more than `KNOWN_WELL_PERCENT` to either side."""
    shown = zip(report.tips, deflections, strict=True)
    changes = {f"deflection of {tip.name}": 100.0 * line.bend.told_change for tip, line in shown}
    if channels is not None:
        changes |= zip(count_keys(len(deflections)), channels.bend_percent, strict=True)
    return [
        f"{table.source}: the slope of {name} over the weights changes by {change:+.2g} % from none to the largest. "
        "The bars of readings hold that; weights no larger than the forces of a press make it smaller."
        for name, change in changes.items()
        if abs(change) > 2.0 * KNOWN_WELL_PERCENT
    ]


def _on_plate(
    unit: PrintedUnit,
    plate: MeasuredTable,
    table: MeasuredTable,
    channels: ChannelCalibration | None,
    weighed: Sequence[Estimate],
    report: Report,
) -> PrintedUnit:
    """Return a unit whose channels tell deflections, by a press on a plate; raises InputError as `pressed_springs`."""
    if channels is None:
        columns = ", ".join(count_keys(len(unit.tips)))
        bound = "a table with the counts of each channel where --plate is given"
        raise validation_error(table.source, "weights alone", "", bound, f"add the columns {columns}")
    springs = pressed_springs(plate, channels, weighed, report)
    return replace(
        _with_bent_deflections(unit, [spring.lack_of_fit for spring in springs]),
        method="counts of weights, and a hard plate",
        calibrated_by="plate",
        K_N_per_m=tuple(1e3 * spring.K.value for spring in springs),
        K_percent=tuple(spring.K.percent for spring in springs),
        gain_percent=_drifted([spring.left_percent for spring in springs], report),
    )


def _drifted(percent: Sequence[float], report: Report) -> tuple[float, ...]:
    """Return what is left of each channel [%] with the drift of its gain, which lies anywhere within its bound."""
    signal = report.read_out.signal
    drifts = [0.0] * len(percent) if signal is None else signal.gain_drift_percent
    return tuple(math.hypot(left, BOUNDED * drift) for left, drift in zip(percent, drifts, strict=True))


def modulus_of_coupon(table: MeasuredTable, report: Report) -> Estimate:
    """Return the modulus of a print [MPa] with its standard deviation, by the leaves of its coupon; raises InputError.

    The surer leaf counts more.
    """
    if report.housing is None:
        hint = "run pipeline design with springs that print"
        raise validation_error("coupon", None, "", "a coupon of a design with a housing", hint)
    every = report.housing.arms
    arms = [arm for arm in every if arm.name in table.texts["coupon"]] or list(every)
    names = [arm.name for arm in arms]
    lines = weighed_lines(table, names, [], table.numbers["force"])
    springs = [_anywhere_on(lines[name, DEFLECTION]) for name in names]
    factors = np.array([modulus_factor(arm.flexure) for arm in arms])
    moduli = factors * [spring.value for spring in springs]
    weights = np.array([spring.relative for spring in springs]) ** -2.0
    E = float(np.average(moduli, weights=weights))
    scatter = float(weights @ (moduli / E - 1.0) ** 2)
    return Estimate(E, E * math.sqrt((scatter + 1.0) / float(weights.sum())), "MPa")


def _anywhere_on(deflection: Line) -> Estimate:
    """Return the stiffness of a leaf [N/mm] under any of its weights, within the change of its slope to either side."""
    K = spring_of(deflection)
    bound = BOUNDED * 0.5 * deflection.bend.told_change
    return replace(K, error=math.hypot(K.error, bound * K.value))
