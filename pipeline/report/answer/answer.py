"""What a command answers: sentences and tables as text, printed as wide as the terminal is."""

import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

WIDTH = 132
_ENDLESS = 10_000
_IN_ASCII = {"≤": "at most", "≥": "at least", "± ": "+- ", "·": "-"}


@dataclass(frozen=True, kw_only=True)
class AnswerTable:
    """A table of texts in rich's markup.

    `spare` names columns that a narrow terminal does without, the first to go first.
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""
    spare: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class AnswerPart:
    """A table, where there is one, and sentences in rich's markup below it."""

    table: AnswerTable | None = None
    lines: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RunAnswer:
    """Whether a run passed, None where that is undecided, its answer on one screen, and the one with every table."""

    passed: bool | None
    summary: tuple[AnswerPart, ...]
    everything: tuple[AnswerPart, ...]


def print_answer(parts: Iterable[AnswerPart]) -> None:
    """Print the parts of an answer, one below the other."""
    console = _wide_console()
    for part in parts:
        if part.table is not None:
            _print_table(console, part.table)
        for line in part.lines:
            _print_line(console, line)


def next_steps(folder: Path) -> AnswerPart:
    """Return where the files of a run are, and what to do with them."""
    out, page = escape(str(folder)), escape(str(folder / "report.html"))
    return AnswerPart(
        lines=(
            f"files in {out}: response.csv is the table P -> E, report.json has every number",
            f"look at it: open {page} in a browser, or pipeline view {out}",
            "all verdicts, errors and notes: --verbose",
        )
    )


def _wide_console() -> Console:
    """Return a console as wide as the terminal, or as COLUMNS says; without either wide enough for the tables."""
    columns = os.environ.get("COLUMNS", "")
    asked = int(columns) if columns.isdecimal() and int(columns) > 0 else WIDTH
    return Console(width=None if sys.stdout.isatty() else asked)


def _print_line(console: Console, text: str) -> None:
    """Print a sentence, wrapped between words."""
    console.print(_in_letters_of(console, text))


def _in_letters_of(console: Console, text: str) -> str:
    """Return a text in the letters that the output has: signs as words where it takes ASCII only."""
    if console.options.ascii_only:
        for sign, word in _IN_ASCII.items():
            text = text.replace(sign, word)
    return text


def _print_table(console: Console, table: AnswerTable) -> None:
    """Print a table without the columns that the terminal has no room for; where it still is too narrow, row by row.

    Of a row each cell comes after the name of its column.
    """
    for count in range(len(table.spare) + 1):
        drawn = _drawn(console, table, table.spare[:count])
        if console.measure(drawn, options=console.options.update(width=_ENDLESS)).maximum <= console.width:
            console.print(drawn)
            return
    if drawn.title:
        _print_line(console, str(drawn.title))
    heads = [str(column.header) for column in drawn.columns]
    for row in zip(*(column.cells for column in drawn.columns), strict=True):
        cells = [f"{head} {cell}".strip() for head, cell in zip(heads[1:], row[1:], strict=True) if cell]
        _print_line(console, f"{row[0]}: {', '.join(cells)}")


def _drawn(console: Console, table: AnswerTable, left_out: Iterable[str]) -> Table:
    places = [place for place, head in enumerate(table.heads) if head not in left_out]
    heads = [_in_letters_of(console, table.heads[place]) for place in places]
    drawn = Table(*heads, title=table.title or None, title_justify="left")
    for row in table.rows:
        drawn.add_row(*(_in_letters_of(console, row[place]) for place in places))
    return drawn
