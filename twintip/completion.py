"""Completion of commands, flags and names by the Tab key: the parser of which shtab makes a script for a shell."""

import argparse
from collections.abc import Callable
from typing import Any

import shtab

from pipeline.options import preset_names
from sensor.design.processes import PROCESSES

SHELLS = ("bash", "zsh", "fish")
_NAMES: dict[str, Callable[[], tuple[str, ...]]] = {
    "named": preset_names,
    "design": preset_names,
    "process": lambda: tuple(PROCESSES),
}
_FOLDERS = ("DIR", "OUT")


class CompletedParser(argparse.ArgumentParser):
    """A parser whose places for a preset or a process are completed by their names, those for a path by paths."""

    def add_argument(self, *names: Any, **given: Any) -> argparse.Action:  # noqa: ANN401 - as argparse has it
        """Add an argument, and say how it is completed."""
        action = super().add_argument(*names, **given)
        if action.dest in _NAMES:
            action.choices = _NAMES[action.dest]()
        elif isinstance(action.metavar, str) and action.metavar in _FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]  # shtab looks for it
        elif isinstance(action.metavar, str) and "." in action.metavar:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        return action


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the script with which a shell completes the words of a parser."""
    return shtab.complete(parser, shell)
