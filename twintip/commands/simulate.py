"""`pipeline simulate`: simulated measurements with a unit on fruit and on the bench, or a proof of the design.

A proof reads many simulated presses and checks whether the errors of the readings agree with their error bars.
"""

import itertools
import math
import shlex
from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from instrument.press.printed_unit import read_unit
from instrument.proof import ProvedDesign, ProvedReading, prove
from instrument.simulate.bench_tables import usual_ball
from instrument.simulate.drawn_fruit import PressedFruit, beyond_design, usual_fruit
from instrument.simulate.log import usual_rate
from instrument.simulate.simulation import FILES, SimulationSettings, unit_of_seed
from instrument.simulate.unit import SimulatedUnit, designed_unit, given_unit, refuse_unsimulated
from pipeline.report.report import Report, read_report
from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.storage.record_data import as_data
from sensor.design.reading import ReadingRequirements
from sensor.quantity import (
    COVERAGE,
    LENGTH,
    MODULUS,
    Bounds,
    InputError,
    parse_number,
    report_field,
    validation_error,
)
from sensor.theory.relaxation import FORM, Relaxation
from twintip.commands.console import FAILED, PASSED, Answer, print_error
from twintip.commands.progress import showing_progress
from twintip.flags import is_given, parse_radii

_RADIUS = Bounds(at_least=5.0, at_most=1e6)


class _NumberFlag(NamedTuple):
    """The unit and the bounds of a flag's number, and the hint in the message if the number is out of bounds."""

    unit: str
    bounds: Bounds
    hint: str


_ANGLE = Bounds(at_least=-360.0, at_most=360.0)
_NUMBER_FLAGS = {
    "E": _NumberFlag("MPa", MODULUS, "a ripe mango has 0.5 MPa"),
    "azimuth": _NumberFlag("deg", _ANGLE, "measure it from +x of the housing"),
    "thickness": _NumberFlag("mm", Bounds(at_least=2.0, at_most=1000.0), "a mango has about 12 mm over its stone"),
    "tilt": _NumberFlag("deg", Bounds(at_least=0.0, at_most=10.0), "a sensor held by hand tilts by up to 4 degrees"),
    "towards": _NumberFlag("deg", _ANGLE, "measure it from +x of the housing"),
    "off_centre": _NumberFlag(
        "mm", Bounds(at_least=0.0, at_most=10.0), "a hand keeps the sensor within 1 mm of this point"
    ),
    "presses": _NumberFlag("", Bounds(at_least=1.0, at_most=100.0), "three presses on each fruit are usual"),
    "rate": _NumberFlag("Hz", Bounds(at_least=5.0, at_most=1e4), "leave it out to use the rate of the read-out"),
    "bruise": _NumberFlag("mm", LENGTH, "a typical bruise has a radius of 3 to 6 mm"),
    "seed": _NumberFlag("", Bounds(at_least=0.0, at_most=2.0**32), "any whole number in this range will do"),
    "prove": _NumberFlag("", Bounds(at_least=1.0, at_most=10000.0), "60 presses take two minutes"),
}
_FLAGS_EXCLUDED_BY_PROVE = (
    *("E", "radius", "azimuth", "thickness", "tilt", "towards", "off_centre", "presses", "rate", "noise", "uneven"),
    *("bruise", "relax", "unit", *FILES),
)
"""Flags that cannot be combined with `--prove`, because a proof draws their values and writes no files."""


@dataclass(frozen=True, kw_only=True)
class Simulation:
    """The result of a simulation: the true values, the files, and the commands that use the files."""

    E: float = report_field("MPa", "true modulus of the fruit", key="E_MPa")
    radii: tuple[float, ...] = report_field("mm", "principal radii of the fruit", key="radii_mm")
    thickness: float | None = report_field("mm", "flesh over the stone", key="thickness_mm")
    K: tuple[float, ...] = report_field(
        "N/m", "true stiffness of each spring under a weight", key="K_N_per_m", times=1e3
    )
    dome_radius: float = report_field("mm", "true radius of the domes", key="dome_radius_mm")
    seed: int = report_field("1", "seed of all random numbers")
    outside: tuple[str, ...] = report_field("", "what lies outside the ranges of the design")
    files: tuple[str, ...] = report_field("", "the files that were written")
    commands: tuple[str, ...] = report_field("", "the commands that calibrate and read with them")


def run(arguments: Namespace) -> Answer:
    """Write a log of simulated presses and simulated bench tables, or test a design on simulated fruit.

    The flags name the files that are written. With `--prove`, many random presses are read instead, and no file is
    written. The exit code is then 1 if the errors of the readings are larger than their error bars. Raises InputError
    for an invalid flag, if no output is requested, and for a design whose presses cannot be simulated.
    """
    _check_flags(arguments)
    report = read_report(arguments.folder)
    refuse_unsimulated(report)
    if arguments.prove is not None:
        return _prove_design(arguments, report)
    path_of_flag = {flag: getattr(arguments, flag) for flag in FILES}
    paths = {flag: path for flag, path in path_of_flag.items() if path is not None}
    if not paths:
        bound = "given, or --weights, --plate, --ball or --prove"
        raise validation_error("--out", None, "", bound, "name the log to write, as in --out press.csv")
    return _write_files(arguments, report, paths)


def _flag(name: str) -> str:
    """Return the flag with this name among the arguments, such as --off-centre for off_centre."""
    return f"--{name.replace('_', '-')}"


def _check_flags(arguments: Namespace) -> None:
    """Raise InputError for a number out of bounds, or for a flag that cannot be combined with `--prove`."""
    for name, (unit, bounds, hint) in _NUMBER_FLAGS.items():
        value = getattr(arguments, name)
        if value is not None and not bounds.hold(value):
            raise validation_error(_flag(name), value, unit, str(bounds), hint)
    if arguments.prove is None:
        return
    for name in _FLAGS_EXCLUDED_BY_PROVE:
        value = getattr(arguments, name)
        if is_given(value):
            bound = "left out if --prove is given, which draws fruits, presses and units, and writes no file"
            raise validation_error(_flag(name), str(value), "", bound, "leave it out")


def _write_files(arguments: Namespace, report: Report, paths: dict[str, Path]) -> Answer:
    """Simulate every file that a flag requests, and then write all of them.

    `paths` maps the name of each flag to the path of its file. Nothing is written if a simulation fails. Notes on
    values outside the ranges of the design are printed to stderr. Raises InputError if two flags name the same file, or
    if a file cannot be written.
    """
    _check_paths(paths, force=arguments.force)
    settings = _simulation_settings(arguments, report)
    unit = _simulated_unit(arguments, report, paths)
    # The fruit is pressed only for the log, which is the file of `--out`. The bench tables do not depend on it.
    outside = tuple(beyond_design(settings.fruit, report)) if arguments.out is not None else ()
    contents = _simulated_contents(report, unit, settings, paths)
    for flag, path in paths.items():
        write_files({path: contents[flag]}, _flag(flag), force=arguments.force)
    for note in outside:
        print_error(f"note: {note}")
    simulation = Simulation(
        E=settings.fruit.E,
        radii=settings.fruit.radii,
        thickness=settings.fruit.thickness,
        K=tuple(unit.domes.K.tolist()),
        dome_radius=unit.domes.dome_radius,
        seed=settings.seed,
        outside=outside,
        files=tuple(map(str, paths.values())),
        commands=tuple(_next_commands(arguments, report, paths)),
    )
    text = "\n".join([*simulation.files, *(f"then: {command}" for command in simulation.commands)])
    return Answer(code=PASSED, data=as_data(simulation), text=text)


def _simulated_contents(
    report: Report, unit: SimulatedUnit, settings: SimulationSettings, paths: dict[str, Path]
) -> dict[str, bytes]:
    """Simulate the file of each flag in `paths` with a unit, and return the contents of the files, by flag.

    Progress is shown on stderr.
    """
    contents = {}
    with showing_progress("simulating") as work:
        for flag, path in paths.items():
            work(f"simulating {path.name}")
            simulate_lines = FILES[flag]
            lines = simulate_lines(report, unit, settings, work.count)
            contents[flag] = ("\n".join(lines) + "\n").encode()
    return contents


def _check_paths(paths: dict[str, Path], *, force: bool) -> None:
    """Raise InputError if two flags name the same file, or if a file cannot be written.

    `paths` maps the name of each flag to the path of its file.
    """
    for (first, first_path), (second, path) in itertools.combinations(paths.items(), 2):
        if path.resolve() == first_path.resolve():
            bound = f"a file other than the one that {_flag(first)} names"
            raise validation_error(_flag(second), str(path), "", bound, "choose another name")
    for flag, path in paths.items():
        check_paths_are_free([path], _flag(flag), force=force)


def _simulation_settings(arguments: Namespace, report: Report) -> SimulationSettings:
    """Return the fruit and the conditions of the presses from the flags. Raises InputError for invalid values."""
    return SimulationSettings(
        fruit=_pressed_fruit(arguments, report),
        presses=arguments.presses or 1,
        rate=usual_rate(report) if arguments.rate is None else arguments.rate,
        noise=arguments.noise,
        uneven=arguments.uneven,
        bruise_mm=arguments.bruise,
        relaxation=_relaxation(arguments.relax, report),
        seed=arguments.seed,
    )


def _pressed_fruit(arguments: Namespace, report: Report) -> PressedFruit:
    """Return the fruit and the pose of the sensor on it. Values for which no flag is given come from the design.

    Raises InputError for an invalid `--radius`.
    """
    designed_fruit = usual_fruit(report)
    values_of_flags = {name: getattr(arguments, name) for name in ("E", "azimuth", "thickness")}
    changes = {name: value for name, value in values_of_flags.items() if value is not None}
    if arguments.radius is not None:
        bound = f"one number or two numbers separated by a comma, each {_RADIUS}"
        changes["radii"] = parse_radii(arguments.radius, _RADIUS, bound, "write for instance --radius 45,65")
    # The tilt and the offset from the apex have the same direction, which is measured from +x.
    direction = math.radians(arguments.towards or 0.0)

    def components(magnitude: float | None) -> tuple[float, float]:
        """Return the components along and across the tips. A flag that is not given has the magnitude 0."""
        size = magnitude or 0.0
        return size * math.cos(direction), size * math.sin(direction)

    tilt, off_centre = components(arguments.tilt), components(arguments.off_centre)
    return replace(designed_fruit, **changes, tilt=tilt, off_centre=off_centre)


def _relaxation(text: str | None, report: Report) -> Sequence[tuple[float, float]]:
    """Return the fractions [1] and times [s] by which the force relaxes, from the flag or else from the design.

    `text` is the value of `--relax`, such as 0.25:5,0.33:120, or None. Raises InputError if it does not hold valid
    pairs of numbers.
    """
    if text is None:
        return report.design.fruit.relaxation or ()
    # `parse_number` returns None for a text that is not a number. `Relaxation` rejects everything but pairs of numbers.
    pairs = [tuple(map(parse_number, pair.split(":"))) for pair in text.split(",")]
    try:
        return Relaxation(tuple(pairs)).arms  # type: ignore[arg-type]
    except InputError as error:
        raise validation_error("--relax", text, "", FORM, "write SHARE:SECONDS,..., as in 0.25:5,0.33:120") from error


def _simulated_unit(arguments: Namespace, report: Report, paths: dict[str, Path]) -> SimulatedUnit:
    """Return the unit that is simulated.

    This is the unit of `--unit` if the flag is given. Otherwise, the unit has random errors if a bench table is
    requested, and is as designed if not. `paths` maps the name of each flag to the path of its file. Raises InputError
    for `--unit` together with a bench table, because such a table is written for a unit with random errors.
    """
    bench_flags = [flag for flag in paths if flag != "out"]  # `--out` requests the log, other flags a bench table
    if arguments.unit is None:
        return unit_of_seed(report, arguments.seed) if bench_flags else designed_unit(report)
    if bench_flags:
        bound = f"left out if {_flag(bench_flags[0])} is given, which draws a unit at random"
        raise validation_error("--unit", str(arguments.unit), "", bound, "give only one of these flags")
    return given_unit(report, read_unit(arguments.unit, report))


def _next_commands(arguments: Namespace, report: Report, paths: dict[str, Path]) -> Iterator[str]:
    """Yield the commands that calibrate the unit with the written tables, and that read the log of the presses.

    `paths` maps the name of each flag to the path of its file. A calibration is suggested only if a table of weights is
    written, because it needs this table.
    """
    folder = str(arguments.folder)
    unit_path = None if arguments.unit is None else str(arguments.unit)
    if "weights" in paths:
        unit_path = "unit.toml"  # written by the calibration
        yield _calibration_command(folder, report, paths, unit_path)
    # With bench tables, the simulated unit has random errors, so its log can be read only after a calibration.
    has_bench_tables = bool(set(paths) - {"out"})
    if "out" in paths and (unit_path is not None or not has_bench_tables):
        command = ["pipeline", "read", folder, str(paths["out"])]
        if unit_path is not None:
            command += ["--unit", unit_path]
        if (arguments.presses or 1) > 1:
            command += ["--fruit-presses", "0"]  # all presses of the log are on one fruit
        yield shlex.join(command)


def _calibration_command(folder: str, report: Report, paths: dict[str, Path], unit_path: str) -> str:
    """Return the command that calibrates the unit with the written bench tables, and writes it to `unit_path`.

    `folder` is the output folder of the design, and `paths` maps the name of each flag to the path of its table.
    """
    command = ["pipeline", "calibrate", folder, str(paths["weights"])]
    if "plate" in paths:
        command += ["--plate", str(paths["plate"])]
    if "ball" in paths:
        ball = usual_ball(report)
        percent = (report.design.reading or ReadingRequirements()).ball_percent
        command += ["--ball", str(paths["ball"]), "--ball-reduced-modulus", f"{ball.reduced:.6g}"]
        # The flag takes the half width of the error bar of 95 %.
        command += ["--ball-radius", f"{ball.radius:.6g}", "--ball-modulus-error", f"{COVERAGE * percent:.3g}"]
    return shlex.join([*command, "--out", unit_path])


def _prove_design(arguments: Namespace, report: Report) -> Answer:
    """Read many simulated presses, and compare the readings with the true moduli.

    `--prove` gives the number of presses. The exit code is 1 if the error bars are too small.
    """
    count = arguments.prove
    with showing_progress("pressing random units on random fruit") as work:
        work.count(0, count)
        proof = prove(report, count, arguments.seed, lambda done: work.count(done, count))
    return Answer(code=PASSED if proof.passed else FAILED, data=as_data(proof), text="\n".join(_proof_lines(proof)))


_HEADINGS = ("true MPa", "radii mm", "flesh mm", "tilt deg", "read MPa", "error", "bar", "")


def _proof_lines(proof: ProvedDesign) -> Iterator[str]:
    """Yield the lines of a table of true and read values, a summary of all presses, and whether the design is proved.

    A press is outside if its error exceeds its 95 % error bar. Presses with a flag are counted separately.
    """
    rows = [_HEADINGS, *map(_reading_cells, proof.readings)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    # The last column holds the flags. This column is not aligned, so its width is not used.
    for *number_cells, flags_cell in rows:
        cells = [cell.rjust(width) for cell, width in zip(number_cells, widths, strict=False)]
        yield "  ".join([*cells, flags_cell]).rstrip()
    inside = proof.presses - proof.flagged - proof.outside
    yield (
        f"{proof.design}: {inside} of {proof.presses} inside their 95 % bars, "
        f"{proof.outside} outside (at most {proof.most_outside}), {proof.flagged} flagged, "
        f"farthest {proof.farthest:.2f} bars"
    )
    yield "proved" if proof.passed else f"not proved: {'; '.join(proof.failures)}"


def _reading_cells(reading: ProvedReading) -> tuple[str, ...]:
    """Return the table cells of one press, in the order of `_HEADINGS`.

    The error and the 95 % error bar are relative to the true modulus. The last cell holds the flags of the reading.
    """
    result_cells = ("-", "-", "-")  # for a press from which no modulus could be read
    if reading.E_read is not None and reading.error is not None and reading.u is not None:
        result_cells = (
            f"{reading.E_read:.3f}",
            f"{100.0 * reading.error:+.1f} %",
            f"{100.0 * reading.u * reading.E_read / reading.E:.1f} %",  # `u` is relative to the modulus that was read
        )
    outside = "outside" if reading.error_in_bars > 1.0 and not reading.is_flagged else ""
    thickness = "-" if reading.thickness is None else f"{reading.thickness:.1f}"
    return (
        f"{reading.E:.3f}",
        f"{reading.radii[0]:.0f} x {reading.radii[1]:.0f}",
        thickness,
        f"{reading.tilt:.1f}",
        *result_cells,
        " ".join(text for text in (outside, *reading.flags) if text),
    )
