"""The answer in words."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

from cad.fabrication.templates import EACH
from pipeline.report.report import Report
from sensor.verdict import Verdict

BILL = "bom.csv"
_MASS = f" g{EACH}"  # ends the size of a printed part in the bill
_ON_THE_PART = ("geometry.", "printable.", "sideways.", "files.", "report.")


@dataclass(frozen=True, kw_only=True)
class PageAnswer:
    """The first thing that is said: passed, failed or undecided, a headline, and what did not pass."""

    outcome: str
    headline: str
    not_passed: tuple[Verdict, ...]


class Dimension(NamedTuple):
    """A dimension of the part: its name, its size [mm] as text, and what it means."""

    name: str
    size: str
    meaning: str


def answer_of(report: Report) -> PageAnswer:
    """Return the answer: what failed first, then what is undecided."""
    failed = tuple(verdict for verdict in report.verdicts if verdict.passed is False)
    undecided = tuple(verdict for verdict in report.verdicts if verdict.passed is None)
    count = len(report.verdicts)
    name = report.design.name
    if failed:
        outcome = "failed"
        headline = f"No: {name} fails {len(failed)} of {count} verdicts in the scene asked for."
    elif undecided:
        outcome = "undecided"
        headline = f"Not decided: {len(undecided)} of {count} verdicts of {name} lie within their own error bars."
    else:
        outcome = "passed"
        headline = f"Yes: {name} passes all {count} verdicts in the scene asked for."
    return PageAnswer(outcome=outcome, headline=headline, not_passed=(*failed, *undecided))


class Closest(NamedTuple):
    """A verdict that passed, and how much of its limit it takes [1]."""

    verdict: Verdict
    fraction: float


def closest_to_limit(verdicts: Iterable[Verdict]) -> Closest | None:
    """Return the passed verdict that takes most of a one-sided limit; None where no limit is one-sided."""
    found = []
    for verdict in verdicts:
        value, limit = verdict.value, verdict.limit
        if not verdict.passed or value is None or not isinstance(limit, int | float) or min(value, limit) <= 0.0:
            continue
        if verdict.limit_sense == "at most":
            found.append(Closest(verdict, value / limit))
        elif verdict.limit_sense == "at least":
            found.append(Closest(verdict, limit / value))
    return max(found, key=lambda one: one.fraction, default=None)


def is_on_the_part(verdict: Verdict) -> bool:
    """Say whether a verdict is on the part and its print, not on targets and readings."""
    return verdict.name.startswith(_ON_THE_PART)


def dimensions(report: Report) -> list[Dimension]:
    """Return the dimensions of the leaves, and those of the housing that are numbers other than 0."""
    rows = []
    for name, spring in report.flexures.items():
        leaf = spring.dimensions_mm
        if leaf is not None:
            for item in fields(leaf):
                size = f"{getattr(leaf, item.name):g}"
                rows.append(Dimension(f"{name} spring, leaf {item.name}", size, item.metadata["meaning"]))
    if report.housing is not None:
        for item in fields(report.housing):
            size = getattr(report.housing, item.name)
            if isinstance(size, float) and size != 0.0:
                rows.append(Dimension(item.name.replace("_", " "), f"{size:.5g}", item.metadata["meaning"]))
    return rows


def bill(folder: Path) -> list[list[str]]:
    """Return the rows of the bill of materials of an output folder, its header first; raises OSError."""
    with (folder / BILL).open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def printed_g(rows: list[list[str]]) -> float:
    """Return the mass of all printed parts of a bill of materials [g]."""
    return sum(int(count) * float(size.removesuffix(_MASS)) for count, _, size, *_ in rows[1:] if size.endswith(_MASS))
