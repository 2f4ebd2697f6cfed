"""`pipeline read`: forces of a sensor to the modulus of the fruit, from one reading, a press or a stream."""

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sensor.quantity import validation_error, written_number
from twintip.commands.console import FAILED, PASSED, add_counts_flag, add_force_flag, answering, print_error

if TYPE_CHECKING:
    from instrument.press.fruit_reading import FruitReading
    from instrument.press.measuring import MeasuringUnit

LEAST_RADIUS_MM = 1.0
LARGEST_RADIUS_MM = 1e6
PURPOSE = "read the modulus and ripeness of a fruit from forces"
EXAMPLE = "pipeline read outputs/paper --forces 0.411,1.076"


def add_arguments(parser: ArgumentParser) -> None:
    """Add OUT, FILE.csv and the flags of a reading."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the sensor's design")
    add(
        "signal",
        metavar="FILE.csv",
        nargs="?",
        help="columns t_s or a time for each channel, a force or counts for each tip; or -",
    )
    add("--forces", metavar="F1,F2", help="one reading of a pair [N]; write --forces=-0.5,1 below 0")
    add("--unit", metavar="unit.toml", type=Path, help="the unit as pipeline calibrate found it (default: as designed)")
    add("--classes", metavar="NAMES", help="ripeness by modulus [MPa], as in ripe:0.8,turning:1.6,unripe")
    add(
        "--radius", metavar="R1,R2", help="principal radii of the fruit [mm], or its one radius (default: the design's)"
    )
    add("--columns", metavar="NAME=HEADER,...", help="headers of FILE.csv, or numbers of columns, as in t=1,F_l=Kraft")
    add("--units", metavar="NAME=UNIT,...", help="units where FILE.csv gives none, as in t=ms,F_l=mN")
    add_counts_flag(parser)
    add("--each", action="store_true", help="a reading of the press so far for each sample")
    add("--c-header", metavar="FILE.h", type=Path, help="write the read-out of this unit in C99")
    add("--micropython", metavar="FILE.py", type=Path, help="write the read-out of this unit in MicroPython")
    add_force_flag(parser)
    parser.add_argument("--json", action="store_true", help="print JSON, one object a line for a signal")


def execute(arguments: Namespace) -> int:
    """Read forces, write firmware or both; return 1 where forces tell no modulus, else 0. Files are written last."""
    sources = _sources(arguments)
    sensor = _sensor(arguments)
    _refuse_unreadable(arguments, sensor, sources)
    firmware = _firmware(arguments, sensor)
    outcome = PASSED
    if sources:
        _print_assumptions(arguments, sensor)
        outcome = _read_moment(arguments, sensor) if arguments.signal is None else _read_signal(arguments, sensor)
    elif not firmware:
        raise validation_error("FILE.csv", None, "", "a file, - or left out beside --forces", "say what to read")
    if firmware:
        from pipeline.storage.files import write_files

        for flag, file in firmware.items():
            for path in write_files(file, flag, force=arguments.force):
                print(path, file=sys.stderr if arguments.json else sys.stdout)
    return outcome


def _sources(arguments: Namespace) -> dict[str, str]:
    """Return the flag that gives the forces with its value, none for firmware alone; raises InputError for two."""
    given = {"--forces": arguments.forces, "FILE.csv": arguments.signal}
    sources = {name: value for name, value in given.items() if value is not None}
    if len(sources) > 1:
        first, second = list(sources)[:2]
        raise validation_error(first, sources[first], "", f"left out beside {second}", "read one of the two")
    return sources


def _refuse_unreadable(arguments: Namespace, sensor: "MeasuringUnit", sources: dict[str, str]) -> None:
    """Raise InputError for flags by which this sensor cannot be read.

    Flesh that relaxes is read by a press with its hold; only a pair of flat tips can be read at one moment.
    """
    if sensor.design.fruit.relaxation is not None:
        for name in ("forces", "each", "c_header", "micropython"):
            if getattr(arguments, name):
                flag = f"--{name.replace('_', '-')}"
                bound = "left out where the design has fruit.relaxation"
                raise validation_error(flag, str(getattr(arguments, name)), "", bound, "read a press with its hold")
    if not sensor.reads_moments and "--forces" in sources:
        bound = "left out but for a pair of flat tips: one moment cannot tell the shape of the skin from the modulus"
        raise validation_error("--forces", arguments.forces, "", bound, "read a press: FILE.csv")


def _print_assumptions(arguments: Namespace, sensor: "MeasuringUnit") -> None:
    """Print a note to stderr on each assumption behind a reading."""
    if not sensor.report.moduli:
        lacks = "has no [reading]" if sensor.design.reading is None else "has level presses without a reading"
        print_error(f"note: the design {lacks}; the uncertainty holds for level presses in the middle of the fruit")
    if sensor.design.fruit.relaxation is not None:
        at = sensor.design.read_s
        print_error(f"note: E is that at the first instant; the apparent one is that at {at:g} s")
    if arguments.unit is None:
        print_error("note: no --unit; springs as designed, as uncertain as their process prints them")
    elif sensor.creep.exponent:
        more = 100.0 * (sensor.press_over_weighed() - 1.0)
        weighed = f"stiffer by {more:.2g} % than under weights read after {sensor.unit.weighed_after_s:.3g} s"
        press = f"a press of {sensor.design.press_s:.3g} s"
        print_error(f"note: springs creep by {sensor.creep}; in {press} they are {weighed}")


def _sensor(arguments: Namespace) -> "MeasuringUnit":
    """Return the unit that the flags name, as designed without `--unit`; raises InputError."""
    from instrument.press.measuring import MeasuringUnit
    from instrument.press.printed_unit import nominal_unit, read_unit
    from instrument.press.ripeness import ripeness_classes
    from pipeline.report.report import read_report

    report = read_report(arguments.folder)
    unit = nominal_unit(report) if arguments.unit is None else read_unit(arguments.unit, report)
    text, flag = (arguments.classes, "--classes") if arguments.classes else (unit.classes, "unit.classes")
    classes = ripeness_classes(text, flag) if text else None
    sensor = MeasuringUnit(report=report, unit=unit, classes=classes)
    return sensor if arguments.radius is None else replace(sensor, radii_mm=_radii_of_flag(arguments.radius, sensor))


def _radii_of_flag(text: str, sensor: "MeasuringUnit") -> tuple[float, float]:
    """Return the principal radii [mm] of `--radius`; raises InputError."""
    if sensor.domes is None:
        bound = "left out but for domes in a line or a square"
        raise validation_error(
            "--radius", text, "mm", bound, "leave it out: the radius does not change what other tips read"
        )
    radii = [number for number in map(written_number, text.split(",")) if number is not None]
    in_range = all(LEAST_RADIUS_MM <= number <= LARGEST_RADIUS_MM for number in radii)
    if len(radii) not in (1, 2) or len(radii) != text.count(",") + 1 or not in_range:
        bound = f"one or two numbers from {LEAST_RADIUS_MM:g} to {LARGEST_RADIUS_MM:g} with a comma between"
        raise validation_error("--radius", text, "mm", bound, "write for instance --radius 47,110")
    return radii[0], radii[-1]


def _firmware(arguments: Namespace, sensor: "MeasuringUnit") -> dict[str, dict[Path, bytes]]:
    """Return the file of firmware that each flag asks for, not yet written; raises InputError where it cannot be."""
    paths = {"--c-header": arguments.c_header, "--micropython": arguments.micropython}
    paths = {flag: path for flag, path in paths.items() if path is not None}
    if not paths:
        return {}
    from instrument.firmware.firmware import c_header, micropython
    from pipeline.storage.files import refuse_taken

    if len({path.resolve() for path in paths.values()}) < len(paths):
        bound = "another file than that of --c-header"
        raise validation_error("--micropython", str(arguments.micropython), "", bound, "choose another name")
    written = {"--c-header": c_header, "--micropython": micropython}
    files = {flag: {path: written[flag](sensor).encode()} for flag, path in paths.items()}
    for flag, file in files.items():
        refuse_taken(file, flag, force=arguments.force)
    return files


def _read_moment(arguments: Namespace, sensor: "MeasuringUnit") -> int:
    """Read and print one moment of `--forces`; return the exit code."""
    from instrument.press.count_codes import refuse_without_counts
    from instrument.press.pair_press import single_reading
    from instrument.press.presses import refuse_out_of_scale
    from instrument.press.signals import numbers_of_text

    tips = sensor.report.tips
    refuse_without_counts(arguments.counts_as, "--forces")
    channels = numbers_of_text(arguments.forces, len(tips), "--forces", "N")
    refuse_out_of_scale(sensor, channels, lambda tip: f"--forces: tip {tips[tip].name}")
    reading = single_reading(sensor, sensor.forces_of_channels(channels))
    print_error("note: one reading of a pair is its force ratio, right only for a level press; read a press instead")
    with answering():
        _print_reading(reading, indent=2, as_json=arguments.json)
    return FAILED if reading.E is None else PASSED


def _read_signal(arguments: Namespace, sensor: "MeasuringUnit") -> int:
    """Read and print every press of a file or of the standard input; return 1 where none tells a modulus."""
    from instrument.press.count_codes import refuse_without_counts
    from instrument.press.presses import readings_of
    from instrument.press.signals import Signal
    from pipeline.tables.headers import ColumnFlags
    from pipeline.tables.rows import rows_of

    has_modulus = False
    flags = ColumnFlags(arguments.columns, arguments.units)

    def say(told: str) -> None:
        print_error(f"note: {arguments.signal}: {told}")

    signal = Signal(rows_of(arguments.signal), len(sensor.report.tips), flags, say)
    print_error(f"note: {signal.understood}")
    for note in signal.notes:
        print_error(f"note: {note}")
    if not signal.timed and sensor.report.read_out.signal is None:
        print_error("note: no time for each channel, and no [readout]: all channels of a line are taken as at once")
    if not signal.counted:
        refuse_without_counts(arguments.counts_as, signal.source)
    for reading in readings_of(sensor, signal, every_sample=arguments.each, counts_as=arguments.counts_as):
        has_modulus = has_modulus or reading.E is not None
        _print_reading(reading, indent=None, as_json=arguments.json)
    return PASSED if has_modulus else FAILED


def _print_reading(reading: "FruitReading", *, indent: int | None, as_json: bool) -> None:
    """Print a reading on one line, or as JSON."""
    import json

    from instrument.press.fruit_reading import LINE
    from pipeline.storage.told import as_data, as_line

    text = json.dumps(as_data(reading), indent=indent, allow_nan=False) if as_json else as_line(reading, LINE)
    print(text, flush=True)
