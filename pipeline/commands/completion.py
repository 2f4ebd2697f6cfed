"""`pipeline --print-completion SHELL`: the script by which a shell completes commands, flags and names."""

from argparse import ArgumentParser
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
        hint = f"did you mean {nearest(given, SHELLS)}?"
        raise validation_error("--print-completion", given, "", f"one of {', '.join(SHELLS)}", hint)
    import shtab

    from pipeline.report.explain.entries import entry_names

    names = {
        "--design": preset_names(),
        "named": preset_names(),
        "--process": tuple(PROCESSES),
        "--fruit-stiffness": FRUIT_STIFFNESSES,
        "--contact-method": CONTACT_METHODS,
        "--keep": tuple(every_key()),
        "name": entry_names(),
    }
    for command in parsers.values():
        for action in command._actions:  # argparse has no other list of them
            flag = action.option_strings[-1] if action.option_strings else action.dest
            if flag in names:
                action.choices = names[flag]
            elif action.type is Path or str(action.metavar).startswith(_FILE):
                kind = shtab.DIRECTORY if action.metavar in _FOLDERS else shtab.FILE
                action.complete = kind  # type: ignore[attr-defined]
    script: str = shtab.complete(parser, shell=shell)
    return script if script.endswith("\n") else f"{script}\n"
