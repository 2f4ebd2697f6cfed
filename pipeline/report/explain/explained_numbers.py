"""Show the value that a verdict or a symbol has in a report."""

from pathlib import Path

from pipeline.report.explain.entries import Entry
from pipeline.report.keys import value_at
from pipeline.report.report import read_report
from pipeline.verdicts.in_words import in_display_units, measured
from sensor.verdict import Verdict
from sensor.words import OUTCOMES, unit_suffix, value_text, value_with_bar


def explained_value(folder: Path, entry: Entry, name: str) -> str:
    """Return the value of a verdict or a symbol in a folder's report as text, with error bar and unit.

    `name` is the name that the user typed, which may be one of several names of the `entry`. If the report has no such
    value, the text states this. Raises InputError if the folder has no valid report.
    """
    report = read_report(folder)
    if not entry.is_verdict:
        return _symbol_text(report, entry) or "no number in this report"
    # The name of an entry for several verdicts, such as printable.*, selects all of them.
    names = entry.each if name == entry.name and entry.each else (name,)
    texts = [_verdict_text(verdict) for verdict in report.verdicts if verdict.name in names]
    return "; ".join(texts) or "no verdict in this design"


def _verdict_text(verdict: Verdict) -> str:
    """Return the value, the limit, the outcome, the reference and the hint of a verdict as text."""
    displayed = in_display_units(verdict)
    limit = "" if displayed.limit is None else f", limit {value_text(displayed.limit, displayed.unit)}"
    outcome = OUTCOMES[verdict.passed]
    hint = "" if verdict.remedy is None else f"; {verdict.remedy}"
    return f"{verdict.name} {measured(displayed) or 'no value'}{limit}: {outcome}, {verdict.reference}{hint}"


def _symbol_text(report: object, entry: Entry) -> str | None:
    """Return the value of a symbol as text, with its error bar and its part; None if the report has no such value.

    A list of numbers has neither an error bar nor a part.
    """
    value = None if entry.key is None else _value_or_none(report, entry.key)
    if isinstance(value, tuple):
        text = _list_text(value)
        return None if text is None else text + unit_suffix(entry.unit)
    if not isinstance(value, int | float):
        return None
    percent = None if entry.error_percent is None else _value_or_none(report, entry.error_percent)
    error = 0.01 * abs(value) * percent if isinstance(percent, int | float) else None
    part = f", {entry.part}" if entry.part else ""
    return f"{value_with_bar(value, error, entry.unit)}{part}"


def _list_text(values: tuple[object, ...]) -> str | None:
    """Return a list of numbers as text, or None if it is empty or holds anything else.

    Each row of a matrix is in brackets. A number without a value is shown as null, as in report.json.
    """
    texts = []
    for value in values:
        if isinstance(value, tuple):
            texts.append(f"[{_list_text(value) or ''}]")
        elif value is None or isinstance(value, int | float):
            texts.append(value_text(value, absent="null"))
        else:
            return None
    return ", ".join(texts) or None


def _value_or_none(report: object, key: str) -> object:
    """Return the value at a dotted key of a report, or None if the report has no such key."""
    try:
        return value_at(report, key)
    except KeyError:
        return None
