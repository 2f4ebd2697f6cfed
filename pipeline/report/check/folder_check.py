"""The verdicts on an output folder: files against report, report against itself, solid against design."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file, unreadable
from cad.checks.sensor_checks import check_sensor
from cad.design.processes import Process
from cad.fabrication.mount_checks import mount_verdicts
from cad.files.step import read_step
from cad.parts.assembly import sensor_of
from cad.parts.sensor import Sensor
from cad.verdict import Verdict, equal, failed
from pipeline.report.check.agreement import report_verdicts
from pipeline.report.stored import StoredReport, read_data, refused, report_of
from pipeline.storage.seal import is_regular

Judge = Callable[[Sensor, Any, Process], tuple[Verdict, ...]]
_ALREADY = ("geometry.watertight", "geometry.manifold", "geometry.one_solid")
_MEASURED = ("housing.step", "housing.stl", "housing.3mf")


def check_folder(folder: Path) -> tuple[Verdict, ...]:
    """Return the verdicts of `folder_verdicts`."""
    return tuple(folder_verdicts(folder))


def folder_verdicts(folder: Path) -> Iterator[Verdict]:
    """Yield the verdicts on an output folder, those on files and report first: reading a part may end the process.

    Raises InputError where the report is not one of ours.
    """
    data = read_data(folder)
    report = report_of(folder, data)
    changed = [file.path for file in report.files if not file.is_unchanged_in(folder)]
    named = f"files that are missing or changed since the run: {', '.join(changed) or 'none'}"
    yield equal("files.unchanged", float(len(changed)), 0.0, 0.0, unit="1", reference=named)
    try:
        yield from report_verdicts(data, report.design, report.housing)
    except ValueError as error:
        raise refused(folder, f"its report.json must be as it was written ({error})") from error
    geometry = []
    for verdict in _check_geometry(report, folder):
        geometry.append(verdict)
        yield verdict
    yield _geometry_as_reported(data["verdicts"], geometry)


def _geometry_as_reported(reported: Sequence[dict[str, object]], measured: Sequence[Verdict]) -> Verdict:
    """Return report.geometry: how many verdicts of the report on the part have another outcome when measured again."""
    again = {verdict.name: verdict.passed for verdict in measured}
    outcomes = {str(one["name"]): one["passed"] for one in reported if str(one["name"]).startswith("geometry.")}
    different = [name for name, passed in outcomes.items() if again.get(name, passed) is not passed]
    if measured and not outcomes:
        different.append("geometry.*")
    reference = f"verdicts on the part that differ from those of the report: {', '.join(different) or 'none'}"
    return equal("report.geometry", float(len(different)), 0.0, 0.0, unit="1", reference=reference)


def _check_geometry(report: StoredReport, folder: Path) -> Iterator[Verdict]:
    """Yield the verdicts on the housing of a report and on its files; a failed one where there are none."""
    if report.housing is None:
        yield equal("geometry.made", 0.0, 1.0, 0.0, unit="1", reference="no housing: see printable.*")
        return
    missing = ", ".join(name for name in _MEASURED if not is_regular(folder / name))
    if missing:
        reason = f"{missing} cannot be measured, there is no such file; run the design again"
        yield failed("geometry.readable", "a readable file", unit="1", reference=reason)
        return
    sensor = sensor_of(report.design, report.housing)
    process = report.design.process
    yield from check_sensor(sensor, report.deflections_mm, folder)
    yield from (one for one in check_file(folder / "housing.3mf", process) if one.name not in _ALREADY)
    yield from _check_made(folder / "cover.step", sensor, process, cover_verdicts)
    yield from _check_made(folder / "mount.step", sensor, process, mount_verdicts)


def _check_made(path: Path, sensor: Sensor, process: Process, judge: Judge) -> tuple[Verdict, ...]:
    """Return the verdicts on cover or bracket, none in the folder of a run that made none."""
    if not is_regular(path):
        return ()
    try:
        shape = read_step(path)
    except ValueError as error:
        return (unreadable(error),)
    return judge(sensor, shape, process)
