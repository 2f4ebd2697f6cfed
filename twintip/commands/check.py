"""`pipeline check`: verdicts on what lies on the disk, a whole output folder or one file of any origin."""

from argparse import Namespace
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
from sensor.quantity import nearest, validation_error
from sensor.verdict import Verdict, all_passed
from twintip.commands.console import FAILED, PASSED, Answer, refusing_what_cannot_be_solved
from twintip.commands.progress import showing_progress
from twintip.flags import DEFAULT_PROCESS

if TYPE_CHECKING:
    from pipeline.springs.fitted_springs import FittedSprings

AS_DESIGNED = "geometry.as_designed"
SOLVED_KINDS = (".step", ".stp")
FILE_KINDS = (".step", ".stp", ".stl", ".3mf")


def run(arguments: Namespace) -> Answer:
    """Judge a folder or a file; the exit code is 0 if all verdicts pass, else 1."""
    path: Path = arguments.path
    named: str | None = arguments.design
    process = _process(path, arguments.process, named)
    if arguments.solve:
        return _solved(path, named)
    with showing_progress(f"reads and judges {path.name}"):
        if named is None or process is None:
            verdicts = check_path(path.absolute(), process)
        else:
            design = load_design(named)
            verdicts = check_path(path.absolute(), design.process, (design, _housing(design, named)))
    return Answer(
        code=PASSED if all_passed(verdicts) else FAILED,
        data=[asdict(verdict) for verdict in verdicts],
        parts=verdict_parts(str(path), verdicts),
    )


def _solved(path: Path, named: str | None) -> Answer:
    """Judge a file, and the stiffness of its springs against those of a design; raises InputError."""
    if path.suffix.lower() not in SOLVED_KINDS:
        bound = f"a file of kind {', '.join(SOLVED_KINDS)}: triangles are not solved"
        raise validation_error("--solve", path.name, "", bound, "export the solid as STEP")
    if named is None:
        hint = "add --design NAME, which says where the part is held and pressed"
        raise validation_error("--solve", path.name, "", "given with a design", hint)
    design = load_design(named)
    with showing_progress(f"sizes the springs of {named}") as show:
        springs = _springs(design)
        show(f"solves {path.name}")
        from pipeline.springs.own_part import design_part_stiffness

        with refusing_what_cannot_be_solved():
            found = design_part_stiffness(path, _made(springs, named), (design.process.E_MPa, design.process.poisson))
        show(f"reads and judges {path.name}")
        of_file = check_path(path.absolute(), design.process, (design, _made(springs, named)))
    notes = [*part_notes(found), *(_as_note(verdict) for verdict in of_file if verdict.name == AS_DESIGNED)]
    targets = {name: 1e3 * spring.target for name, spring in springs.springs.items()}
    verdicts = (
        *part_verdicts(found, targets),
        *(verdict for verdict in of_file if verdict.name != AS_DESIGNED),
    )
    return Answer(
        code=PASSED if all_passed(verdicts) else FAILED,
        data={"verdicts": [asdict(verdict) for verdict in verdicts], "stiffness": part_data(found), "notes": notes},
        parts=[*verdict_parts(str(path), verdicts), *(f"- {escape(note)}" for note in notes)],
    )


def _as_note(verdict: Verdict) -> str:
    """Return in words how far a part is from that of the design, which its maker has changed."""
    return f"{verdict.value:.4g} mm is the largest distance from the part of the design ({verdict.reference})"


def _housing(design: Design, named: str) -> Housing:
    """Return the housing of a design, its leaves as a run finds them; raises InputError for one without a housing."""
    return _made(_springs(design), named)


def _springs(design: Design) -> "FittedSprings":
    """Return the springs of a design as a run finds them; raises InputError."""
    from pipeline.sensor import Sensor  # it loads the solvers, which other checks do without

    with refusing_what_cannot_be_solved():
        return Sensor(design=design).upright_springs


def _made(springs: "FittedSprings", named: str) -> Housing:
    """Return the housing of the springs of a design; raises InputError for one without a housing."""
    housing = springs.housing
    if housing is None:
        hint = f"see printable.* of pipeline run {named}"
        raise validation_error("--design", named, "", "a design whose housing can be made", hint)
    return housing


def _process(path: Path, name: str | None, design: str | None) -> Process | None:
    """Return the process whose rules a file is judged by, None for a folder; raises InputError."""
    if name is not None and design is not None:
        raise validation_error(
            "--process", name, "", "left out beside --design", "leave it out: the design names the process"
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
