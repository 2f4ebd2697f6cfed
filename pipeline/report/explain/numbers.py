"""The number that a design has for a verdict or a symbol: from a report, or of the default design as it is sized."""

from pathlib import Path

from cad.design.parameters import Design
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.report.explain.entries import Entry
from pipeline.report.mapping import contact_keys, sizing_keys
from pipeline.report.stored import as_data, read_data, report_of
from pipeline.response.contact import fruit_compliance
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.plain import Plain

_OUTCOMES = {True: "passed", False: "failed", None: "undecided"}


def number_in(folder: Path, entry: Entry, name: str) -> str:
    """Return the number that a folder's report has for a name, with its error and unit; raises InputError.

    A report without it says so.
    """
    data = read_data(folder)
    report = report_of(folder, data)
    if not entry.is_verdict:
        return _of_symbol(data, entry) or "no number in this report"
    names = entry.each if name == entry.name and entry.each else (name,)
    words = [_of_verdict(verdict) for verdict in report.verdicts if verdict.name in names]
    return "; ".join(words) or "no verdict in this design"


def _of_verdict(verdict: Verdict) -> str:
    value = "no value" if verdict.value is None else _with_error(verdict.value, verdict.error, verdict.unit)
    limit = "" if verdict.limit is None else f", limit {verdict.limit}"
    if isinstance(verdict.limit, float):
        limit = f", limit {verdict.limit:.5g}"
    hint = "" if verdict.remedy is None else f"; {verdict.remedy}"
    return f"{verdict.name} {value}{limit}: {_OUTCOMES[verdict.passed]}{hint}"


def _of_symbol(report: Plain, entry: Entry) -> str | None:
    """Return the number at the key of an entry, None where there is none."""
    value = None if entry.key is None else _at(report, entry.key)
    if not isinstance(value, int | float):
        return None
    percent = None if entry.error_percent is None else _at(report, entry.error_percent)
    error = 0.01 * abs(value) * percent if isinstance(percent, int | float) else None
    return _with_error(value, error, entry.unit)


def _at(report: Plain, path: str) -> object:
    """Return what lies at a dotted path, parts of lists by their index; None where there is nothing."""
    value: object = report
    for key in path.split("."):
        if isinstance(value, dict):
            value = value.get(key)
        elif isinstance(value, list) and value:
            value = value[int(key)]
        else:
            return None
    return value


def _with_error(value: float, error: float | None, unit: str) -> str:
    """Return a number with its error; a unit may say after a comma of which part it is, "1" is none."""
    bar = "" if error is None else f" +- {error:.2g}"
    if unit == "1" or unit.startswith("1,"):
        return f"{value:.5g}{bar}{unit[1:]}"
    return f"{value:.5g}{bar} {unit}"


def default_number(entry: Entry) -> str | None:
    """Return the number of a symbol by the true contact of the default design, which sizes its springs.

    None for one that needs more than that.
    """
    design = Design()
    options = RunOptions()
    contact = fruit_compliance(design, options)
    sizing = spring_sizing(design, contact, options)
    report = as_data({"design": design, "springs": sizing_keys(sizing), "contact": contact_keys(contact)})
    return _of_symbol(report, entry)
