"""Verdicts as a table, and a line for each that did not pass."""

import sys
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cad.verdict import Verdict

WIDTH = 132
OUTCOME = {True: "[green]passed[/]", False: "[red]failed[/]", None: "[yellow]undecided[/]"}


def print_verdicts(title: str, verdicts: Sequence[Verdict]) -> None:
    """Print the verdicts on a file or folder as a table, and why each that did not pass did not."""
    console = wide_console()
    console.print(verdict_table(escape(title), verdicts))
    print_reasons(console, [verdict for verdict in verdicts if verdict.passed is not True])


def wide_console() -> Console:
    """Return a console as wide as the terminal, or wide enough for the tables where there is none."""
    return Console(width=None if sys.stdout.isatty() else WIDTH)


def print_reasons(console: Console, verdicts: Iterable[Verdict]) -> None:
    """Print one line for every verdict."""
    for verdict in verdicts:
        console.print(f"{OUTCOME[verdict.passed]} {verdict.name}: {escape(verdict.reference)}")


def verdict_table(title: str, verdicts: Sequence[Verdict]) -> Table:
    """Return the table of verdicts under a title in rich's markup."""
    table = Table("verdict", "value", "± error", "target", "tolerance", "", title=title or None, title_justify="left")
    for verdict in verdicts:
        table.add_row(
            verdict.name,
            shown(verdict.value, verdict.unit),
            shown(verdict.error),
            shown(verdict.limit),
            _tolerance(verdict),
            OUTCOME[verdict.passed],
        )
    return table


def shown(value: float | str | None, unit: str = "") -> str:
    """Return a number with five digits and its unit, or a text; nothing for None."""
    text = "" if value is None else f"{value:.5g}" if isinstance(value, int | float) else escape(value)
    return f"{text} {unit}" if text and unit not in ("", "1") else text


def _tolerance(verdict: Verdict) -> str:
    if verdict.relative and isinstance(verdict.tolerance, float):
        return f"{100.0 * verdict.tolerance:.5g} %"
    return shown(verdict.tolerance)
