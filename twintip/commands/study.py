"""`pipeline study`: solve many variations of one design, each once, and store all of them in one file."""

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from pipeline.study.engines import chosen_engine
from pipeline.study.execute import StudySummary, run_study
from pipeline.study.sensitivity import Sensitivity, sensitivities
from pipeline.study.store import StudyStore, stored_study
from pipeline.study.study_file import Study, read_study
from pipeline.study.study_page import refuse_page, write_page
from pipeline.study.study_table import export_table, refuse_export
from sensor.machine_error import MachineError
from twintip.commands.console import FAILED, PASSED, Answer
from twintip.commands.progress import showing_progress


def run(arguments: Namespace) -> Iterator[Answer]:
    """Solve the points of a study that are not stored yet, and yield the answer.

    The exit code is 1 if a point failed or none is done. After the answer, MachineError is raised if points failed
    because of the machine, for instance because of a full disk.
    """
    study = read_study(arguments.file)
    folder = arguments.out or Path("outputs") / study.name
    summary = _solve_points(arguments, study, folder)
    with stored_study(folder) as store:
        written = _write_requested_files(arguments, store, study)
        messages = store.messages()
        machine_faults = store.machine_faults()
        indices = sensitivities(store, study) if study.how == "sensitivity" else ()
        range_lines = _range_lines(store, study)
    lines = [*_summary_lines(summary, messages, indices), *range_lines, *map(str, written)]
    index_records = [asdict(index) for index in indices]
    yield Answer(
        code=FAILED if summary.failed or not summary.done else PASSED,
        data={**asdict(summary), "folder": str(folder), "messages": messages, "sensitivities": index_records},
        text="\n".join(lines),
    )
    if machine_faults:
        msg = (
            f"{machine_faults} of {summary.points} points failed because of the machine, for the first reason above. "
            "Run the same command again to solve them."
        )
        raise MachineError(msg)


def _solve_points(arguments: Namespace, study: Study, folder: Path) -> StudySummary:
    """Solve the points of a study, store them in `folder`, and return the numbers of done, refused and failed points.

    Progress is shown on stderr. Raises InputError for a requested file that could not be written at the end.
    """
    # These files are refused before anything is solved.
    if arguments.export is not None:
        refuse_export(arguments.export, folder, force=arguments.force)
    if arguments.html:
        refuse_page(folder, force=arguments.force)
    with (
        showing_progress("solving points") as work,
        chosen_engine(arguments.processes, arguments.scheduler) as engine,
    ):
        return run_study(study, folder, engine, work.count)


def _range_lines(store: StudyStore, study: Study) -> list[str]:
    """Return a line with the smallest and the largest value of each requested key, if its values are numbers."""
    spans = {key: store.span(key) for key in study.wanted}
    # A key whose values are not numbers has no span.
    return [f"{key}: {span[0]:.5g} to {span[1]:.5g}" for key, span in spans.items() if span is not None]


def _write_requested_files(arguments: Namespace, store: StudyStore, study: Study) -> list[Path]:
    """Write the table and the page of a study if flags request them, and return the paths of all files of the study.

    The first file is the store, which holds all points.
    """
    paths = [store.path]
    if arguments.export is not None:
        export_table(store, arguments.export, force=arguments.force)
        paths.append(arguments.export)
    if arguments.html:
        paths.append(write_page(store, study, force=arguments.force))
    return paths


def _summary_lines(summary: StudySummary, messages: dict[str, int], indices: tuple[Sensitivity, ...]) -> list[str]:
    """Return the lines that summarise a study: its points, their errors, the points per second, and the Sobol indices.

    `messages` maps each error message of refused and failed points to the number of points that have it.
    """
    lines = [f"{summary.points} points: {summary.done} done, {summary.refused} refused, {summary.failed} failed"]
    for message, count in messages.items():  # messages that differ only in their numbers are counted together
        lines.append(f"  {count} x {message}" if count == 1 else f"  {count} x, for instance: {message}")
    if summary.solved:
        rate = summary.solved / summary.seconds
        lines.append(f"{summary.solved} solved in {summary.seconds:.1f} s, {rate:.3g} points per second")
    # "alone" is the first-order Sobol index of a key, and "with others" its total index. Each index is followed by its
    # confidence interval.
    for index in indices:
        first_order = "alone {:.3f} ({:.3f} to {:.3f})".format(index.first, *index.first_interval)
        total = "with others {:.3f} ({:.3f} to {:.3f})".format(index.total, *index.total_interval)
        lines.append(f"{index.wanted} by {index.key}: {first_order}, {total}")
    return lines
