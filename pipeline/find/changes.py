"""Changes of a design's keys that may make failed verdicts pass, their size, and their text."""

import dataclasses
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial

from pipeline.study.variation import Setting
from sensor.design.design_tables import DesignTables
from sensor.design.parameters import Design, GivenSprings
from sensor.design.processes import PROCESSES
from sensor.tips.shapes import OPTIONAL_KEYS
from sensor.verdict import row_of
from sensor.words import value_text

Value = Setting | None
Changes = Mapping[str, Value]
"""New values of keys named TABLE.KEY; None removes a key from the design."""
Sweep = list[Changes]
"""A sequence of changes of the same keys in one direction, the smallest change first."""

# Factors [1] by which a number of the design is multiplied, the smallest change first. Some sweeps use only the first
# factors, because their trials take longer.
SMALLER = (0.85, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.03, 0.01)
LARGER = (1.2, 1.5, 2.0, 3.0, 4.0, 7.0, 10.0, 20.0, 50.0)
# fewer factors for trials whose contact is solved on cells, because these trials are expensive
_COARSELY_SMALLER = (0.5, 0.25)
_COARSELY_LARGER = (2.0, 4.0)
_CLOSE_SPACING = 2.5  # ratio of the spacing to the side of a tip at which a round fruit is nearly flat under the tips
_CHANGE_WITHOUT_RATIO = 1.0  # size of a change without a ratio: a different word, or a key that is removed or set to 0
# keys that state what the sensor must achieve, and that are changed only as a last resort
_REQUIREMENTS = ("reading.bias_limit", "reading.uncertainty_limit", "reading.tilt_deg")
_SPRINGS = [f"springs.{item.name}" for item in dataclasses.fields(GivenSprings)]
_TRAVEL = "press.travel_mm"
_TIPS = [f"tips.{key}" for key in ("dome_radius_mm", "side_mm", "spacing_mm")]


def change_design(design: Design, changes: Changes) -> Design:
    """Return a design with changed keys, as with `--set`; raise InputError if the changed design is invalid."""
    return DesignTables.from_design(design).design(changes)


def value_of(design: Design, name: str) -> object:
    """Return the value of the key TABLE.KEY of a design, in the unit of the key; None if it is not set."""
    table, _, key = name.partition(".")
    record = getattr(design, table)  # None if the design does not have this table
    return None if record is None else getattr(record, key)


def size(design: Design, changes: Changes) -> tuple[int, int, float]:
    """Return the size of changes to a design as a tuple, by which a search prefers the smallest changes.

    Tuples are compared entry by entry. The first entry is the number of keys, and the second one is the number of
    requirements among them. The third entry is a sum over the keys [1]: a number that keeps its sign contributes
    |ln(new value / old value)|, and any other change contributes 1.
    """
    total = 0.0
    for name, after in changes.items():
        before = value_of(design, name)
        if isinstance(before, float) and isinstance(after, float) and before * after > 0.0:
            total += abs(math.log(after / before))
        else:
            total += _CHANGE_WITHOUT_RATIO
    return len(changes), sum(name in _REQUIREMENTS for name in changes), total


def in_words(changes: Changes) -> str:
    """Return the changes as one line of text, with four significant digits."""
    return ", ".join(f"{key} = {value_text(value, digits=4, absent='not set')}" for key, value in changes.items())


def sweeps(design: Design, failed: Collection[str], *, is_solved_on_cells: bool) -> list[Sweep]:
    """Return the parameter sweeps that may make failed verdicts pass; `failed` holds the names of these verdicts.

    A move is a kind of change, such as a different process. The table of verdicts lists for each verdict the moves that
    may make it pass, in `mended_by`. The sweeps are returned in the order of `MOVES`. A different travel is always
    tried. If contact `is_solved_on_cells`, the sweeps have fewer steps, because such trials are expensive.
    """
    moves = {move for name in failed for move in row_of(name).mended_by} | {_TRAVEL}
    all_sweeps: list[Sweep] = []
    for move, make_sweeps in MOVES.items():
        if move in moves:
            all_sweeps += make_sweeps(design, is_solved_on_cells)
    return all_sweeps


def _two_spring_law_sweeps(design: Design, _is_solved_on_cells: bool) -> list[Sweep]:
    """Return sweeps towards the assumptions of the two-spring law: a level press, flat faces, springs from targets.

    Each sweep has a single change. A press to the side keeps the tips at the same height, because their weight then
    does not act along the press. Changes that the design already has are omitted.
    """
    changes: list[Changes] = [{"press.tilt_deg": 0.0}, {"press.roll_deg": 0.0}]
    press_sideways: Changes = {"press.attitude": "side"}
    if design.tips.tip_shape.has_flat_face:
        changes += [{"tips.fillet_mm": 0.0}, press_sideways]
    else:
        no_fillet = {"tips.fillet_mm": 0.0} if design.tips.fillet_mm else {}
        # the keys of other shapes, such as a dome radius, are not allowed for a cube
        removed_keys = _remove_keys(design, [f"tips.{key}" for key in OPTIONAL_KEYS])
        changes += [press_sideways, {"tips.shape": "cube", **no_fillet, **removed_keys}]
    if design.targets is not None:
        changes.append(dict.fromkeys(_SPRINGS))  # removes the given stiffnesses, so that the targets size the springs
    return _single_sweeps(design, changes)


def _process_sweeps(design: Design, _is_solved_on_cells: bool) -> list[Sweep]:
    """Return a sweep with a single change for each of the other print processes."""
    return _single_sweeps(design, [{"print.process": process} for process in PROCESSES])


def _single_sweeps(design: Design, changes: list[Changes]) -> list[Sweep]:
    """Return each change as a separate sweep; changes that the design already has are omitted."""
    return [[change] for change in changes if any(value_of(design, key) != value for key, value in change.items())]


def _target_sweeps(design: Design, _is_solved_on_cells: bool) -> list[Sweep]:
    """Return sweeps of smaller and larger targets; none if the design gives the stiffnesses of its springs."""
    if design.springs.given:
        return []
    return [
        *_scaling_sweeps(design, "targets.NL", SMALLER, LARGER),
        *_scaling_sweeps(design, "targets.P_max", SMALLER, LARGER),
    ]


def _number_sweeps(keys: Sequence[str], design: Design, is_solved_on_cells: bool) -> list[Sweep]:
    """Return two sweeps for each of the `keys`: its number times factors below 1, and times factors above 1."""
    factors = _factors(design, is_solved_on_cells=is_solved_on_cells)
    return [sweep for key in keys for sweep in _scaling_sweeps(design, key, *factors)]


def _tilt_sweeps(design: Design, _is_solved_on_cells: bool) -> list[Sweep]:
    """Return a sweep of smaller tilts; none for tips with flat faces, because their readings take too long to try."""
    return _scaling_sweeps(design, "reading.tilt_deg", SMALLER[:7]) if design.tips.tip_shape.obeys_hertz else []


def _limit_sweeps(key: str, design: Design, _is_solved_on_cells: bool) -> list[Sweep]:
    """Return a sweep of larger values of the limit `key`.

    The result is empty for tips with flat faces, because their readings take too long to try.
    """
    return _scaling_sweeps(design, key, LARGER[:5]) if design.tips.tip_shape.obeys_hertz else []


def _calibration_sweeps(design: Design, _is_solved_on_cells: bool) -> list[Sweep]:
    """Return sweeps to more accurate calibrations: on a plate, and on a reference ball if the design allows one."""
    methods = ("plate", *(["ball"] if design.takes_ball else []))
    return [[{"reading.calibrated_by": method}] for method in methods]


def _spacing_sweeps(design: Design, is_solved_on_cells: bool) -> list[Sweep]:
    """Return sweeps to tips so close that a round fruit is nearly flat under them.

    The result is empty unless contact is solved on cells. The first sweep makes the tips smaller and closer together.
    The second one moves tips of the present size closer together.
    """
    if not is_solved_on_cells:
        return []
    side = design.tips.side_mm
    smaller_sides = [side * factor for factor in _COARSELY_SMALLER]
    smaller_tips: Sweep = [
        {"tips.side_mm": smaller_side, "tips.spacing_mm": _CLOSE_SPACING * smaller_side}
        for smaller_side in smaller_sides
    ]
    return [smaller_tips, [{"tips.spacing_mm": _CLOSE_SPACING * side}]]


MOVES: Mapping[str, Callable[[Design, bool], list[Sweep]]] = {
    "two-spring law": _two_spring_law_sweeps,
    "print.process": _process_sweeps,
    "targets": _target_sweeps,
    _TRAVEL: partial(_number_sweeps, [_TRAVEL]),
    "springs": partial(_number_sweeps, _SPRINGS),
    "tips": partial(_number_sweeps, _TIPS),
    "reading.tilt_deg": _tilt_sweeps,
    "reading.bias_limit": partial(_limit_sweeps, "reading.bias_limit"),
    "reading.uncertainty_limit": partial(_limit_sweeps, "reading.uncertainty_limit"),
    "reading.calibrated_by": _calibration_sweeps,
    "tips.spacing_mm": _spacing_sweeps,
}
"""The functions that make the sweeps, by the name of a move; verdicts list these names in `mended_by`.

The second argument is True if contact is solved on cells.
"""


def _factors(design: Design, *, is_solved_on_cells: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the factors [1] below 1 and above 1 by which a number is multiplied.

    The factors are fewest if contact is solved on cells, where trials are most expensive, and few for domes.
    """
    if is_solved_on_cells:
        return _COARSELY_SMALLER, _COARSELY_LARGER
    if design.tips.tip_shape.obeys_hertz:
        return SMALLER[:3], LARGER[:3]
    return SMALLER, LARGER[:5]


def _scaling_sweeps(design: Design, key: str, *directions: tuple[float, ...]) -> list[Sweep]:
    """Return a sweep of a key for each of the `directions`, which hold the factors [1] on its value.

    If the value is a list, every number in it is multiplied by the factor. The result is empty if the key is not set or
    is not a number.
    """
    value = value_of(design, key)
    scaled_sweeps: list[Sweep] = []
    for factors in directions:
        if isinstance(value, tuple):
            scaled_sweeps.append([{key: tuple(factor * number for number in value)} for factor in factors])
        elif isinstance(value, float):
            scaled_sweeps.append([{key: factor * value} for factor in factors])
    return scaled_sweeps


def _remove_keys(design: Design, keys: list[str]) -> dict[str, None]:
    """Return changes that remove the given keys from a design; keys that are not set are omitted."""
    return {key: None for key in keys if value_of(design, key) is not None}
