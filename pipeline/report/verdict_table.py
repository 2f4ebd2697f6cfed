"""Verdicts as a table that fits the terminal, and a line for each that did not pass."""

import os
import sys
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cad.verdict import Verdict
from pipeline.report.verdict_rule import UNREAD, bound_sign, fails_unread

WIDTH = 132
OUTCOME = {True: "[green]passed[/]", False: "[red]failed[/]", None: "[yellow]undecided[/]"}
_HEADS = ("verdict", "value", "± error", "target", "tolerance", "")
_LEAVES_OUT = ((), ("tolerance",), ("tolerance", "± error"))
"""Columns that a narrow terminal does without, the wider ones first."""
_ENDLESS = 10_000
_IN_ASCII = {"≤": "at most", "≥": "at least", "± ": "+- ", "·": "-"}


def print_verdicts(title: str, verdicts: Sequence[Verdict]) -> None:
    """Print the verdicts on a file or folder as a table, and why each that did not pass did not."""
    console = wide_console()
    print_verdict_table(console, escape(title), verdicts)
    print_reasons(console, [verdict for verdict in verdicts if verdict.passed is not True])


def wide_console() -> Console:
    """Return a console as wide as the terminal, or as COLUMNS says; without either wide enough for the tables."""
    columns = os.environ.get("COLUMNS", "")
    asked = int(columns) if columns.isdecimal() and int(columns) > 0 else WIDTH
    return Console(width=None if sys.stdout.isatty() else asked)


def print_line(console: Console, text: str) -> None:
    """Print a sentence in rich's markup, wrapped between words."""
    console.print(in_letters_of(console, text))


def in_letters_of(console: Console, text: str) -> str:
    """Return a text in the letters that the output has: signs as words where it takes ASCII only."""
    if console.options.ascii_only:
        for sign, word in _IN_ASCII.items():
            text = text.replace(sign, word)
    return text


def print_reasons(console: Console, verdicts: Iterable[Verdict]) -> None:
    """Print one line for every verdict, which ends with its remedy; a remedy that was told is named by its verdict."""
    told: dict[str, str] = {}
    for verdict in verdicts:
        remedy = ""
        if verdict.remedy is not None:
            first = told.setdefault(verdict.remedy, verdict.name)
            remedy = f"; remedy: {verdict.remedy if first == verdict.name else f'as for {first}'}"
        print_line(console, f"{OUTCOME[verdict.passed]} {verdict.name}: {escape(verdict.reference + remedy)}")


def print_verdict_table(
    console: Console, title: str, verdicts: Sequence[Verdict], last_row: Sequence[str] | None = None
) -> None:
    """Print the table of verdicts under a title in rich's markup, without columns that the terminal has no room for.

    `last_row` stands for verdicts that are not listed, one text for each column of the whole table.
    """
    for left_out in _LEAVES_OUT:
        table = _verdict_table(console, title, verdicts, last_row, left_out)
        if _width(console, table) <= console.width:
            break
    print_table(console, table)


def print_table(console: Console, table: Table) -> None:
    """Print a table; where the terminal is too narrow for it row by row, each cell after the name of its column."""
    if _width(console, table) <= console.width:
        console.print(table)
        return
    if table.title:
        print_line(console, str(table.title))
    heads = [str(column.header) for column in table.columns]
    for row in zip(*(column.cells for column in table.columns), strict=True):
        cells = [f"{head} {cell}".strip() for head, cell in zip(heads[1:], row[1:], strict=True) if cell]
        print_line(console, f"{row[0]}: {', '.join(cells)}")


def _width(console: Console, table: Table) -> int:
    """Return how many columns of a terminal a table takes that nothing squeezes."""
    return console.measure(table, options=console.options.update(width=_ENDLESS)).maximum


def _verdict_table(
    console: Console, title: str, verdicts: Sequence[Verdict], last_row: Sequence[str] | None, left_out: Sequence[str]
) -> Table:
    places = [place for place, head in enumerate(_HEADS) if head not in left_out]
    heads = [in_letters_of(console, _HEADS[place]) for place in places]
    table = Table(*heads, title=title or None, title_justify="left")
    for row in (*(_row(verdict) for verdict in verdicts), *([last_row] if last_row else [])):
        table.add_row(*(in_letters_of(console, row[place]) for place in places))
    return table


def _row(verdict: Verdict) -> tuple[str, ...]:
    return (
        verdict.name,
        shown(verdict.value, verdict.unit),
        shown(verdict.error),
        bound_sign(verdict) + shown(verdict.limit),
        _tolerance(verdict),
        f"{OUTCOME[verdict.passed]}: {UNREAD}" if fails_unread(verdict) else OUTCOME[verdict.passed],
    )


def shown(value: float | str | None, unit: str = "") -> str:
    """Return a number with five digits and its unit, or a text; nothing for None."""
    text = "" if value is None else f"{value:.5g}" if isinstance(value, int | float) else escape(value)
    return f"{text} {unit}" if text and unit not in ("", "1") else text


def _tolerance(verdict: Verdict) -> str:
    if verdict.relative and isinstance(verdict.tolerance, float):
        return f"{100.0 * verdict.tolerance:.5g} %"
    return shown(verdict.tolerance)
