"""`pipeline run`: build a design and options from the flags, run it, and print the answer on one screen."""

import json
import time
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from cad.files.file_date import file_date
from pipeline.options import (
    DEFAULT_DESIGN,
    DEFAULT_TOLERANCE,
    ROUGH_TOLERANCE,
    TOLERANCES,
    RunOptions,
    check_can_be_made,
    load_design,
    run_key,
)
from pipeline.storage.digests import Json
from pipeline.storage.folder import refuse_unusable, unchanged_report
from sensor.design.parameters import Design
from sensor.quantity import InputError, parse_number, validation_error
from twintip.commands.console import (
    FAILED,
    PASSED,
    Answer,
    print_error,
    solver_errors_as_input_errors,
)
from twintip.commands.progress import showing_progress

_POLL_S = 0.1  # time between two checks of a watched file [s]
# The key of the design file that each of these flags sets.
_KEY_OF_FLAG = {"nl": "targets.NL", "p_max": "targets.P_max", "process": "print.process"}


def run(arguments: Namespace) -> Iterator[Answer]:
    """Run the design that the flags specify, and yield its answer.

    If the output folder already holds the answer, nothing is solved. With `--watch`, a quick run is repeated whenever
    the design file is written, and each run yields an answer. The exit code is 0 if all verdicts pass, and 1 if not.
    """
    if arguments.watch is not None:
        yield from watch(arguments, arguments.watch)
        return
    design = load_design(named_design(arguments), collect_settings(arguments))
    folder = arguments.out or Path("outputs") / (f"{design.name}-look" if arguments.look else design.name)
    options = _options(arguments, folder)
    check_can_be_made(design, options)
    file_date()  # raises InputError if the environment gives an invalid date for the files
    report = _report_of_same_run(design, options, folder)
    if report is None:
        report = _new_report(design, options, folder)
    # This import loads rich, which wrong input does not need.
    from pipeline.report.answer import every_section, report_passed, summary

    parts = every_section(report) if arguments.verbose else summary(report, folder)
    yield Answer(code=PASSED if report_passed(report) else FAILED, data=report, parts=parts)


def _new_report(design: Design, options: RunOptions, folder: Path) -> Json:
    """Run a design, which writes all files of `folder`, and return its report.

    A note on stderr reports the files of an earlier run that the new run has removed and does not write again.
    """
    with showing_progress("loading the solvers") as work, solver_errors_as_input_errors():
        # The solvers are slow to import, so they are imported only after all checks of the input.
        from pipeline import run as whole_run
        from pipeline.report.outputs import earlier_answer

        earlier = earlier_answer(folder)  # the files of an earlier run, which the new run replaces
        report = whole_run(design, options, progress=work).report
    lost_files = earlier.lost_files_text(folder, options.command)
    if lost_files is not None:
        print_error(f"note: {lost_files}")
    return report


def watch(arguments: Namespace, file: str) -> Iterator[Answer]:
    """Make a quick run of a design file, and repeat it whenever the file is written, until the user presses Ctrl-C.

    `file` is the path of the design file. An error in the first run is raised. In later runs an InputError or OSError
    is printed as one line, so that the user can correct the file.
    """
    if arguments.design != DEFAULT_DESIGN or arguments.named is not None:
        raise validation_error("--watch", file, "", "given without DESIGN", "give the design once")
    if not file.endswith(".toml"):
        raise validation_error("--watch", file, "", "a path that ends in .toml", "name the design file")
    # The folder is named after the file, because the name of the design may change between two runs.
    out = arguments.out or Path("outputs") / f"{Path(file).stem}-look"
    look_arguments = Namespace(**{**vars(arguments), "design": file, "out": out, "look": True, "watch": None})
    # The stamp of a file changes whenever the file is written.
    last_stamp = _file_stamp(file)  # before the run, so that a change during the run is noticed
    yield from run(look_arguments)
    while True:
        time.sleep(_POLL_S)
        stamp = _file_stamp(file)
        if stamp in (last_stamp, None):  # some editors replace the file, so it may be missing for a moment
            continue
        last_stamp = stamp
        try:
            yield from run(look_arguments)
        except (InputError, OSError) as error:
            print_error(str(error))


def _file_stamp(file: str) -> tuple[int, int] | None:
    """Return the modification time [ns] and the size [bytes] of a file, or None if it does not exist."""
    try:
        status = Path(file).stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def _options(arguments: Namespace, folder: Path) -> RunOptions:
    """Return the options of a run that writes to `folder`. Raises InputError if a value is invalid."""
    default = ROUGH_TOLERANCE if arguments.look else DEFAULT_TOLERANCE  # --look makes a quick run
    tolerance = default if arguments.tol is None else parse_number(arguments.tol)
    if tolerance is None:
        raise validation_error("--tol", arguments.tol, "", f"a number {TOLERANCES}", "write 0.001 for 0.1 %")
    return RunOptions(
        out=folder,
        look=arguments.look,
        fruit_stiffness=arguments.fruit_stiffness,
        fields=arguments.fields,
        fabrication=arguments.fabrication,
        tolerance=tolerance,
        force=arguments.force,
    )


def _report_of_same_run(design: Design, options: RunOptions, folder: Path) -> Json | None:
    """Return the report in a folder if it is still valid, or None. A valid report makes a new run unnecessary.

    A report is valid if the same code wrote it for the same design and options, and no file of the folder has changed
    since. Raises OutputError if the folder cannot be used for a new run.
    """
    content = unchanged_report(folder)
    if content is None:
        refuse_unusable(folder, force=options.force)
        return None
    report: Json = json.loads(content)
    return report if report.get("key") == run_key(design, options) else None


def named_design(arguments: Namespace) -> str:
    """Return the preset or design file given as DESIGN or by --design. Raises InputError if both are given."""
    if arguments.named is None:
        return str(arguments.design)
    if arguments.design != DEFAULT_DESIGN:
        raise validation_error("--design", arguments.design, "", "left out if DESIGN is given", "give the design once")
    return str(arguments.named)


def collect_settings(arguments: Namespace) -> dict[str, str]:
    """Return the values of design keys that `--set` and the flags for single keys give, by TABLE.KEY.

    Raises InputError if `--set` has no equals sign, or if a key is set twice.
    """
    pairs = []
    for flag, key in _KEY_OF_FLAG.items():
        value = getattr(arguments, flag)
        if value is not None:
            # An empty flag means an empty string, which is '""' in TOML. An empty --set would unset the key instead.
            pairs.append((key, value or '""'))
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals:
            raise validation_error("--set", text, "", "TABLE.KEY=VALUE", "write for instance --set tips.side_mm=1.5")
        pairs.append((key.strip(), value.strip()))
    settings: dict[str, str] = {}
    for key, value in pairs:
        if key in settings:
            bound = f"given once; it has already been set to {settings[key]!r}"
            raise validation_error(key, value, "", bound, "keep only one of them")
        settings[key] = value
    return settings
