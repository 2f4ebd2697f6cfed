"""The number that a design has for a verdict or a symbol, from the report of its output folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from cad.verdict import Verdict
from pipeline.report.explain.entries import Entry
from pipeline.report.stored import read_data, refused
from pipeline.storage.plain import Plain, from_plain, value_at


def number_in(folder: Path, entry: Entry, name: str) -> str:
    """Return the number that a folder's report has for a name, with its error and unit; raises InputError.

    A report without it says so.
    """
    report = read_data(folder)
    try:
        return _of_verdict(report, entry, name) if entry.is_verdict else _of_symbol(report, entry)
    except ValueError as error:
        raise refused(folder, f"its report.json must be as it was written ({error})") from error


def _of_verdict(report: Plain, entry: Entry, name: str) -> str:
    stored = from_plain(tuple[Verdict, ...], value_at(report, "verdicts"), "verdicts")
    names = entry.each if name == entry.name and entry.each else (name,)
    those = [verdict for verdict in stored if verdict.name in names]
    return "; ".join(_in_words(verdict) for verdict in those) or "not judged in this design"


def _in_words(verdict: Verdict) -> str:
    outcome = {True: "passed", False: "failed", None: "undecided"}[verdict.passed]
    limit = "" if verdict.limit is None else f", limit {_shown(verdict.limit)}"
    remedy = "" if verdict.remedy is None else f"; {verdict.remedy}"
    value = "no value" if verdict.value is None else _with_error(verdict.value, verdict.error, verdict.unit)
    return f"{verdict.name} {value}{limit}: {outcome}{remedy}"


def _of_symbol(report: Plain, entry: Entry) -> str:
    value = None if entry.key is None else _at(report, entry.key)
    if not isinstance(value, int | float):
        return "no number in this report"
    percent = None if entry.error_percent is None else _at(report, entry.error_percent)
    error = 0.01 * abs(value) * percent if isinstance(percent, int | float) else None
    return _with_error(value, error, entry.unit)


def _at(report: Plain, key: str) -> object:
    """Return what lies at a key, parts of lists by their place; None where there is nothing."""
    value: object = report
    for part in key.split("."):
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, Sequence) and value and not isinstance(value, str):
            value = value[int(part)]
        else:
            return None
    return value


def _shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.5g}"


def _with_error(value: float, error: float | None, unit: str) -> str:
    bar = "" if error is None else f" +- {error:.2g}"
    plain, _, place = unit.partition(",")
    shown = "" if plain == "1" else f" {plain}"
    return f"{value:.5g}{bar}{shown}{',' + place if place else ''}"
