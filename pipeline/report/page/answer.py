"""The answer in words."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

from cad.fabrication.templates import EACH
from pipeline.options import load_design, preset_names
from pipeline.report.report import Report
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design
from sensor.design.reading import Reading
from sensor.verdict import Verdict

BILL = "bom.csv"
_MASS = f" g{EACH}"  # ends the size of a printed part in the bill
OUTCOMES = {True: "passed", False: "failed", None: "undecided"}
_ON_THE_PART = ("geometry.", "printable.", "sideways.", "files.", "report.")
_SCENE_TABLES = ("fruit", "tips", "press", "reading")
_ALWAYS_SAID: tuple[str, ...] = (
    "fruit.shape", "fruit.radius_mm", "fruit.length_mm", "fruit.width_mm", "fruit.height_mm", "fruit.thickness_mm",
    "fruit.E_MPa", "fruit.E_max_MPa",
    "tips.layout", "tips.shape", "tips.side_mm", "tips.spacing_mm", "press.travel_mm",
    "reading.tilt_deg", "reading.off_centre_mm", "reading.radius_spread",
)  # fmt: skip
"""Keys that the scene in words has, whatever their value."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The first thing that is said: passed, failed or undecided, a headline, and what did not pass."""

    outcome: str
    headline: str
    not_passed: tuple[Verdict, ...]


class Dimension(NamedTuple):
    """A dimension of the part: its name, its size [mm] as text, and what it means."""

    name: str
    size: str
    meaning: str


def answer_of(report: Report) -> Answer:
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
    return Answer(outcome=outcome, headline=headline, not_passed=(*failed, *undecided))


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


def _fruits_in_words(reading: Reading) -> str:
    """Return words for the range of radii that occur."""
    if reading.radius_mm is None or reading.radius_across_mm is None:
        return f"on radii up to {100.0 * reading.radius_spread:g} % off"
    ranges = [f"{low:g} to {high:g}" for low, high in (reading.radius_mm, reading.radius_across_mm)]
    return f"on principal radii of {ranges[0]} and {ranges[1]} mm at any azimuth"


def scene_in_words(design: Design) -> str:
    """Return the scene in words: tips, press, fruit and poses, and the other keys of the scene that were changed."""
    fruit = design.fruit
    tips = design.tips
    reading = design.reading
    shape = f"a {fruit.shape},"
    if fruit.radius_across_mm is not None:
        shape = f"an ellipsoid of radii {fruit.radius_mm:g} and {fruit.radius_across_mm:g} mm, a piece of"
    elif fruit.radius_mm is not None:
        shape = f"a sphere of radius {fruit.radius_mm:g} mm, a piece of"
    poses = ""
    if reading is not None:
        poses = (
            f", at tilts up to {reading.tilt_deg:g} degrees, up to {reading.off_centre_mm:g} mm off the "
            f"apex and {_fruits_in_words(reading)}"
        )
    made = f"made by {design.print.process}" if tips.tip_layout.has_housing else "a line of tips has no housing"
    each_tip = f"{tips.layout}, {tips.shape}, {tips.side_mm:g} mm, {tips.spacing_mm:g} mm apart"
    size = f"{fruit.length_mm:g} x {fruit.width_mm:g} x {fruit.depth_mm:g} mm"
    moduli = f"{min(fruit.E_MPa):g} to {fruit.E_max_MPa:g} MPa"
    pressed = f"{len(tips.names)} tips ({each_tip}), pressed {design.press.travel_mm:g} mm"
    return f"{pressed} into {shape} {size}, of {moduli}{poses}; {made}.{_changes_in_words(design)}"


def _changes_in_words(design: Design) -> str:
    """Return the keys of the scene that differ from the preset of the design's name, else from the defaults.

    Beyond the defaults those are left out that the scene in words has anyhow.
    """
    if design.name in preset_names():
        base = load_design(design.name)
        words = f"Other than in the preset {design.name}"
        said_already: tuple[str, ...] = ()
    else:
        base = Design(reading=design.reading and Reading())
        words = "Beyond the defaults"
        said_already = _ALWAYS_SAID
    tables = design_as_mapping(design)
    base_tables = design_as_mapping(base)
    changes = []
    for table in _SCENE_TABLES:
        for key, value in tables.get(table, {}).items():
            name = f"{table}.{key}"
            if name not in said_already and value != base_tables.get(table, {}).get(key):
                changes.append(f"{name} = {value}")
    return f" {words}: {', '.join(changes)}." if changes else ""


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
