"""Check of files: unchanged since they were written, and geometry measured in a worker, because a file may crash it."""

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, wait
from pathlib import Path

from cad.parts.housing import Housing
from pipeline.report.outputs import LATEST
from pipeline.report.report import is_as_written, read_data, report_of
from pipeline.storage.digests import is_regular
from pipeline.storage.workers import close_workers, open_workers
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.verdict import READABLE, Verdict, judge

SECONDS = 300.0  # limit of wall time for a file or a folder [s]; whole folders take some seconds
# loky reports these signals if the system ends a worker, for instance for its memory; files do not cause them
_FROM_OUTSIDE = ("SIGKILL", "SIGTERM")


def check_path(
    path: Path, process: Process | None, designed: tuple[Design, Housing] | None = None
) -> tuple[Verdict, ...]:
    """Return the verdicts on a file by the rules of a process, or without one on an output folder.

    If a design and its housing are given, the file is compared with their parts. A file that crashes the kernel, or
    keeps it busy for minutes, gets the failed verdict geometry.readable. Raises InputError if a folder's report is not
    one of ours, and BrokenExecutor if the worker was ended from outside.
    """
    written = unchanged_verdicts(path) if process is None else ()
    executor = open_workers(1)
    try:
        if process is None:
            judged = executor.submit(folder_geometry, path)
        else:
            judged = executor.submit(file_geometry, path, process, designed)
        if wait([judged], SECONDS).done:
            geometry = judged.result()
        else:
            geometry = (judge(READABLE, None, f"reading {path.name} took more than {SECONDS:g} s; export it again"),)
    except BrokenExecutor as error:
        if any(signal in str(error) for signal in _FROM_OUTSIDE):
            raise
        geometry = (judge(READABLE, None, f"reading {path.name} ended the CAD kernel; export it again"),)
    finally:
        close_workers(executor)
    return *written, *geometry


def unchanged_verdicts(folder: Path) -> tuple[Verdict, ...]:
    """Return the verdicts on the digests of a report and of its files; raises InputError."""
    data = read_data(folder)
    report = report_of(folder, data)
    changed = [file.path for file in report.files if not file.is_unchanged_in(folder)]
    listed = f"files that are missing or changed since the run: {', '.join(changed) or 'none'}"
    return (
        judge("files.unchanged", len(changed), listed),
        judge("report.digest", not is_as_written(data), "report.json is as the run wrote it"),
    )


def file_geometry(path: Path, process: Process, designed: tuple[Design, Housing] | None) -> tuple[Verdict, ...]:
    """Return the geometry verdicts on a STEP, STL or 3MF file [mm] by the rules of a process, and against a design."""
    from cad.checks.part_checks import check_file
    from cad.fabrication.file_shapes import part_as_designed
    from cad.parts.assembly import sensor_of

    verdicts = check_file(path, process)
    if designed is None or any(verdict.name == READABLE for verdict in verdicts):
        return verdicts
    return (part_as_designed(sensor_of(*designed), path), *verdicts)


def folder_geometry(folder: Path) -> tuple[Verdict, ...]:
    """Return the geometry verdicts on the files of an output folder; raises InputError."""
    from cad.checks.assembly_checks import cover_verdicts
    from cad.checks.part_checks import check_file
    from cad.checks.sensor_checks import check_sensor
    from cad.fabrication.file_shapes import RUN_FILES, file_shapes, files_as_designed
    from cad.fabrication.mount_checks import mount_verdicts
    from cad.files.step import read_step
    from cad.parts.assembly import sensor_of

    report = report_of(folder, read_data(folder))  # an edited report has its own verdict
    if not report.design.tips.tip_layout.has_housing:
        return ()
    if report.housing is None:
        return (judge("geometry.made", 0.0, "no housing: see printable.*", limit=1.0),)
    missing = ", ".join(name for name in RUN_FILES if not is_regular(folder / name))
    if missing:
        reason = f"{missing} cannot be measured, there is no such file; run the design again"
        if any(file.path == LATEST for file in report.files):
            reason = "a look makes no solid to measure: run the design without --look, and check that folder"
        return (judge(READABLE, None, reason),)
    process = report.design.process
    sensor = sensor_of(report.design, report.housing)
    there = [name for name in file_shapes(sensor) if is_regular(folder / name)]
    verdicts = check_sensor(sensor, report.deflections_mm, folder)
    verdicts += _measured(lambda: (files_as_designed(sensor, folder, there),))
    known = {verdict.name for verdict in verdicts}
    verdicts += tuple(one for one in check_file(folder / "housing.3mf", process) if one.name not in known)
    if "cover.step" in there:  # only `pipeline design` writes cover and bracket
        verdicts += _measured(lambda: cover_verdicts(sensor, read_step(folder / "cover.step"), process))
    if "mount.step" in there:
        verdicts += _measured(lambda: mount_verdicts(sensor, read_step(folder / "mount.step"), process))
    return verdicts


def _measured(measure: Callable[[], tuple[Verdict, ...]]) -> tuple[Verdict, ...]:
    """Return the verdicts of a measurement, or the failed verdict on an unreadable file."""
    try:
        return measure()
    except ValueError as error:
        return (judge(READABLE, None, str(error)),)
