"""Verdicts as a table for the terminal, and a line with the reason for each that did not pass."""

import os
import sys
from collections.abc import Callable, Iterable, Sequence

from rich.console import Console, RenderableType
from rich.markup import escape
from rich.table import Column, Table

from pipeline.verdicts.in_words import (
    ERRORS_IN_WORDS,
    UNREAD,
    as_read,
    fails_unread,
    limit_text,
    measured,
    tolerance_text,
    value_and_limit,
)
from sensor.verdict import READABLE, Verdict
from sensor.words import OUTCOMES

WIDTH = 132
_COLOURS = {True: "green", False: "red", None: "yellow"}
OUTCOME = {passed: f"[{_COLOURS[passed]}]{word}[/]" for passed, word in OUTCOMES.items()}


def print_parts(parts: Iterable[RenderableType], width: int | None = None) -> None:
    """Print tables and sentences in the width of the terminal.

    Output that goes to a file or a pipe has the given `width`, or `WIDTH`, unless COLUMNS is set [characters].
    """
    console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else width or WIDTH)
    for part in parts:
        console.print(part)


def verdict_parts(title: str, verdicts: Sequence[Verdict]) -> list[RenderableType]:
    """Return the verdicts on a file or folder as a table, with reasons for those that did not pass."""
    explained = [verdict for verdict in verdicts if verdict.passed is not True or verdict.name == READABLE]
    return [verdict_table(escape(title), verdicts), *reasons(explained)]


def reasons(verdicts: Iterable[Verdict], in_table: Callable[[Verdict], bool] = lambda _: True) -> tuple[str, ...]:
    """Return one line for each verdict, with its reason and its hint.

    A verdict for which `in_table` is false has its value and limit in the line, because no table shows them. A hint
    that an earlier line gave is replaced by the name of that line's verdict.
    """
    first_with: dict[str, str] = {}  # for each hint, the first verdict that has it
    lines = []
    for verdict in verdicts:
        hint = ""
        if verdict.remedy is not None:
            first = first_with.setdefault(verdict.remedy, verdict.name)
            hint = f"; hint: {verdict.remedy if first == verdict.name else f'as for {first}'}"
        numbers = "" if in_table(verdict) else value_and_limit(verdict)
        lines.append(f"{OUTCOME[verdict.passed]} {verdict.name}: {escape(numbers + verdict.reference + hint)}")
    return tuple(lines)


def verdict_table(title: str, verdicts: Iterable[Verdict]) -> Table:
    """Return the verdicts as a table with value, limit, tolerance and outcome; `title` is in rich's markup."""
    heads = ("verdict", f"value, {ERRORS_IN_WORDS}", "target", "tolerance", "")
    columns = [Column(head, overflow="fold") for head in heads]  # a narrow terminal wraps a word and truncates none
    table = Table(*columns, title=title or None, title_justify="left")
    for verdict in verdicts:
        outcome = OUTCOME[verdict.passed]
        in_units = as_read(verdict)
        table.add_row(
            in_units.name,
            measured(in_units),
            escape(limit_text(in_units, in_units.unit)),
            escape(tolerance_text(in_units)),
            f"{outcome}: {UNREAD}" if fails_unread(verdict) else outcome,
        )
    return table
