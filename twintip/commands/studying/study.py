"""`pipeline study`: many designs around one, each solved once, kept in one file."""

from argparse import ArgumentParser, Namespace
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from sensor.machine_error import MachineError
from twintip.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json

if TYPE_CHECKING:
    from pipeline.study.execute import StudySummary
    from pipeline.study.sensitivity import Sensitivity

PURPOSE = "solve many designs around one; a file says what varies and what is wanted"
EXAMPLE = "pipeline study springs.toml --export springs.csv"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the study file, where it runs and what is written of it."""
    add = parser.add_argument
    add("file", metavar="FILE.toml", type=Path, help="the study file, see docs/studies.md")
    add_engine_flags(parser)
    add("--export", metavar="FILE.csv", type=Path, help="write the table of all points")
    add("--html", action="store_true", help="write its page, study.html, into its folder")
    add_force_flag(parser)
    add_json_flag(parser)


def add_engine_flags(parser: ArgumentParser) -> None:
    """Add --out, --processes and --scheduler."""
    add = parser.add_argument
    add("--out", metavar="DIR", type=Path, help="folder of study.sqlite (default outputs/NAME of the study file)")
    add("--processes", metavar="N", type=int, help="processes on this machine (default: one for each core)")
    add("--scheduler", metavar="ADDRESS", help="solve on the Dask cluster of this scheduler, tcp://HOST:PORT")


def execute(arguments: Namespace) -> int:
    """Solve what the study lacks and print how its points ended; return 0 when none failed, else 1.

    Raises MachineError at the end if some failed by a fault of the machine.
    """
    from pipeline.study.columns import point_columns
    from pipeline.study.execute import run_study
    from pipeline.study.page import refuse_page, write_page
    from pipeline.study.sensitivity import sensitivities
    from pipeline.study.store import stored_study
    from pipeline.study.study_file import read_study
    from pipeline.study.table import export_table, refuse_export
    from pipeline.study.workers import chosen_engine, shown_progress

    study = read_study(arguments.file)
    folder = arguments.out or Path("outputs") / study.name
    if arguments.export is not None:
        refuse_export(arguments.export, folder, force=arguments.force)
    if arguments.html:
        refuse_page(folder, force=arguments.force)
    with chosen_engine(arguments.processes, arguments.scheduler) as engine, shown_progress() as progress:
        summary = run_study(study, folder, engine, progress)
    with stored_study(folder) as store:
        written = [store.path]
        if arguments.export is not None:
            export_table(store, study, arguments.export, force=arguments.force)
            written.append(arguments.export)
        if arguments.html:
            written.append(write_page(store, study, force=arguments.force))
        messages = store.messages()
        machine_faults = store.machine_faults()
        indices = sensitivities(store, study) if study.how == "sensitivity" else ()
        columns = point_columns(store, study.wanted)
    with answering():
        if arguments.json:
            sensitivity = [asdict(index) for index in indices]
            print_json({**asdict(summary), "folder": str(folder), "messages": messages, "sensitivities": sensitivity})
        else:
            _print(summary, messages, indices)
            for key in columns.values:
                low, high = columns.span(key)
                print(f"{key}: {low:.5g} to {high:.5g}")
            for path in written:
                print(path)
    if machine_faults:
        failed = f"{machine_faults} of {summary.points} points"
        msg = f"{failed} failed by a fault of the machine, the first reason above; the same command tries them again"
        raise MachineError(msg)
    return FAILED if summary.failed or not summary.done else PASSED


def _print(summary: "StudySummary", messages: dict[str, int], indices: "tuple[Sensitivity, ...]") -> None:
    """Print how the points ended, why some were refused, what the solved ones cost, and the indices with intervals."""
    print(f"{summary.points} points: {summary.done} done, {summary.refused} refused, {summary.failed} failed")
    for message, count in messages.items():
        print(f"  {count} x {message}" if count == 1 else f"  {count} x, for instance: {message}")
    if summary.solved:
        rate = summary.solved / summary.seconds
        print(f"{summary.solved} solved in {summary.seconds:.1f} s, {rate:.3g} points a second")
    for index in indices:
        alone = "alone {:.3f} ({:.3f} to {:.3f})".format(index.first, *index.first_interval)
        total = "with others {:.3f} ({:.3f} to {:.3f})".format(index.total, *index.total_interval)
        print(f"{index.wanted} by {index.key}: {alone}, {total}")
