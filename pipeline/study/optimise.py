"""The design that makes a number of its report least while verdicts pass, by differential evolution.

R. Storn, K. Price, J. Global Optimization 11 (1997) 341, doi 10.1023/A:1008202821328, as SciPy has it.
"""

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeGuard

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from cad.design.design_file import design_as_toml
from cad.design.parameters import Design
from cad.quantity import InputError, validation_error
from pipeline import run
from pipeline.options import RunOptions
from pipeline.storage.files import is_ours, refuse_taken, write_files
from pipeline.storage.folder import refuse_unusable
from pipeline.study.columns import Floats
from pipeline.study.page import PAGE
from pipeline.study.points import Point, design_of, point_at
from pipeline.study.store import STORE, StudyStore, study_store
from pipeline.study.study_file import VERDICT_FIELDS, Study
from pipeline.study.tasks import PointResult, lost_points, solve_points
from pipeline.study.variation import Span
from pipeline.study.workers import Engine, ProgressReport, completed

MARGIN = 0.01  # of a limit, kept from it: the plate of printed springs moves each number by less
MOST_RUNS = 5
DESIGN = "design.toml"
RUN = "best"
_INFEASIBLE = 2.0  # above the costs of designs that pass, which lie from -1 to 1
_REFUSED = 4.0
_MEMBERS = 8  # of a generation, for each key that varies


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A point of the search: its result, the number to be made least, and by how much verdicts fail [1], 0 for none."""

    result: PointResult
    value: float
    violation: float

    @property
    def cost(self) -> float:
        """Return a number [1] in the order of the designs: those that pass, that fail verdicts, that are refused.

        The number to be made least, and among designs that fail the violation, are mapped by v / (1 + |v|).
        """
        if not math.isfinite(self.value) or not math.isfinite(self.violation):
            return _REFUSED
        if self.violation == 0.0:
            return self.value / (1.0 + abs(self.value))
        return _INFEASIBLE + self.violation / (1.0 + self.violation)


@dataclass(frozen=True, kw_only=True)
class Proof:
    """A candidate that was run, whether all verdicts passed, None where one is undecided, and its file if they did."""

    candidate: Candidate
    design: Path | None
    passed: bool | None


def search(study: Study, folder: Path, engine: Engine, progress: ProgressReport | None = None) -> tuple[Candidate, ...]:
    """Return every candidate of a search, the best first; all are points of the study's store.

    A search that was ended goes on: it asks for the same candidates again, and those that are stored are not solved.
    With more `evaluations` it asks for the same ones and then for more: no step of the method looks at how many are to
    come. Raises InputError where not all keys are those of a design that vary over spans, and where what is to be
    made least is no number.
    """
    for key, varied in study.vary.items():
        if not isinstance(varied, Span):
            raise validation_error(key, type(varied).__name__, "", "a span, from and to", "an optimum lies in a span")
    if not (folder / STORE).exists():
        _refuse_no_number(study)
    with study_store(folder, study) as store:
        _evolve(study, store, engine, progress)
        candidates = [candidate_of(study, result) for result in store.rows()]
    return tuple(sorted(candidates, key=lambda candidate: (candidate.cost, candidate.result.number)))


def _refuse_no_number(study: Study) -> None:
    """Solve the base itself; raise InputError where it has a text or a truth value for what is to be made least."""
    (base,) = solve_points(study, None, [Point(number=0, settings={})])
    value = base.values.get(study.goal.minimise)
    if value is not None and not _is_number(value):
        bound = f"a key whose value is a number, and that of the base is {value!r}"
        raise validation_error("optimise.minimise", study.goal.minimise, "", bound, "name another key of report.json")


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _evolve(study: Study, store: StudyStore, engine: Engine, progress: ProgressReport | None) -> None:
    """Solve generations of candidates until the points that the study allows are spent; all go into its store."""
    results = {result.number: result for result in store.rows()}
    asked = 0

    def costs(_objective: object, members: Iterable[Sequence[float]]) -> list[float]:
        """Return the cost of each member of a generation; those that are stored are not solved."""
        nonlocal asked
        points = [point_at(study, number, list(map(float, member))) for number, member in enumerate(members, asked)]
        asked += len(points)
        for point in points:
            if point.number in results and results[point.number].settings != point.settings:
                msg = f"{store.path}: must hold the candidates of this search, and point {point.number} is another"
                raise InputError(msg)
        missing = [[point] for point in points if point.number not in results]
        with closing(completed(engine, partial(solve_points, study, None), missing, lost_points)) as ended:
            for _, solved in ended:
                store.put(solved)
                results.update({result.number: result for result in solved})
                if progress is not None:
                    progress(len(results), max(study.goal.evaluations, len(results)))
        return [candidate_of(study, results[point.number]).cost for point in points]

    keys = len(study.vary)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns that a map of our own needs deferred updating, which it is given
        differential_evolution(
            _not_called,
            Bounds(np.zeros(keys), np.ones(keys)),
            maxiter=max(1, study.goal.evaluations // (_MEMBERS * keys) - 1),
            popsize=_MEMBERS,
            tol=0.0,
            rng=np.random.default_rng(study.seed),
            polish=False,
            x0=_base_fractions(study),
            updating="deferred",
            workers=costs,
        )


def _not_called(_fractions: Floats) -> float:
    """Stand for the objective, which `workers` computes for whole generations [1]."""
    return math.nan


def _base_fractions(study: Study) -> Floats | None:
    """Return the base design as fractions of the spans [1], where the search begins; None where it lies outside."""
    design = design_of(study, {})
    fractions = []
    for key, span in study.vary.items():
        table, _, name = key.partition(".")
        value = getattr(getattr(design, table), name, None)
        if not isinstance(span, Span) or not _is_number(value) or not span.low <= value <= span.high:
            return None
        fractions.append(span.fraction_of(float(value)))
    return np.array(fractions)


def base_candidate(study: Study, candidates: Sequence[Candidate]) -> Candidate | None:
    """Return the candidate that is the base design itself, where the search began; None where it is outside."""
    if _base_fractions(study) is None:
        return None
    return next((candidate for candidate in candidates if candidate.result.number == 0), None)


def candidate_of(study: Study, result: PointResult) -> Candidate:
    """Return a point as a candidate: refused and failed ones have no value."""
    if result.status != "done":
        return Candidate(result=result, value=math.nan, violation=math.inf)
    value = result.values[study.goal.minimise]
    return Candidate(
        result=result,
        value=float(value) if _is_number(value) else math.nan,
        violation=sum(_violation(name, result.values) for name in study.goal.under),
    )


def _violation(name: str, values: Mapping[str, object]) -> float:
    """Return by how much a verdict fails, or comes too near to its limit [1]; 0 where it passes."""
    value, limit, tolerance, passed = (values[f"verdicts.{name}.{word}"] for word in VERDICT_FIELDS)
    if passed is None and name.startswith("printable."):
        return 0.0  # whether a process can make a spring is left to the run to decide
    if not _is_number(value) or not _is_number(limit):
        return 0.0 if passed else 1.0
    scale = abs(limit)
    if scale == 0.0:  # no measure of a distance: the tolerance is, or the unit of the verdict
        scale = abs(tolerance) if _is_number(tolerance) and tolerance else 1.0
    distance = abs(value - limit) / scale
    if not passed:
        return MARGIN + distance
    is_target = bool(tolerance)  # which is met on either side; a limit is kept by a margin
    return 0.0 if is_target else max(0.0, MARGIN - distance)


def refuse_occupied(folder: Path, *, force: bool = False) -> None:
    """Raise InputError where a search could not write its results into its folder, before anything is solved."""
    refuse_unusable(folder / RUN, force=force)
    refuse_taken((folder / DESIGN, folder / PAGE), "--out", force=force, renew=True)


def prove(study: Study, candidates: Sequence[Candidate], folder: Path, *, force: bool = False) -> Proof | None:
    """Return the first of the best five candidates whose run passes all verdicts, else the last that was run.

    The outputs of its run are in `best`, and where it passes, its design file is `design.toml` in the folder. None
    where no candidate passes the verdicts of the search. Raises as a run, and InputError as `write_files`.
    """
    proof = None
    passing = [candidate for candidate in candidates if candidate.violation == 0.0]
    for candidate in passing[:MOST_RUNS]:
        design = _named_design(study, candidate)
        passed = run(design, RunOptions(out=folder / RUN, tolerance=study.tol, force=force)).passed
        proof = Proof(candidate=candidate, design=None, passed=passed)
        if passed:
            text = design_as_toml(design)
            write_files({folder / DESIGN: text.encode()}, "--out", force=force, renew=True)
            return replace(proof, design=folder / DESIGN)
    if is_ours(folder / DESIGN):  # that of a shorter search, and `best` no longer holds its run
        (folder / DESIGN).unlink()
    return proof


def _named_design(study: Study, candidate: Candidate) -> Design:
    """Return the design of a candidate, named for the study."""
    return design_of(replace(study, base={**study.base, "name": study.name}), candidate.result.settings)
