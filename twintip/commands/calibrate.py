"""`pipeline calibrate`: find the springs of a printed unit from measurements, and write its unit.toml."""

import shlex
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace

from instrument.calibrate.calibration import Calibration, calibrate_unit, modulus_of_coupon, read_print_table
from instrument.calibrate.fruit_presses import read_fruit_table
from instrument.calibrate.hard_plate import read_plate_table
from instrument.calibrate.reference_presses import PressedBall, reference_ball
from instrument.press.printed_unit import check_weighed_after, unit_as_toml
from instrument.press.ripeness import ripeness_classes
from instrument.press.signals import count_keys, force_keys, time_keys
from instrument.template import template_parts
from pipeline.report.report import Report, read_report
from pipeline.report.verdict_table import verdict_parts
from pipeline.storage.files import write_files
from pipeline.storage.record_data import as_data
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.measured_table import MeasuredTable
from pipeline.verdicts.in_words import MEASURED
from sensor.quantity import COVERAGE, validation_error
from sensor.verdict import all_passed
from sensor.words import value_with_bar
from twintip.commands.console import FAILED, PASSED, Answer, print_error

NAMES = ("tip", "coupon", "force", "deflection", "t", "travel", "fruit", "firmness", "E")
"""Names of the columns in the measured tables, besides the columns of forces, counts and times of channels."""


def run(arguments: Namespace) -> Answer:
    """Calibrate a unit, or find the modulus of a coupon, depending on the columns of the measured table.

    The exit code is 1 if a verdict on the unit fails or is undecided. For a coupon it is 0.
    """
    # These flags are checked before any table is read.
    if arguments.classes:
        ripeness_classes(arguments.classes)  # raises InputError for invalid classes; the result is not needed here
    check_weighed_after("--after", arguments.after)
    report = read_report(arguments.folder)
    tip_count = len(report.tips)
    column_names = (*NAMES, *force_keys(tip_count), *count_keys(tip_count), *time_keys(tip_count))
    flags = ColumnFlags(arguments.columns, arguments.units, column_names)
    table = read_print_table(arguments.measured, report, flags, arguments.counts_as)
    if "coupon" in table.texts:
        return _find_coupon_modulus(arguments, report, table)
    return _calibrate(arguments, report, table, flags)


def _find_coupon_modulus(arguments: Namespace, report: Report, table: MeasuredTable) -> Answer:
    """Return the modulus of a printed coupon, and the command that sizes the sensor for this modulus.

    `table` holds the weights on the leaves of the coupon and their deflections. Notes on how it was read are printed to
    stderr. Raises InputError for a flag that applies only to a unit.
    """
    for flag in ("--out", "--fruit", "--plate", "--after", "--ball"):
        value = getattr(arguments, flag.removeprefix("--"))
        if value is not None:
            bound = "left out for a coupon, which gives a modulus and no unit"
            raise validation_error(flag, str(value), "", bound, "leave it out")
    modulus = modulus_of_coupon(table, report)
    _print_notes(table)
    E = modulus.value  # [MPa]
    design_E = report.design.process.E_MPa
    E_with_error = value_with_bar(E, COVERAGE * modulus.error, "MPa", in_percent=True)  # the error bar of 95 %
    difference = f"{100.0 * (E / design_E - 1.0):+.1f} % from the design's modulus"
    command = ["pipeline", "design", "--design", str(arguments.folder / "design.toml"), "--set", f"print.E_MPa={E:.1f}"]
    return Answer(
        code=PASSED,
        data={"E_MPa": E, "E_percent": modulus.percent, "design_E_MPa": design_E},
        text=f"E as printed {E_with_error} (95 %), {difference}\nprint again from: {shlex.join(command)}",
    )


def _calibrate(arguments: Namespace, report: Report, table: MeasuredTable, flags: ColumnFlags) -> Answer:
    """Calibrate a unit from the weights in `table`, and write the unit to the path of `--out`, if given.

    `report` is the report of the unit's design, and `flags` are the columns and units that the user stated. Presses on
    fruit, on a hard plate and on a ball are read from the files that other flags name. Notes on the tables and on
    assumptions are printed to stderr.
    """
    fruit_table = None
    if arguments.fruit is not None:
        fruit_table = read_fruit_table(arguments.fruit, len(report.tips), flags)
    plate_table = None
    if arguments.plate is not None:
        plate_table = read_plate_table(arguments.plate, report, flags, arguments.counts_as)
    ball_notes: list[str] = []
    ball = _pressed_ball(arguments, flags, ball_notes.append)
    calibration = calibrate_unit(report, table, fruit_table, plate_table, arguments.after, ball)
    if arguments.out is not None:
        unit = replace(calibration.unit, classes=arguments.classes)
        write_files({arguments.out: unit_as_toml(unit).encode()}, "--out", force=arguments.force)
    _print_notes(table, fruit_table, plate_table)
    for note in (*ball_notes, *calibration.assumed):
        print_error(f"note: {note}")
    return _calibration_answer(calibration)


def _calibration_answer(calibration: Calibration) -> Answer:
    """Return the answer for a calibrated unit: its data, a text on the calibration, and a table of its verdicts."""
    has_passed = all_passed(calibration.verdicts)  # None if a verdict is undecided and none fails
    # If a verdict fails, the text explains how to correct the leaves, unless a verdict has its own remedy.
    explains_leaves = has_passed is False and all(verdict.remedy is None for verdict in calibration.verdicts)
    parts = template_parts("calibrate/calibration.txt.j2", failed=explains_leaves, **vars(calibration))
    return Answer(
        code=PASSED if has_passed else FAILED,
        data=as_data(calibration),
        parts=[*parts, *verdict_parts("the unit compared with its design", calibration.verdicts, MEASURED)],
    )


def _pressed_ball(arguments: Namespace, flags: ColumnFlags, report_note: Callable[[str], None]) -> PressedBall | None:
    """Return the reference ball and the file of the presses on it, or None if no flag requests a ball.

    `flags` are the columns and units that the user stated. `report_note` is called with each note about the file of the
    presses. Raises InputError if some, but not all, of the ball's flags are given.
    """
    modulus, radius, modulus_error = arguments.ball_reduced_modulus, arguments.ball_radius, arguments.ball_modulus_error
    if arguments.ball is not None:
        ball = reference_ball(modulus, radius, modulus_error)
        return PressedBall(
            source=arguments.ball, ball=ball, counts_as=arguments.counts_as, columns=flags, say=report_note
        )
    # Without a file of presses, the properties of the ball would have no use.
    properties = {"--ball-reduced-modulus": modulus, "--ball-radius": radius, "--ball-modulus-error": modulus_error}
    for flag, value in properties.items():
        if value is not None:
            bound = "left out unless --ball is given"
            raise validation_error(flag, value, "", bound, "name the file of the presses on the ball")
    return None


def _print_notes(*tables: MeasuredTable | None) -> None:
    """Print to stderr how each table was read."""
    for table in tables:
        if table is not None:
            print_error(f"note: {table.summary}")
