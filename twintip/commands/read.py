"""`pipeline read`: from forces of a sensor to the modulus of the fruit, for one reading, a press or a stream."""

from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from instrument.press.count_codes import refuse_without_counts
from instrument.press.fruit_of_presses import FRUIT_LINE, FruitAnswer, fruits_of
from instrument.press.fruit_reading import LINE, FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.pair_press import single_reading
from instrument.press.presses import readings_of, refuse_out_of_scale
from instrument.press.signals import Signal, numbers_of_text
from pipeline.report.report import read_report
from pipeline.storage.files import refuse_taken, write_files
from pipeline.storage.record_data import as_data, as_line
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.rows import rows_of
from sensor.quantity import Bounds, validation_error
from twintip.commands.console import FAILED, PASSED, Answer, print_error
from twintip.flags import parse_radii

_RADIUS = Bounds(at_least=1.0, at_most=1e6)


class _Incompatible(NamedTuple):
    """A rule for flags that are wrong if `applies` is true of the other flags and the sensor."""

    flags: tuple[str, ...]
    applies: Callable[[Namespace, MeasuringUnit], bool]
    bound: str
    hint: str
    unit: str = ""


_INCOMPATIBLE = (
    _Incompatible(
        flags=("--forces",),
        applies=lambda arguments, _: arguments.signal is not None,
        bound="left out if FILE.csv is given",
        hint="read one of the two",
    ),
    _Incompatible(
        flags=("--fruit-presses",),
        applies=lambda arguments, _: arguments.signal is None,
        bound="left out without FILE.csv",
        hint="read a file of presses, or leave it out",
    ),
    _Incompatible(
        flags=("--fruit-presses",),
        applies=lambda arguments, _: arguments.fruit_presses < 0,
        bound="at least 0",
        hint="0 counts all presses of the file to one fruit",
    ),
    _Incompatible(
        flags=("--each",),
        applies=lambda arguments, _: arguments.fruit_presses is not None,
        bound="left out if --fruit-presses is given",
        hint="read presses as they grow, or fruits",
    ),
    _Incompatible(
        flags=("--radius",),
        applies=lambda _, sensor: sensor.domes is None,
        bound="left out except for domes in a line or a square",
        hint="leave it out: the radius does not change what other tips read",
        unit="mm",
    ),
    _Incompatible(
        flags=("--forces", "--each", "--c-header", "--micropython"),
        applies=lambda _, sensor: sensor.report.design.fruit.relaxation is not None,
        bound="left out if the design has fruit.relaxation",
        hint="read a press with its hold",
    ),
    _Incompatible(
        flags=("--forces",),
        applies=lambda _, sensor: not sensor.reads_moments,
        bound="left out except for a pair of flat tips: one moment cannot separate the skin's shape from the modulus",
        hint="read a press: FILE.csv",
    ),
)


def run(arguments: Namespace) -> Iterator[Answer]:
    """Read forces, write firmware, or both; files are written last.

    The exit code is 1 if forces were given and no modulus could be read from them.
    """
    sensor = _measuring_unit(arguments)
    _reject_incompatible_flags(arguments, sensor)
    if arguments.radius is not None:
        bound = f"one or two numbers from {_RADIUS.at_least:g} to {_RADIUS.at_most:g} with a comma between"
        hint = "write for instance --radius 47,110"
        sensor = replace(sensor, radii_mm=parse_radii(arguments.radius, _RADIUS, bound, hint))
    firmware = _firmware(arguments, sensor)
    reads = arguments.forces is not None or arguments.signal is not None
    if not reads and not firmware:
        raise validation_error(
            "FILE.csv", None, "", "a file or -, unless --forces is given", "name the file of presses to read"
        )
    code = PASSED
    if reads:
        _print_assumptions(arguments, sensor)
        code = FAILED
        for answer in _readings(arguments, sensor):
            code = code if answer.E is None else PASSED
            of_stream = arguments.signal is not None
            yield Answer(code=code, data=as_data(answer), text=_answer_text(answer), of_stream=of_stream)
    files = [path for flag, those in firmware.items() for path in write_files(those, flag, force=arguments.force)]
    yield Answer(code=code, files=files)


def _reject_incompatible_flags(arguments: Namespace, sensor: MeasuringUnit) -> None:
    """Raise InputError for a flag that is incompatible with the others, or with this sensor."""
    for rule in _INCOMPATIBLE:
        for flag in rule.flags:
            value = getattr(arguments, flag.removeprefix("--").replace("-", "_"))
            if value not in (None, False) and rule.applies(arguments, sensor):
                raise validation_error(flag, str(value), rule.unit, rule.bound, rule.hint)


def _print_assumptions(arguments: Namespace, sensor: MeasuringUnit) -> None:
    """Print a note to stderr for each assumption behind a reading."""
    if not sensor.report.moduli:
        lacks = "has no [reading]" if sensor.report.design.reading is None else "has level presses without a reading"
        print_error(f"note: the design {lacks}; the uncertainty holds for level presses at the centre of the fruit")
    if sensor.lacks_form:
        print_error("note: report.json is of an older version: bars leave out the form of domes; run the design again")
    if sensor.report.design.fruit.relaxation is not None:
        at = sensor.report.design.read_s
        print_error(f"note: E is the modulus at the first instant; the apparent one is at {at:g} s")
    if arguments.unit is None:
        print_error("note: no --unit; springs as designed, as uncertain as their process prints them")
    elif sensor.creep.exponent:
        more = 100.0 * (sensor.press_over_weighed() - 1.0)
        weighed = f"stiffer by {more:.2g} % than under weights read after {sensor.unit.weighed_after_s:.3g} s"
        press = f"a press of {sensor.report.design.press_s:.3g} s"
        print_error(f"note: springs creep by {sensor.creep}; in {press} they are {weighed}")


def _measuring_unit(arguments: Namespace) -> MeasuringUnit:
    """Return the unit that the flags name, or the designed one without `--unit`; raises InputError."""
    return MeasuringUnit.from_report(read_report(arguments.folder), arguments.unit, arguments.classes)


def _firmware(arguments: Namespace, sensor: MeasuringUnit) -> dict[str, dict[Path, bytes]]:
    """Return the content of the requested firmware files, by flag and path; nothing is written yet.

    Raises InputError if two flags name one file, or a file cannot be written.
    """
    if all(value is None for value in (arguments.c_header, arguments.micropython, arguments.logger)):
        return {}
    # loads jinja, which readings do not need
    from instrument.firmware.firmware import board_files, header_text, module_text

    texts: dict[str, dict[Path, str]] = {}
    if arguments.c_header is not None:
        texts["--c-header"] = {arguments.c_header: header_text(sensor)}
    if arguments.micropython is not None:
        texts["--micropython"] = {arguments.micropython: module_text(sensor)}
    if arguments.logger is not None:
        out = arguments.folder.absolute()
        folder = out.with_name(f"{out.name}-board") if arguments.logger is True else arguments.logger
        programs = board_files(sensor, calibrated=arguments.unit is not None)
        texts["--logger"] = {folder / name: text for name, text in programs.items()}
    taken: dict[Path, str] = {}
    for flag, files in texts.items():
        for path in files:
            if path.resolve() in taken:
                bound = f"another file than for {taken[path.resolve()]}"
                raise validation_error(flag, str(path), "", bound, "choose another name")
            taken[path.resolve()] = flag
        refuse_taken(files, flag, force=arguments.force)
    return {flag: {path: text.encode() for path, text in files.items()} for flag, files in texts.items()}


def _answer_text(answer: FruitReading | FruitAnswer) -> str:
    """Return the printed answer: one line for a reading; for a fruit, its line and one for each of its presses."""
    if isinstance(answer, FruitReading):
        return as_line(answer, LINE)
    return "\n".join([as_line(answer, FRUIT_LINE), *(f"  {as_line(press, LINE)}" for press in answer.presses)])


def _readings(arguments: Namespace, sensor: MeasuringUnit) -> Iterator[FruitReading | FruitAnswer]:
    """Yield the reading of `--forces`, or of each press or fruit in a file or the standard input."""
    tips = sensor.report.tips
    if arguments.signal is None:
        refuse_without_counts(arguments.counts_as, "--forces")
        channels = numbers_of_text(arguments.forces, len(tips), "--forces", "N")
        refuse_out_of_scale(sensor, channels, lambda tip: f"--forces: tip {tips[tip].name}")
        reading = single_reading(sensor, sensor.forces_of_channels(channels))
        print_error(
            "note: one reading of a pair is its force ratio, right only for a level press; read a press instead"
        )
        yield reading
        return

    def print_note(note: str) -> None:
        print_error(f"note: {arguments.signal}: {note}")

    signal = Signal(rows_of(arguments.signal), len(tips), ColumnFlags(arguments.columns, arguments.units), print_note)
    for note in (signal.understood, *signal.notes):
        print_error(f"note: {note}")
    if not signal.timed and sensor.report.read_out.signal is None:
        print_error(
            "note: no time for each channel, and no [readout]: all channels of a line are taken as simultaneous"
        )
    if not signal.counted:
        refuse_without_counts(arguments.counts_as, signal.source)
    if signal.names_fruit and arguments.fruit_presses is not None:
        bound = f"left out if {signal.source} has a column fruit"
        raise validation_error(
            "--fruit-presses", arguments.fruit_presses, "", bound, "the column names the fruit of each press"
        )
    readings = readings_of(sensor, signal, every_sample=arguments.each, counts_as=arguments.counts_as)
    reads_fruit = arguments.fruit_presses is not None or (signal.names_fruit and not arguments.each)
    if not reads_fruit:
        yield from readings
        return
    yield from fruits_of(sensor, readings, arguments.fruit_presses or 0, named=signal.names_fruit)
