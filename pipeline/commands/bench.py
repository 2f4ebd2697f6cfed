"""`pipeline bench`: speed against error on this machine, or the hard cases."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from pipeline.commands.console import add_force_flag, add_json_flag
from pipeline.commands.progress_line import showing_progress
from pipeline.storage.interruption import interruptible

PURPOSE = "measure speed against error on this machine"
EXAMPLE = "pipeline bench"


def add_arguments(parser: ArgumentParser) -> None:
    """Add --hard, --out, --force and --json."""
    parser.add_argument("--hard", action="store_true", help="solve the hard cases instead; exit code 1 if one is wrong")
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder of the tables (default outputs/bench)")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Measure, or solve the hard cases; return the exit code."""
    place = {} if arguments.out is None else {"out": arguments.out}
    if arguments.hard:
        from pipeline.bench.hard.suite import hard

        with interruptible(), showing_progress("hard cases", quiet=arguments.json):
            return hard(as_json=arguments.json, force=arguments.force, **place)
    from pipeline.bench.bench import bench

    with interruptible(), showing_progress("speed against error", quiet=arguments.json):
        return bench(as_json=arguments.json, force=arguments.force, **place)
