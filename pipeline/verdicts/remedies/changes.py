"""Changes of a design's keys: which there are for the verdicts that fail, how large they are, how they are written."""

import dataclasses
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cad.design.parameters import Design, GivenSprings
from cad.design.processes import PROCESSES
from pipeline.options import load_design

Value = float | str | None
Changes = Mapping[str, Value]
Ladder = tuple[Changes, ...]
"""Changes of the same keys in the same sense, the smallest first."""

SMALLER, LARGER = (0.85, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1), (1.2, 1.5, 2.0, 3.0, 4.0)
FAR_SMALLER, FAR_LARGER = (*SMALLER, 0.05, 0.03, 0.01), (*LARGER, 7.0, 10.0, 20.0, 50.0)  # where a trial costs nothing
SOME_SMALLER, SOME_LARGER = (0.85, 0.7, 0.5), (1.2, 1.5, 2.0)  # of domes, whose fruit costs a solve each time
DEAR_SMALLER, DEAR_LARGER = (0.5, 0.25), (2.0, 4.0)  # where each trial solves contact on cells
_SPACING_OF_SIDE = 2.5  # tips so close that a round fruit is nearly flat under them, and still apart
_WHOLE_CHANGE = 1.0  # size of a change that is no ratio: another word, a key that is unset or set to 0
_DIGITS = 3
DEMANDS = ("reading.bias_limit", "reading.uncertainty_limit", "reading.tilt_deg")  # asking for less comes last
_SPRINGS = tuple(f"springs.{item.name}" for item in dataclasses.fields(GivenSprings))
_OF_THE_RATIO = {"P_max", "NL", "P_displacement_independent", "P_monotonic"}


def changed(design: Design, changes: Changes) -> Design:
    """Return a design with keys changed, None for one that is unset; raises InputError where that is no design.

    A known process takes the place of one of the design's own, as `--set` does it.
    """
    tables: dict[str, dict[str, Value]] = {}
    for name, value in changes.items():
        table, _, key = name.partition(".")
        tables.setdefault(table, {})[key] = value
    records: dict[str, Any] = {table: _replaced(design, table, values) for table, values in tables.items()}
    if changes.get("print.process") in PROCESSES:
        records["printer"] = None
    return dataclasses.replace(design, **records)


def _replaced(design: Design, table: str, values: Mapping[str, Value]) -> object:
    record = getattr(design, table)
    defaults = {item.name: item.default for item in dataclasses.fields(record)}
    return dataclasses.replace(record, **{key: defaults[key] if v is None else v for key, v in values.items()})


def value_of(design: Design, name: str) -> object:
    """Return what a key of a design holds, in its own unit; None where its table or itself is not set."""
    table, _, key = name.partition(".")
    record = getattr(design, table)
    return None if record is None else getattr(record, key)


def size(design: Design, changes: Changes) -> tuple[int, int, float]:
    """Return how large a change is: its keys, those of them that ask for less, the sum of |log ratio| of all [1]."""
    demands = sum(name in DEMANDS for name in changes)
    return len(changes), demands, sum(_key_size(value_of(design, name), value) for name, value in changes.items())


def _key_size(before: object, after: Value) -> float:
    if not isinstance(before, float) or not isinstance(after, float) or before * after <= 0.0:
        return _WHOLE_CHANGE
    return abs(math.log(after / before))


def rounded(value: float, towards: float) -> float:
    """Return a number of three digits beside a value, on the side of another one [its unit]."""
    if value == 0.0:
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) - _DIGITS + 1)
    toward = math.ceil if towards > value else math.floor
    return float(f"{toward(round(value / step, 6)) * step:.{_DIGITS}g}")


def flags(changes: Changes) -> list[str]:
    """Return the changes as the command line takes them, `--set` and what it sets in turn."""
    return [word for name, value in changes.items() for word in ("--set", f"{name}={written(value)}")]


def written(value: Value) -> str:
    """Return a value as `--set` takes it; nothing for a key that is unset."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def in_digits(changes: Changes) -> str:
    """Return the changes in one line, numbers with four digits."""
    words = {key: f"{value:.4g}" if isinstance(value, float) else str(value) for key, value in changes.items()}
    return ", ".join(f"{key} = {word}" for key, word in words.items())


def ladders(design: Design, wrong: Sequence[str], *, dear: bool) -> Iterator[Ladder]:
    """Yield the changes that may mend the verdicts of some names; with fewer steps where each trial is dear.

    Nothing mends a line but another layout: no housing is drawn for it.
    """
    if "geometry.layout" in wrong:
        yield from _of_the_layout(design)
        return
    kinds = {name.partition(".")[0] for name in wrong}
    of_the_ratio, reads = bool(_OF_THE_RATIO & set(wrong)), "reading" in kinds
    if of_the_ratio:
        yield from _straightened(design)
        yield from _given_springs(design)
    if "geometry.tip_shape" in wrong:
        yield ({"tips.socket": "pin"},)
    if {"printable", "K_l", "K_h"} & kinds or "geometry.made" in wrong:
        yield from _of_the_print(design)
    if "geometry.tip_face" in wrong or reads:
        yield from _scaled(design, "tips.side_mm", SOME_LARGER)
    steps = _steps(design, dear=dear)
    yield from _scaled(design, "press.travel_mm", *steps)
    if reads or "printable" in kinds or "bruise" in kinds:
        for key in _SPRINGS:
            yield from _scaled(design, key, *steps)
    if reads:
        yield from _of_the_reading(design, wrong)
    if of_the_ratio or reads or "bruise" in kinds:
        yield from _of_the_tips(design, wrong, dear=dear)


def _steps(design: Design, *, dear: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the factors [1] by which a number becomes smaller and larger, fewer where a trial costs more."""
    if dear:
        return DEAR_SMALLER, DEAR_LARGER
    return (SOME_SMALLER, SOME_LARGER) if design.tips.tip_shape.obeys_hertz else (FAR_SMALLER, LARGER)


def _of_the_tips(design: Design, wrong: Sequence[str], *, dear: bool) -> Iterator[Ladder]:
    """Yield other sides, spacings and radii of tips; each costs another compliance of the fruit."""
    factors = _steps(design, dear=dear)
    if design.tips.tip_shape.obeys_hertz:
        yield from _scaled(design, "tips.dome_radius_mm", *factors)
    else:
        yield from _scaled(design, "tips.side_mm", *factors)
    yield from _scaled(design, "tips.spacing_mm", *factors)
    if dear and "P_displacement_independent" in wrong:
        sides = [factor * design.tips.side_mm for factor in (1.0, 0.5, 0.25)]
        yield tuple({"tips.side_mm": side, "tips.spacing_mm": _SPACING_OF_SIDE * side} for side in sides[1:])
        yield ({"tips.spacing_mm": _SPACING_OF_SIDE * sides[0]},)


def _of_the_reading(design: Design, wrong: Sequence[str]) -> Iterator[Ladder]:
    """Yield tips that are known to read round fruit; of domes what the reading may ask for instead."""
    if not design.tips.tip_shape.obeys_hertz:
        yield (_domes(design),)
        return
    for verdict, key, factors in (
        ("reading.bias", "reading.bias_limit", LARGER),
        ("reading.uncertainty", "reading.uncertainty_limit", LARGER),
        ("reading.lift", "reading.tilt_deg", SMALLER),
        ("reading.bias", "reading.tilt_deg", SMALLER),
    ):
        if verdict in wrong:
            yield from _scaled(design, key, factors)


def _of_the_layout(design: Design) -> Iterator[Ladder]:
    """Yield the layouts that have a housing, without the keys of a line."""
    for layout in ("pair", "square"):
        yield ({"tips.layout": layout, **_unset(design, "tips.order", "tips.outer_mm")},)
    if design.reading is not None and not design.tips.tip_shape.obeys_hertz:
        yield (_domes(design),)


def _unset(design: Design, *keys: str) -> Changes:
    """Return changes that unset those of the keys that are set."""
    return {key: None for key in keys if value_of(design, key) is not None}


def _straightened(design: Design) -> Iterator[Ladder]:
    """Yield what makes a press level and faces flat."""
    for key in ("press.tilt_deg", "press.roll_deg", "tips.fillet_mm"):
        if value_of(design, key) != 0.0:
            yield ({key: 0.0},)
    if design.press.attitude != "side":
        yield ({"press.attitude": "side"},)
    if not design.tips.tip_shape.has_flat_face:
        yield ({"tips.shape": "cube", **_unset(design, "tips.dome_radius_mm")},)


def _given_springs(design: Design) -> Iterator[Ladder]:
    """Yield springs that targets size, in the place of given ones."""
    if design.springs.given and design.targets is not None:
        yield (dict.fromkeys(_SPRINGS),)


def _of_the_print(design: Design) -> Iterator[Ladder]:
    """Yield other targets, no gauges, other processes."""
    if design.targets is not None and not design.springs.given:
        yield from _scaled(design, "targets.NL", FAR_SMALLER, FAR_LARGER)
        excess = design.targets.P_max - 1.0
        for factors in (FAR_SMALLER, FAR_LARGER):
            yield tuple({"targets.P_max": 1.0 + factor * excess} for factor in factors)
    if design.print.gauges != "none":
        yield ({"print.gauges": "none"},)
    for process in PROCESSES:
        if process != design.print.process:
            yield ({"print.process": process},)


def _scaled(design: Design, key: str, *senses: Sequence[float]) -> Iterator[Ladder]:
    """Yield a number times the factors [1] of each sense; nothing for a key that is not set."""
    value = value_of(design, key)
    if isinstance(value, float):
        for factors in senses:
            yield tuple({key: factor * value} for factor in factors)


def _domes(design: Design) -> Changes:
    """Return the square of domes of the preset `mango`, with its springs: the sensor that is known to read fruit."""
    known = load_design("mango")
    keys = [f"tips.{item.name}" for item in dataclasses.fields(known.tips)]
    keys += [*_SPRINGS, "press.travel_mm"]
    changes: dict[str, Value] = {}
    for key in keys:
        value = value_of(known, key)
        if value != value_of(design, key) and (value is None or isinstance(value, float | str)):
            changes[key] = value
    return changes
