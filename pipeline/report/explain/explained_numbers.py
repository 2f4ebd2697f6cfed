"""The number in a report for a verdict or a symbol."""

from pathlib import Path

from pipeline.report.explain.entries import Entry
from pipeline.report.keys import value_at
from pipeline.report.report import read_report
from pipeline.verdicts.in_words import as_read, measured
from sensor.verdict import Verdict
from sensor.words import OUTCOMES, shown, with_bar


def number_in(folder: Path, entry: Entry, name: str) -> str:
    """Return the number in a folder's report for a name, as text with its error and unit; raises InputError.

    If the report has none, the text says so.
    """
    report = read_report(folder)
    if not entry.is_verdict:
        return _of_symbol(report, entry) or "no number in this report"
    names = entry.each if name == entry.name and entry.each else (name,)
    words = [_of_verdict(verdict) for verdict in report.verdicts if verdict.name in names]
    return "; ".join(words) or "no verdict in this design"


def _of_verdict(verdict: Verdict) -> str:
    read = as_read(verdict)
    limit = "" if read.limit is None else f", limit {shown(read.limit, read.unit)}"
    hint = "" if verdict.remedy is None else f"; {verdict.remedy}"
    return f"{verdict.name} {measured(read) or 'no value'}{limit}: {OUTCOMES[verdict.passed]}{hint}"


def _of_symbol(report: object, entry: Entry) -> str | None:
    """Return the number at the key of an entry as text, or None."""
    value = None if entry.key is None else _at(report, entry.key)
    if not isinstance(value, int | float):
        return None
    percent = None if entry.error_percent is None else _at(report, entry.error_percent)
    error = 0.01 * abs(value) * percent if isinstance(percent, int | float) else None
    part = f", {entry.part}" if entry.part else ""
    return f"{with_bar(value, error, entry.unit)}{part}"


def _at(report: object, key: str) -> object:
    """Return the value at a key of a report or of its parts, or None."""
    try:
        return value_at(report, key)
    except KeyError:
        return None
