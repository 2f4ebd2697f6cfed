"""`pipeline check`: verdicts on existing files, an output folder or one file of any origin."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape

from cad.parts.housing import Housing
from pipeline.options import load_design
from pipeline.report.check import check_path
from pipeline.report.own_part import part_data, part_notes, part_verdicts
from pipeline.report.verdict_table import verdict_parts
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES, Process
from sensor.quantity import nearest, parse_number, validation_error
from sensor.verdict import Verdict, all_passed
from twintip.commands.console import FAILED, PASSED, Answer, refusing_what_cannot_be_solved
from twintip.commands.progress import showing_progress
from twintip.flags import DEFAULT_PROCESS

if TYPE_CHECKING:
    from cad.checks.own_part import Place
    from pipeline.springs.fitted_springs import FittedSprings

TIPS = 2
AXES = "XYZ"
AS_DESIGNED = "geometry.as_designed"
SOLVED_KINDS = (".step", ".stp")
FILE_KINDS = (".step", ".stp", ".stl", ".3mf")


def run(arguments: Namespace) -> Answer:
    """Judge an output folder, or a file of any origin; the exit code is 0 if all verdicts pass, else 1."""
    path: Path = arguments.path
    named: str | None = arguments.design
    process = _judging_process(path, arguments.process, named)
    if arguments.solve and process is not None:
        return _check_solved(path, process, arguments)
    if arguments.solve:  # a folder has no process
        raise validation_error("--solve", path.name, "", "left out for a folder", "name a STEP file, and add --solve")
    for flag, points in (("--held", arguments.held), ("--pressed", arguments.pressed)):
        if points:
            raise validation_error(flag, path.name, "", "given with --solve", "name a STEP file, and add --solve")
    with showing_progress(f"reads and judges {path.name}"):
        if named is None or process is None:
            verdicts = check_path(path.absolute(), process)
        else:
            design = load_design(named)
            verdicts = check_path(path.absolute(), design.process, (design, _designed_housing(design, named)))
    return Answer(
        code=PASSED if all_passed(verdicts) else FAILED,
        data=[asdict(verdict) for verdict in verdicts],
        parts=verdict_parts(str(path), verdicts),
    )


def _check_solved(path: Path, process: Process, arguments: Namespace) -> Answer:
    """Judge a STEP file after solving the stiffness of its springs by finite elements.

    With `--design`, the stiffnesses are compared with the targets of the design. Raises InputError if the part cannot
    be solved.
    """
    named: str | None = arguments.design
    held = [_parse_point("--held", text) for text in arguments.held]
    pressed = {str(number): _parse_point("--pressed", text) for number, text in enumerate(arguments.pressed, 1)}
    _require_solvable(path, named, held, pressed)
    design = None if named is None else load_design(named)
    with showing_progress(f"solves {path.name}") as show:
        from pipeline.springs.own_part import file_stiffness, refuse_part

        refuse_part(path, {"--held": held, "--pressed": list(pressed.values())})  # before springs are solved
        springs = None if design is None else _designed_springs(design)
        housing = None if springs is None or named is None else _housing_of_springs(springs, named)
        if springs is not None and pressed:
            pressed = dict(zip(springs.springs, pressed.values(), strict=True))
        rules = process if design is None else design.process
        with refusing_what_cannot_be_solved():
            found = file_stiffness(path, (rules.E_MPa, rules.poisson), held, pressed, housing)
        show(f"reads and judges {path.name}")
        file_verdicts = check_path(
            path.absolute(), rules, None if design is None or housing is None else (design, housing)
        )
    notes = [*part_notes(found), *(_distance_note(verdict) for verdict in file_verdicts if verdict.name == AS_DESIGNED)]
    targets = {} if springs is None else {name: 1e3 * spring.target for name, spring in springs.springs.items()}
    verdicts = (*part_verdicts(found, targets), *(one for one in file_verdicts if one.name != AS_DESIGNED))
    return Answer(
        code=PASSED if all_passed(verdicts) else FAILED,
        data={"verdicts": [asdict(verdict) for verdict in verdicts], "stiffness": part_data(found), "notes": notes},
        parts=[*verdict_parts(str(path), verdicts), *(f"- {escape(note)}" for note in notes)],
    )


def _require_solvable(path: Path, named: str | None, held: Sequence["Place"], pressed: Mapping[str, "Place"]) -> None:
    """Raise InputError unless the file is STEP, and the flags say where the part is held and pressed."""
    if path.suffix.lower() not in SOLVED_KINDS:
        bound = f"a file of kind {', '.join(SOLVED_KINDS)}, because a surface of triangles cannot be solved"
        raise validation_error("--solve", path.name, "", bound, "export the solid as STEP")
    if named is None and not (held and pressed):
        hint = "add --design NAME, or both --held X,Y,Z and --pressed X,Y,Z"
        raise validation_error(
            "--solve", path.name, "", "given with the places where the part is held and pressed", hint
        )
    if named is not None and len(pressed) not in (0, TIPS):
        hint = "give the low tip first, then the high one, or leave both to the design"
        raise validation_error("--pressed", len(pressed), "", f"given {TIPS} times beside --design", hint)


def _parse_point(flag: str, text: str) -> "Place":
    """Return the point [mm] that a flag gives as text; raises InputError unless it has three numbers."""
    numbers = [parse_number(word) for word in text.split(",")]
    if len(numbers) != len(AXES) or None in numbers:
        raise validation_error(flag, text, "mm", "three numbers X,Y,Z", f"for instance {flag}=-4,0,0")
    x, y, z = (float(number or 0.0) for number in numbers)
    return x, y, z


def _distance_note(verdict: Verdict) -> str:
    """Return the distance between a changed part and the part of the design as a note."""
    return f"{verdict.value:.4g} mm is the largest distance from the part of the design ({verdict.reference})"


def _designed_housing(design: Design, named: str) -> Housing:
    """Return the housing of a design with its leaves as in a run; raises InputError for one without a housing."""
    return _housing_of_springs(_designed_springs(design), named)


def _designed_springs(design: Design) -> "FittedSprings":
    """Return the springs of a design as in a run; raises InputError."""
    from pipeline.sensor import Sensor  # loads the solvers, which other checks do not need

    with refusing_what_cannot_be_solved():
        return Sensor(design=design).upright_springs


def _housing_of_springs(springs: "FittedSprings", named: str) -> Housing:
    """Return the housing of a design's springs; raises InputError for one without a housing."""
    housing = springs.housing
    if housing is None:
        hint = f"see printable.* of pipeline run {named}"
        raise validation_error("--design", named, "", "a design whose housing can be made", hint)
    return housing


def _judging_process(path: Path, name: str | None, design: str | None) -> Process | None:
    """Return the print process whose rules judge a file; None for a folder, which has a process of its own.

    Raises InputError for flags that exclude each other, a missing path, and an unknown kind of file or process.
    """
    if name is not None and design is not None:
        raise validation_error(
            "--process", name, "", "left out if --design is given", "leave it out: the design names the process"
        )
    if path.is_dir():
        for flag, value in (("--process", name), ("--design", design)):
            if value is not None:
                hint = "leave it out: a folder has its design, which names the process"
                raise validation_error(flag, value, "", "left out for a folder", hint)
        return None
    if not path.is_file():
        hint = "name an output folder, or a STEP, STL or 3MF file"
        raise validation_error("PATH", str(path), "", "an existing file or folder", hint)
    if path.suffix.lower() not in FILE_KINDS:
        kinds = ", ".join(FILE_KINDS)
        raise validation_error("PATH", path.name, "", f"a file of kind {kinds}", "export the part as one of these")
    name = name or DEFAULT_PROCESS
    if name not in PROCESSES:
        bound = f"one of {', '.join(PROCESSES)}"
        raise validation_error("--process", name, "", bound, f"did you mean {nearest(name, [*PROCESSES])}?")
    return PROCESSES[name]
