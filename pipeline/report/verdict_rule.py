"""On which side the limit of a verdict bounds its value, from its name."""

from fnmatch import fnmatchcase

from cad.verdict import Verdict

UNREAD = "some poses have no reading"
"""Why a verdict on readings fails whose value keeps the limit: the value is that of the other poses."""

_SENSES = (
    ("reading.lift", "at least"), ("reading.*", "at most"), ("bruise", "at most"), ("sideways.*", "at least"),
    ("geometry.*_clearance", "at least"), ("geometry.*_over_fruit", "at least"), ("geometry.stops_*", "at least"),
    ("geometry.deflected_gap_*", "at least"), ("geometry.fillets", "at least"), ("geometry.plates", "at least"),
    ("geometry.tip_face", "at most"),
)  # fmt: skip


def bound_sense(verdict: Verdict) -> str | None:
    """Return "at most" or "at least" for a verdict whose limit is a number that bounds its value on one side."""
    if not isinstance(verdict.limit, int | float):
        return None
    return next((sense for pattern, sense in _SENSES if fnmatchcase(verdict.name, pattern)), None)


def bound_sign(verdict: Verdict) -> str:
    """Return the sign that stands before a limit which bounds its value on one side; an empty text before others."""
    return {"at most": "≤ ", "at least": "≥ "}.get(bound_sense(verdict) or "", "")


def fails_unread(verdict: Verdict) -> bool:
    """Say whether a verdict on readings fails though its value keeps the limit: for poses that have no reading."""
    if verdict.passed is not False or verdict.value is None or not isinstance(verdict.limit, int | float):
        return False
    at_most = verdict.name.startswith("reading.") and verdict.name != "reading.lift"
    return at_most and verdict.limit - verdict.value > (verdict.error or 0.0)
