"""`pipeline calibrate`: what was measured of a printed unit to its springs, its verdict and its unit.toml."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import InputError
from cad.verdict import all_passed
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_error, print_json

if TYPE_CHECKING:
    from pipeline.measure.calibrating.calibration import Calibration
    from pipeline.measure.calibrating.coupon_modulus import PrintedModulus

PURPOSE = "find the springs of a printed unit from what was measured of it"
EXAMPLE = "pipeline calibrate outputs/paper weights.csv --out unit.toml"


def add_arguments(parser: ArgumentParser) -> None:
    """Add OUT, MEASURED.csv and --out."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the unit's design")
    columns = "tip,weight_g,deflection_mm; or coupon,...; or rubber,E_over_1_minus_nu2_MPa and a force for each tip"
    add("measured", metavar="MEASURED.csv", type=Path, help=f"a table with the columns {columns}")
    add("--out", metavar="unit.toml", type=Path, help="write the unit there, for pipeline read --unit")
    add("--classes", metavar="NAMES", default="", help="ripeness classes of its readings, as in ripe:0.8,unripe")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Calibrate a unit, or find the modulus of a coupon; return 1 where the unit misses the targets of its design."""
    from pipeline.measure.calibrating.calibration import is_coupon
    from pipeline.measure.calibrating.measured_table import measured_rows
    from pipeline.report.stored import read_report

    report = read_report(arguments.folder)
    rows = measured_rows(arguments.measured)
    if not is_coupon(rows):
        return _calibrate(arguments)
    from pipeline.measure.calibrating.coupon_modulus import modulus_of_coupon

    if arguments.out is not None:
        msg = f"--out = {str(arguments.out)!r}: must be left out for a coupon; it tells a modulus, not a unit"
        raise InputError(msg)
    _print_modulus(modulus_of_coupon(arguments.measured, rows, report), arguments)
    return PASSED


def _calibrate(arguments: Namespace) -> int:
    from dataclasses import replace

    from cad.theory.contrast_law import ReadingError
    from pipeline.measure.calibrating.calibration import calibrated
    from pipeline.measure.unit.printed_unit import unit_as_toml
    from pipeline.measure.unit.ripeness import ripeness_classes
    from pipeline.report.stored import read_report
    from pipeline.storage.new_file import write_new

    if arguments.classes:
        ripeness_classes(arguments.classes)
    try:
        found = calibrated(read_report(arguments.folder), arguments.measured)
    except ReadingError as error:
        msg = f"{arguments.measured}: {error}"
        raise InputError(msg) from error
    if arguments.out is not None:
        unit = replace(found.unit, classes=arguments.classes)
        write_new(arguments.out, unit_as_toml(unit), "--out", force=arguments.force)
    for assumed in found.assumed:
        print_error(f"note: {assumed}")
    with answering():
        if arguments.json:
            print_json(_as_mapping(found))
        else:
            _print(found)
    return PASSED if all_passed(found.verdicts) else FAILED


def _as_mapping(found: "Calibration") -> dict[str, object]:
    from dataclasses import asdict

    keys = ("K_N_per_m", "K_percent")
    return {
        "tips": list(found.unit.tips),
        "method": found.unit.method,
        **{key: list(getattr(found.unit, key)) for key in keys},
        "design_K_N_per_m": [1e3 * K for K in found.nominal],
        "table": [
            {
                "E_MPa": row.E,
                "F_N": list(row.forces),
                "P": row.P,
                "u_percent": 100.0 * row.u,
                "with_design_stiffness_percent": 100.0 * row.with_design,
            }
            for row in found.table
        ],
        "verdicts": [asdict(verdict) for verdict in found.verdicts],
        "trims": [{"tip": trim.name, "leaf_longer_mm": trim.longer} for trim in found.trims],
    }


def _print(found: "Calibration") -> None:
    """Print springs, table, verdicts and, where the unit misses its targets, how to trim it."""
    from pipeline.report.verdict_table import print_verdicts

    _print_springs(found)
    _print_table(found)
    print_verdicts("the unit against its design", found.verdicts)
    if all_passed(found.verdicts) is not False:
        return
    for trim in found.trims:
        what = "file the roots of both leaves, longer by" if trim.longer > 0.0 else "clamp both leaves, shorter by"
        print(f"{trim.name}: {what} {abs(trim.longer):.2f} mm for {1e3 * trim.target:.1f} N/m")


def _print_springs(found: "Calibration") -> None:
    unit = found.unit
    for name, K, percent, nominal in zip(unit.tips, unit.K_N_per_m, unit.K_percent, found.nominal, strict=True):
        against = f"{0.1 * K / nominal - 100.0:+.1f} % against the design's {1e3 * nominal:.1f}"
        print(f"{name:8} K {K:9.1f} N/m +- {2.0 * percent:.2g} % (95 %), {against}")


def _print_table(found: "Calibration") -> None:
    print(f"E +- (95 %) is what is left open {found.open_by}")
    print("E [MPa]  P       E +- (95 %)  E read with the design's stiffnesses")
    for row in found.table:
        print(f"{row.E:7.3f}  {row.P:6.3f}  {100.0 * row.u:9.2g} %  {100.0 * row.with_design:+.1f} %")
    worst = max((row.with_design for row in found.table), key=abs)
    print(f"E read with the design's stiffnesses is off by {100.0 * worst:+.1f} % at worst; with these by", end=" ")
    print(f"{100.0 * max(row.u for row in found.table):.2g} % at most (95 %), {found.open_by}")


def _print_modulus(found: "PrintedModulus", arguments: Namespace) -> None:
    if arguments.json:
        print_json({"E_MPa": found.E, "E_percent": 100.0 * found.share, "design_E_MPa": found.of_design})
        return
    share = 100.0 * (found.E / found.of_design - 1.0)
    print(f"E as printed {found.E:.1f} MPa +- {200.0 * found.share:.2g} % (95 %), {share:+.1f} % against the design's")
    print(f"print again from: pipeline design --design DESIGN --set print.E_MPa={found.E:.1f}")
