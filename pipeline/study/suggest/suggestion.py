"""The nearest design that passes: searched with springs just as stiff as they were sized, proved by whole runs."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from cad.design.parameters import Design
from cad.files.export_error import ExportError
from cad.quantity import InputError
from cad.verdict import Verdict, failed
from mesh.session import MeshError
from pipeline import run
from pipeline.evaluate import check_targets, refuse_unsolvable
from pipeline.options import RunOptions
from pipeline.report.solids import NO_LINE
from pipeline.response.scene_press import TRAVELS, pressed_at, scene_of
from pipeline.result import SensorResult
from pipeline.springs.fitted_springs import ideal_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.stopwatch import Progress, silent
from pipeline.study.scenes import scene_compliance, unit_scene
from pipeline.study.suggest.changes import Changes, Sweep, changed, in_words, size, sweeps, value_of
from pipeline.verdicts.hints import rounded, shorter_travel
from pipeline.verdicts.rules import displacement_verdict, tolerance_remedy
from solve.fruit.compliance import FruitCompliance
from solve.linear import SolveError

BUDGET = 6000  # of trials, in about hundredths of a processor second
MOST_RUNS = 4  # that prove a candidate; each costs some ten seconds
MOST_KEYS = 3  # changed one on top of the other
_KEPT = 4  # changes that did not pass on which the next round builds
_BISECTIONS = 6
_BISECTIONS_ON_CELLS = 2
_BEYOND = 0.05  # by how much a bound is passed over, so that the solved leaves and error bars pass too
_ROUGH = 0.02  # tolerance of the springs whose contact is good enough to try a change
_NO_NUMBER = 3.0  # how far a verdict without a number counts as off
_TRAVEL = "press.travel_mm"
# Readings of flat tips are too slow to try, and none is known to pass.
_FLAT_TIPS = failed("reading.bias", "tips with a dome", unit="1", reference="readings of flat tips")
_UNSOLVED = (ExportError, InputError, MeshError, SolveError)


@dataclass(frozen=True, kw_only=True)
class Suggestion:
    """What makes a design pass: no changes where it passes as it is, None where no such changes were found.

    `verdicts` are those of the run that proves it, or of the design's own run. `reason` is a sentence. `tried` counts
    the designs with sized springs, `runs` the whole runs.
    """

    design: Design
    changes: Changes | None
    verdicts: tuple[Verdict, ...]
    reason: str
    tried: int = 0
    runs: int = 1

    @property
    def changed(self) -> Design:
        """Return the design with its changes."""
        return changed(self.design, self.changes or {})


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A design with some keys changed, and its verdicts with sized springs that do not pass."""

    changes: Changes
    design: Design
    failed: tuple[Verdict, ...]

    @property
    def distance(self) -> float:
        """Return how far the verdicts that do not pass are off, all together [1]; 0 where all pass."""
        return sum(1.0 + _excess(verdict) for verdict in self.failed)


def _excess(verdict: Verdict) -> float:
    """Return how far a verdict is off in steps of its tolerance, as a logarithm [1]."""
    value, limit, tolerance = verdict.value, verdict.limit, verdict.tolerance
    if value is None:
        return _NO_NUMBER
    if not isinstance(limit, int | float) or not isinstance(tolerance, int | float):
        return 0.0
    allowed = max(tolerance * abs(limit) if verdict.relative else tolerance, 0.01 * abs(limit), 1e-9)
    return min(_NO_NUMBER, math.log1p(abs(value - limit) / allowed))


class Search:
    """Tries changes of a design with sized springs until a budget is spent; `keys` are those that were changed."""

    def __init__(self, base: SensorResult, fixed: frozenset[str] = frozenset(), budget: float = BUDGET) -> None:
        """Take a design that was run, and the keys that stay as they are."""
        self.design = base.design
        self.count = 0
        self.keys: dict[str, None] = {}
        self.least: Candidate | None = None
        self._base = base
        self._fixed = fixed
        self._left = budget

    def passing(self, wrong: Sequence[Verdict]) -> list[Candidate]:
        """Return the candidates that pass where these verdicts do not, the nearest first.

        Nearest is the one with the fewest keys changed, then with the smallest sum of |log ratio|.
        """
        bases = [Candidate(changes={}, design=self.design, failed=tuple(wrong))]
        for _ in range(MOST_KEYS):
            candidates = list(itertools.chain.from_iterable(map(self._one_key_more, bases)))
            passing = [one for one in candidates if not one.failed]
            if passing:
                self._left = max(self._left, 0.05 * BUDGET)  # to bring near what passes
                passing.sort(key=self._size)
                return sorted(map(self._nearer, passing[:_KEPT]), key=self._size)
            candidates.sort(key=lambda one: (one.distance, self._size(one)))
            if candidates and (self.least is None or candidates[0].distance < self.least.distance):
                self.least = candidates[0]
            bases = candidates[:_KEPT]
        return []

    def trial(self, changes: Changes) -> Candidate | None:
        """Return the candidate of some changes; None where they make no design, or one that cannot be solved."""
        if self._left <= 0.0:
            return None
        try:
            design = changed(self.design, changes)
            self._left -= _cost(design)
            self.count += 1
            verdicts = self._verdicts(design)
        except _UNSOLVED:
            return None
        return Candidate(changes=changes, design=design, failed=tuple(v for v in verdicts if v.passed is not True))

    def _size(self, candidate: Candidate) -> tuple[int, int, float]:
        return size(self.design, candidate.changes)

    def _one_key_more(self, base: Candidate) -> Iterator[Candidate]:
        """Yield the best candidate of each sweep of keys that a base has not changed yet and that are not fixed."""
        names = [verdict.name for verdict in base.failed]
        for sweep in sweeps(base.design, names, on_cells=_on_cells(base.design)):
            if not sweep or any(key in base.changes or key in self._fixed for key in sweep[0]):
                continue
            count = self.count
            best = self._best_of(base.changes, sweep)
            if self.count > count:
                self.keys.update(dict.fromkeys(sweep[0]))
            if best is not None:
                yield best

    def _best_of(self, changes: Changes, sweep: Sweep) -> Candidate | None:
        """Return the first candidate of a sweep that passes, else the one that fails least."""
        best: Candidate | None = None
        for further in sweep:
            candidate = self.trial({**changes, **further})
            if candidate is None:
                continue
            if best is None or candidate.distance < best.distance:
                best = candidate
            if not candidate.failed:
                break
        return best

    def _verdicts(self, design: Design) -> tuple[Verdict, ...]:
        """Return the verdicts of a design with ideal springs, fewer where the first ones decide that it fails."""
        if not design.tips.tip_layout.has_housing:
            return (NO_LINE,)
        if design.reading is not None and not design.tips.tip_shape.obeys_hertz:
            return (_FLAT_TIPS,)
        refuse_unsolvable(design)
        contact = self._contact(design)
        sizing = spring_sizing(design, contact, RunOptions())
        sags = design.press.attitude != "side" and design.tips.layout == self.design.tips.layout
        offsets = self._base.press.height_offsets if sags else ()
        springs = replace(ideal_springs(design, sizing), ideal_offsets_mm=offsets)
        if _on_cells(design):
            moduli = sorted({min(design.fruit.E_MPa), design.fruit.E_max_MPa})
            few = pressed_at(scene_of(design, offsets), contact, springs.C, moduli, TRAVELS)
            spread = displacement_verdict(few)
            if spread.passed is not True:
                printable = check_targets(design, contact=contact, sizing=sizing, springs=springs, parts=())
                return (*printable.verdicts, spread)
            self._left -= 2.0 * _cost(design)
        return check_targets(design, contact=contact, sizing=sizing, springs=springs).verdicts

    def _contact(self, design: Design) -> FruitCompliance:
        scene = unit_scene(design)
        if scene == unit_scene(self.design) and design.tips.side_mm == self.design.tips.side_mm:
            return self._base.contact
        return scene_compliance(scene, _ROUGH, "split")

    def _nearer(self, candidate: Candidate) -> Candidate:
        """Return a candidate each of whose numbers is as near to the design's as lets it pass, a little beyond."""
        if len(candidate.changes) > MOST_KEYS:  # a whole sensor of its own
            return candidate
        for key, value in candidate.changes.items():
            before = value_of(self.design, key)
            if isinstance(value, float) and isinstance(before, float) and before * value > 0.0:
                candidate = self._bisected(candidate, key, before, value)
        return candidate

    def _bisected(self, candidate: Candidate, key: str, fails: float, passes: float) -> Candidate:
        sign = 1.0 if passes > fails else -1.0
        for _ in range(_BISECTIONS_ON_CELLS if _on_cells(candidate.design) else _BISECTIONS):
            middle = math.sqrt(fails * passes)
            trial = self.trial({**candidate.changes, key: middle})
            if trial is not None and not trial.failed:
                passes = middle
            else:
                fails = middle
        value = rounded(passes * (1.0 + sign * _BEYOND), passes * (1.0 + 2.0 * sign * _BEYOND))
        final = self.trial({**candidate.changes, key: value})
        return candidate if final is None or final.failed else final


def _on_cells(design: Design) -> bool:
    """Say whether contact of a design is solved on cells."""
    return not scene_of(design).linear and not design.tips.tip_shape.obeys_hertz


def _cost(design: Design) -> float:
    """Return what a trial costs, in about hundredths of a processor second."""
    if _on_cells(design):
        return 80.0
    return 8.0 if design.reading is None else 30.0


def suggestion(
    design: Design, options: RunOptions, fixed: frozenset[str] = frozenset(), progress: Progress = silent
) -> Suggestion:
    """Return the nearest design that a run shows to pass, without changing the keys that are `fixed`.

    Raises as `run` where the design itself cannot be run.
    """
    progress("runs the design as it is")
    options = replace(options, out=None)
    result = run(design, options)
    if result.passed:
        return Suggestion(design=design, changes={}, verdicts=result.verdicts, reason="passes as it is")
    wrong = [verdict for verdict in result.verdicts if verdict.passed is not True]
    if result.springs.monolithic:
        finer = [tolerance_remedy(verdict, options.tolerance) for verdict in wrong]
        if all(finer):
            return Suggestion(design=design, changes=None, verdicts=result.verdicts, reason=str(finer[0]))
    progress("tries changes with ideal springs")
    search = Search(result, fixed)
    passing = search.passing(wrong)
    return _proved(result, search, passing, [*_travels(result, fixed)], options, progress)


def _travels(result: SensorResult, fixed: frozenset[str]) -> Iterator[Changes]:
    """Yield the shorter travel that solved strains and clearances ask for, where it is not fixed."""
    travels = []
    for verdict in result.verdicts:
        travel = shorter_travel(verdict, result.design, result.springs) if verdict.passed is not True else None
        if travel is not None and verdict.name != "bruise":
            travels.append(travel)
    if travels and _TRAVEL not in fixed:
        yield {_TRAVEL: min(travels)}


def _proved(
    result: SensorResult,
    search: Search,
    passing: Sequence[Candidate],
    first: Sequence[Changes],
    options: RunOptions,
    progress: Progress,
) -> Suggestion:
    """Return the first candidate that a run shows to pass; one that its own solve refutes is tried with less travel."""
    design = result.design
    runs = 1
    waiting = [*first, *(candidate.changes for candidate in passing)]
    while waiting and runs <= MOST_RUNS:
        changes = waiting.pop(0)
        progress(f"runs the candidate with {in_words(changes)}")
        runs += 1
        try:
            proof = run(changed(design, changes), options)
        except _UNSOLVED:
            continue
        if proof.passed:
            reason = f"passes, as a whole run shows: {len(proof.verdicts)} verdicts"
            return Suggestion(
                design=design, changes=changes, verdicts=proof.verdicts, reason=reason, tried=search.count, runs=runs
            )
        waiting[:0] = [{**changes, **less} for less in _travels(proof, frozenset(changes))]
    reason = _failure(search, passing)
    return Suggestion(
        design=design, changes=None, verdicts=result.verdicts, reason=reason, tried=search.count, runs=runs
    )


def _failure(search: Search, passing: Sequence[Candidate]) -> str:
    """Return why nothing is suggested, with what comes nearest."""
    if passing:
        return f"none found: what passes with ideal springs, {in_words(passing[0].changes)}, fails its run"
    if search.least is None:
        return "none found: no key of the design is known to help, or every other value of it is refused"
    worst = search.least.failed[0]
    value = "no value" if worst.value is None else f"{worst.value:.3g}"
    nearest = f"nearest: {in_words(search.least.changes)}, where {worst.name} still is {value} against {worst.limit}"
    return f"none found: of {search.count} designs with other {', '.join(search.keys)} none passes; {nearest}"
