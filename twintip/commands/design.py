"""`pipeline design`: the run with what a maker needs beside it, or the list of print processes."""

from argparse import ArgumentParser, Namespace

from pipeline.options import load_design
from twintip.commands import run

PURPOSE = "make the files for fabrication and judge their geometry"
EXAMPLE = "pipeline design"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the flags of a run and --list-processes."""
    run.add_run_flags(parser)
    parser.set_defaults(fabrication=True)
    parser.add_argument("--list-processes", action="store_true", help="print the print processes and leave")


def execute(arguments: Namespace) -> int:
    """Run the design with its files for fabrication; return the exit code."""
    if arguments.list_processes:
        from twintip.commands.processes import list_processes

        own = load_design(run.named_design(arguments), run.settings_of(arguments)).printer
        return list_processes(own, as_json=arguments.json)
    return run.execute(arguments)
