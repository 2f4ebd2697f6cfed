"""By which rule each verdict of a report passes, from its name: what `check` holds a stored outcome against."""

from fnmatch import fnmatchcase

from cad.quantity import Estimate
from cad.verdict import Verdict
from pipeline.report.mapping import STIFFNESS_VERDICTS
from pipeline.verdicts.rules import margin_verdict, target_verdict

Outcomes = tuple[bool | None, ...]
ANY: Outcomes = (True, False, None)
_NOT_PASSED: Outcomes = (False, None)
_RULES = {
    **dict.fromkeys(("P_max", "NL", *STIFFNESS_VERDICTS), "target, if made"), "P_displacement_independent": "target",
    "P_monotonic": "above 0", "sideways.*": "at least", "bruise": "at most",
    "reading.lift": "at least", "reading.*": "at most, if read",
    "geometry.frame_clearance": "reaches", "geometry.neck_clearance": "reaches", "geometry.stops_*": "reaches",
    "geometry.deflected_gap_*": "reaches", "geometry.cover_clearance": "reaches",
    "geometry.mount_clearance": "reaches", "geometry.mount_over_fruit": "reaches",
    "geometry.cover_over_fruit": "reaches", "geometry.fillets": "reaches",
    "geometry.plates": "reaches", "geometry.tip_face": "at most", "geometry.*": "equal",
}  # fmt: skip
"""The rule of each name, of which the first that fits decides; `*` stands for the rest of a name."""
UNREAD = "some poses have no reading"
"""Why a verdict on readings fails whose value keeps the limit: the value is that of the other poses."""


def outcome_of(verdict: Verdict) -> Outcomes:
    """Return the outcomes that value, limit, tolerance and error of a verdict allow; all where no rule is known."""
    rule = _rule_of(verdict.name)
    if verdict.value is None:
        return _NOT_PASSED
    if rule == "above 0":
        return (verdict.value > 0.0,)
    limit, tolerance = verdict.limit, verdict.tolerance
    if rule is None or not isinstance(limit, int | float) or not isinstance(tolerance, int | float):
        return ANY
    if rule == "equal":
        return (bool(abs(verdict.value - limit) <= tolerance),)
    if rule == "reaches":
        return (bool(verdict.value >= limit - tolerance),)
    estimate = Estimate(verdict.value, verdict.error or 0.0, verdict.unit)
    if rule.startswith("target"):
        found = target_verdict(verdict.name, estimate, limit, tolerance, "", relative=verdict.relative).passed
        # Springs that were not made leave their targets undecided, whatever the numbers.
        return (found, None) if rule == "target, if made" else (found,)
    held = margin_verdict(verdict.name, estimate, limit, "", at_most=rule.startswith("at most")).passed
    # A pose without a reading fails what the others reach.
    return (held, False) if rule == "at most, if read" else (held,)


def bound_sense(verdict: Verdict) -> str | None:
    """Return "at most" or "at least" for a verdict whose limit is a number that bounds its value on one side."""
    rule = _rule_of(verdict.name) or ""
    if not isinstance(verdict.limit, int | float):
        return None
    if rule.startswith("at most"):
        return "at most"
    return "at least" if rule in ("at least", "reaches") else None


def bound_sign(verdict: Verdict) -> str:
    """Return the sign that stands before a limit which bounds its value on one side; an empty text before others."""
    return {"at most": "≤ ", "at least": "≥ "}.get(bound_sense(verdict) or "", "")


def fails_unread(verdict: Verdict) -> bool:
    """Say whether a verdict on readings fails though its value keeps the limit: for poses that have no reading."""
    return verdict.passed is False and outcome_of(verdict) == (True, False)


def _rule_of(name: str) -> str | None:
    return next((rule for pattern, rule in _RULES.items() if fnmatchcase(name, pattern)), None)
