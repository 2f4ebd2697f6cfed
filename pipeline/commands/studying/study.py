"""`pipeline study`: many designs around one, each solved once, kept in one file."""

from argparse import ArgumentParser, Namespace
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import validation_error
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json

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
    add(
        "--html",
        metavar="FILE.html",
        type=Path,
        nargs="?",
        const=Path(),
        help="write its page (DIR/study.html)",
    )
    add_force_flag(parser)
    add_json_flag(parser)


def add_engine_flags(parser: ArgumentParser) -> None:
    """Add --out, --processes and --scheduler."""
    add = parser.add_argument
    add("--out", metavar="DIR", type=Path, help="folder of study.sqlite (default outputs/NAME of the study file)")
    add("--processes", metavar="N", type=int, help="processes on this machine (default: one for each core)")
    add("--scheduler", metavar="ADDRESS", help="solve on the Dask cluster of this scheduler, tcp://HOST:PORT")


def execute(arguments: Namespace) -> int:
    """Solve what the study lacks and print how its points ended; return 0 when none failed, else 1."""
    from pipeline.study.execute import run_study
    from pipeline.study.sensitivity import sensitivities
    from pipeline.study.store import STORE, stored_study
    from pipeline.study.study_file import read_study
    from pipeline.study.workers import chosen_engine, shown_progress

    study = read_study(arguments.file)
    refuse_two_engines(arguments)
    folder = arguments.out or Path("outputs") / study.name
    page = folder / "study.html" if arguments.html == Path() else arguments.html
    _refuse_outputs(arguments.export, page, folder, force=arguments.force)
    with chosen_engine(arguments.processes, arguments.scheduler) as engine, shown_progress() as progress:
        summary = run_study(study, folder, engine, progress)
    with stored_study(folder) as store:
        if arguments.export is not None:
            from pipeline.study.table import export_table

            export_table(store, study, arguments.export, force=arguments.force)
        if page is not None:
            from pipeline.study.page import write_page

            write_page(store, study, page, force=arguments.force)
        refusals = store.messages()
        spans = {} if arguments.json else store.spans(study.wanted)
        indices = sensitivities(store, study) if study.how == "sensitivity" else ()
    with answering():
        if arguments.json:
            print_json(_as_mapping(summary, refusals, indices))
        else:
            _print_counts(summary, refusals)
            _print_sensitivities(indices)
            for key, (least, most) in spans.items():
                print(f"{key}: {least:.5g} to {most:.5g}")
            for path in (summary.folder / STORE, arguments.export, page):
                if path is not None:
                    print(path)
    return FAILED if summary.failed or not summary.done else PASSED


def _refuse_outputs(table: Path | None, page: Path | None, folder: Path, *, force: bool) -> None:
    """Raise InputError where what is asked for beside the points could not be written."""
    if table is not None:
        from pipeline.study.table import refuse_export

        refuse_export(table, folder, force=force)
    if page is not None:
        from pipeline.study.page import refuse_page

        refuse_page(page, folder, force=force)


def refuse_two_engines(arguments: Namespace) -> None:
    """Raise InputError where both processes and a scheduler are asked for."""
    if arguments.processes is not None and arguments.scheduler is not None:
        hint = "the cluster has its workers"
        raise validation_error("--processes", arguments.processes, "", "left out beside --scheduler", hint)


def _as_mapping(
    summary: "StudySummary", refusals: dict[str, int], indices: "tuple[Sensitivity, ...]"
) -> dict[str, object]:
    return {
        **asdict(summary),
        "folder": str(summary.folder),
        "messages": refusals,
        "sensitivities": [asdict(index) for index in indices],
    }


def _print_counts(summary: "StudySummary", refusals: dict[str, int]) -> None:
    """Print how the points ended, why some were refused, and what the solved ones cost."""
    print(f"{summary.points} points: {summary.done} done, {summary.refused} refused, {summary.failed} failed")
    for message, count in refusals.items():
        print(f"  {count} x {message}" if count == 1 else f"  {count} x, for instance: {message}")
    if summary.solved:
        rate = summary.solved / summary.seconds
        print(f"{summary.solved} solved in {summary.seconds:.1f} s, {rate:.3g} points a second")


def _print_sensitivities(indices: "tuple[Sensitivity, ...]") -> None:
    """Print which fraction of the variance of each number a key makes, alone and with others, with 95 % intervals."""
    for index in indices:
        alone_low, alone_high = index.first_interval
        total_low, total_high = index.total_interval
        alone = f"alone {index.first:.3f} ({alone_low:.3f} to {alone_high:.3f})"
        total = f"with others {index.total:.3f} ({total_low:.3f} to {total_high:.3f})"
        print(f"{index.wanted} by {index.key}: {alone}, {total}")
