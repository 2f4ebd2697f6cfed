"""What one check found: a number against its limit, or a reason why there is none."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One verdict on a geometry; passed is None where the check could not be made, and the reference says why."""

    name: str
    value: float | None
    unit: str
    limit: float | str
    tolerance: float
    passed: bool | None
    reference: str


def equal(name: str, value: float, limit: float, tolerance: float, *, unit: str, reference: str) -> Finding:
    """Return a finding that passes when the value is the limit within the tolerance; nan fails."""
    return Finding(
        name=name, value=value, unit=unit, limit=limit, tolerance=tolerance, reference=reference,
        passed=bool(abs(value - limit) <= tolerance),
    )  # fmt: skip


def at_least(name: str, value: float, limit: float, tolerance: float, *, unit: str, reference: str) -> Finding:
    """Return a finding that passes when the value reaches the limit but for the tolerance; nan fails."""
    return Finding(
        name=name, value=value, unit=unit, limit=limit, tolerance=tolerance, reference=reference,
        passed=bool(value >= limit - tolerance),
    )  # fmt: skip


def failed(name: str, limit: float | str, *, unit: str, reference: str) -> Finding:
    """Return a finding that fails without a number."""
    return Finding(name=name, value=None, unit=unit, limit=limit, tolerance=0.0, passed=False, reference=reference)
