"""`pipeline calibrate`: what was measured of a printed unit to its springs, its verdict and its unit.toml."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import InputError, validation_error
from cad.verdict import all_passed
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_error, print_json

if TYPE_CHECKING:
    from cad.quantity import Estimate
    from pipeline.measure.calibrating.calibration import Calibration
    from pipeline.measure.calibrating.fruit_presses import ScaleFit

PURPOSE = "find the springs of a printed unit from what was measured of it"
EXAMPLE = "pipeline calibrate outputs/paper weights.csv --out unit.toml"


def add_arguments(parser: ArgumentParser) -> None:
    """Add OUT, MEASURED.csv, --fruit and --out."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the unit's design")
    columns = "tip,weight_g,deflection_mm, with counts of each channel; or coupon,..."
    add("measured", metavar="MEASURED.csv", type=Path, help=f"a table with the columns {columns}")
    firm = "fruit,firmness_N (or E_MPa) and a force for each tip: fruit that another instrument measured"
    add("--fruit", metavar="FRUIT.csv", type=Path, help=f"find the scale of its firmness, of the columns {firm}")
    add("--out", metavar="unit.toml", type=Path, help="write the unit there, for pipeline read --unit")
    add("--classes", metavar="NAMES", default="", help="ripeness classes of its readings, as in ripe:0.8,unripe")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Calibrate a unit, or find the modulus of a coupon; return 1 where the unit misses the targets of its design."""
    from cad.theory.contrast_law import ReadingError
    from pipeline.measure.calibrating.calibration import calibrated, measured_print, modulus_of_coupon
    from pipeline.measure.calibrating.fruit_presses import measured_fruit
    from pipeline.measure.unit.ripeness import ripeness_classes
    from pipeline.report.stored import read_report

    if arguments.classes:
        ripeness_classes(arguments.classes)
    report = read_report(arguments.folder)
    table = measured_print(arguments.measured, report)
    if "coupon" in table.texts:
        for flag, path in (("--out", arguments.out), ("--fruit", arguments.fruit)):
            if path is not None:
                bound = "left out for a coupon, which tells a modulus and no unit"
                raise validation_error(flag, str(path), "", bound, "leave it out")
        modulus = modulus_of_coupon(table, report)
        _print_modulus(modulus, report.design.process.E_MPa, as_json=arguments.json)
        return PASSED
    fruit = None if arguments.fruit is None else measured_fruit(arguments.fruit, len(report.tips))
    try:
        calibration = calibrated(report, table, fruit)
    except ReadingError as error:
        msg = f"{arguments.measured}: {error}"
        raise InputError(msg) from error
    _write(calibration, arguments)
    for assumed in calibration.assumed:
        print_error(f"note: {assumed}")
    with answering():
        if arguments.json:
            print_json(_as_mapping(calibration))
        else:
            _print(calibration)
    return PASSED if all_passed(calibration.verdicts) else FAILED


def _write(calibration: "Calibration", arguments: Namespace) -> None:
    """Write unit.toml where --out asks for it."""
    from dataclasses import replace

    from pipeline.measure.unit.printed_unit import unit_as_toml
    from pipeline.storage.files import write_files

    if arguments.out is not None:
        unit = replace(calibration.unit, classes=arguments.classes)
        write_files({arguments.out: unit_as_toml(unit).encode()}, "--out", force=arguments.force)


def _as_mapping(calibration: "Calibration") -> dict[str, object]:
    from dataclasses import asdict

    unit = calibration.unit
    table = []
    for row in calibration.table:
        table.append(
            {
                "E_MPa": row.E,
                "F_N": list(row.forces),
                "P": row.P,
                "u_percent": 100.0 * row.u,
                "with_design_stiffness_percent": 100.0 * row.with_design,
            }
        )
    trims = []
    for tip, longer in zip(unit.tips, calibration.trims, strict=False):
        trims.append({"tip": tip, "leaf_longer_mm": longer})
    data: dict[str, object] = {
        "tips": list(unit.tips),
        "method": unit.method,
        "K_N_per_m": list(unit.K_N_per_m),
        "K_percent": list(unit.K_percent),
        "design_K_N_per_m": [1e3 * K for K in calibration.nominal],
        "table": table,
        "verdicts": [asdict(verdict) for verdict in calibration.verdicts],
        "trims": trims,
        **_channel_keys(calibration),
    }
    if calibration.scale is not None:
        left_out = {f"{curve}_percent": 100.0 * error for curve, error in calibration.scale.left_out.items()}
        data["scale"] = {**asdict(calibration.scale.scale), "fruit": calibration.scale.fruit, "left_out": left_out}
    return data


def _channel_keys(calibration: "Calibration") -> dict[str, object]:
    channels = calibration.channels
    if channels is None:
        return {}
    keys: dict[str, object] = {
        "counts_per_N": channels.counts_per_N.tolist(),
        "zero_counts": channels.zero_counts.tolist(),
        "gain_percent": list(calibration.unit.gain_percent),
        "crosstalk_percent": list(channels.crosstalk_percent),
        "hysteresis_percent": list(channels.hysteresis_percent),
        "drift_percent": list(channels.drift_percent),
    }
    return {"channels": keys}


def _print(calibration: "Calibration") -> None:
    """Print springs, table, verdicts and, where the unit misses its targets, how to trim it."""
    from pipeline.report.verdict_table import print_verdicts

    _print_springs(calibration)
    _print_channels(calibration)
    _print_table(calibration)
    if calibration.scale is not None:
        _print_scale(calibration.scale)
    print_verdicts("the unit against its design", calibration.verdicts)
    if all_passed(calibration.verdicts) is not False:
        return
    for tip, longer, target in zip(calibration.unit.tips, calibration.trims, calibration.nominal, strict=False):
        if longer is None:
            print(f"{tip}: its error holds its target of {1e3 * target:.1f} N/m; cut nothing before K is known better")
            continue
        what = "file the roots of both leaves, longer by" if longer > 0.0 else "clamp both leaves, shorter by"
        print(f"{tip}: {what} {abs(longer):.2f} mm for {1e3 * target:.1f} N/m")


def _print_springs(calibration: "Calibration") -> None:
    unit = calibration.unit
    for name, K, percent, nominal in zip(unit.tips, unit.K_N_per_m, unit.K_percent, calibration.nominal, strict=True):
        against = f"{0.1 * K / nominal - 100.0:+.1f} % against the design's {1e3 * nominal:.1f}"
        print(f"{name:8} K {K:9.1f} N/m +- {2.0 * percent:.2g} % (95 %), {against}")


def _print_channels(calibration: "Calibration") -> None:
    """Print gain, crosstalk, hysteresis and drift of each channel, where counts were given."""
    channels = calibration.channels
    if channels is None:
        return
    for tip, name in enumerate(calibration.unit.tips):
        print(
            f"{name:8} {channels.counts_per_N[tip, tip]:.6g} counts/N +- {2.0 * channels.gain_percent[tip]:.2g} % "
            f"(95 %), zero {channels.zero_counts[tip]:.0f}, crosstalk {channels.crosstalk_percent[tip]:.2g} %, "
            f"hysteresis {channels.hysteresis_percent[tip]:.2g} %, drift {channels.drift_percent[tip]:+.2g} %"
        )


def _print_table(calibration: "Calibration") -> None:
    print(f"E +- (95 %) is what is left open {calibration.error_by}")
    print("E [MPa]  P       E +- (95 %)  E read with the design's stiffnesses")
    for row in calibration.table:
        print(f"{row.E:7.3f}  {row.P:6.3f}  {100.0 * row.u:9.2g} %  {100.0 * row.with_design:+.1f} %")
    worst = max((row.with_design for row in calibration.table), key=abs)
    print(f"E read with the design's stiffnesses is off by {100.0 * worst:+.1f} % at worst; with these by", end=" ")
    print(f"{100.0 * max(row.u for row in calibration.table):.2g} % at most (95 %), {calibration.error_by}")


def _print_scale(fit: "ScaleFit") -> None:
    scale = fit.scale
    print(f"firmness by {scale.curve} of E read, +- {scale.percent:.2g} % (95 %), of {fit.fruit} fruit")
    errors = ", ".join(f"{curve} {100.0 * error:.2g} %" for curve, error in fit.left_out.items())
    print(f"error of a fruit that is left out: {errors}")
    print(f"E read [MPa]  firmness [{scale.unit}]")
    for E, firmness in zip(scale.E_MPa, scale.firmness, strict=True):
        print(f"{E:12.3f}  {firmness:.4g}")


def _print_modulus(modulus: "Estimate", design_MPa: float, *, as_json: bool) -> None:
    if as_json:
        print_json({"E_MPa": modulus.value, "E_percent": modulus.percent, "design_E_MPa": design_MPa})
        return
    against = f"{100.0 * (modulus.value / design_MPa - 1.0):+.1f} % against the design's"
    print(f"E as printed {modulus.value:.1f} MPa +- {2.0 * modulus.percent:.2g} % (95 %), {against}")
    print(f"print again from: pipeline design --design DESIGN --set print.E_MPa={modulus.value:.1f}")
