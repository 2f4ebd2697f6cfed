"""`pipeline design`: a run that also writes the files for fabrication, or the list of print processes."""

from argparse import Namespace
from collections.abc import Iterator

from pipeline.options import load_design
from twintip.commands import run as whole_run
from twintip.commands.console import Answer


def run(arguments: Namespace) -> Answer | Iterator[Answer]:
    """Run the design and write its files for fabrication, or list the print processes."""
    if not arguments.list_processes:
        return whole_run.run(arguments)
    from twintip.commands.processes import process_list  # imports rich, which is not needed to reject wrong input

    return process_list(load_design(whole_run.named_design(arguments), whole_run.collect_settings(arguments)).printer)
