"""Geometry verdicts on what lies on the disk: a whole output folder, or one file of any origin."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cad.checks.sensor_checks import check_file, check_sensor
from cad.checks.slicer import slicer_absence
from cad.design.design_file import design_from_mapping
from cad.design.processes import PROCESSES, Process
from cad.files.step import read_step
from cad.parts.cover import cover_findings
from cad.parts.sensor import Sensor
from cad.quantity import InputError, fault
from cad.verdict import Verdict, equal
from pipeline.report.mapping import file_digest
from pipeline.report.tables import print_findings
from pipeline.stages.kept import housing_from
from pipeline.stages.solids import sensor_of

_ALREADY = ("geometry.watertight", "geometry.manifold", "geometry.one_solid")
_REMEDY = "name an output folder, or a STEP or STL file"


def check(path: Path, *, as_json: bool) -> int:
    """Judge a folder or a file and print the findings; return 0 when all pass, else 1. Raises InputError."""
    findings = check_folder(path) if path.is_dir() else _check_one(path)
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings], indent=1, allow_nan=False))
    else:
        print_findings(str(path), findings)
        if slicer_absence():
            print(slicer_absence())
    return 0 if all(finding.passed is True for finding in findings) else 1


def _check_one(path: Path) -> tuple[Verdict, ...]:
    if not path.is_file():
        raise fault("PATH", str(path), "", "an existing file or folder", _REMEDY)
    return check_file(path)


def check_folder(folder: Path) -> tuple[Verdict, ...]:
    """Return the findings on an output folder: its files against the report, its solid against the design.

    Raises InputError where the report is not one of ours.
    """
    report = _report(folder)
    try:
        return _findings(folder, report)
    except (AttributeError, KeyError, TypeError) as error:
        reason = f"{error.__class__.__name__} {error}"
        msg = f"PATH = {str(folder)!r}: its report.json must be as it was written ({reason}); run the design again"
        raise InputError(msg) from error


def _findings(folder: Path, report: dict[str, Any]) -> tuple[Verdict, ...]:
    changed = [entry["path"] for entry in report["files"] if not _is_unchanged(folder, entry)]
    named = f"files that are missing or changed since the run: {', '.join(changed) or 'none'}"
    files = equal("files.unchanged", float(len(changed)), 0.0, 0.0, unit="1", reference=named)
    declared = report["housing"]
    if declared is None:
        return (files, equal("geometry.made", 0.0, 1.0, 0.0, unit="1", reference="no housing: see printable.*"))
    housing = housing_from(declared)
    design = design_from_mapping(report["design"])
    sensor = sensor_of(design, housing)
    low, high = report["deflections_mm"]
    process = PROCESSES[design.print.process]
    printed = tuple(one for one in check_file(folder / "housing.3mf", process) if one.name not in _ALREADY)
    return (files, *check_sensor(sensor, (low, high), folder), *printed, *_cover(folder, sensor, process))


def _cover(folder: Path, sensor: Sensor, process: Process) -> tuple[Verdict, ...]:
    """Return the findings on the cover, none in the folder of a run that made none."""
    path = folder / "cover.step"
    return cover_findings(sensor, read_step(path), process) if path.is_file() else ()


def _report(folder: Path) -> dict[str, Any]:
    try:
        report: Any = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = (
            f"PATH = {str(folder)!r}: must hold a report.json that can be read ({error.__class__.__name__}); {_REMEDY}"
        )
        raise InputError(msg) from error
    if not isinstance(report, dict):
        msg = f"PATH = {str(folder)!r}: its report.json must be an object; run the design again"
        raise InputError(msg)
    for key in ("files", "design", "housing", "deflections_mm"):
        if key not in report:
            msg = f"PATH = {str(folder)!r}: its report.json must have the key {key!r}; run the design again"
            raise InputError(msg)
    return dict(report)


def _is_unchanged(folder: Path, entry: dict[str, str]) -> bool:
    path = folder / entry["path"]
    inside = path.resolve().is_relative_to(folder.resolve())
    return inside and path.is_file() and file_digest(path) == entry["sha256"]
