"""The nearest design that passes: changes tried one key at a time, then on top of the best that did not pass."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cad.design.parameters import Design
from cad.quantity import InputError
from mesh.session import MeshError
from pipeline.response.scene_press import scene_of
from pipeline.verdicts.remedies.changes import Changes, Ladder, Value, changed, ladders, rounded, size, value_of
from pipeline.verdicts.remedies.trial import Trial, Trials
from solve.linear import SolveError

MOST_ROUNDS = 3
_KEPT = 4  # changes that did not pass on which the next round builds
_BISECTIONS, _DEAR_BISECTIONS = 6, 2
_TO_BISECT = 300  # of the budget, so that what passes is also brought near
_BEYOND = 0.05  # by how much a bound that was found is passed over, so that the solved leaves and error bars pass too


Base = tuple[Changes, Design, Sequence[str]]
"""Changes, the design that they make, and the names of its verdicts that do not pass."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Changes of a design, and the trial of what they make of it."""

    changes: Changes
    trial: Trial


@dataclass(frozen=True, kw_only=True)
class Search:
    """What a search has found: the candidates that pass, the nearest first; else the one that fails least.

    `keys` are those that were changed, and `count` the number of designs that were tried.
    """

    passing: tuple[Candidate, ...]
    least: Candidate | None
    keys: tuple[str, ...]
    count: int


def nearest_passing(
    design: Design, wrong: Sequence[str], trials: Trials, fixed: frozenset[str] = frozenset()
) -> Search:
    """Return the search for the nearest design that passes where verdicts of these names do not.

    Nearest is the one with the fewest keys changed, then with the smallest sum of |log ratio|. Keys that are `fixed`
    stay. A search ends when the budget of the trials is used up.
    """
    started, keys = trials.count, dict[str, None]()
    passing, least = _searched(design, wrong, fixed, keys, trials)
    ordered = _nearest_first(design, passing)
    trials.allow(_TO_BISECT)
    exact = _nearest_first(design, [_nearer(design, one, trials) for one in ordered[:_KEPT]])
    return Search(passing=(*exact, *ordered[_KEPT:]), least=least, keys=tuple(keys), count=trials.count - started)


def _searched(
    design: Design, wrong: Sequence[str], fixed: frozenset[str], keys: dict[str, None], trials: Trials
) -> tuple[list[Candidate], Candidate | None]:
    """Return the candidates of the first round in which one passes; where none does, the one that fails least."""
    bases: list[Base] = [({}, design, wrong)]
    least: list[Candidate] = []
    for _ in range(MOST_ROUNDS):
        found = [one for base in bases for one in _round(design, base, fixed, keys, trials)]
        passing = [one for one in found if one.trial.passes]
        if passing:
            return passing, None
        found.sort(key=lambda one: (one.trial.distance, size(design, one.changes)))
        least = sorted([*least, *found[:1]], key=lambda one: one.trial.distance)[:1]
        bases = [(one.changes, one.trial.design, [v.name for v in one.trial.wrong]) for one in found[:_KEPT]]
    return [], least[0] if least else None


def _nearest_first(design: Design, candidates: Sequence[Candidate]) -> list[Candidate]:
    return sorted(candidates, key=lambda one: size(design, one.changes))


def _round(
    design: Design, base: Base, fixed: frozenset[str], keys: dict[str, None], trials: Trials
) -> Iterator[Candidate]:
    """Yield what becomes of a base with one more key changed, and note the keys that were tried."""
    changes, changed_design, wrong = base
    for ladder in _open_ladders(changed_design, wrong, changes, fixed):
        before = trials.count
        yield from _climbed(design, changes, ladder, trials)
        if trials.count > before:
            keys.update(dict.fromkeys(ladder[0]))


def is_dear(design: Design) -> bool:
    """Say whether contact of a design is solved on cells."""
    return not scene_of(design).linear and not design.tips.tip_shape.obeys_hertz


def _open_ladders(design: Design, wrong: Sequence[str], changes: Changes, fixed: frozenset[str]) -> Iterator[Ladder]:
    """Yield the ladders of keys that are neither changed yet nor fixed."""
    for ladder in ladders(design, wrong, dear=is_dear(design)):
        if ladder and not any(key in changes or key in fixed for key in ladder[0]):
            yield ladder


def _climbed(design: Design, changes: Changes, ladder: Ladder, trials: Trials) -> list[Candidate]:
    """Return the first rung of a ladder that passes; else the one that fails least; none where none can be tried."""
    best: list[Candidate] = []
    for rung in ladder:
        candidate = tried(design, {**changes, **rung}, trials)
        if candidate is None:
            continue
        if candidate.trial.passes:
            return [candidate]
        best = sorted([*best, candidate], key=lambda one: one.trial.distance)[:1]
    return best


def tried(design: Design, changes: Changes, trials: Trials) -> Candidate | None:
    """Return the candidate of a design's changes; None where they make no design, or one that cannot be tried."""
    if trials.left <= 0:
        return None
    try:
        return Candidate(changes=changes, trial=trials(changed(design, changes)))
    except (InputError, MeshError, SolveError):
        return None


def _nearer(design: Design, candidate: Candidate, trials: Trials) -> Candidate:
    """Return a candidate each of whose numbers is as near to the design's as lets it pass, a little beyond.

    One of many keys is a sensor of its own and stays as it is known.
    """
    if len(candidate.changes) > MOST_ROUNDS:
        return candidate
    for key, value in candidate.changes.items():
        before = value_of(design, key)
        if isinstance(value, float) and isinstance(before, float) and before * value > 0.0:
            candidate = _bisected(design, candidate, key, before, trials)
    return candidate


def _bisected(design: Design, candidate: Candidate, key: str, before: float, trials: Trials) -> Candidate:
    fails, passes = before, _number(candidate.changes[key])
    steps = _DEAR_BISECTIONS if is_dear(candidate.trial.design) else _BISECTIONS
    for _ in range(steps):
        middle = (fails * passes) ** 0.5
        nearer = tried(design, {**candidate.changes, key: middle}, trials)
        if nearer is not None and nearer.trial.passes:
            passes = middle
        else:
            fails = middle
    sense = 1.0 if passes > before else -1.0
    exact = rounded(passes * (1.0 + sense * _BEYOND), passes * (1.0 + 2.0 * sense * _BEYOND))
    final = tried(design, {**candidate.changes, key: exact}, trials)
    return final if final is not None and final.trial.passes else candidate


def _number(value: Value) -> float:
    if not isinstance(value, float):
        msg = f"{value!r} is no number"
        raise TypeError(msg)
    return value
