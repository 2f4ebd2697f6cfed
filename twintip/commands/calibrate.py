"""`pipeline calibrate`: what was measured of a printed unit to its springs, its verdict and its unit.toml."""

from argparse import Namespace
from dataclasses import replace

from instrument.calibrate.calibration import Calibration, calibrate_unit, measured_print, modulus_of_coupon
from instrument.calibrate.fruit_presses import measured_fruit
from instrument.calibrate.plate import measured_plate
from instrument.press.printed_unit import check_weighed_after, unit_as_toml
from instrument.press.ripeness import ripeness_classes
from instrument.press.signals import count_keys, force_keys
from instrument.template import template_parts
from pipeline.report.report import Report, read_report
from pipeline.report.verdict_table import verdict_parts
from pipeline.storage.files import write_files
from pipeline.storage.plain import to_plain
from pipeline.storage.told import as_data
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.measured_table import MeasuredTable
from sensor.quantity import COVERAGE, validation_error
from sensor.verdict import all_passed
from sensor.words import with_bar
from twintip.commands.console import FAILED, PASSED, Answer, print_error

NAMES = ("tip", "coupon", "force", "deflection", "t", "travel", "fruit", "firmness", "E")
"""What the columns of its tables hold, beside forces and counts."""
_BENDS = ("force_bend", "force_bend_per_N", "deflection_bend", "deflection_bend_per_N")


def run(arguments: Namespace) -> Answer:
    """Calibrate a unit, or find the modulus of a coupon; the exit code is 1 if the unit misses its targets."""
    if arguments.classes:
        ripeness_classes(arguments.classes)
    check_weighed_after("--after", arguments.after)
    report = read_report(arguments.folder)
    tips = len(report.tips)
    flags = ColumnFlags(arguments.columns, arguments.units, (*NAMES, *force_keys(tips), *count_keys(tips)))
    table = measured_print(arguments.measured, report, flags, arguments.counts_as)
    if "coupon" in table.texts:
        return _answer_coupon(arguments, report, table)
    return _answer_unit(arguments, report, table, flags)


def _answer_coupon(arguments: Namespace, report: Report, table: MeasuredTable) -> Answer:
    """Return the modulus of a coupon; raises InputError for a flag that asks for a unit."""
    for flag in ("--out", "--fruit", "--plate", "--after"):
        value = getattr(arguments, flag[2:])
        if value is not None:
            bound = "left out for a coupon, which tells a modulus and no unit"
            raise validation_error(flag, str(value), "", bound, "leave it out")
    modulus = modulus_of_coupon(table, report)
    _tell_tables(table)
    E = modulus.value
    design_MPa = report.design.process.E_MPa
    against = f"{100.0 * (E / design_MPa - 1.0):+.1f} % against the design's"
    printed = f"E as printed {with_bar(E, COVERAGE * modulus.error, 'MPa', in_percent=True)} (95 %), {against}"
    again = f"print again from: pipeline design --design DESIGN --set print.E_MPa={E:.1f}"
    data = {"E_MPa": E, "E_percent": modulus.percent, "design_E_MPa": design_MPa}
    return Answer(code=PASSED, data=data, text=f"{printed}\n{again}")


def _answer_unit(arguments: Namespace, report: Report, table: MeasuredTable, flags: ColumnFlags) -> Answer:
    """Calibrate a unit, and write it where `--out` says."""
    fruit = None if arguments.fruit is None else measured_fruit(arguments.fruit, len(report.tips), flags)
    plate = None if arguments.plate is None else measured_plate(arguments.plate, report, flags, arguments.counts_as)
    calibration = calibrate_unit(report, table, fruit, plate, arguments.after)
    if arguments.out is not None:
        unit = replace(calibration.unit, classes=arguments.classes)
        write_files({arguments.out: unit_as_toml(unit).encode()}, "--out", force=arguments.force)
    _tell_tables(table, fruit, plate)
    for assumed in calibration.assumed:
        print_error(f"note: {assumed}")
    passed = all_passed(calibration.verdicts)
    parts = template_parts("calibrate/calibration.txt.j2", failed=passed is False, **vars(calibration))
    return Answer(
        code=PASSED if passed else FAILED,
        data=_data(calibration),
        parts=[*parts, *verdict_parts("the unit against its design", calibration.verdicts)],
    )


def _tell_tables(*tables: MeasuredTable | None) -> None:
    """Print what was read of each table."""
    for table in tables:
        if table is not None:
            print_error(f"note: {table.understood}")


def _data(calibration: Calibration) -> dict[str, object]:
    """Return a calibration as the data of `--json`; each key ends in its unit."""
    unit = to_plain(calibration.unit)
    trims = zip(unit["tips"], calibration.trims, strict=False)  # there are no trims where no housing is made
    data: dict[str, object] = {
        **{key: unit[key] for key in ("tips", "method", "K_N_per_m", "K_percent", *_BENDS)},
        "design_K_N_per_m": [1e3 * K for K in calibration.nominal],
        "weighed_after_s": calibration.weighing.after_s,
        "creep_of": "unit" if calibration.weighing.own else "process",
        "creep_per_decade": calibration.weighing.creep.per_decade,
        "creep_error": calibration.weighing.creep.error,
        "press_s": calibration.press_s,
        "K_press_over_weighed": calibration.stiffened,
        "table": as_data(calibration.table),
        "verdicts": as_data(calibration.verdicts),
        "trims": [{"tip": tip, "leaf_longer_mm": longer} for tip, longer in trims],
    }
    if calibration.channels is not None:
        channels = to_plain(calibration.channels)
        del channels["lacks_of_fit"]  # which the unit has
        data["channels"] = {**channels, "gain_percent": unit["gain_percent"]}
    fit = calibration.scale
    if fit is not None:
        left_out = {f"{curve}_percent": 100.0 * error for curve, error in fit.left_out.items()}
        data["scale"] = {**to_plain(fit.scale), "fruit": fit.fruit, "left_out": left_out}
    return data
