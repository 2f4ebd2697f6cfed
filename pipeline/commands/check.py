"""`pipeline check`: geometry verdicts on what lies on the disk, a whole output folder or one file of any origin."""

from argparse import ArgumentParser, Namespace
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from cad.design.processes import PROCESSES, Process
from cad.quantity import fault, nearest
from cad.verdict import Verdict, all_passed, equal, failed
from pipeline.commands.console import FAILED, PASSED, add_json_flag, print_json

if TYPE_CHECKING:
    from cad.parts.sensor import Sensor
    from pipeline.report.stored import StoredReport

PURPOSE = "judge the geometry of files, own or foreign"
EXAMPLE = "pipeline check outputs/paper"
DEFAULT_PROCESS = "fdm-petg"
_ALREADY = ("geometry.watertight", "geometry.manifold", "geometry.one_solid")
_MEASURED = ("housing.step", "housing.stl", "housing.3mf")


def add_arguments(parser: ArgumentParser) -> None:
    """Add PATH, --process and --json."""
    parser.add_argument("path", metavar="PATH", type=Path, help="an output folder, or a STEP, STL or 3MF file [mm]")
    help_text = f"process whose rules a file is judged by (default {DEFAULT_PROCESS}; a folder has its own)"
    parser.add_argument("--process", metavar="NAME", help=help_text)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Judge a folder or a file and print the verdicts; return 0 when all pass, else 1."""
    path: Path = arguments.path
    if path.is_dir():
        if arguments.process is not None:
            raise fault("--process", arguments.process, "", "left out for a folder", "its design names the process")
        verdicts = check_folder(path)
    elif path.is_file():
        verdicts = check_one_file(path, _process(arguments.process or DEFAULT_PROCESS))
    else:
        remedy = "name an output folder, or a STEP or STL file"
        raise fault("PATH", str(path), "", "an existing file or folder", remedy)
    _print(str(path), verdicts, as_json=arguments.json)
    return PASSED if all_passed(verdicts) else FAILED


def _process(name: str) -> Process:
    if name not in PROCESSES:
        raise fault(
            "--process", name, "", f"one of {', '.join(PROCESSES)}", f"did you mean {nearest(name, [*PROCESSES])}?"
        )
    return PROCESSES[name]


def _print(title: str, verdicts: tuple[Verdict, ...], *, as_json: bool) -> None:
    from cad.checks.slicer import slicer_absence
    from pipeline.report.tables import print_verdicts

    if as_json:
        print_json([asdict(verdict) for verdict in verdicts])
        return
    print_verdicts(title, verdicts)
    if slicer_absence():
        print(slicer_absence())


def check_one_file(path: Path, process: Process) -> tuple[Verdict, ...]:
    """Return the verdicts on one file by the rules of a process; raises InputError for another kind of file."""
    from cad.checks.part_checks import check_file

    return check_file(path, process)


def check_folder(folder: Path) -> tuple[Verdict, ...]:
    """Return the verdicts on an output folder: its files against the report, its solid against the design.

    Raises InputError where the report is not one of ours.
    """
    from pipeline.report.stored import read_report

    report = read_report(folder)
    changed = [file.path for file in report.files if not file.is_unchanged_in(folder)]
    named = f"files that are missing or changed since the run: {', '.join(changed) or 'none'}"
    unchanged = equal("files.unchanged", float(len(changed)), 0.0, 0.0, unit="1", reference=named)
    return (unchanged, *_check_geometry(report, folder))


def _check_geometry(report: "StoredReport", folder: Path) -> tuple[Verdict, ...]:
    """Return the verdicts on the housing of a report and on its files; a failed one where there are none."""
    from cad.checks.part_checks import check_file
    from cad.checks.sensor_checks import check_sensor
    from pipeline.stages.solids import sensor_of

    if report.housing is None:
        return (equal("geometry.made", 0.0, 1.0, 0.0, unit="1", reference="no housing: see printable.*"),)
    missing = ", ".join(name for name in _MEASURED if not (folder / name).is_file())
    if missing:
        reason = f"{missing} cannot be measured, there is no such file; run the design again"
        return (failed("geometry.readable", "a readable file", unit="1", reference=reason),)
    sensor = sensor_of(report.design, report.housing)
    process = PROCESSES[report.design.print.process]
    printed = (one for one in check_file(folder / "housing.3mf", process) if one.name not in _ALREADY)
    cover = _check_cover(folder, sensor, process)
    return (*check_sensor(sensor, report.deflections_mm, folder), *printed, *cover)


def _check_cover(folder: Path, sensor: "Sensor", process: Process) -> tuple[Verdict, ...]:
    """Return the verdicts on the cover, none in the folder of a run that made none."""
    from cad.checks.cover_checks import cover_verdicts
    from cad.checks.part_checks import unreadable
    from cad.files.step import read_step

    path = folder / "cover.step"
    if not path.is_file():
        return ()
    try:
        cover = read_step(path)
    except ValueError as error:
        return (unreadable(error),)
    return cover_verdicts(sensor, cover, process)
