"""`pipeline check`: verdicts on what lies on the disk, a whole output folder or one file of any origin."""

from argparse import ArgumentParser, Namespace
from dataclasses import asdict
from pathlib import Path

from pipeline.commands.console import FAILED, PASSED, add_json_flag, answering, print_json, showing_progress
from sensor.design.processes import PROCESSES
from sensor.quantity import nearest, validation_error
from sensor.verdict import all_passed

PURPOSE = "judge the geometry of files, own or foreign"
EXAMPLE = "pipeline check outputs/paper"
DEFAULT_PROCESS = "fdm-petg"
FILE_KINDS = (".step", ".stp", ".stl", ".3mf")


def add_arguments(parser: ArgumentParser) -> None:
    """Add PATH, --process and --json."""
    parser.add_argument("path", metavar="PATH", type=Path, help="an output folder, or a STEP, STL or 3MF file [mm]")
    help_text = f"process whose rules a file is judged by (default {DEFAULT_PROCESS}; a folder has its own)"
    parser.add_argument("--process", metavar="NAME", help=help_text)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Judge a folder or a file and print the verdicts; return 0 when all pass, else 1."""
    from pipeline.report.check import check_path
    from pipeline.report.verdict_table import print_verdicts

    path: Path = arguments.path
    process = _process(path, arguments.process)
    with showing_progress(f"reads and judges {path.name}", quiet=arguments.json):
        verdicts = check_path(path.absolute(), process)
    with answering():
        if arguments.json:
            print_json([asdict(verdict) for verdict in verdicts])
        else:
            print_verdicts(str(path), verdicts)
    return PASSED if all_passed(verdicts) else FAILED


def _process(path: Path, name: str | None) -> str | None:
    """Return the process whose rules a file is judged by, None for a folder; raises InputError."""
    if path.is_dir():
        if name is not None:
            raise validation_error(
                "--process",
                name,
                "",
                "left out for a folder",
                "leave it out: the design of the folder names the process",
            )
        return None
    if not path.is_file():
        hint = "name an output folder, or a STEP, STL or 3MF file"
        raise validation_error("PATH", str(path), "", "an existing file or folder", hint)
    if path.suffix.lower() not in FILE_KINDS:
        kinds = ", ".join(FILE_KINDS)
        raise validation_error("PATH", path.name, "", f"a file of kind {kinds}", "export the part as one of these")
    name = name or DEFAULT_PROCESS
    if name not in PROCESSES:
        bound = f"one of {', '.join(PROCESSES)}"
        raise validation_error("--process", name, "", bound, f"did you mean {nearest(name, [*PROCESSES])}?")
    return name
