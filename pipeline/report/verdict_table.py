"""Show verdicts in the terminal: a table, and a line with the reason for each verdict that did not pass."""

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
    """Print tables and sentences, wrapped to the width of the terminal.

    Output to a file or a pipe is `width` or else `WIDTH` characters wide, unless COLUMNS is set.
    """
    console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else width or WIDTH)
    for part in parts:
        console.print(part)


def verdict_parts(title: str, verdicts: Sequence[Verdict]) -> list[RenderableType]:
    """Return a table of the verdicts on a file or folder, and the reasons for verdicts that did not pass."""
    explained = [verdict for verdict in verdicts if verdict.passed is not True or verdict.name == READABLE]
    return [verdict_table(escape(title), verdicts), *reason_lines(explained)]


def reason_lines(verdicts: Iterable[Verdict], in_table: Callable[[Verdict], bool] = lambda _: True) -> tuple[str, ...]:
    """Return one line for each verdict, with its reason and its hint.

    If `in_table` is false for a verdict, the line also has its value and limit, because no table shows them. A hint
    that is already in an earlier line is replaced by a reference to the verdict of that line.
    """
    first_verdicts: dict[str, str] = {}  # name of the first verdict with each hint
    lines = []
    for verdict in verdicts:
        hint = ""
        if verdict.remedy is not None:
            first_verdict = first_verdicts.setdefault(verdict.remedy, verdict.name)
            is_first = first_verdict == verdict.name
            hint = f"; hint: {verdict.remedy}" if is_first else f"; hint: as for {first_verdict}"
        numbers = "" if in_table(verdict) else value_and_limit(verdict)
        lines.append(f"{OUTCOME[verdict.passed]} {verdict.name}: {escape(numbers + verdict.reference + hint)}")
    return tuple(lines)


def verdict_table(title: str, verdicts: Iterable[Verdict]) -> Table:
    """Return a table of the verdicts with value, limit, tolerance and outcome; `title` is in rich's markup."""
    headings = ("verdict", f"value, {ERRORS_IN_WORDS}", "target", "tolerance", "")
    # on a narrow terminal, words are wrapped instead of truncated
    columns = [Column(heading, overflow="fold") for heading in headings]
    table = Table(*columns, title=title or None, title_justify="left")
    for verdict in verdicts:
        outcome = OUTCOME[verdict.passed]
        if fails_unread(verdict):  # otherwise the value within its limit would not explain the failure
            outcome = f"{outcome}: {UNREAD}"
        in_units = as_read(verdict)
        table.add_row(
            in_units.name,
            measured(in_units),
            escape(limit_text(in_units, in_units.unit)),
            escape(tolerance_text(in_units)),
            outcome,
        )
    return table
