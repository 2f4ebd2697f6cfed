"""`pipeline explain`: what a verdict, a symbol or a key of report.json means, its source, and this design's number."""

import shutil
import sys
import textwrap
from argparse import ArgumentParser, Namespace
from dataclasses import asdict
from pathlib import Path

from sensor.quantity import validation_error
from twintip.commands.console import PASSED, add_json_flag, answering, print_json

PURPOSE = "say what a verdict, a symbol or a key of report.json means"
EXAMPLE = "pipeline explain NL --out outputs/paper"
_WIDTH = 100


def add_arguments(parser: ArgumentParser) -> None:
    """Add NAME, --out and --json."""
    add = parser.add_argument
    add(
        "name",
        metavar="NAME",
        nargs="?",
        help="a verdict, a symbol or a key of report.json; without it verdicts and symbols are listed",
    )
    add("--out", metavar="DIR", type=Path, help="an output folder, whose number is told too")
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Print what a name means, or the list of names; return 0.

    Raises InputError for an unknown name, and for a folder without a name.
    """
    from pipeline.report.explain.entries import entry_of

    folder = arguments.out
    if arguments.name is None:
        if folder is not None:
            bound = "left out without a NAME"
            raise validation_error("--out", str(folder), "", bound, "name what its number is asked of")
        with answering():
            _print_list(arguments)
        return PASSED
    entry = entry_of(arguments.name)
    number = None
    if folder is not None:
        from pipeline.report.explain.numbers import number_in

        number = number_in(folder, entry, arguments.name)
    with answering():
        if arguments.json:
            print_json({**asdict(entry), "number": number})
            return PASSED
        _print_wrapped("", f"{arguments.name}: {entry.meaning}")
        if entry.formula:
            _print_wrapped("formula: ", entry.formula)
        _print_wrapped("source: ", entry.source)
        if number is not None:
            _print_wrapped(f"{folder}: ", number)
        else:
            print("add --out DIR to see its value in that run")
    return PASSED


def _print_list(arguments: Namespace) -> None:
    """Print every name with the first sentence, or question, of its meaning."""
    from pipeline.report.explain.entries import entries

    if arguments.json:
        print_json([asdict(entry) for entry in entries()])
        return
    for entry in entries():
        _print_wrapped(f"{entry.name}: ", _first_sentence(entry.meaning))


def _first_sentence(text: str) -> str:
    """Return the first sentence of a text, or its first question where that ends before."""
    sentence, stop, _ = text.partition(". ")
    question, mark, _ = sentence.partition("?")
    return question + mark if mark else sentence + stop.strip()


def _print_wrapped(head: str, text: str) -> None:
    """Print a text in lines as wide as the terminal, or as 100 letters where there is none; no word is cut."""
    width = shutil.get_terminal_size((_WIDTH, 24)).columns if sys.stdout.isatty() else _WIDTH
    lines = textwrap.wrap(
        head + text, width=max(20, width), subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )
    print("\n".join(lines))
