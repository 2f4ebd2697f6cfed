"""The number that a design has for a verdict or a symbol: from a report, or of the springs of the default design."""

from pathlib import Path

from cad.design.parameters import Design
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.report.explain.entries import Entry
from pipeline.report.stored import read_data, report_of
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
        return _of_symbol(data, entry)
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


def _of_symbol(report: Plain, entry: Entry) -> str:
    value = None if entry.key is None else _at(report, entry.key)
    if not isinstance(value, int | float):
        return "no number in this report"
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


def default_numbers() -> dict[str, str]:
    """Return by name what a run has for the default design, with its unit: true contact, and springs sized by it."""
    design = Design()
    targets = design.nominal_targets
    options = RunOptions()
    sizing = spring_sizing(design, fruit_compliance(design, options), options)
    springs = sizing.springs
    return {
        "E": f"{design.fruit.E_max_MPa:g} MPa, the firmest fruit of the range",
        "nu": f"{design.fruit.poisson:g}",
        "K_m": f"{1e3 * sizing.K_m_max:.5g} N/m",
        "K_l": f"{1e3 * springs.K_l:.5g} N/m",
        "K_h": f"{1e3 * springs.K_h:.5g} N/m",
        "P": f"{targets.P_max:.4g} at the largest modulus",
        "P_max": f"{targets.P_max:.4g}",
        "NL": f"{targets.NL:.4g}",
        "x": f"{design.press.travel_mm:g} mm, full travel",
        "spacing": f"{design.tips.spacing_mm:g} mm",
        "tip": f"{design.tips.side_mm:g} mm, its side",
    }
