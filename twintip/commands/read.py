"""`pipeline read`: the modulus of a fruit from the forces of a sensor, for one reading, a file or a stream."""

from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from instrument.press.count_codes import refuse_without_counts
from instrument.press.fruit_of_presses import FRUIT_LINE, FruitAnswer, fruit_answers
from instrument.press.fruit_reading import LINE, FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.pair_press import single_reading
from instrument.press.presses import readings_of, refuse_out_of_scale
from instrument.press.signals import Signal, numbers_of_text
from pipeline.report.report import read_report
from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.storage.record_data import as_data, as_line
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.rows import rows_of
from sensor.design.radius_ranges import radii_beyond_design
from sensor.quantity import Bounds, validation_error
from twintip.commands.console import FAILED, PASSED, Answer, print_error
from twintip.flags import is_given, parse_radii

_RADIUS = Bounds(at_least=1.0, at_most=1e6)


class _Incompatible(NamedTuple):
    """A rule that rejects each of `flags` if `applies` returns true for all arguments of the command and the sensor.

    `bound`, `hint` and `unit` are the parts of the error message.
    """

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
        hint="give only one of them",
    ),
    _Incompatible(
        flags=("--fruit-presses",),
        applies=lambda arguments, _: arguments.signal is None,
        bound="left out unless FILE.csv is given",
        hint="name a file of presses, or leave it out",
    ),
    _Incompatible(
        flags=("--fruit-presses",),
        applies=lambda arguments, _: arguments.fruit_presses < 0,
        bound="at least 0",
        hint="with 0, all presses of the file belong to one fruit",
    ),
    _Incompatible(
        flags=("--each",),
        applies=lambda arguments, _: arguments.fruit_presses is not None,
        bound="left out if --fruit-presses is given",
        hint="read either each press up to every sample, or whole fruits",
    ),
    _Incompatible(
        flags=("--radius",),
        applies=lambda _, sensor: sensor.domes is None,
        bound="left out unless the tips are domes in a line or a square",
        hint="leave it out, because the radius does not affect the readings of other tips",
        unit="mm",
    ),
    _Incompatible(
        flags=("--forces", "--each", "--c-header", "--micropython"),
        applies=lambda _, sensor: sensor.report.design.fruit.relaxation is not None,
        bound="left out if the design has fruit.relaxation",
        hint="read a file of whole presses, including the hold",
    ),
    _Incompatible(
        flags=("--forces",),
        applies=lambda _, sensor: not sensor.reads_moments,
        bound="left out unless the sensor is a pair of flat tips, "
        "because other tips cannot separate the shape of the skin from the modulus in one reading",
        hint="name a file of presses, FILE.csv",
    ),
)


def run(arguments: Namespace) -> Iterator[Answer]:
    """Read forces, write firmware, or both, and yield an answer for each reading. The files are written last.

    The exit code is 1 if forces were given but no modulus could be read from them. Raises InputError for incompatible
    flags, and if there is nothing to read or write.
    """
    sensor = _measuring_unit(arguments)
    firmware = _firmware_files(arguments, sensor)
    has_forces = arguments.forces is not None or arguments.signal is not None
    if not has_forces and not firmware:
        raise validation_error(
            "FILE.csv", None, "", "a file or -, unless --forces is given", "name the file of presses to read"
        )
    code = PASSED
    if has_forces:
        _print_assumptions(arguments, sensor)
        code = FAILED  # until one of the readings has a modulus
        for answer in _readings(arguments, sensor):
            if answer.E is not None:
                code = PASSED
            # The presses of a file or of the standard input are a stream. The forces of `--forces` are one reading.
            of_stream = arguments.signal is not None
            yield Answer(code=code, data=as_data(answer), text=_answer_text(answer), of_stream=of_stream)
    written = []
    for flag, contents in firmware.items():
        written += write_files(contents, flag, force=arguments.force)
    yield Answer(code=code, files=written)


def _reject_incompatible_flags(arguments: Namespace, sensor: MeasuringUnit) -> None:
    """Raise InputError for a flag that is incompatible with the other flags or with the sensor."""
    for rule in _INCOMPATIBLE:
        for flag in rule.flags:
            value = getattr(arguments, flag.removeprefix("--").replace("-", "_"))
            if is_given(value) and rule.applies(arguments, sensor):
                raise validation_error(flag, str(value), rule.unit, rule.bound, rule.hint)


def _print_assumptions(arguments: Namespace, sensor: MeasuringUnit) -> None:
    """Print a note to stderr for each assumption on which the readings depend.

    The assumptions concern the pose of the sensor, the form of the domes, relaxation, and the stiffness and the creep
    of the springs.
    """
    if not sensor.report.moduli:
        reason = "has no [reading]" if sensor.report.design.reading is None else "has level presses without a reading"
        print_error(f"note: the design {reason}; the uncertainty holds for level presses at the centre of the fruit")
    if sensor.lacks_form:
        print_error(
            "note: an older version wrote report.json, so the error bars leave out the form errors of the domes; "
            "run the design again"
        )
    if sensor.report.design.fruit.relaxation is not None:
        apparent_s = sensor.report.design.read_s
        print_error(f"note: E is the instantaneous modulus; the apparent modulus holds at {apparent_s:g} s")
    if arguments.unit is None:
        print_error("note: no --unit; the springs are assumed to be as designed, with the errors of their process")
    elif sensor.creep.exponent:
        more_percent = 100.0 * (sensor.press_stiffness_ratio() - 1.0)
        print_error(
            f"note: springs creep by {sensor.creep}; "
            f"in a press of {sensor.report.design.press_s:.3g} s they are stiffer by {more_percent:.2g} % "
            f"than under weights read after {sensor.unit.weighed_after_s:.3g} s"
        )


def _measuring_unit(arguments: Namespace) -> MeasuringUnit:
    """Return the unit given by `--unit`, or the unit as designed, for fruit with the radii given by `--radius`.

    A note is printed to stderr for a radius outside the range of the design. Raises InputError if the file of the unit
    or a radius is invalid, or if another flag is incompatible with the unit.
    """
    sensor = MeasuringUnit.from_report(read_report(arguments.folder), arguments.unit, arguments.classes)
    _reject_incompatible_flags(arguments, sensor)
    if arguments.radius is None:
        return sensor
    bound = f"one or two numbers from {_RADIUS.at_least:g} to {_RADIUS.at_most:g}, separated by a comma"
    hint = "write for instance --radius 47,110"
    radii = parse_radii(arguments.radius, _RADIUS, bound, hint)
    for note in radii_beyond_design(radii, sensor.report.design):
        print_error(f"note: --radius: {note}")
    return replace(sensor, radii_mm=radii)


def _firmware_files(arguments: Namespace, sensor: MeasuringUnit) -> dict[str, dict[Path, bytes]]:
    """Return the contents of the requested firmware files, by flag and path. Nothing is written yet.

    `sensor` is the unit whose calibration the firmware contains. Raises InputError if two flags name the same file, or
    if a file cannot be written.
    """
    if all(value is None for value in (arguments.c_header, arguments.micropython, arguments.logger)):
        return {}
    # This import loads jinja, which is not needed for readings.
    from instrument.firmware.firmware import render_board_files, render_header, render_module

    texts: dict[str, dict[Path, str]] = {}
    if arguments.c_header is not None:
        texts["--c-header"] = {arguments.c_header: render_header(sensor)}
    if arguments.micropython is not None:
        texts["--micropython"] = {arguments.micropython: render_module(sensor)}
    if arguments.logger is not None:
        out = arguments.folder.absolute()
        # If the flag names no folder, its value is True, and the folder lies beside the output folder of the design.
        folder = out.with_name(f"{out.name}-board") if arguments.logger is True else arguments.logger
        programs = render_board_files(sensor, calibrated=arguments.unit is not None)
        texts["--logger"] = {folder / name: text for name, text in programs.items()}
    _check_paths({flag: [*files] for flag, files in texts.items()}, force=arguments.force)
    return {flag: {path: text.encode() for path, text in files.items()} for flag, files in texts.items()}


def _check_paths(paths: dict[str, list[Path]], *, force: bool) -> None:
    """Raise InputError if two flags name the same file, or if a file cannot be written.

    `paths` maps each flag to the paths of its files.
    """
    flag_of_path: dict[Path, str] = {}
    for flag, paths_of_flag in paths.items():
        for path in paths_of_flag:
            if path.resolve() in flag_of_path:
                bound = f"a file other than the one that {flag_of_path[path.resolve()]} names"
                raise validation_error(flag, str(path), "", bound, "choose another name")
            flag_of_path[path.resolve()] = flag
        check_paths_are_free(paths_of_flag, flag, force=force)


def _answer_text(answer: FruitReading | FruitAnswer) -> str:
    """Return the text of an answer: a line for a press, or a line for a fruit and then one for each of its presses."""
    if isinstance(answer, FruitReading):
        return as_line(answer, LINE)
    return "\n".join([as_line(answer, FRUIT_LINE), *(f"  {as_line(press, LINE)}" for press in answer.presses)])


def _readings(arguments: Namespace, sensor: MeasuringUnit) -> Iterator[FruitReading | FruitAnswer]:
    """Yield the reading of `--forces`, or of each press or fruit in a file or the standard input."""
    if arguments.signal is None:
        yield _reading_of_forces(arguments, sensor)
    else:
        yield from _readings_of_signal(arguments, sensor)


def _reading_of_forces(arguments: Namespace, sensor: MeasuringUnit) -> FruitReading:
    """Return the reading of the forces [N] that `--forces` gives for a pair of tips.

    A note on the accuracy of such a reading is printed to stderr. Raises InputError if the text does not hold one
    number for each tip, or if a force is out of scale.
    """
    tips = sensor.report.tips
    refuse_without_counts(arguments.counts_as, "--forces")  # rejects --counts-as, because forces are not counts
    channels = numbers_of_text(arguments.forces, len(tips), "--forces", "N")
    # The function names a tip in the error message, given its index.
    refuse_out_of_scale(sensor, channels, lambda tip: f"--forces: tip {tips[tip].name}")
    reading = single_reading(sensor, sensor.forces_of_channels(channels))
    print_error(
        "note: the modulus is read from the force ratio of one moment, which is correct only for a level press; "
        "read a whole press instead"
    )
    return reading


def _readings_of_signal(arguments: Namespace, sensor: MeasuringUnit) -> Iterator[FruitReading | FruitAnswer]:
    """Yield the reading of each press in a file or the standard input, or of each fruit if its presses are combined.

    Presses are combined if `--fruit-presses` is given. Presses are also combined if a column names the fruit of each
    press, unless `--each` requests a reading for every sample.
    """
    signal = _open_signal(arguments, sensor)
    readings = readings_of(sensor, signal, every_sample=arguments.each, counts_as=arguments.counts_as)
    combines_presses = arguments.fruit_presses is not None or (signal.names_fruit and not arguments.each)
    if combines_presses:
        # With 0, a fruit has any number of presses: it ends where the name changes, or at the end of the signal.
        yield from fruit_answers(sensor, readings, arguments.fruit_presses or 0, named=signal.names_fruit)
    else:
        yield from readings


def _open_signal(arguments: Namespace, sensor: MeasuringUnit) -> Signal:
    """Open the file or the standard input that holds the presses, and print notes on its columns to stderr.

    Notes on single lines, such as a line that is left out, are printed later, when the signal reaches them. Raises
    InputError if a flag contradicts the columns.
    """

    def print_note(note: str) -> None:
        """Print a note about a line of the signal to stderr."""
        print_error(f"note: {arguments.signal}: {note}")

    tip_count = len(sensor.report.tips)
    signal = Signal(rows_of(arguments.signal), tip_count, ColumnFlags(arguments.columns, arguments.units), print_note)
    for note in (signal.summary, *signal.notes):
        print_error(f"note: {note}")
    if not signal.timed and sensor.report.read_out.signal is None:
        print_error(
            "note: there is no time for each channel and no [readout], so all channels of a line are assumed to be "
            "simultaneous"
        )
    if not signal.counted:  # the signal holds forces
        refuse_without_counts(arguments.counts_as, signal.source)
    if signal.names_fruit and arguments.fruit_presses is not None:
        bound = f"left out if {signal.source} has a column fruit"
        raise validation_error(
            "--fruit-presses", arguments.fruit_presses, "", bound, "the column names the fruit of each press"
        )
    return signal
