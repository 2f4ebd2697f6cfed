"""Completion of commands, flags and names with the Tab key; shtab generates the scripts from a parser."""

import argparse
from collections.abc import Callable
from typing import Any

import shtab

from pipeline.options import preset_names
from sensor.design.processes import PROCESSES

SHELLS = ("bash", "zsh", "fish")
# For each argument whose value is a name, the function that returns the known names.
_NAMES: dict[str, Callable[[], tuple[str, ...]]] = {
    "named": preset_names,
    "design": preset_names,
    "process": lambda: tuple(PROCESSES),
}
_FOLDERS = ("DIR", "OUT")  # placeholders of values that are folders


class CompletedParser(argparse.ArgumentParser):
    """A parser that completes preset and process names from lists, and leaves paths to the shell."""

    def add_argument(self, *names: Any, **options: Any) -> argparse.Action:  # noqa: ANN401 - as in argparse
        """Add an argument, and determine from its name or its placeholder how the shell completes its value."""
        action = super().add_argument(*names, **options)
        if action.dest in _NAMES:
            action.choices = _NAMES[action.dest]()
        elif isinstance(action.metavar, str) and action.metavar in _FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]  # shtab reads this attribute
        elif isinstance(action.metavar, str) and "." in action.metavar:  # a file name, such as FILE.csv
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        return action


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the script that completes the commands and flags of a parser in a shell."""
    return shtab.complete(parser, shell)
