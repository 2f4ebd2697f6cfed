"""Changes of a design's keys: which may mend the verdicts that fail, how large they are, how they are written."""

import dataclasses
import json
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from cad.design.parameters import Design, GivenSprings
from cad.design.processes import PROCESSES
from cad.tips.layouts import LAYOUTS
from cad.tips.shapes import OPTIONAL_KEYS
from pipeline.options import load_design

_OF_OTHER_SHAPES = tuple(f"tips.{key}" for key in OPTIONAL_KEYS)

Value = float | str | None
Changes = Mapping[str, Value]
"""Values by TABLE.KEY; None unsets a key."""
Sweep = tuple[Changes, ...]
"""Changes of the same keys in the same direction, the smallest first."""

SMALLER = (0.85, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.03, 0.01)
LARGER = (1.2, 1.5, 2.0, 3.0, 4.0, 7.0, 10.0, 20.0, 50.0)
_FEW = 3  # factors where each trial solves a fruit under domes
_COARSE = ((0.5, 0.25), (2.0, 4.0))  # factors where each trial solves contact on cells
_CLOSE = 2.5  # sides between tips so close that a round fruit is nearly flat under them
_WHOLE_CHANGE = 1.0  # size of a change that is no ratio: another word, a key that is unset or set to 0
DEMANDS = ("reading.bias_limit", "reading.uncertainty_limit", "reading.tilt_deg")  # asking for less comes last
_SPRINGS = tuple(f"springs.{item.name}" for item in dataclasses.fields(GivenSprings))
_OF_THE_RATIO = frozenset(("P_max", "NL", "P_displacement_independent", "P_monotonic"))
_NEED_OTHER_TIPS = _OF_THE_RATIO | {"bruise", "geometry.tip_face"}


def changed(design: Design, changes: Changes) -> Design:
    """Return a design with keys changed; raises InputError where that is no design.

    A known process takes the place of one of the design's own, as `--set` does it.
    """
    tables: dict[str, dict[str, Value]] = {}
    for name, value in changes.items():
        table, _, key = name.partition(".")
        tables.setdefault(table, {})[key] = value
    records: dict[str, Any] = {}
    for table, values in tables.items():
        record = getattr(design, table)
        defaults = {item.name: item.default for item in dataclasses.fields(record)}
        filled = {key: defaults[key] if value is None else value for key, value in values.items()}
        records[table] = dataclasses.replace(record, **filled)
    if changes.get("print.process") in PROCESSES:
        records["printer"] = None
    return dataclasses.replace(design, **records)


def value_of(design: Design, name: str) -> object:
    """Return what a key of a design holds, in its own unit; None where its table or itself is not set."""
    table, _, key = name.partition(".")
    record = getattr(design, table)
    return None if record is None else getattr(record, key)


def size(design: Design, changes: Changes) -> tuple[int, int, float]:
    """Return how large a change is: its keys, those of them that ask for less, the sum of |log ratio| of all [1]."""
    total = 0.0
    for name, after in changes.items():
        before = value_of(design, name)
        if isinstance(before, float) and isinstance(after, float) and before * after > 0.0:
            total += abs(math.log(after / before))
        else:
            total += _WHOLE_CHANGE
    return len(changes), sum(name in DEMANDS for name in changes), total


def written(value: Value) -> str:
    """Return a value as `--set` takes it; nothing for a key that is unset."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def in_words(changes: Changes) -> str:
    """Return the changes in one line, numbers with four digits."""
    words = []
    for key, value in changes.items():
        words.append(f"{key} = {value:.4g}" if isinstance(value, float) else f"{key} = {value or 'not set'}")
    return ", ".join(words)


def sweeps(design: Design, failed: Collection[str], *, on_cells: bool) -> Iterator[Sweep]:
    """Yield the changes that may mend the verdicts of some names, with fewer steps where contact is solved on cells."""
    if "geometry.layout" in failed:  # no housing is drawn for a line: no other key mends it
        yield from _layouts(design)
        return
    groups = {name.partition(".")[0] for name in failed}
    reads = "reading" in groups
    smaller, larger = _steps(design, on_cells=on_cells)
    if "geometry.tip_shape" in failed:
        yield ({"tips.socket": "pin"},)
    if not _OF_THE_RATIO.isdisjoint(failed):
        yield from _level_and_flat(design)
    if not groups.isdisjoint({"printable", "K_l", "K_h"}) or "geometry.made" in failed:
        yield from _of_the_print(design)
    yield from _scaled(design, "press.travel_mm", smaller, larger)
    if reads or not groups.isdisjoint({"printable", "bruise"}):
        for key in _SPRINGS:
            yield from _scaled(design, key, smaller, larger)
    if reads:
        yield from _of_the_reading(design, failed)
    if reads or not _NEED_OTHER_TIPS.isdisjoint(failed):
        yield from _of_the_tips(design, smaller, larger)
    if on_cells and "P_displacement_independent" in failed:
        yield from _small_and_close(design.tips.side_mm)


def _steps(design: Design, *, on_cells: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the factors [1] by which a number becomes smaller and larger, fewer where a trial costs more."""
    if on_cells:
        return _COARSE
    if design.tips.tip_shape.obeys_hertz:
        return SMALLER[:_FEW], LARGER[:_FEW]
    return SMALLER, LARGER[:5]


def _scaled(design: Design, key: str, *directions: tuple[float, ...]) -> Iterator[Sweep]:
    """Yield a number times the factors [1] of each direction; nothing for a key that is not set."""
    value = value_of(design, key)
    if isinstance(value, float):
        for factors in directions:
            yield tuple({key: factor * value} for factor in factors)


def _of_the_tips(design: Design, smaller: tuple[float, ...], larger: tuple[float, ...]) -> Iterator[Sweep]:
    """Yield other widths and spacings of the tips; each needs another compliance of the fruit."""
    if design.tips.tip_shape.obeys_hertz:
        yield from _scaled(design, "tips.dome_radius_mm", smaller, larger)
        yield from _scaled(design, "tips.side_mm", larger)
    else:
        yield from _scaled(design, "tips.side_mm", smaller, larger)
    yield from _scaled(design, "tips.spacing_mm", smaller, larger)


def _small_and_close(side: float) -> Iterator[Sweep]:
    smaller = [factor * side for factor in _COARSE[0]]
    yield tuple({"tips.side_mm": one, "tips.spacing_mm": _CLOSE * one} for one in smaller)
    yield ({"tips.spacing_mm": _CLOSE * side},)


def _level_and_flat(design: Design) -> Iterator[Sweep]:
    """Yield what makes a press level and faces flat, and springs that targets size in the place of given ones."""
    for key in ("press.tilt_deg", "press.roll_deg", "tips.fillet_mm"):
        if value_of(design, key) != 0.0:
            yield ({key: 0.0},)
    if design.press.attitude != "side":
        yield ({"press.attitude": "side"},)
    if not design.tips.tip_shape.has_flat_face:
        yield ({"tips.shape": "cube", **_unset(design, *_OF_OTHER_SHAPES)},)
    if design.springs.given and design.targets is not None:
        yield (dict.fromkeys(_SPRINGS),)


def _of_the_print(design: Design) -> Iterator[Sweep]:
    """Yield other targets, no gauges, other processes."""
    if design.targets is not None and not design.springs.given:
        yield from _scaled(design, "targets.NL", SMALLER, LARGER)
        excess = design.targets.P_max - 1.0
        for factors in (SMALLER, LARGER):
            yield tuple({"targets.P_max": 1.0 + factor * excess} for factor in factors)
    if design.print.gauges != "none":
        yield ({"print.gauges": "none"},)
    for process in PROCESSES:
        if process != design.print.process:
            yield ({"print.process": process},)


def _of_the_reading(design: Design, failed: Collection[str]) -> Iterator[Sweep]:
    """Yield tips that are known to read round fruit; of domes what the reading may ask for instead."""
    if not design.tips.tip_shape.obeys_hertz:
        yield (_domes(design),)
        return
    if "reading.bias" in failed:
        yield from _scaled(design, "reading.bias_limit", LARGER[:5])
    if "reading.uncertainty" in failed:
        yield from _scaled(design, "reading.uncertainty_limit", LARGER[:5])
    if not {"reading.lift", "reading.bias"}.isdisjoint(failed):
        yield from _scaled(design, "reading.tilt_deg", SMALLER[:7])


def _layouts(design: Design) -> Iterator[Sweep]:
    """Yield the layouts that have a housing, without the keys of a line."""
    with_housing = [layout.name for layout in LAYOUTS.values() if layout.has_housing]
    for name in with_housing:
        yield ({"tips.layout": name, **_unset(design, "tips.order", "tips.outer_mm")},)
    if design.reading is not None and not design.tips.tip_shape.obeys_hertz:
        yield (_domes(design),)


def _unset(design: Design, *keys: str) -> dict[str, None]:
    """Return changes that unset those of the keys that are set."""
    return {key: None for key in keys if value_of(design, key) is not None}


def _domes(design: Design) -> Changes:
    """Return the square of domes of the preset `mango`, with its springs: a sensor that reads round fruit."""
    mango = load_design("mango")
    changes: dict[str, Value] = {}
    for key in (*(f"tips.{item.name}" for item in dataclasses.fields(mango.tips)), *_SPRINGS, "press.travel_mm"):
        value = value_of(mango, key)
        if value != value_of(design, key) and (value is None or isinstance(value, float | str)):
            changes[key] = value
    return changes
