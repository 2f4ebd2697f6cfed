"""`pipeline run`: from flags to a design and options, the run, and its answer on one screen."""

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
    load_design,
    refuse_unmakeable,
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
    refusing_what_cannot_be_solved,
)
from twintip.commands.progress import showing_progress

_POLL_S = 0.1
_SETTING_OF = {"nl": "targets.NL", "p_max": "targets.P_max", "process": "print.process"}


def run(arguments: Namespace) -> Iterator[Answer]:
    """Run or look at the design in the flags; with --watch, again whenever its file is written.

    If the folder holds the answer already, nothing is solved.
    """
    if arguments.watch is not None:
        yield from watch(arguments, arguments.watch)
        return
    design = load_design(named_design(arguments), settings_of(arguments))
    folder = arguments.out or Path("outputs") / (f"{design.name}-look" if arguments.look else design.name)
    options = _options(arguments, folder)
    refuse_unmakeable(design, options)
    file_date()  # refuses an invalid file date
    report = _report_of_same_run(design, options, folder)
    if report is None:
        with showing_progress("loads the solvers") as work, refusing_what_cannot_be_solved():
            # The solvers are imported after all refusals.
            from pipeline import run as whole_run
            from pipeline.report.outputs import earlier_answer

            before = earlier_answer(folder)
            report = whole_run(design, options, progress=work).report
        lost = before.lost_files_text(folder, options.command)
        if lost is not None:
            print_error(f"note: {lost}")
    from pipeline.report.answer import every_section, report_passed, summary

    parts = every_section(report) if arguments.verbose else summary(report, folder)
    yield Answer(code=PASSED if report_passed(report) else FAILED, data=report, parts=parts)


def watch(arguments: Namespace, file: str) -> Iterator[Answer]:
    """Look at a design file, and again whenever it is written; later errors are printed as one line.

    Raises InputError for an error at the start.
    """
    if arguments.design != DEFAULT_DESIGN or arguments.named is not None:
        raise validation_error("--watch", file, "", "given without DESIGN", "give the design once")
    if not file.endswith(".toml"):
        raise validation_error("--watch", file, "", "a path that ends in .toml", "name the design file")
    out = arguments.out or Path("outputs") / f"{Path(file).stem}-look"  # does not change with the name in the file
    look = Namespace(**{**vars(arguments), "design": file, "out": out, "look": True, "watch": None})
    seen = _stamp(file)
    yield from run(look)
    while True:
        time.sleep(_POLL_S)
        stamp = _stamp(file)
        if stamp in (seen, None):  # an editor that writes aside removes the file for a moment
            continue
        seen = stamp
        try:
            yield from run(look)
        except (InputError, OSError) as error:
            print_error(str(error))


def _stamp(file: str) -> tuple[int, int] | None:
    """Return the time and size of a file, which change when it is written; None if it does not exist."""
    try:
        status = Path(file).stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def _options(arguments: Namespace, folder: Path) -> RunOptions:
    """Return the options of a run that writes into `folder`; raises InputError if `--tol` is no number."""
    default = ROUGH_TOLERANCE if arguments.look else DEFAULT_TOLERANCE
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
    """Return the report in a folder if the same design, options and code wrote it and nothing has changed; else None.

    Raises OutputError for an unusable folder.
    """
    content = unchanged_report(folder)
    if content is None:
        refuse_unusable(folder, force=options.force)
        return None
    report: Json = json.loads(content)
    return report if report.get("key") == run_key(design, options) else None


def named_design(arguments: Namespace) -> str:
    """Return the preset or file in DESIGN or --design; raises InputError for both."""
    if arguments.named is None:
        return str(arguments.design)
    if arguments.design != DEFAULT_DESIGN:
        raise validation_error("--design", arguments.design, "", "left out if DESIGN is given", "give the design once")
    return str(arguments.named)


def settings_of(arguments: Namespace) -> dict[str, str]:
    """Return the design keys set by flags, by TABLE.KEY; raises InputError for a key that is set twice."""
    pairs = []
    for flag, key in _SETTING_OF.items():
        value = getattr(arguments, flag)
        if value is not None:
            pairs.append((key, value or '""'))  # an empty flag is an empty text; an empty --set unsets its key
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals:
            raise validation_error("--set", text, "", "TABLE.KEY=VALUE", "write for instance --set tips.side_mm=1.5")
        pairs.append((key.strip(), value.strip()))
    settings: dict[str, str] = {}
    for key, value in pairs:
        if key in settings:
            bound = f"given once; it is {settings[key]!r} already"
            raise validation_error(key, value, "", bound, "keep one of the two")
        settings[key] = value
    return settings
