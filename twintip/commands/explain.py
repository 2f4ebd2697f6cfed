"""`pipeline explain`: the meaning and source of a verdict, a symbol or a key of report.json, and its value in a run."""

import shutil
import sys
import textwrap
from argparse import Namespace
from dataclasses import asdict

from pipeline.report.explain.entries import entries, find_entry
from pipeline.report.explain.explained_numbers import explained_value
from sensor.quantity import validation_error
from twintip.commands.console import PASSED, Answer

_WIDTH = 100  # [characters], if the width of the terminal is not known
_LEAST_WIDTH = 20  # [characters]; a narrower terminal wraps the lines itself


def run(arguments: Namespace) -> Answer:
    """Explain a verdict, a symbol or a key of report.json, or list all verdicts and symbols if no name is given.

    With `--out`, the answer also contains the value in the report of this folder. Raises InputError for an unknown
    name, or if a folder is given without a name.
    """
    folder = arguments.out
    if arguments.name is None:
        if folder is not None:
            bound = "left out unless NAME is given"
            raise validation_error(
                "--out", str(folder), "", bound, "name the verdict, symbol or key whose value you want"
            )
        return _list_entries()
    entry = find_entry(arguments.name)
    value_text = None if folder is None else explained_value(folder, entry, arguments.name)
    lines = [_wrap("", f"{arguments.name}: {entry.meaning}")]
    if entry.formula:
        lines.append(_wrap("formula: ", entry.formula))
    lines.append(_wrap("source: ", entry.source))
    if value_text is None:
        lines.append("add --out DIR to see its value in that run")
    else:
        lines.append(_wrap(f"{folder}: ", value_text))
    return Answer(code=PASSED, data={**asdict(entry), "number": value_text}, text="\n".join(lines))


def _list_entries() -> Answer:
    """Return a list of all verdicts and symbols, each with the first sentence of its meaning."""
    lines = [_wrap(f"{entry.name}: ", _first_sentence(entry.meaning)) for entry in entries()]
    return Answer(code=PASSED, data=[asdict(entry) for entry in entries()], text="\n".join(lines))


def _first_sentence(text: str) -> str:
    """Return the first sentence or question of a text, whichever ends earlier."""
    # A sentence ends with a full stop and a space, because a full stop also occurs inside numbers and file names.
    sentence, stop, _ = text.partition(". ")
    question, mark, _ = sentence.partition("?")
    return question + mark if mark else sentence + stop.strip()


def _wrap(label: str, text: str) -> str:
    """Wrap a label and a text to the width of the terminal, without breaking words. Later lines are indented.

    If stdout is not a terminal, or the width of the terminal is not known, lines have at most 100 characters.
    """
    width = _WIDTH
    if sys.stdout.isatty():
        width = shutil.get_terminal_size((_WIDTH, 24)).columns  # the fallback needs a number of lines, here 24
    lines = textwrap.wrap(
        label + text,
        width=max(_LEAST_WIDTH, width),
        subsequent_indent="    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines)
