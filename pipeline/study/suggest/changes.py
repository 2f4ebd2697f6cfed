"""Changes of a design's keys: which may mend the verdicts that fail, how large they are, how they are written."""

import dataclasses
import json
import math
from collections.abc import Collection, Mapping

from cad.design.design_file import design_as_mapping, design_from_mapping, overridden
from cad.design.parameters import Design, GivenSprings
from cad.design.processes import PROCESSES
from cad.tips.layouts import LAYOUTS
from cad.tips.shapes import OPTIONAL_KEYS

Value = float | str | tuple[float, ...] | None
Changes = Mapping[str, Value]
"""Values by TABLE.KEY; None unsets a key."""
Sweep = list[Changes]
"""Changes of the same keys in the same direction, the smallest first."""

SMALLER = (0.85, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.03, 0.01)
LARGER = (1.2, 1.5, 2.0, 3.0, 4.0, 7.0, 10.0, 20.0, 50.0)
_COARSELY_SMALLER = (0.5, 0.25)
_COARSELY_LARGER = (2.0, 4.0)
_CLOSE = 2.5  # sides between tips so close that a round fruit is nearly flat under them
_WHOLE_CHANGE = 1.0  # size of a change that is no ratio: another word, a key that is unset or set to 0
_DEMANDS = ("reading.bias_limit", "reading.uncertainty_limit", "reading.tilt_deg")  # asking for less comes last
_SPRINGS = tuple(f"springs.{item.name}" for item in dataclasses.fields(GivenSprings))
_OF_THE_RATIO = {"P_max", "NL", "P_displacement_independent", "P_monotonic"}
_OF_THE_SPRINGS = {"printable.low", "printable.high", "K_l", "K_h"}
_OF_THE_READING = {"reading.bias", "reading.uncertainty", "reading.lift"}


def changed(design: Design, changes: Changes) -> Design:
    """Return a design with keys changed as `--set` does it; raises InputError where that is no design."""
    settings = {key: written(value) for key, value in changes.items()}
    return design_from_mapping(overridden(design_as_mapping(design), settings))


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
    return len(changes), sum(name in _DEMANDS for name in changes), total


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


def sweeps(design: Design, failed: Collection[str], *, on_cells: bool) -> list[Sweep]:
    """Return the changes that may mend some verdicts, with fewer steps where contact is solved on cells."""
    if "geometry.layout" in failed:  # no housing is drawn for a line: no other key mends it
        without_line = _unset(design, "tips.order", "tips.outer_mm")
        return [[{"tips.layout": layout.name, **without_line}] for layout in LAYOUTS.values() if layout.has_housing]
    reads = not _OF_THE_READING.isdisjoint(failed)
    springs_fail = not _OF_THE_SPRINGS.isdisjoint(failed)
    smaller, larger = _factors(design, on_cells=on_cells)
    found: list[Sweep] = []
    if "geometry.tip_shape" in failed:
        found.append([{"tips.socket": "pin"}])
    if not _OF_THE_RATIO.isdisjoint(failed):
        found += _level_and_flat(design)
    if springs_fail or "geometry.made" in failed:
        found += _of_the_print(design)
    found += _scaled(design, "press.travel_mm", smaller, larger)
    if reads or springs_fail or "bruise" in failed:
        for key in _SPRINGS:
            found += _scaled(design, key, smaller, larger)
    if reads and design.tips.tip_shape.obeys_hertz:
        found += _of_the_reading(design, failed)
    if reads or not (_OF_THE_RATIO | {"bruise", "geometry.tip_face"}).isdisjoint(failed):
        found += _of_the_tips(design, smaller, larger)
    if on_cells and "P_displacement_independent" in failed:
        side = design.tips.side_mm
        sides = [side * factor for factor in _COARSELY_SMALLER]
        found.append(
            [{"tips.side_mm": smaller_side, "tips.spacing_mm": _CLOSE * smaller_side} for smaller_side in sides]
        )
        found.append([{"tips.spacing_mm": _CLOSE * side}])
    return found


def _factors(design: Design, *, on_cells: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the factors [1] by which a number becomes smaller and larger, fewer where a trial costs more."""
    if on_cells:
        return _COARSELY_SMALLER, _COARSELY_LARGER
    if design.tips.tip_shape.obeys_hertz:
        return SMALLER[:3], LARGER[:3]
    return SMALLER, LARGER[:5]


def _scaled(design: Design, key: str, *directions: tuple[float, ...]) -> list[Sweep]:
    """Return a number times the factors [1] of each direction; nothing for a key that is not set."""
    value = value_of(design, key)
    if not isinstance(value, float):
        return []
    return [[{key: factor * value} for factor in factors] for factors in directions]


def _of_the_tips(design: Design, smaller: tuple[float, ...], larger: tuple[float, ...]) -> list[Sweep]:
    """Return other widths and spacings of the tips; each needs another compliance of the fruit."""
    spacings = _scaled(design, "tips.spacing_mm", smaller, larger)
    if not design.tips.tip_shape.obeys_hertz:
        return [*_scaled(design, "tips.side_mm", smaller, larger), *spacings]
    radii = _scaled(design, "tips.dome_radius_mm", smaller, larger)
    return [*radii, *_scaled(design, "tips.side_mm", larger), *spacings]


def _level_and_flat(design: Design) -> list[Sweep]:
    """Return what makes a press level and faces flat, and springs that targets size in the place of given ones."""
    found: list[Sweep] = []
    for key in ("press.tilt_deg", "press.roll_deg", "tips.fillet_mm"):
        if value_of(design, key) != 0.0:
            found.append([{key: 0.0}])
    if design.press.attitude != "side":
        found.append([{"press.attitude": "side"}])
    if not design.tips.tip_shape.has_flat_face:
        found.append([{"tips.shape": "cube", **_unset(design, *(f"tips.{key}" for key in OPTIONAL_KEYS))}])
    if design.springs.given and design.targets is not None:
        found.append([dict.fromkeys(_SPRINGS)])
    return found


def _of_the_print(design: Design) -> list[Sweep]:
    """Return other targets, no gauges, other processes."""
    found: list[Sweep] = []
    if design.targets is not None and not design.springs.given:
        excess = design.targets.P_max - 1.0
        found += _scaled(design, "targets.NL", SMALLER, LARGER)
        for factors in (SMALLER, LARGER):
            found.append([{"targets.P_max": 1.0 + factor * excess} for factor in factors])
    if design.print.gauges != "none":
        found.append([{"print.gauges": "none"}])
    for process in PROCESSES:
        if process != design.print.process:
            found.append([{"print.process": process}])
    return found


def _of_the_reading(design: Design, failed: Collection[str]) -> list[Sweep]:
    """Return what the reading may ask for instead."""
    found: list[Sweep] = []
    for name in ("reading.bias", "reading.uncertainty"):
        if name in failed:
            found += _scaled(design, f"{name}_limit", LARGER[:5])
    if not {"reading.lift", "reading.bias"}.isdisjoint(failed):
        found += _scaled(design, "reading.tilt_deg", SMALLER[:7])
    return found


def _unset(design: Design, *keys: str) -> dict[str, None]:
    """Return changes that unset those of the keys that are set."""
    return {key: None for key in keys if value_of(design, key) is not None}
