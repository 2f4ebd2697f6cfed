"""`pipeline doctor`: whether this machine has what the commands need."""

from argparse import ArgumentParser, Namespace

PURPOSE = "look whether this machine has what the commands need"
EXAMPLE = "pipeline doctor"


def add_arguments(_parser: ArgumentParser) -> None:
    """Add nothing."""


def execute(_arguments: Namespace) -> int:
    """Print what this machine has; return 0, or 2 when something that every run needs is missing."""
    from pipeline.commands.machine import print_examination

    return print_examination()
