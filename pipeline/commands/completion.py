"""`pipeline --print-completion SHELL`: the script by which a shell completes commands, flags and names."""

from argparse import Action, ArgumentParser
from collections.abc import Mapping, Sequence
from pathlib import Path

from cad.design.design_file import every_key
from cad.design.processes import PROCESSES
from cad.quantity import nearest, validation_error
from pipeline.options import CONTACT_METHODS, FRUIT_STIFFNESSES, preset_names

SHELLS = ("bash", "zsh", "tcsh")
_FOLDERS = ("DIR", "OUT")
_FILE = "FILE"


def completion(parser: ArgumentParser, parsers: Mapping[str, ArgumentParser], words: Sequence[str]) -> str:
    """Return the completion script of the shell that the words name; raises InputError for any other.

    The parsers are for this only: from here on they know the names that each flag takes.
    """
    shell = words[0] if words else ""
    if shell not in SHELLS or len(words) > 1:
        given = " ".join(words)
        raise validation_error(
            "--print-completion", given, "", f"one of {', '.join(SHELLS)}", f"did you mean {_close(given)}?"
        )
    import shtab

    names = _names()
    for each in parsers.values():
        for action in each._actions:  # argparse has no other list of them
            key = _key(action)
            if key in names:
                action.choices = names[key]
            elif action.type is Path or str(action.metavar).startswith(_FILE):
                kind = shtab.DIRECTORY if action.metavar in _FOLDERS else shtab.FILE
                action.complete = kind  # type: ignore[attr-defined]
    script: str = shtab.complete(parser, shell=shell)
    return script if script.endswith("\n") else f"{script}\n"


def _close(given: str) -> str:
    return nearest(given, SHELLS)


def _key(action: Action) -> str:
    """Return the long flag of an action, or the name of a positional one."""
    return next((flag for flag in action.option_strings if flag.startswith("--")), action.dest)


def _names() -> dict[str, tuple[str, ...]]:
    """Return by flag the names that it takes."""
    from pipeline.report.explain.entries import entry_names

    return {
        "--design": preset_names(),
        "named": preset_names(),
        "--process": tuple(PROCESSES),
        "--fruit-stiffness": FRUIT_STIFFNESSES,
        "--contact-method": CONTACT_METHODS,
        "--keep": tuple(every_key()),
        "name": entry_names(),
    }
