"""Check whether files are unchanged since the run, and whether their geometry is valid.

The geometry is measured in a worker process, because a file may crash the CAD kernel. The functions that run there
import the modules that load the kernel, so that this process does not load it.
"""

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, wait
from pathlib import Path

from cad.parts.housing import Housing
from pipeline.report.outputs import LATEST
from pipeline.report.report import Report, is_as_written, read_data, report_from_data
from pipeline.storage.digests import is_regular
from pipeline.storage.workers import close_workers, open_workers
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.verdict import READABLE, Verdict, judge

SECONDS = 300.0  # limit of the wall time for a file or a folder [s]; a whole folder takes a few seconds
# loky reports these signals if the operating system ends a worker, for example to free memory; files do not cause them
_OUTSIDE_SIGNALS = ("SIGKILL", "SIGTERM")


def check_path(
    path: Path, process: Process | None, designed: tuple[Design, Housing] | None = None
) -> tuple[Verdict, ...]:
    """Return the verdicts on one file by the rules of a print `process`, or on an output folder if `process` is None.

    If `designed` gives a design and its housing, a file is also compared with the part of this design. The verdict
    geometry.readable fails for a file that crashes the CAD kernel or takes longer than `SECONDS`. Raises InputError if
    a folder has no valid report, and BrokenExecutor if the operating system ends the worker.
    """
    unchanged = unchanged_verdicts(path) if process is None else ()
    executor = open_workers(1)
    try:
        if process is None:
            future = executor.submit(folder_geometry, path)
        else:
            future = executor.submit(file_geometry, path, process, designed)
        if wait([future], SECONDS).done:
            geometry = future.result()
        else:
            geometry = (judge(READABLE, None, f"reading {path.name} took more than {SECONDS:g} s; export it again"),)
    except BrokenExecutor as error:
        if any(signal in str(error) for signal in _OUTSIDE_SIGNALS):
            raise  # the file is not the cause, so it gets no verdict
        geometry = (judge(READABLE, None, f"reading {path.name} ended the CAD kernel; export it again"),)
    finally:
        close_workers(executor)
    return *unchanged, *geometry


def unchanged_verdicts(folder: Path) -> tuple[Verdict, ...]:
    """Return the verdicts on whether report.json and the files that it lists are unchanged since the run.

    Raises InputError if the folder has no valid report.
    """
    data = read_data(folder)
    report = report_from_data(folder, data)
    changed = [file.path for file in report.files if not file.is_unchanged_in(folder)]
    listed = f"files that are missing or changed since the run: {', '.join(changed) or 'none'}"
    return (
        judge("files.unchanged", len(changed), listed),
        judge("report.digest", not is_as_written(data), "report.json is as the run wrote it"),
    )


def file_geometry(path: Path, process: Process, designed: tuple[Design, Housing] | None) -> tuple[Verdict, ...]:
    """Return the geometry verdicts on a STEP, STL or 3MF file [mm], by the rules of a print process.

    If `designed` gives a design and its housing, the first verdict compares the file with the part of this design. A
    file that cannot be read is not compared.
    """
    # These modules load the CAD kernel, so they are imported only in the worker process.
    from cad.checks.part_checks import check_file
    from cad.fabrication.file_shapes import part_as_designed
    from cad.parts.assembly import draw_sensor

    verdicts = check_file(path, process)
    if designed is None or any(verdict.name == READABLE for verdict in verdicts):
        return verdicts
    return (part_as_designed(draw_sensor(*designed), path), *verdicts)


def folder_geometry(folder: Path) -> tuple[Verdict, ...]:
    """Measure the files of an output folder and return the geometry verdicts.

    Some verdicts are evaluated on the solid of the design in the folder's report, others on the files themselves. If
    files of a whole run are missing, a single verdict names them. A layout without a housing has no geometry verdicts.
    Raises InputError if the report is invalid.
    """
    report = report_from_data(folder, read_data(folder))  # an edited report fails a different verdict, report.digest
    if not report.design.tips.tip_layout.has_housing:
        return ()
    if report.housing is None:
        return (judge("geometry.made", 0.0, "no housing: see printable.*", limit=1.0),)
    reason = _unmeasurable_reason(folder, report)
    if reason is not None:
        return (judge(READABLE, None, reason),)
    return _measured_verdicts(folder, report, report.housing)


def _unmeasurable_reason(folder: Path, report: Report) -> str | None:
    """Return why the files of a folder cannot be measured; None if every file of a whole run exists."""
    from cad.fabrication.file_shapes import RUN_FILES  # imported here, because the module loads the CAD kernel

    missing_files = ", ".join(name for name in RUN_FILES if not is_regular(folder / name))
    if not missing_files:
        return None
    if any(file.path == LATEST for file in report.files):
        return "a run with --look makes no solid to measure: run the design without --look, and check that folder"
    return f"{missing_files} cannot be measured, because the folder does not have them; run the design again"


def _measured_verdicts(folder: Path, report: Report, housing: Housing) -> tuple[Verdict, ...]:
    """Return the geometry verdicts on the solid of a report's design, and on the files in its folder."""
    # These modules load the CAD kernel, so they are imported only in the worker process.
    from cad.checks.assembly_checks import cover_verdicts
    from cad.checks.part_checks import check_file
    from cad.checks.sensor_checks import check_sensor
    from cad.fabrication.file_shapes import file_shapes, files_as_designed
    from cad.fabrication.mount_checks import mount_verdicts
    from cad.files.step import read_step
    from cad.parts.assembly import draw_sensor

    process = report.design.process
    sensor = draw_sensor(report.design, housing)
    names = [name for name in file_shapes(sensor) if is_regular(folder / name)]
    verdicts = check_sensor(sensor, report.deflections_mm, folder)
    verdicts += _verdicts_or_unreadable(lambda: (files_as_designed(sensor, folder, names),))
    # The solid already has some of the verdicts on the 3MF file, so only the others are added.
    evaluated_names = {verdict.name for verdict in verdicts}
    file_verdicts = check_file(folder / "housing.3mf", process)
    verdicts += tuple(verdict for verdict in file_verdicts if verdict.name not in evaluated_names)
    if "cover.step" in names:  # only `pipeline design` writes a cover and a bracket
        verdicts += _verdicts_or_unreadable(lambda: cover_verdicts(sensor, read_step(folder / "cover.step"), process))
    if "mount.step" in names:
        verdicts += _verdicts_or_unreadable(lambda: mount_verdicts(sensor, read_step(folder / "mount.step"), process))
    return verdicts


def _verdicts_or_unreadable(measure: Callable[[], tuple[Verdict, ...]]) -> tuple[Verdict, ...]:
    """Call `measure` and return its verdicts; if a file cannot be read, return the failed geometry.readable."""
    try:
        return measure()
    except ValueError as error:
        return (judge(READABLE, None, str(error)),)
