"""What was asked, what came out, and whether it passed: the one type of every judgement."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One target, what came out, and whether it passed; None where the error bar or a failed check leaves it open.

    The tolerance is a share of the limit where `relative`, else in the unit of the value. `error` is the half width of
    the value's error bar [unit of the value]; `reference` says what was compared, or why there is no number. `remedy`
    says what would make it pass, or that nothing does; None where it passed or nobody looked.
    """

    name: str
    value: float | None
    unit: str
    limit: float | str | None
    tolerance: float | str | None
    passed: bool | None
    reference: str
    error: float | None = None
    relative: bool = False
    remedy: str | None = None


def equal(name: str, value: float, limit: float, tolerance: float, *, unit: str, reference: str) -> Verdict:
    """Return a verdict that passes when the value is the limit within the tolerance [unit]; nan fails."""
    passed = bool(abs(value - limit) <= tolerance)
    return Verdict(
        name=name, value=value, unit=unit, limit=limit, tolerance=tolerance, reference=reference, passed=passed
    )


def at_least(name: str, value: float, limit: float, tolerance: float, *, unit: str, reference: str) -> Verdict:
    """Return a verdict that passes when the value reaches the limit but for the tolerance [unit]; nan fails."""
    passed = bool(value >= limit - tolerance)
    return Verdict(
        name=name, value=value, unit=unit, limit=limit, tolerance=tolerance, reference=reference, passed=passed
    )


def judged(name: str, value: float, *, passed: bool, limit: str, unit: str, reference: str) -> Verdict:
    """Return a verdict on a value [unit] whose limit is said in words, without a tolerance."""
    return Verdict(name=name, value=value, unit=unit, limit=limit, tolerance=0.0, reference=reference, passed=passed)


def failed(name: str, limit: float | str, *, unit: str, reference: str) -> Verdict:
    """Return a verdict that fails without a number; the unit is that of the limit."""
    return Verdict(name=name, value=None, unit=unit, limit=limit, tolerance=0.0, reference=reference, passed=False)


def all_passed(verdicts: Iterable[Verdict]) -> bool | None:
    """Return False when a verdict failed, None when one is undecided and none failed, else True."""
    outcomes = {verdict.passed for verdict in verdicts}
    if False in outcomes:
        return False
    return None if None in outcomes else True
