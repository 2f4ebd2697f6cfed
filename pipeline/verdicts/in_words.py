"""A verdict in words: its numbers as text, with the sign of a limit that bounds its value on one side."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from sensor.quantity import COVERAGE
from sensor.verdict import Verdict
from sensor.words import ROUND_OFF, shown, with_bar

ERRORS_IN_WORDS = "± holds 95 %"
"""What stands once over everything that a person reads; files keep standard uncertainties."""
UNREAD = "some poses have no reading"
"""Why a verdict on readings fails whose value keeps the limit: the value is that of the other poses."""


def headline(name: str, verdicts: Sequence[Verdict]) -> str:
    """Return the answer on a design of a name in one sentence."""
    counts = Counter(verdict.passed for verdict in verdicts)
    if counts[False]:
        return f"No: {name} fails {counts[False]} of {len(verdicts)} verdicts in the scene asked for."
    if counts[None]:
        return f"Not decided: {counts[None]} of {len(verdicts)} verdicts of {name} lie within their own error bars."
    return f"Yes: {name} passes all {len(verdicts)} verdicts in the scene asked for."


def is_on_the_part(verdict: Verdict) -> bool:
    """Say whether a verdict is on the part and its print, not on targets and readings."""
    return verdict.row.group != "target"


def not_passed(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return the verdicts that did not pass, those that failed first."""
    return sorted((one for one in verdicts if not one.passed), key=lambda one: one.passed is None)


def as_read(verdict: Verdict) -> Verdict:
    """Return a verdict as a person reads it: a fraction in per cent, an uncertainty at 95 %, the limit likewise."""
    row = verdict.row
    if row.shown is None:
        return verdict
    factor = 100.0 * (COVERAGE if row.standard else 1.0)
    numbers: dict[str, Any] = {"unit": row.shown}
    for key in ("value", "error", "limit", "tolerance"):
        number = getattr(verdict, key)
        if isinstance(number, int | float):
            numbers[key] = number if key == "tolerance" and verdict.relative else factor * number
    return replace(verdict, **numbers)


def measured(verdict: Verdict) -> str:
    """Return the value of a verdict ± its bar, with its unit; nothing without a value."""
    value = verdict.value
    return "" if value is None else with_bar(0.0 if abs(value) < ROUND_OFF else value, verdict.error, verdict.unit)


def bound_sign(verdict: Verdict) -> str:
    """Return the sign that stands before a limit which bounds its value on one side; an empty text before others."""
    return {"at most": "≤ ", "at least": "≥ "}.get(verdict.limit_sense or "", "")


def limit_text(verdict: Verdict, unit: str) -> str:
    """Return the target or limit of a verdict with a unit, its sign before it where it bounds the value on one side."""
    return bound_sign(verdict) + shown(verdict.limit, unit)


def tolerance_text(verdict: Verdict) -> str:
    """Return the tolerance of a verdict, in per cent where it is relative; nothing where it has none."""
    if verdict.relative and isinstance(verdict.tolerance, int | float):
        return shown(100.0 * verdict.tolerance, "%")
    return "" if verdict.tolerance == 0.0 else shown(verdict.tolerance, verdict.unit)


def fails_unread(verdict: Verdict) -> bool:
    """Say whether a verdict on readings fails though its value keeps the limit: for poses that have no reading."""
    if verdict.passed is not False or verdict.value is None or not isinstance(verdict.limit, int | float):
        return False
    return verdict.row.needs == "reading" and verdict.limit - verdict.value > (verdict.error or 0.0)
