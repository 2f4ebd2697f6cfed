"""Search for the passing design nearest to a given design, with ideal springs, and confirm it by a whole run."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pipeline import run
from pipeline.find.candidate import Candidate
from pipeline.find.changes import Changes, Sweep, change_design, in_words, size, sweeps, value_of
from pipeline.find.proved_candidate import UNSOLVED, Proof, prove_first
from pipeline.options import RunOptions
from pipeline.response.scaled_scene import unit_scene
from pipeline.response.scene_press import TRAVELS, scene_of
from pipeline.result import SensorResult
from pipeline.sensor import Sensor
from pipeline.storage.stopwatch import Progress, ignore_progress
from pipeline.verdicts.hints import find_shorter_travel, least_travel, tolerance_hint
from pipeline.verdicts.rules import displacement_verdict
from sensor.design.parameters import Design
from sensor.verdict import Verdict, judge
from sensor.words import rounded
from solve.contact.linear_response import travels
from solve.contact.response import scene_response

BUDGET = 6000.0  # budget for trials, in units of about 0.01 s of CPU time, so about a minute
_RESERVE = 0.05  # fraction of the budget that is reserved for moving candidates nearer to the base design
MAX_RUNS = 4  # maximum number of runs of candidates, each of which takes about ten seconds
MAX_KEYS = 3  # maximum number of keys that are changed together
_BEAM_WIDTH = 4  # number of candidates that each round of the beam search keeps
_BISECTIONS = 6  # number of bisections by which a number is moved back towards the base design
_BISECTIONS_ON_CELLS = 2  # number of bisections if contact is solved on cells, where trials are expensive
_MARGIN = 0.05  # relative margin added to a passing value, so that springs solved by finite elements pass too
ROUGH = 0.02  # relative tolerance of the springs [1], at which the contact is accurate enough to try a change
_TRAVEL = "press.travel_mm"


@dataclass(frozen=True, kw_only=True)
class Suggestion:
    """The changes that make a design pass; empty if it passes unchanged, None if no changes were found.

    `verdicts` come from the run that confirms the changed design, or else from the run of the unchanged design.
    `reason` is shown to the user. `tried` is the number of designs that were tried with sized springs, and `runs` the
    number of whole runs.
    """

    design: Design
    changes: Changes | None
    verdicts: tuple[Verdict, ...]
    reason: str = "passes, confirmed by a whole run"
    tried: int = 0
    runs: int = 1

    @property
    def changed(self) -> Design:
        """Return the design with its changes."""
        return change_design(self.design, self.changes or {})


class Search:
    """A beam search over changes of a design. Each design is tried with sized springs, until the budget is used up.

    `tried` is the number of trials. `nearest_miss` is the candidate that failed but came nearest to passing, or None.
    """

    def __init__(self, base: SensorResult, fixed: frozenset[str], progress: Progress = ignore_progress) -> None:
        """Start from `base`, the result of a run of the design, with the keys in `fixed` unchanged.

        `progress` is called with a text for each trial.
        """
        self.tried = 0
        self._progress = progress
        self.nearest_miss: Candidate | None = None
        self._base = base
        self._fixed = fixed
        self._budget_left = BUDGET

    def find_passing(self, failed_verdicts: Sequence[Verdict]) -> list[Candidate]:
        """Search for candidates that pass, and return the nearest first; the base design has the `failed_verdicts`.

        Each round makes one more change to the best candidates of the previous round, which are the beam. The search
        ends at the first round with a candidate that passes. The nearest candidate changes the fewest keys. Among
        candidates with equally many keys, it changes the fewest requirements, and then has the smallest ratios of new
        to old numbers. The result is empty if no candidate passes. `tried` and `nearest_miss` are updated.
        """
        beam = [Candidate(changes={}, verdicts=tuple(failed_verdicts))]
        for _ in range(MAX_KEYS):
            candidates = []
            for start in beam:
                candidates += self._add_one_change(start)
            passing = sorted([candidate for candidate in candidates if not candidate.failed], key=self._size)
            if passing:
                # The trials of `_move_nearer` need a part of the budget, so at least a reserve is made available.
                self._budget_left = max(self._budget_left, _RESERVE * BUDGET)
                nearer = [self._move_nearer(candidate) for candidate in passing[:_BEAM_WIDTH]]
                return sorted(nearer, key=self._size)
            beam = sorted(candidates, key=lambda candidate: (candidate.rank, self._size(candidate)))[:_BEAM_WIDTH]
            self._update_nearest_miss(beam)
        return []

    def _update_nearest_miss(self, failed: Sequence[Candidate]) -> None:
        """Keep the failed candidate of the lowest rank, which came nearest to passing; an earlier one loses a tie."""
        candidates = [*failed, self.nearest_miss] if self.nearest_miss else failed
        self.nearest_miss = min(candidates, key=lambda candidate: candidate.rank, default=None)

    def try_changes(self, changes: Changes) -> Candidate | None:
        """Try the base design with the given changes, and return the candidate with its verdicts on sized springs.

        The cost of the trial is taken from the budget. The result is None if the budget is used up, or if the changed
        design is invalid or cannot be solved. A changed travel that is too short for the height errors of printed tips
        also gives None.
        """
        if self._budget_left <= 0.0:
            return None
        try:
            design = change_design(self._base.design, changes)
            if _TRAVEL in changes and design.press.travel_mm < least_travel(design):
                return None
            self._budget_left -= _trial_cost(design)
            self.tried += 1
            self._progress(f"trying changes with ideal springs, design {self.tried}: {in_words(changes)}")
            verdicts = self._trial_verdicts(design)
        except UNSOLVED:
            return None
        return Candidate(changes=changes, verdicts=verdicts)

    def _changed_design(self, candidate: Candidate) -> Design:
        """Return the base design with the changes of a candidate."""
        return change_design(self._base.design, candidate.changes)

    def _size(self, candidate: Candidate) -> tuple[int, int, float]:
        """Return the size of a candidate's changes to the base design, which can be compared."""
        return size(self._base.design, candidate.changes)

    def _add_one_change(self, start: Candidate) -> list[Candidate]:
        """Try each sweep from the candidate `start`, and return the best candidate of each sweep.

        A sweep is a list of changes of the same keys, the smallest change first. Sweeps of keys that are fixed, or that
        `start` has already changed, are omitted.
        """
        failed_names = [verdict.name for verdict in start.failed]
        design = self._changed_design(start)
        unavailable_keys = self._fixed | start.changes.keys()
        best = []
        for sweep in sweeps(design, failed_names, is_solved_on_cells=scene_of(design).is_solved_on_cells):
            if not sweep[0] or not unavailable_keys.isdisjoint(sweep[0]):  # all changes of a sweep have the same keys
                continue
            candidate = self._try_sweep(start, sweep)
            if candidate is not None:
                best.append(candidate)
        return best

    def _try_sweep(self, start: Candidate, sweep: Sweep) -> Candidate | None:
        """Try the changes of a sweep from the candidate `start` until one passes, and return the best candidate.

        The result is None if none of the changes can be tried.
        """
        trials: list[Candidate] = []
        for change in sweep:
            candidate = self.try_changes({**start.changes, **change})
            if candidate is None:
                continue
            trials.append(candidate)
            if not candidate.failed:
                break
        return min(trials, key=lambda candidate: candidate.rank, default=None)

    def _trial_verdicts(self, design: Design) -> tuple[Verdict, ...]:
        """Return the verdicts of a design with ideal springs, or only some of them if these already show that it fails.

        A trial with all presses takes further cost from the budget.
        """
        if design.reading is not None and not design.tips.tip_shape.obeys_hertz:
            # Readings of flat tips take too long to be tried, so such a design is treated as failed.
            return (judge("reading.bias", None, "readings of flat tips", limit="tips with a dome"),)
        sensor = self._sized_sensor(design)
        if scene_of(design).is_solved_on_cells:
            # Solving P at two moduli costs a tenth of solving all presses, and often shows that the design fails.
            displacement = _displacement_at_two_moduli(design, sensor)
            if displacement.passed is not True:
                return (*sensor.verdicts_on("print"), displacement)
            # With the contact, a trial with all presses costs three times as much as a trial that ends here.
            self._budget_left -= 2.0 * _trial_cost(design)
        return sensor.verdicts

    def _sized_sensor(self, design: Design) -> Sensor:
        """Return the sensor of a design with ideal springs, which reuses results from the run of the base design.

        The solved contact is reused if the design has the same contact problem at the same size. The sag of the tips
        under their weight is assumed to be the same if the layouts are equal.
        """
        base = self._base
        has_same_scene = unit_scene(design) == unit_scene(base.design)
        has_same_contact = has_same_scene and design.tips.side_mm == base.design.tips.side_mm
        # a sensor held sideways has no sag
        has_same_sag = design.press.attitude != "side" and design.tips.layout == base.design.tips.layout
        return Sensor(
            design=design,
            options=RunOptions(tolerance=ROUGH),
            springs_as="sized",
            known_contact=base.contact if has_same_contact else None,
            known_offsets_mm=base.press.scene.height_offset_mm if has_same_sag else (),
        )

    def _move_nearer(self, candidate: Candidate) -> Candidate:
        """Return a candidate with its numbers moved back towards the base design, as far as it still passes.

        The numbers are moved one after another. Each number gets a margin from the nearest value that passes, and is
        rounded away from the failing value. Strings, and numbers whose sign was changed, keep their new values.
        """
        scene = scene_of(self._changed_design(candidate))
        bisections = _BISECTIONS_ON_CELLS if scene.is_solved_on_cells else _BISECTIONS
        nearest = candidate
        for key, new_value in candidate.changes.items():
            base_value = value_of(self._base.design, key)
            if not (isinstance(new_value, float) and isinstance(base_value, float)):
                continue
            if base_value * new_value <= 0.0:  # no logarithmic scale contains both values
                continue
            margin = _MARGIN if new_value > base_value else -_MARGIN
            passing_value = self._bisect(nearest, key, base_value, new_value, bisections)
            # Rounding towards twice the margin never makes the margin smaller.
            value = rounded(passing_value * (1.0 + margin), towards=passing_value * (1.0 + 2.0 * margin))
            rounded_candidate = self.try_changes({**nearest.changes, key: value})
            # if the rounded value fails, the key keeps its former value, at which the candidate passes
            if rounded_candidate is not None and not rounded_candidate.failed:
                nearest = rounded_candidate
        return nearest

    def _bisect(
        self, candidate: Candidate, key: str, failing_value: float, passing_value: float, bisections: int
    ) -> float:
        """Return the value of a key nearest to `failing_value` at which a candidate is known to pass.

        The logarithm of the value is bisected between the two given values, of which only `passing_value` passes. Each
        of the `bisections` costs one trial.
        """
        for _ in range(bisections):
            middle = math.sqrt(failing_value * passing_value)
            trial = self.try_changes({**candidate.changes, key: middle})
            if trial is not None and not trial.failed:
                passing_value = middle
            else:
                failing_value = middle
        return passing_value


def _displacement_at_two_moduli(design: Design, sensor: Sensor) -> Verdict:
    """Return the verdict on how P depends on the travel, from presses at the smallest modulus and at E_max only.

    `sensor` is the sensor of the design with ideal springs.
    """
    moduli = sorted({min(design.fruit.E_MPa), design.fruit.E_max_MPa})
    scene = scene_of(design, sensor.springs.ideal_offsets_mm)
    x = travels(design.press.travel_mm, TRAVELS)
    return displacement_verdict(scene_response(scene, sensor.contact, sensor.springs.C, moduli, x))


def _trial_cost(design: Design) -> float:
    """Return the cost of a trial as measured, in units of about 0.01 s of CPU time.

    Trials on cells are the most expensive. Among all other trials, a design with readings costs more than a design
    without readings.
    """
    if scene_of(design).is_solved_on_cells:
        return 80.0
    return 8.0 if design.reading is None else 30.0


def suggestion(
    design: Design, options: RunOptions, fixed: frozenset[str] = frozenset(), progress: Progress = ignore_progress
) -> Suggestion:
    """Search for the passing design nearest to a given design; the keys in `fixed` do not change.

    The unchanged design is run first. If it does not pass, candidates are searched with ideal springs, and the nearest
    ones are run until one passes. All runs have the given `options`, but write no files. If no changes are found, the
    suggestion states the reason. Raises the same errors as `run` if the given design cannot be run.
    """
    progress("running the unchanged design")
    run_options = replace(options, out=None)
    result = run(design, run_options)
    if result.passed:
        return Suggestion(design=design, changes={}, verdicts=result.verdicts, reason="passes as it is")
    failed_verdicts = [verdict for verdict in result.verdicts if verdict.passed is not True]
    none_found = Suggestion(design=design, changes=None, verdicts=result.verdicts)
    finer_tolerance_hint = _finer_tolerance_hint(result, failed_verdicts, run_options.tolerance)
    if finer_tolerance_hint is not None:
        return replace(none_found, reason=finer_tolerance_hint)
    search = Search(result, fixed, progress)
    passing = search.find_passing(failed_verdicts)

    def make_design(candidate: Candidate) -> Design:
        """Report the run of a candidate, and return its design."""
        progress(f"running the candidate with {in_words(candidate.changes)}")
        return change_design(design, candidate.changes)

    def with_shorter_travel(proof: Proof) -> list[Candidate]:
        """Return the candidate with a shorter travel, if the failed run requires it."""
        return [] if proof.result is None else _shorten_travel(proof.result, proof.candidate.changes, fixed)

    # A shorter travel for the strains and clearances of the unchanged design is tried first.
    candidates = [*_shorten_travel(result, {}, fixed), *passing]
    proof = prove_first(candidates, make_design, run_options, MAX_RUNS, with_shorter_travel)
    runs = 1 if proof is None else 1 + proof.runs  # with the run of the unchanged design
    if proof is None or proof.result is None or not proof.passed:
        return replace(none_found, reason=_failure_reason(search, passing), tried=search.tried, runs=runs)
    changes = proof.candidate.changes
    return Suggestion(design=design, changes=changes, verdicts=proof.result.verdicts, tried=search.tried, runs=runs)


def _finer_tolerance_hint(result: SensorResult, failed_verdicts: Sequence[Verdict], tolerance: float) -> str | None:
    """Return the hint to use a finer tolerance, if this may decide every verdict that did not pass; else None.

    `result` is a run with the given `tolerance` [1]. A finer tolerance does not reduce the error of glued pins, so
    springs with pins get no hint.
    """
    if not result.springs.monolithic:
        return None
    hints = [tolerance_hint(verdict, tolerance) for verdict in failed_verdicts]
    return str(hints[0]) if all(hints) else None


def _shorten_travel(result: SensorResult, changes: Changes, fixed: frozenset[str]) -> list[Candidate]:
    """Return a list of one candidate, with the shorter travel that failed verdicts on strains and clearances require.

    `result` is a run of the design with `changes`, to which the travel is added. The shortest required travel is used.
    The list is empty if no failed verdict requires a shorter travel, or if the travel is already changed or fixed.
    """
    shorter_travels = []
    if _TRAVEL not in {*changes, *fixed}:
        for verdict in result.verdicts:
            shorter = find_shorter_travel(verdict, result.design, result.springs)
            if verdict.passed is not True and verdict.row.by_travel != "pressure" and shorter is not None:
                shorter_travels.append(shorter)
    return [Candidate(changes={**changes, _TRAVEL: min(shorter_travels)}, verdicts=())] if shorter_travels else []


def _failure_reason(search: Search, passing: Sequence[Candidate]) -> str:
    """Return a sentence that states why there is no suggestion, and which candidate came nearest to passing."""
    if passing:
        return f"none found: the design that passes with ideal springs, {in_words(passing[0].changes)}, fails its run"
    nearest = search.nearest_miss
    if nearest is None:
        return "none found: no known change can help, or every changed design is invalid"
    still_fail = ", ".join(verdict.name for verdict in nearest.failed)
    miss = f"nearest: {in_words(nearest.changes)}, where {still_fail} still fails"
    return f"none found: none of {search.tried} changed designs passes; {miss}"
