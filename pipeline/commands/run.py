"""`pipeline run`: flags to a design and options, the run, its answer on one screen."""

import json
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.design.parameters import Design
from cad.files.file_date import file_date
from cad.quantity import InputError, validation_error
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json
from pipeline.commands.progress_line import showing_progress
from pipeline.options import (
    CONTACT_METHODS,
    DEFAULT_DESIGN,
    DEFAULT_TOLERANCE,
    FRUIT_STIFFNESSES,
    TOLERANCES,
    RunOptions,
    load_design,
)
from pipeline.storage.folder import refuse_unusable
from pipeline.storage.interruption import interruptible

if TYPE_CHECKING:
    from pipeline.report.answer.answer import RunAnswer
    from pipeline.storage.plain import Plain

PURPOSE = "size, shape, mesh, solve and judge a sensor"
EXAMPLE = "pipeline run --nl 0.05 --out outputs/mine"
_SETTING_OF = {"nl": "targets.NL", "p_max": "targets.P_max", "process": "print.process"}


def add_design_flags(parser: ArgumentParser) -> None:
    """Add the flags that give a design."""
    add = parser.add_argument
    add("--nl", metavar="NL", help="target nonlinearity [fraction, 0.05 = 5 %%], greater than 0 and less than 0.5")
    add("--p-max", metavar="P", help="target force ratio at the largest modulus [1], greater than 1 and at most 100")
    add("--design", metavar="NAME|FILE.toml", default=DEFAULT_DESIGN, help=f"preset or file (default {DEFAULT_DESIGN})")
    add("--process", metavar="NAME", help="print process, see pipeline design --list-processes")
    add(
        "--set",
        metavar="TABLE.KEY=VALUE",
        action="append",
        default=[],
        help="any key of the design file, unset where VALUE is left out; repeatable",
    )


def add_arguments(parser: ArgumentParser) -> None:
    """Add the flags that give a design and the options of its run."""
    add = parser.add_argument
    add_design_flags(parser)
    add("--out", metavar="DIR", type=Path, help="the output folder itself (default outputs/NAME)")
    stiffnesses, methods = "|".join(FRUIT_STIFFNESSES), "|".join(CONTACT_METHODS)
    add_force_flag(parser)
    add("--fruit-stiffness", metavar=stiffnesses, default="contact", help="true contact, or the paper's (6)")
    add("--contact-method", metavar=methods, default="auto", help="how the contact is solved (default auto)")
    add("--tol", metavar="TOL", help=f"relative error allowed to both stiffnesses (default {DEFAULT_TOLERANCE:g})")
    add("--fields", action="store_true", help="write displacement [mm] and stress [MPa] fields too (VTU)")
    add("--verbose", action="store_true", help="print every verdict, error and cost, not one screen")
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Run the design that the flags ask for; return the exit code."""
    return execute_run(arguments, *asked(arguments))


def asked(arguments: Namespace) -> tuple[Design, RunOptions]:
    """Return the design and the options that flags ask for; raises InputError."""
    design = load_design(arguments.design, settings_of(arguments))
    options = RunOptions(
        out=_folder(arguments, design),
        fruit_stiffness=arguments.fruit_stiffness,
        contact_method=arguments.contact_method,
        fields=arguments.fields,
        tolerance=_tolerance(arguments.tol),
        force=arguments.force,
    )
    return design, options


def _folder(arguments: Namespace, design: Design) -> Path:
    return arguments.out or Path("outputs") / design.name


def execute_run(arguments: Namespace, design: Design, options: RunOptions) -> int:
    """Run, print the answer, return the exit code; a scene that cannot be solved is wrong input.

    Where the folder holds just what this run would write, its answer is printed again and nothing is solved.
    """
    folder = _folder(arguments, design)
    refuse_unusable(folder, force=options.force)
    file_date()
    from pipeline.report.answer.answer import next_steps, print_answer
    from pipeline.report.answer.kept_answer import kept_answer

    with interruptible():
        kept = kept_answer(design, options, folder)
    answer, report = kept or _new_answer(design, options, folder, quiet=arguments.json)
    with answering():
        if arguments.json:
            print_json(_own_report(report, folder))
        elif arguments.verbose:
            print_answer(answer.everything)
        else:
            print_answer((*answer.summary, next_steps(folder)))
    return PASSED if answer.passed else FAILED


def _own_report(report: bytes | None, folder: Path) -> "Plain":
    """Return report.json as data; raises InputError where another run has taken the folder since."""
    if report is None:
        bound = "a folder that no other run writes, and its report.json is not that of this run any longer"
        raise validation_error("--out", str(folder), "", bound, "run again, or name another folder with --out")
    data: Plain = json.loads(report)
    return data


def _new_answer(design: Design, options: RunOptions, folder: Path, *, quiet: bool) -> "tuple[RunAnswer, bytes | None]":
    """Run and keep the answer; return it with report.json, None where another run has taken the folder since.

    Raises InputError for a scene that cannot be solved.
    """
    from cad.files.export_error import ExportError
    from mesh.session import MeshError
    from pipeline import run
    from pipeline.report.answer.kept_answer import keep_answer
    from pipeline.report.outputs import written_report
    from pipeline.report.tables import run_answer
    from solve.fruit.split import SplitDomainError
    from solve.linear import SolveError

    try:
        with interruptible(), showing_progress("start", quiet=quiet):
            result = run(design, options)
            answer, report = run_answer(result), written_report(result, folder)
            if report is not None:
                keep_answer(answer, design, options, report)
    except (ExportError, MeshError, SolveError, SplitDomainError) as error:
        raise InputError(str(error)) from error
    return answer, report


def settings_of(arguments: Namespace) -> dict[str, str]:
    """Return the design keys that flags set; raises InputError for one that is set twice."""
    settings: dict[str, str] = {}
    # an empty flag is an empty text, not a key that --set leaves unset
    given = [
        (key, '""' if getattr(arguments, flag) == "" else getattr(arguments, flag)) for flag, key in _SETTING_OF.items()
    ]
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals:
            msg = f"--set = {text!r}: must be TABLE.KEY=VALUE; write for instance --set tips.side_mm=1.5"
            raise InputError(msg)
        given.append((key.strip(), value.strip()))
    for key, value in given:
        if value is None:
            continue
        if key in settings:
            msg = f"{key} = {value!r}: must be given once, and it is {settings[key]!r} already; keep one of the two"
            raise InputError(msg)
        settings[key] = value
    return settings


def _tolerance(text: str | None) -> float:
    try:
        return DEFAULT_TOLERANCE if text is None else float(text)
    except ValueError as error:
        raise validation_error("--tol", text, "", f"a number {TOLERANCES}", "0.001 is 0.1 %") from error
