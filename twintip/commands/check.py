"""`pipeline check`: verdicts on an output folder, or on one file of any origin."""

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
from twintip.commands.console import FAILED, PASSED, Answer, solver_errors_as_input_errors
from twintip.commands.progress import showing_progress
from twintip.flags import DEFAULT_PROCESS

if TYPE_CHECKING:
    from cad.checks.own_part import Place
    from pipeline.springs.fitted_springs import FittedSprings
    from pipeline.springs.own_part import PartStiffness

TIPS = 2
AXES = "XYZ"
AS_DESIGNED = "geometry.as_designed"
SOLVED_KINDS = (".step", ".stp")
FILE_KINDS = (".step", ".stp", ".stl", ".3mf")


def run(arguments: Namespace) -> Answer:
    """Check an output folder, or a file of any origin. The exit code is 0 if all verdicts pass, and 1 if not.

    With `--solve`, the springs in a STEP file are solved too. Raises InputError for flags that contradict each other or
    the path.
    """
    path: Path = arguments.path
    design_name: str | None = arguments.design
    process = _file_process(path, arguments.process, design_name)  # None for a folder, whose report names its process
    if arguments.solve:
        if process is None:
            hint = "name a STEP file, and add --solve"
            raise validation_error("--solve", path.name, "", "left out for a folder", hint)
        return _check_solved(path, process, arguments)
    _reject_places(path, arguments)
    with showing_progress(f"checking {path.name}"):
        verdicts = _find_verdicts(path, process, design_name)
    return Answer(
        code=PASSED if all_passed(verdicts) else FAILED,
        data=[asdict(verdict) for verdict in verdicts],
        parts=verdict_parts(str(path), verdicts),
    )


def _find_verdicts(path: Path, process: Process | None, design_name: str | None) -> tuple[Verdict, ...]:
    """Return the verdicts on a folder or a file. If a design is given, a file is also compared with its housing.

    `process` is the print process of a file. The process is None for a folder, which cannot be compared with another
    design.
    """
    if design_name is None or process is None:
        return check_path(path.absolute(), process)
    design = load_design(design_name)
    return check_path(path.absolute(), design.process, (design, _designed_housing(design, design_name)))


def _reject_places(path: Path, arguments: Namespace) -> None:
    """Raise InputError for `--held` and `--pressed`, which apply only to a part whose springs are solved."""
    for flag, points in (("--held", arguments.held), ("--pressed", arguments.pressed)):
        if points:
            raise validation_error(flag, path.name, "", "given with --solve", "name a STEP file, and add --solve")


def _check_solved(path: Path, process: Process, arguments: Namespace) -> Answer:
    """Solve the stiffness of the springs in a STEP file by finite elements, and check the file.

    With `--design`, the part is made by the process of the design, and its stiffnesses are compared with the targets of
    the design. Without a design, the part is made by `process`. Raises InputError if the part cannot be solved.
    """
    design_name: str | None = arguments.design
    held, pressed = _parse_places(arguments)
    _require_solvable(path, design_name, held, pressed)
    design = None if design_name is None else load_design(design_name)
    with showing_progress(f"solving {path.name}") as work:
        from pipeline.springs.own_part import file_stiffness, refuse_part  # loads the mesher and the solvers

        # A wrong part is rejected before the springs of the design are solved, which takes a while.
        refuse_part(path, {"--held": held, "--pressed": list(pressed.values())})
        springs, housing = _solve_design(design, design_name)
        if springs is not None and pressed:
            # The pressed faces get the names of the springs. In both, the low tip comes before the high tip.
            pressed = dict(zip(springs.springs, pressed.values(), strict=True))
        part_process = process if design is None else design.process
        elasticity = (part_process.E_MPa, part_process.poisson)
        with solver_errors_as_input_errors():
            stiffness = file_stiffness(path, elasticity, held, pressed, housing)
        work(f"checking {path.name}")
        designed = None if design is None or housing is None else (design, housing)
        file_verdicts = check_path(path.absolute(), part_process, designed)
    return _solved_answer(path, stiffness, _target_stiffnesses(springs), file_verdicts)


def _solve_design(
    design: Design | None, design_name: str | None
) -> "tuple[FittedSprings, Housing] | tuple[None, None]":
    """Solve the springs of a design, and return them and its housing, or twice None without a design."""
    if design is None or design_name is None:
        return None, None
    springs = _designed_springs(design)
    return springs, _housing_of_springs(springs, design_name)


def _parse_places(arguments: Namespace) -> tuple[list["Place"], dict[str, "Place"]]:
    """Return the points [mm] of the held faces, and the points of the pressed faces by name: "1", "2" and so on.

    Raises InputError unless each point has three numbers.
    """
    held = [_parse_point("--held", text) for text in arguments.held]
    pressed = {str(number): _parse_point("--pressed", text) for number, text in enumerate(arguments.pressed, 1)}
    return held, pressed


def _target_stiffnesses(springs: "FittedSprings | None") -> dict[str, float]:
    """Return the target stiffness [N/m] of each spring of a design, by name, or an empty dict without a design."""
    if springs is None:
        return {}
    return {name: 1e3 * spring.target for name, spring in springs.springs.items()}  # the targets are in N/mm


def _solved_answer(
    path: Path, stiffness: "PartStiffness", targets: Mapping[str, float], file_verdicts: Sequence[Verdict]
) -> Answer:
    """Return the answer for a solved part: verdicts on its stiffness and its file, its stiffness as data, and notes.

    `targets` [N/m] are the target stiffnesses by the name of the spring, or empty without a design. A user may change
    the shape of a part on purpose, so its distance from the designed surface is a note and not a verdict.
    """
    distance_notes = [_distance_note(verdict) for verdict in file_verdicts if verdict.name == AS_DESIGNED]
    notes = [*part_notes(stiffness), *distance_notes]
    other_verdicts = [verdict for verdict in file_verdicts if verdict.name != AS_DESIGNED]
    verdicts = (*part_verdicts(stiffness, targets), *other_verdicts)
    return Answer(
        code=PASSED if all_passed(verdicts) else FAILED,
        data={"verdicts": [asdict(verdict) for verdict in verdicts], "stiffness": part_data(stiffness), "notes": notes},
        parts=[*verdict_parts(str(path), verdicts), *(f"- {escape(note)}" for note in notes)],
    )


def _require_solvable(
    path: Path, design_name: str | None, held: Sequence["Place"], pressed: Mapping[str, "Place"]
) -> None:
    """Raise InputError unless the file is a STEP file, and it is known where the part is held and pressed.

    `held` are points [mm] of the held faces, and `pressed` are points [mm] of the pressed faces by name. Without a
    design, both must be given. With a design, both may be empty: the part is then held at the holes of the design and
    pressed at its tips.
    """
    if path.suffix.lower() not in SOLVED_KINDS:
        bound = f"a file of kind {', '.join(SOLVED_KINDS)}, because a surface of triangles cannot be solved"
        raise validation_error("--solve", path.name, "", bound, "export the solid as STEP")
    if design_name is None and not (held and pressed):
        hint = "add --design NAME, or both --held X,Y,Z and --pressed X,Y,Z"
        raise validation_error(
            "--solve", path.name, "", "given with the places where the part is held and pressed", hint
        )
    if design_name is not None and len(pressed) not in (0, TIPS):
        hint = "give the low tip first and then the high tip, or leave both to the design"
        raise validation_error("--pressed", len(pressed), "", f"given {TIPS} times together with --design", hint)


def _parse_point(flag: str, text: str) -> "Place":
    """Convert the text of a flag to a point [mm]. Raises InputError unless it has three numbers."""
    numbers = [parse_number(part) for part in text.split(",")]
    if len(numbers) != len(AXES) or None in numbers:
        raise validation_error(flag, text, "mm", "three numbers X,Y,Z", f"for instance {flag}=-4,0,0")
    # No number is None here. `or 0.0` only shows this to the type checker.
    x, y, z = (float(number or 0.0) for number in numbers)
    return x, y, z


def _distance_note(verdict: Verdict) -> str:
    """Return a note with the largest distance between the part in the file and the part of the design."""
    return f"{verdict.value:.4g} mm is the largest distance from the part of the design ({verdict.reference})"


def _designed_housing(design: Design, design_name: str) -> Housing:
    """Solve the leaf lengths of a design, and return its housing. Raises InputError if it has no housing."""
    return _housing_of_springs(_designed_springs(design), design_name)


def _designed_springs(design: Design) -> "FittedSprings":
    """Solve the springs of a design as in a run. Raises InputError if they cannot be solved."""
    from pipeline.sensor import Sensor  # loads the solvers, which other checks do not need

    with solver_errors_as_input_errors():
        return Sensor(design=design).upright_springs


def _housing_of_springs(springs: "FittedSprings", design_name: str) -> Housing:
    """Return the housing that contains the springs of a design. Raises InputError if there is none."""
    housing = springs.housing
    if housing is None:
        hint = f"see printable.* of pipeline run {design_name}"
        raise validation_error("--design", design_name, "", "a design whose housing can be made", hint)
    return housing


def _file_process(path: Path, process_name: str | None, design_name: str | None) -> Process | None:
    """Return the print process whose rules apply to a file, or None for a folder, whose report names its process.

    `process_name` and `design_name` are the values of `--process` and `--design`, or None. Raises InputError for
    incompatible flags, a missing path, an unknown kind of file and an unknown process.
    """
    if process_name is not None and design_name is not None:
        hint = "leave it out: the design names the process"
        raise validation_error("--process", process_name, "", "left out if --design is given", hint)
    if path.is_dir():
        for flag, value in (("--process", process_name), ("--design", design_name)):
            if value is not None:
                hint = "leave it out: a folder has its own design, which names the process"
                raise validation_error(flag, value, "", "left out for a folder", hint)
        return None
    if not path.is_file():
        hint = "name an output folder, or a STEP, STL or 3MF file"
        raise validation_error("PATH", str(path), "", "an existing file or folder", hint)
    if path.suffix.lower() not in FILE_KINDS:
        kinds = ", ".join(FILE_KINDS)
        raise validation_error("PATH", path.name, "", f"a file of kind {kinds}", "export the part as one of these")
    # With a design, the rules of its own process apply, and the default that is returned here is not used.
    return _find_process(process_name or DEFAULT_PROCESS)


def _find_process(name: str) -> Process:
    """Return the print process with a name. Raises InputError for an unknown name, with a similar name as the hint."""
    if name not in PROCESSES:
        bound = f"one of {', '.join(PROCESSES)}"
        hint = f"did you mean {nearest(name, [*PROCESSES])}?"
        raise validation_error("--process", name, "", bound, hint)
    return PROCESSES[name]
