"""The text of verdicts: their values and limits, with a sign before a one-sided limit."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from sensor.quantity import COVERAGE
from sensor.verdict import Verdict
from sensor.words import ROUND_OFF, value_text, value_with_bar

NUMERICAL = "± numerical error"
"""The statement above a table of solved values, whose error bars leave out the scatter of prints."""
MEASURED = "± holds 95 %"
"""The statement above a table of measured values, whose error bars cover 95 %. Files contain standard uncertainties."""
UNREAD = "some poses have no reading"
"""Why a verdict on readings may fail although its value is within the limit: the value leaves out these poses."""


def overall_sentence(name: str, verdicts: Sequence[Verdict]) -> str:
    """Return the overall result of a design as a sentence that begins with Yes, No or Not decided."""
    counts = Counter(verdict.passed for verdict in verdicts)
    scene = "for the fruit and the press of its design file"
    if counts[False]:
        return f"No: {name} fails {counts[False]} of {len(verdicts)} verdicts, {scene}."
    if counts[None]:
        return f"Not decided: {counts[None]} of {len(verdicts)} verdicts of {name} lie within their own error bars."
    return f"Yes: {name} passes all {len(verdicts)} verdicts, {scene}."


def is_on_the_part(verdict: Verdict) -> bool:
    """Return whether a verdict judges the part and its print, instead of targets and readings."""
    return verdict.row.group != "target"


def failed_or_undecided(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return the verdicts that did not pass, with failed verdicts before undecided ones."""
    problems = [verdict for verdict in verdicts if not verdict.passed]
    return sorted(problems, key=lambda verdict: verdict.passed is None)  # False sorts before True


def in_display_units(verdict: Verdict) -> Verdict:
    """Convert a verdict to display units: fractions to per cent, and standard uncertainties to 95 % coverage.

    The value, its error, the limit and an absolute tolerance are multiplied by the same factor. A verdict that is not a
    fraction is returned unchanged.
    """
    row = verdict.row
    if row.shown is None:  # `shown` is the unit in which a fraction is displayed
        return verdict
    factor = 100.0 * (COVERAGE if row.standard else 1.0)  # `standard` marks a standard uncertainty
    keys = ["value", "error", "limit"]
    if not verdict.relative:  # a relative tolerance is a fraction of the limit, so it does not depend on the unit
        keys.append("tolerance")
    converted: dict[str, Any] = {"unit": row.shown}
    for key in keys:
        number = getattr(verdict, key)
        if isinstance(number, int | float):  # a value may be missing, and a limit may be a text
            converted[key] = factor * number
    return replace(verdict, **converted)


def measured(verdict: Verdict) -> str:
    """Return the value of a verdict with its error bar and its unit, or an empty string without a value."""
    if verdict.value is None:
        return ""
    value = 0.0 if abs(verdict.value) < ROUND_OFF else verdict.value  # so that round-off is not shown
    return value_with_bar(value, verdict.error, verdict.unit)


def bound_sign(verdict: Verdict) -> str:
    """Return the sign before a one-sided limit, or an empty string for other limits."""
    return {"at most": "≤ ", "at least": "≥ "}.get(verdict.limit_sense or "", "")


def limit_text(verdict: Verdict, unit: str) -> str:
    """Return the target or the limit of a verdict with its unit, after the sign of a one-sided limit."""
    return bound_sign(verdict) + value_text(verdict.limit, unit)


def value_and_limit(verdict: Verdict) -> str:
    """Return the value of a verdict with its error bar and its limit, as text before the reason of the verdict.

    The string is empty without a value, and also if the limit is a text, because the reason then explains it.
    """
    if verdict.value is None or isinstance(verdict.limit, str):
        return ""
    in_units = in_display_units(verdict)
    return f"{measured(in_units)}, must be {limit_text(in_units, in_units.unit)}; "


def tolerance_text(verdict: Verdict) -> str:
    """Return the tolerance of a verdict, in per cent if it is relative, or an empty string if it has none."""
    if verdict.relative and isinstance(verdict.tolerance, int | float):
        return value_text(100.0 * verdict.tolerance, "%")
    return "" if verdict.tolerance == 0.0 else value_text(verdict.tolerance, verdict.unit)


def fails_only_by_unread_poses(verdict: Verdict) -> bool:
    """Return whether a verdict on readings fails only because some poses have no reading.

    The value of such a verdict is within the limit, even at the upper end of its error bar.
    """
    if verdict.passed is not False or verdict.value is None or not isinstance(verdict.limit, int | float):
        return False
    return verdict.row.needs == "reading" and verdict.limit - verdict.value > (verdict.error or 0.0)
