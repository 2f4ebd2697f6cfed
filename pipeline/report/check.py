"""Whether files are as they were written, and their geometry checked anew in a worker: a bad file may end a kernel."""

from concurrent.futures import BrokenExecutor
from pathlib import Path

from cad.design.processes import PROCESSES
from cad.verdict import Verdict, equal, failed
from pipeline.storage.digests import KEY, content_digest, is_regular
from pipeline.storage.workers import close_workers, open_workers

SECONDS = 300.0  # of wall time for a file or a folder: whole folders take some seconds
_MEASURED = ("housing.step", "housing.stl", "housing.3mf")


def check_path(path: Path, process: str | None) -> tuple[Verdict, ...]:
    """Return the verdicts on a file by the rules of a process, or on an output folder without one.

    A file that ends the kernel, or keeps it busy for minutes, is the failed verdict geometry.readable. Raises
    InputError where a folder's report is not one of ours.
    """
    written = unchanged_verdicts(path) if process is None else ()
    executor = open_workers(1)
    try:
        if process is None:
            geometry = executor.submit(folder_geometry, path).result(SECONDS)
        else:
            geometry = executor.submit(file_geometry, path, process).result(SECONDS)
    except BrokenExecutor:
        geometry = (_unreadable(f"reading {path.name} ended the CAD kernel; export it again"),)
    except TimeoutError:
        geometry = (_unreadable(f"reading {path.name} took more than {SECONDS:g} s; export it again"),)
    finally:
        close_workers(executor)
    return *written, *geometry


def unchanged_verdicts(folder: Path) -> tuple[Verdict, ...]:
    """Return the verdicts on the digests of a report and of the files that it lists; raises InputError."""
    from pipeline.report.stored import read_data, report_of

    data = read_data(folder)
    changed = [file.path for file in report_of(folder, data).files if not file.is_unchanged_in(folder)]
    listed = f"files that are missing or changed since the run: {', '.join(changed) or 'none'}"
    edited = float(data.get(KEY) != content_digest(data))
    return (
        equal("files.unchanged", float(len(changed)), 0.0, 0.0, unit="1", reference=listed),
        equal("report.digest", edited, 0.0, 0.0, unit="1", reference="report.json is as the run wrote it"),
    )


def file_geometry(path: Path, process: str) -> tuple[Verdict, ...]:
    """Return the geometry verdicts on a STEP, STL or 3MF file [mm] by the rules of a process."""
    from cad.checks.part_checks import check_file

    return tuple(check_file(path, PROCESSES[process]))


def folder_geometry(folder: Path) -> tuple[Verdict, ...]:
    """Return the geometry verdicts on the files of an output folder; raises InputError."""
    from cad.checks.assembly_checks import cover_verdicts
    from cad.checks.part_checks import check_file
    from cad.checks.sensor_checks import check_sensor
    from cad.fabrication.mount_checks import mount_verdicts
    from cad.files.step import read_step
    from cad.parts.assembly import sensor_of
    from pipeline.report.stored import read_report

    report = read_report(folder)
    process = report.design.process
    if report.housing is None:
        return (equal("geometry.made", 0.0, 1.0, 0.0, unit="1", reference="no housing: see printable.*"),)
    missing = ", ".join(name for name in _MEASURED if not is_regular(folder / name))
    if missing:
        return (_unreadable(f"{missing} cannot be measured, there is no such file; run the design again"),)
    sensor = sensor_of(report.design, report.housing)
    verdicts = list(check_sensor(sensor, report.deflections_mm, folder))
    names = {verdict.name for verdict in verdicts}
    verdicts += [verdict for verdict in check_file(folder / "housing.3mf", process) if verdict.name not in names]
    for name, judge in (("cover.step", cover_verdicts), ("mount.step", mount_verdicts)):
        path = folder / name
        if not is_regular(path):
            continue
        try:
            shape = read_step(path)
        except ValueError as error:
            verdicts.append(_unreadable(str(error)))
        else:
            verdicts += judge(sensor, shape, process)
    return tuple(verdicts)


def _unreadable(reason: str) -> Verdict:
    return failed("geometry.readable", "a readable file", unit="1", reference=reason)
