"""Verdicts as a table, and a line for each that did not pass."""

from collections.abc import Iterable, Sequence

from rich.markup import escape

from cad.verdict import Verdict
from pipeline.report.answer.answer import AnswerPart, AnswerTable, print_answer
from pipeline.report.verdict_rule import UNREAD, bound_sign, fails_unread

OUTCOME = {True: "[green]passed[/]", False: "[red]failed[/]", None: "[yellow]undecided[/]"}
_HEADS = ("verdict", "value", "± error", "target", "tolerance", "")
_SPARE = ("tolerance", "± error")


def print_verdicts(title: str, verdicts: Sequence[Verdict]) -> None:
    """Print the verdicts on a file or folder as a table, and why each that did not pass did not."""
    wrong = [verdict for verdict in verdicts if verdict.passed is not True]
    print_answer([AnswerPart(table=verdict_table(escape(title), verdicts), lines=reasons(wrong))])


def reasons(verdicts: Iterable[Verdict]) -> tuple[str, ...]:
    """Return one line for every verdict, which ends with its remedy.

    A remedy that a line before has told is named by the verdict of that line.
    """
    told: dict[str, str] = {}
    lines = []
    for verdict in verdicts:
        remedy = ""
        if verdict.remedy is not None:
            first = told.setdefault(verdict.remedy, verdict.name)
            remedy = f"; remedy: {verdict.remedy if first == verdict.name else f'as for {first}'}"
        lines.append(f"{OUTCOME[verdict.passed]} {verdict.name}: {escape(verdict.reference + remedy)}")
    return tuple(lines)


def verdict_table(title: str, verdicts: Iterable[Verdict], last_row: tuple[str, ...] | None = None) -> AnswerTable:
    """Return the table of verdicts under a title in rich's markup.

    `last_row` stands for verdicts that are not listed, one text for each column.
    """
    rows = [_row(verdict) for verdict in verdicts]
    if last_row is not None:
        rows.append(last_row)
    return AnswerTable(title=title, heads=_HEADS, rows=tuple(rows), spare=_SPARE)


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
