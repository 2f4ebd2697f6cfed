"""`pipeline run`: flags to a design and options, the run, its answer on one screen."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from cad.design.parameters import Design
from cad.files.file_date import file_date
from cad.quantity import InputError, fault
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json
from pipeline.options import (
    CONTACT_METHODS,
    DEFAULT_DESIGN,
    DEFAULT_TOLERANCE,
    FRUIT_STIFFNESSES,
    TOLERANCES,
    RunOptions,
    load_design,
)
from pipeline.progress.line import showing_progress
from pipeline.storage.folder import refuse_unusable
from pipeline.storage.interruption import interruptible

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
        out=arguments.out or Path("outputs") / design.name,
        fruit_stiffness=arguments.fruit_stiffness,
        contact_method=arguments.contact_method,
        fields=arguments.fields,
        tolerance=_tolerance(arguments.tol),
        force=arguments.force,
    )
    return design, options


def execute_run(arguments: Namespace, design: Design, options: RunOptions) -> int:
    """Run, print the answer, return the exit code; a scene that cannot be solved is wrong input."""
    if options.out is not None:
        refuse_unusable(options.out, force=options.force)
    file_date()
    from cad.files.sensor_files import ExportError
    from mesh.session import MeshError
    from pipeline import run
    from pipeline.report.mapping import report_mapping
    from pipeline.report.outputs import written_entries
    from pipeline.report.tables import print_everything, print_summary
    from solve.fruit.split import SplitDomainError
    from solve.linear import SolveError

    try:
        with interruptible(), showing_progress("start", quiet=arguments.json):
            result = run(design, options)
    except (ExportError, MeshError, SolveError, SplitDomainError) as error:
        raise InputError(str(error)) from error
    code = PASSED if result.passed else FAILED
    with answering():
        if arguments.json:
            print_json(report_mapping(result, () if options.out is None else written_entries(options.out)))
        elif arguments.verbose:
            print_everything(result)
        else:
            print_summary(result)
    return code


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
        raise fault("--tol", text, "", f"a number {TOLERANCES}", "0.001 is 0.1 %") from error
