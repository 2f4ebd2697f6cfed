"""`pipeline calibrate`: what was measured of a printed unit to its springs, its verdict and its unit.toml."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from sensor.quantity import COVERAGE, validation_error, with_bar
from sensor.verdict import all_passed
from twintip.commands.console import (
    FAILED,
    PASSED,
    add_counts_flag,
    add_force_flag,
    add_json_flag,
    answering,
    number,
    print_error,
    print_json,
)

if TYPE_CHECKING:
    from instrument.calibrate.calibration import Calibration
    from pipeline.report.report import Report
    from pipeline.tables.headers import ColumnFlags
    from pipeline.tables.measured_table import MeasuredTable
    from sensor.quantity import Estimate

PURPOSE = "find the springs of a printed unit from what was measured of it"
NAMES = ("tip", "coupon", "force", "deflection", "t", "travel", "fruit", "firmness", "E")
"""What the columns of its tables hold, beside forces and counts."""
_BENDS = ("force_bend", "force_bend_per_N", "deflection_bend", "deflection_bend_per_N")
EXAMPLE = "pipeline calibrate outputs/paper weights.csv --out unit.toml"


def add_arguments(parser: ArgumentParser) -> None:
    """Add OUT, MEASURED.csv, --after, --fruit, --plate and --out."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the unit's design")
    columns = "tip,weight_g,deflection_mm, with t_s or counts of each channel; or coupon,..."
    add("measured", metavar="MEASURED.csv", type=Path, help=f"a table with the columns {columns}")
    since = "seconds from the hanging of a weight to its reading, for springs that creep (default: 30)"
    add("--after", metavar="SECONDS", type=number, help=f"{since}; a column t_s has them for each row")
    firm = "fruit,firmness_N (or E_MPa), a force for each tip, t_s if known: fruit that another instrument measured"
    add("--fruit", metavar="FRUIT.csv", type=Path, help=f"find the scale of its firmness, of the columns {firm}")
    pressed = "travel_mm and the counts of each channel: a press on a hard flat plate, all tips on it"
    add("--plate", metavar="PLATE.csv", type=Path, help=f"calibrate deflections, of the columns {pressed}")
    add("--columns", metavar="NAME=HEADER,...", help="headers or numbers of columns, as in force=Gewicht,counts_l=4")
    add("--units", metavar="NAME=UNIT,...", help="units where a table gives none, as in force=g,deflection=um")
    add_counts_flag(parser)
    add("--out", metavar="unit.toml", type=Path, help="write the unit there, for pipeline read --unit")
    add("--classes", metavar="NAMES", default="", help="ripeness classes of its readings, as in ripe:0.8,unripe")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Calibrate a unit, or find the modulus of a coupon; return 1 where the unit misses the targets of its design."""
    from instrument.calibrate.calibration import measured_print
    from instrument.press.printed_unit import check_weighed_after
    from instrument.press.ripeness import ripeness_classes
    from instrument.press.signals import count_keys, force_keys
    from pipeline.report.report import read_report
    from pipeline.tables.headers import ColumnFlags

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


def _answer_coupon(arguments: Namespace, report: "Report", table: "MeasuredTable") -> int:
    """Print the modulus of a coupon; return exit code 0. Raises InputError for a flag that asks for a unit."""
    from instrument.calibrate.calibration import modulus_of_coupon

    for flag in ("--out", "--fruit", "--plate", "--after"):
        value = getattr(arguments, flag[2:])
        if value is not None:
            bound = "left out for a coupon, which tells a modulus and no unit"
            raise validation_error(flag, str(value), "", bound, "leave it out")
    modulus = modulus_of_coupon(table, report)
    _tell_tables(table)
    _print_modulus(modulus, report.design.process.E_MPa, as_json=arguments.json)
    return PASSED


def _answer_unit(arguments: Namespace, report: "Report", table: "MeasuredTable", flags: "ColumnFlags") -> int:
    """Calibrate a unit, write it where `--out` asks for it, print it; return 1 where it misses its targets."""
    from dataclasses import replace

    from instrument.calibrate.calibration import calibrate_unit
    from instrument.calibrate.fruit_presses import measured_fruit
    from instrument.calibrate.plate import measured_plate
    from instrument.press.printed_unit import unit_as_toml
    from instrument.template import print_answer
    from pipeline.report.verdict_table import print_verdicts
    from pipeline.storage.files import write_files

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
    with answering():
        if arguments.json:
            print_json(_as_mapping(calibration))
        else:
            template = "calibrate/calibration.txt.j2"
            print_answer(template, failed=passed is False, **vars(calibration))
            print_verdicts("the unit against its design", calibration.verdicts)
    return PASSED if passed else FAILED


def _tell_tables(*tables: "MeasuredTable | None") -> None:
    """Print what was read of each table."""
    for table in tables:
        if table is not None:
            print_error(f"note: {table.understood}")


def _as_mapping(calibration: "Calibration") -> dict[str, object]:
    """Return a calibration as the data of `--json`; each key ends in its unit."""
    from pipeline.storage.plain import to_plain
    from pipeline.storage.told import as_data

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


def _print_modulus(modulus: "Estimate", design_MPa: float, *, as_json: bool) -> None:
    if as_json:
        print_json({"E_MPa": modulus.value, "E_percent": modulus.percent, "design_E_MPa": design_MPa})
        return
    against = f"{100.0 * (modulus.value / design_MPa - 1.0):+.1f} % against the design's"
    bar = COVERAGE * modulus.error
    print(f"E as printed {with_bar(modulus.value, bar, 'MPa', in_percent=True)} (95 %), {against}")
    print(f"print again from: pipeline design --design DESIGN --set print.E_MPa={modulus.value:.1f}")
