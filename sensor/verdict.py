"""What was asked, what came out, and whether it passed: the one type of every judgement."""

from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Literal

from sensor.quantity import report_field

Sense = Literal["at most", "at least"]
"""On which side a limit bounds a value."""

SENSES: dict[str, Sense] = {
    "reading.*": "at most",
    "unit.uncertainty": "at most",
    "bruise": "at most",
    "sideways.*": "at least",
    "geometry.*_clearance": "at least",
    "geometry.*_over_fruit": "at least",
    "geometry.stops_*": "at least",
    "geometry.deflected_gap_*": "at least",
    "geometry.as_designed": "at most",
    "geometry.plates": "at least",
    "geometry.tip_face": "at most",
    "geometry.min_wall": "at least",
    "geometry.min_gap": "at least",
    "geometry.overhang": "at most",
    "geometry.magnet_pockets": "at least",
    "geometry.sensor_windows": "at least",
}
"""The sense of a verdict by its name, since report.json holds no sense. Any other value must meet its limit."""


def sense_of(name: str) -> Sense | None:
    """Return the side on which the limit of a named verdict bounds its value; None for a target."""
    return next((sense for pattern, sense in SENSES.items() if fnmatchcase(name, pattern)), None)


READABLE = "geometry.readable"
_A_FILE = "a readable file"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One target, what came out, and whether it passed; None where the error bar or a failed check leaves it open."""

    name: str = report_field("", "name of the verdict, see [verdicts](words.md#verdicts)")
    value: float | None = report_field("as in `unit`", "the number that is judged; null where there is no number")
    unit: str = report_field("", 'unit of value, limit and error; "1" for a plain number')
    limit: float | str | None = report_field("as in `unit`", "the target or the limit, a number or words")
    tolerance: float | str | None = report_field(
        "as in `unit`",
        "largest deviation of the value from the limit; a fraction of the limit where `relative` is true",
    )
    passed: bool | None = report_field("", "true, false, or null if the error bar does not decide")
    reference: str = report_field(
        "", "what the value was compared with; why there is no number, or why the verdict did not pass"
    )
    error: float | None = report_field("as in `unit`", "half width of the value's error bar", default=None)
    relative: bool = report_field("", "true where the tolerance is a fraction of the limit", default=False)
    remedy: str | None = report_field(
        "",
        "a change that would make the verdict pass, or the advice to run `pipeline suggest`; null where it "
        "passed or where no hint was computed",
        default=None,
    )

    @property
    def sense(self) -> Sense | None:
        """Return the side on which the limit bounds the value; None for a target, which both sides may miss."""
        return sense_of(self.name)

    @property
    def limit_sense(self) -> Sense | None:
        """Return the sense where the limit is a number; None for a limit in words too."""
        return self.sense if isinstance(self.limit, int | float) else None


def one_sided(verdict: Verdict, sense: Sense) -> Verdict:
    """Return a verdict that was judged on one side of its limit; raises ValueError unless SENSES names that side."""
    if verdict.sense != sense:
        msg = f"verdict {verdict.name}: SENSES in sensor/verdict.py must say {sense!r}, not {verdict.sense!r}"
        raise ValueError(msg)
    return verdict


def equal(name: str, value: float, limit: float, tolerance: float, *, unit: str, reference: str) -> Verdict:
    """Return a verdict that passes when the value is the limit within the tolerance [unit]; nan fails."""
    passed = bool(abs(value - limit) <= tolerance)
    return Verdict(
        name=name, value=value, unit=unit, limit=limit, tolerance=tolerance, reference=reference, passed=passed
    )


def at_least(name: str, value: float, limit: float, tolerance: float, *, unit: str, reference: str) -> Verdict:
    """Return a verdict that passes when the value reaches the limit but for the tolerance [unit]; nan fails."""
    passed = bool(value >= limit - tolerance)
    verdict = Verdict(
        name=name, value=value, unit=unit, limit=limit, tolerance=tolerance, reference=reference, passed=passed
    )
    return one_sided(verdict, "at least")


def value_verdict(name: str, value: float, *, passed: bool, limit: str, unit: str, reference: str) -> Verdict:
    """Return a verdict on a value [unit] whose limit is said in words, without a tolerance."""
    return Verdict(name=name, value=value, unit=unit, limit=limit, tolerance=0.0, reference=reference, passed=passed)


def failed_verdict(name: str, limit: float | str, *, unit: str, reference: str) -> Verdict:
    """Return a verdict that fails without a number; the unit is that of the limit."""
    return Verdict(name=name, value=None, unit=unit, limit=limit, tolerance=0.0, reference=reference, passed=False)


def unreadable(reason: str) -> Verdict:
    """Return the failed verdict geometry.readable with the reason why a file cannot be read."""
    return failed_verdict(READABLE, _A_FILE, unit="1", reference=reason)


def all_passed(verdicts: Iterable[Verdict]) -> bool | None:
    """Return False when a verdict failed, None when one is undecided and none failed, else True."""
    outcomes = {verdict.passed for verdict in verdicts}
    if False in outcomes:
        return False
    return None if None in outcomes else True
