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
    from pipeline.study.store import StudyStore
    from pipeline.study.study_file import Study

PURPOSE = "solve many designs around one: what varies, how, and what is wanted stand in a file"
EXAMPLE = "pipeline study springs.toml --export springs.csv"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the study file, where it runs and what is written of it."""
    add = parser.add_argument
    add("file", metavar="FILE.toml", type=Path, help="the study file, see docs/studies.md")
    add_engine_flags(parser)
    add("--export", metavar="FILE.csv|FILE.parquet", type=Path, help="write the table of all points")
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
    from pipeline.study.store import stored_study
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
        _write(store, study, arguments.export, page, force=arguments.force)
        refusals = store.messages()
        shares = sensitivities(store, study) if study.how == "sensitivity" else ()
    with answering():
        _print(summary, refusals, shares, as_json=arguments.json)
    return FAILED if summary.failed or not summary.done else PASSED


def _write(store: "StudyStore", study: "Study", table: Path | None, page: Path | None, *, force: bool) -> None:
    """Write what is asked for beside the points."""
    if table is not None:
        from pipeline.study.table import export_table

        export_table(store, study, table, force=force)
    if page is not None:
        from pipeline.study.page import write_page

        write_page(store, study, page, force=force)


def _refuse_outputs(table: Path | None, page: Path | None, folder: Path, *, force: bool) -> None:
    """Raise InputError where what is asked for beside the points could not be written."""
    from pipeline.study.table import refuse_export

    if table is not None:
        refuse_export(table, folder, force=force)
    if page is not None:
        from pipeline.study.page import refuse_page

        refuse_page(page, folder, force=force)


def refuse_two_engines(arguments: Namespace) -> None:
    """Raise InputError where both processes and a scheduler are asked for."""
    if arguments.processes is not None and arguments.scheduler is not None:
        raise validation_error(
            "--processes", arguments.processes, "", "left out beside --scheduler", "the cluster has its workers"
        )


def _plain(summary: "StudySummary") -> dict[str, object]:
    model = summary.interpolation
    names = ("points", "done", "refused", "failed", "solved", "seconds")
    return {
        "folder": str(summary.folder),
        **{name: getattr(summary, name) for name in names},
        "surrogate": None if model is None else {"solves": model.solves, "error": model.error},
    }


def _print(
    summary: "StudySummary", messages: dict[str, int], shares: "tuple[Sensitivity, ...]", *, as_json: bool
) -> None:
    if as_json:
        print_json({**_plain(summary), "messages": messages, "sensitivities": [asdict(one) for one in shares]})
    else:
        _print_counts(summary, messages)
        _print_sensitivities(shares)


def _print_counts(summary: "StudySummary", messages: dict[str, int]) -> None:
    print(f"{summary.points} points: {summary.done} done, {summary.refused} refused, {summary.failed} failed")
    model = summary.interpolation
    if model is not None:
        print(f"contact interpolated between {model.solves} solves, K_m / E off by at most {100.0 * model.error:.2g} %")
    for message, count in messages.items():
        print(f"  {count} x {message}" if count == 1 else f"  {count} x, for instance: {message}")
    if summary.solved:
        rate = summary.solved / summary.seconds
        print(f"{summary.solved} solved in {summary.seconds:.1f} s, {rate:.3g} points a second")
    print(f"{summary.folder / 'study.sqlite'}")


def _print_sensitivities(shares: "tuple[Sensitivity, ...]") -> None:
    """Print which share of the variance of each number a key makes, alone and with others, with 95 % intervals."""
    for one in shares:
        first, total = one.first_interval, one.total_interval
        alone = f"alone {one.first:.3f} ({first[0]:.3f} to {first[1]:.3f})"
        print(f"{one.wanted} by {one.key}: {alone}, with others {one.total:.3f} ({total[0]:.3f} to {total[1]:.3f})")
