"""Show verdicts in the terminal: a table, and a line with the reason for each verdict that did not pass."""

import os
import sys
from collections.abc import Callable, Iterable, Sequence

from rich.console import Console, RenderableType
from rich.markup import escape
from rich.table import Column, Table

from pipeline.verdicts.in_words import (
    NUMERICAL,
    UNREAD,
    fails_only_by_unread_poses,
    in_display_units,
    limit_text,
    measured,
    tolerance_text,
    value_and_limit,
)
from sensor.verdict import READABLE, Verdict
from sensor.words import OUTCOMES

WIDTH = 132  # default width of output that does not go to a terminal [characters]
_COLOURS = {True: "green", False: "red", None: "yellow"}
OUTCOME = {passed: f"[{_COLOURS[passed]}]{word}[/]" for passed, word in OUTCOMES.items()}


def print_parts(parts: Iterable[RenderableType], width: int | None = None) -> None:
    """Print tables and sentences, wrapped to the width of the terminal.

    Output to a file or a pipe is `width` characters wide, or `WIDTH` by default. The environment variable COLUMNS
    overrides both.
    """
    console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else width or WIDTH)
    for part in parts:
        console.print(part)


def verdict_parts(title: str, verdicts: Sequence[Verdict], errors: str = NUMERICAL) -> list[RenderableType]:
    """Return a table of the verdicts on a file or folder, and the reasons for verdicts that did not pass.

    The heading of the values says by `errors` which errors their bars hold.
    """
    explained = [verdict for verdict in verdicts if verdict.passed is not True or verdict.name == READABLE]
    return [verdict_table(escape(title), verdicts, errors), *reason_lines(explained)]


def reason_lines(verdicts: Iterable[Verdict], in_table: Callable[[Verdict], bool] = lambda _: True) -> tuple[str, ...]:
    """Return one line for each verdict, with its reason and its hint.

    `in_table` returns whether a table shows the value and the limit of a verdict; if not, the line shows them. A hint
    that is already in an earlier line is replaced by the name of the earlier verdict.
    """
    first_verdicts: dict[str, str] = {}  # name of the first verdict with each hint, keyed by hint
    lines = []
    for verdict in verdicts:
        hint = ""
        if verdict.remedy is not None:
            first_verdict = first_verdicts.setdefault(verdict.remedy, verdict.name)
            is_first = first_verdict == verdict.name
            hint_text = verdict.remedy if is_first else f"as for {first_verdict}"
            hint = f"; hint: {hint_text}"
        numbers = "" if in_table(verdict) else value_and_limit(verdict)
        lines.append(f"{OUTCOME[verdict.passed]} {verdict.name}: {escape(numbers + verdict.reference + hint)}")
    return tuple(lines)


def verdict_table(title: str, verdicts: Iterable[Verdict], errors: str = NUMERICAL) -> Table:
    """Return a table of the verdicts with value, limit, tolerance and outcome; `title` is in rich's markup.

    Values are in display units, with error bars that hold 95 %. `errors` says in the heading which errors they are.
    """
    headings = ("verdict", f"value, {errors}", "target", "tolerance", "")
    # On a narrow terminal, "fold" wraps long words instead of truncating them.
    columns = [Column(heading, overflow="fold") for heading in headings]
    table = Table(*columns, title=title or None, title_justify="left")
    for verdict in verdicts:
        outcome = OUTCOME[verdict.passed]
        if fails_only_by_unread_poses(verdict):
            # The value of this verdict is within its limit, so the value does not explain the failure.
            outcome = f"{outcome}: {UNREAD}"
        displayed = in_display_units(verdict)
        table.add_row(
            displayed.name,
            measured(displayed),
            escape(limit_text(displayed, displayed.unit)),
            escape(tolerance_text(displayed)),
            outcome,
        )
    return table
