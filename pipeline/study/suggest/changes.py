"""Changes of a design's keys: which may mend the verdicts that fail, how large they are, how they are written."""

import dataclasses
import json
import math
from collections.abc import Collection, Mapping

from pipeline.study.variation import Setting
from sensor.design.design_tables import DesignTables
from sensor.design.parameters import Design, GivenSprings
from sensor.design.processes import PROCESSES
from sensor.tips.shapes import OPTIONAL_KEYS
from sensor.words import shown

Value = Setting | None
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
_SPRINGS = [f"springs.{item.name}" for item in dataclasses.fields(GivenSprings)]
_TIPS = [f"tips.{key}" for key in ("dome_radius_mm", "side_mm", "spacing_mm")]
_OF_THE_RATIO = {"P_max", "NL", "P_displacement_independent", "P_monotonic"}
_OF_THE_SPRINGS = {"printable.low", "printable.high", "K_l", "K_h"}
_OF_THE_READING = {"reading.bias", "reading.uncertainty", "reading.touch"}


def change_design(design: Design, changes: Changes) -> Design:
    """Return a design with keys changed as `--set` does it; raises InputError where that is no design."""
    return DesignTables.from_design(design).design(changes)


def value_of(design: Design, name: str) -> object:
    """Return the value of a key of a design, in its own unit; None where its table or itself is not set."""
    table, _, key = name.partition(".")
    record = getattr(design, table)
    return None if record is None else getattr(record, key)


def size(design: Design, changes: Changes) -> tuple[int, int, float]:
    """Return the size of a change: its number of keys, that of demands among them, the sum of |log ratio| [1]."""
    total = 0.0
    for name, after in changes.items():
        before = value_of(design, name)
        if isinstance(before, float) and isinstance(after, float) and before * after > 0.0:
            total += abs(math.log(after / before))
        else:
            total += _WHOLE_CHANGE
    return len(changes), sum(name in _DEMANDS for name in changes), total


def setting_text(value: Value) -> str:
    """Return a value as `--set` takes it; nothing for a key that is unset."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def in_words(changes: Changes) -> str:
    """Return the changes in one line, numbers with four digits."""
    return ", ".join(f"{key} = {shown(value, digits=4, absent='not set')}" for key, value in changes.items())


def sweeps(design: Design, failed: Collection[str], *, on_cells: bool) -> list[Sweep]:
    """Return the changes that may mend some verdicts, with fewer steps where contact is solved on cells."""
    return [[change] for change in _words(design, set(failed))] + _numbers(design, set(failed), on_cells=on_cells)


def _words(design: Design, failed: set[str]) -> list[Changes]:
    """Return the changes to other words or to zero, each by itself, that may mend some verdicts.

    For a force ratio they are a level press, flat faces, and springs that targets size. For springs that cannot be made
    they are other processes.
    """
    changes: list[Changes] = []
    if failed & _OF_THE_RATIO:
        changes += [{"press.tilt_deg": 0.0}, {"press.roll_deg": 0.0}]
        if design.tips.tip_shape.has_flat_face:
            changes.append({"tips.fillet_mm": 0.0})
        changes.append({"press.attitude": "side"})
        if not design.tips.tip_shape.has_flat_face:
            sharp = {"tips.fillet_mm": 0.0} if design.tips.fillet_mm else {}
            unset = _unset(design, [f"tips.{key}" for key in OPTIONAL_KEYS])
            changes.append({"tips.shape": "cube", **sharp, **unset})
        if design.targets is not None:
            changes.append(dict.fromkeys(_SPRINGS))
    if failed & _OF_THE_SPRINGS or "geometry.made" in failed:
        changes += [{"print.process": process} for process in PROCESSES]
    return [change for change in changes if any(value_of(design, key) != value for key, value in change.items())]


def _numbers(design: Design, failed: set[str], *, on_cells: bool) -> list[Sweep]:
    """Return the changes of numbers that may mend some verdicts: times factors that make them smaller or larger."""
    reads = bool(failed & _OF_THE_READING)
    smaller, larger = _factors(design, on_cells=on_cells)
    keys = ["press.travel_mm"]
    found: list[Sweep] = []
    if reads or failed & _OF_THE_SPRINGS or "bruise" in failed:
        keys += _SPRINGS
    if reads or failed & (_OF_THE_RATIO | {"bruise", "geometry.tip_face"}):
        keys += _TIPS
    if failed & _OF_THE_SPRINGS and not design.springs.given:
        for key in ("targets.NL", "targets.P_max"):
            found += _scaled(design, key, SMALLER, LARGER)
    for key in keys:
        found += _scaled(design, key, smaller, larger)
    if reads and design.tips.tip_shape.obeys_hertz:
        found += _scaled(design, "reading.tilt_deg", SMALLER[:7])
        for name in failed & {"reading.bias", "reading.uncertainty"}:
            found += _scaled(design, f"{name}_limit", LARGER[:5])
    if "reading.uncertainty" in failed:
        found.append([{"reading.calibrated_by": "plate"}])
    if on_cells and "P_displacement_independent" in failed:
        side = design.tips.side_mm
        sides = [side * factor for factor in _COARSELY_SMALLER]
        found.append([{"tips.side_mm": less, "tips.spacing_mm": _CLOSE * less} for less in sides])
        found.append([{"tips.spacing_mm": _CLOSE * side}])
    return found


def _factors(design: Design, *, on_cells: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the factors [1] that make a number smaller and larger: fewer ones where a trial costs more."""
    if on_cells:
        return _COARSELY_SMALLER, _COARSELY_LARGER
    if design.tips.tip_shape.obeys_hertz:
        return SMALLER[:3], LARGER[:3]
    return SMALLER, LARGER[:5]


def _scaled(design: Design, key: str, *directions: tuple[float, ...]) -> list[Sweep]:
    """Return a number, or all of a list, times the factors [1] of each direction; nothing where none is set."""
    value = value_of(design, key)
    if isinstance(value, tuple):
        return [[{key: tuple(factor * each for each in value)} for factor in factors] for factors in directions]
    if not isinstance(value, float):
        return []
    return [[{key: factor * value} for factor in factors] for factors in directions]


def _unset(design: Design, keys: list[str]) -> dict[str, None]:
    """Return changes that unset those of the keys that are set."""
    return {key: None for key in keys if value_of(design, key) is not None}
