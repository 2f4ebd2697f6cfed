"""The answer of a run as text for the page."""

import csv
from collections.abc import Iterable
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
_ERRORS = ("reading.bias", "reading.uncertainty")
_MAX_DIGITS = 6  # an error of a reading that needs more digits is shown in full
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
    is_error = verdict.name in _ERRORS and verdict.passed is not None
    if value is None or not is_error or not isinstance(limit, int | float):
        return measured(verdict)
    rounded_texts = (f"{value:.{digits}g}" for digits in range(2, _MAX_DIGITS))
    on_the_same_side = (text for text in rounded_texts if (float(text) <= limit) == (value <= limit))
    return f"{next(on_the_same_side, f'{value:g}')} {verdict.unit}"


class Closest(NamedTuple):
    """A verdict that passed, and the fraction of its limit that its value uses [1]."""

    verdict: Verdict
    fraction: float


def closest_to_limit(verdicts: Iterable[Verdict]) -> Closest | None:
    """Return the passed verdict that uses the largest fraction of a one-sided limit; None without such a limit.

    The fraction is value / limit for an upper limit, and limit / value for a lower limit. Verdicts whose value or limit
    is not positive are omitted, because this fraction then has no meaning.
    """
    candidates = []
    for verdict in verdicts:
        value, limit = verdict.value, verdict.limit
        if not verdict.passed or value is None or not isinstance(limit, int | float) or min(value, limit) <= 0.0:
            continue
        if verdict.limit_sense == "at most":
            candidates.append(Closest(verdict, value / limit))
        elif verdict.limit_sense == "at least":
            candidates.append(Closest(verdict, limit / value))
    return max(candidates, key=lambda candidate: candidate.fraction, default=None)


def dimensions(report: Report) -> list[Dimension]:
    """Return the dimensions of the leaves, and then the dimensions of the housing that are not 0.

    A dimension of 0 belongs to a feature that the housing does not have. The names and meanings come from the fields of
    the records.
    """
    rows = []
    for name, spring in report.flexures.items():
        leaf = spring.flexure
        if leaf is not None:
            for item in fields(leaf):
                size = f"{getattr(leaf, item.name):g}"
                rows.append(Dimension(f"{name} spring, leaf {item.name}", size, item.metadata["meaning"]))
    if report.housing is not None:
        for key, (item, _) in fields_by_key(Housing).items():
            size = value_at_key(report.housing, key)
            if isinstance(size, float) and size != 0.0:
                rows.append(Dimension(key.replace("_", " "), f"{size:.5g}", item.metadata["meaning"]))
    return rows


def bill(folder: Path) -> list[list[str]]:
    """Read the bill of materials of an output folder, and return its rows, the header first; raises OSError."""
    with (folder / BILL).open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def printed_g(rows: list[list[str]]) -> float:
    """Return the total mass [g] of the printed parts in a bill of materials."""
    return sum(int(count) * float(size.removesuffix(_MASS)) for count, _, size, *_ in rows[1:] if size.endswith(_MASS))
