"""The answer of a run as text for the page."""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple

from cad.fabrication.sheet_templates import EACH
from cad.parts.housing import Housing
from pipeline.report.report import Report
from pipeline.storage.record_data import fields_by_key, value_at_key
from pipeline.verdicts.in_words import measured
from sensor.verdict import Verdict

BILL = "bom.csv"  # file name of the bill of materials
_READING_ERRORS = ("reading.bias", "reading.uncertainty")
_MIN_DIGITS, _MAX_DIGITS = 2, 5  # significant digits of a reading error; if even more are needed, it gets six
_MASS = f" g{EACH}"  # suffix of the entry `size` of a printed part in the bill of materials


class Dimension(NamedTuple):
    """A dimension of the part: its name, its value [mm] as text, and its meaning."""

    name: str
    size: str
    meaning: str


def short_value(verdict: Verdict) -> str:
    """Return the value of a verdict with its unit, with as few digits as the outcome allows; empty without a value.

    The bias and the uncertainty of readings are given to two digits, or more if the rounded value would be on the other
    side of the limit. All other values, and the values of undecided verdicts, have an error bar.
    """
    value, limit = verdict.value, verdict.limit
    is_decided_error = verdict.name in _READING_ERRORS and verdict.passed is not None
    if value is None or not is_decided_error or not isinstance(limit, int | float):
        return measured(verdict)
    for digits in range(_MIN_DIGITS, _MAX_DIGITS + 1):
        text = f"{value:.{digits}g}"
        is_on_same_side = (float(text) <= limit) == (value <= limit)
        if is_on_same_side:
            return f"{text} {verdict.unit}"
    return f"{value:g} {verdict.unit}"  # six digits


class Closest(NamedTuple):
    """A verdict that passed, and the fraction of its limit that its value uses [1]."""

    verdict: Verdict
    fraction: float


def closest_to_limit(verdicts: Iterable[Verdict]) -> Closest | None:
    """Return the passed verdict that uses the largest fraction of a one-sided limit; None without such a limit."""
    candidates = []
    for verdict in verdicts:
        fraction = _used_fraction(verdict) if verdict.passed else None
        if fraction is not None:
            candidates.append(Closest(verdict, fraction))
    return max(candidates, key=lambda candidate: candidate.fraction, default=None)


def _used_fraction(verdict: Verdict) -> float | None:
    """Return the fraction of its limit that a verdict uses [1].

    The fraction is value / limit for an upper limit, and limit / value for a lower limit. The result is None without a
    one-sided limit. If the value or the limit is not positive, the fraction has no meaning, so the result is None too.
    """
    value, limit = verdict.value, verdict.limit
    if value is None or not isinstance(limit, int | float) or min(value, limit) <= 0.0:
        return None
    if verdict.limit_sense == "at most":
        return value / limit
    return limit / value if verdict.limit_sense == "at least" else None


def dimensions(report: Report) -> list[Dimension]:
    """Return the dimensions of the leaves, and then the dimensions of the housing that are not 0.

    The names and meanings come from the fields of the records.
    """
    return [*_leaf_dimensions(report), *_housing_dimensions(report)]


def _leaf_dimensions(report: Report) -> Iterator[Dimension]:
    """Yield the dimensions of the leaves of each spring that is made."""
    for name, spring in report.flexures.items():
        leaf = spring.flexure
        if leaf is not None:
            for item in fields(leaf):
                size = f"{getattr(leaf, item.name):g}"
                yield Dimension(f"{name} spring, leaf {item.name}", size, item.metadata["meaning"])


def _housing_dimensions(report: Report) -> Iterator[Dimension]:
    """Yield the dimensions of the housing, if there is one.

    A dimension of 0 is omitted, because it belongs to a feature that the housing does not have. Fields without a float,
    such as counts, are omitted too.
    """
    if report.housing is None:
        return
    for key, (item, _) in fields_by_key(Housing).items():
        size = value_at_key(report.housing, key)
        if isinstance(size, float) and size != 0.0:
            # The side of a printed tip may exceed the side of its face in the design, so it has a name of its own.
            name = "printed tip side" if key == "tip_side" else key.replace("_", " ")
            yield Dimension(name, f"{size:.5g}", item.metadata["meaning"])


def bill(folder: Path) -> list[list[str]]:
    """Read the bill of materials of an output folder, and return its rows, the header first; raises OSError."""
    with (folder / BILL).open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def printed_g(rows: list[list[str]]) -> float:
    """Return the total mass [g] of the printed parts in a bill of materials."""
    return sum(int(count) * float(size.removesuffix(_MASS)) for count, _, size, *_ in rows[1:] if size.endswith(_MASS))
