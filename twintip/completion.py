"""Completion of commands, flags and names by the Tab key, with scripts that shtab makes from a parser."""

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
    """A parser whose arguments are completed: presets and processes by their names, paths by the shell."""

    def add_argument(self, *names: Any, **given: Any) -> argparse.Action:  # noqa: ANN401 - as argparse has it
        """Add an argument with its completion."""
        action = super().add_argument(*names, **given)
        if action.dest in _NAMES:
            action.choices = _NAMES[action.dest]()
        elif isinstance(action.metavar, str) and action.metavar in _FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]  # shtab looks for it
        elif isinstance(action.metavar, str) and "." in action.metavar:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        return action


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the script that completes the words of a parser in a shell."""
    return shtab.complete(parser, shell)
