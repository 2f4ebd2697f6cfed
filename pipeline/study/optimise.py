"""The design that makes a number of its report least while verdicts pass, by differential evolution.

R. Storn, K. Price, J. Global Optimization 11 (1997) 341, doi 10.1023/A:1008202821328, as SciPy has it.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeGuard

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from cad.design.design_file import design_as_toml
from cad.quantity import validation_error
from pipeline import run
from pipeline.options import RunOptions
from pipeline.storage.files import is_ours, refuse_taken, write_files
from pipeline.storage.folder import refuse_unusable
from pipeline.study.columns import Floats
from pipeline.study.page import refuse_page
from pipeline.study.points import design_of, point_at
from pipeline.study.store import StudyStore, study_store
from pipeline.study.study_file import Study
from pipeline.study.tasks import PointResult, lost_points, solve_points
from pipeline.study.variation import Span
from pipeline.study.workers import Engine, ProgressReport, completed

MARGIN = 0.01  # of a limit, kept from it: the plate of printed springs moves each number by less
MOST_RUNS = 20
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
    come. Raises InputError where not all keys vary over spans.
    """
    for key, varied in study.vary.items():
        if not isinstance(varied, Span):
            raise validation_error(key, type(varied).__name__, "", "a span, from and to", "an optimum lies in a span")
    with study_store(folder, study) as store:
        _evolve(study, store, engine, progress)
        candidates = [candidate_of(study, result) for result in store.rows()]
    return tuple(sorted(candidates, key=lambda candidate: (candidate.cost, candidate.result.number)))


def _evolve(study: Study, store: StudyStore, engine: Engine, progress: ProgressReport | None) -> None:
    """Solve generations of candidates until the points that the study allows are spent; all go into its store."""
    results = {result.number: result for result in store.rows()}
    solve = partial(solve_points, study, None)
    asked = 0

    def costs(fractions: Floats) -> list[float]:
        """Return the cost of each member of a generation, shape (keys, members); those that are stored are not solved.

        Each is known by its number, as the same study asks for the same members in the same order.
        """
        nonlocal asked
        points = [point_at(study, number, member) for number, member in enumerate(fractions.T.tolist(), asked)]
        asked += len(points)
        missing = [[point] for point in points if point.number not in results]
        with closing(completed(engine, solve, missing, lost_points)) as ended:
            for _, solved in ended:
                store.put(solved)
                results.update({result.number: result for result in solved})
                if progress is not None:
                    progress(len(results), max(study.goal.evaluations, len(results)))
        return [candidate_of(study, results[point.number]).cost for point in points]

    keys = len(study.vary)
    differential_evolution(
        costs,  # type: ignore[arg-type]  # a whole generation at a time, for which there are no stubs
        Bounds(np.zeros(keys), np.ones(keys)),
        maxiter=max(1, study.goal.evaluations // (_MEMBERS * keys) - 1),
        popsize=_MEMBERS,
        tol=0.0,
        rng=np.random.default_rng(study.seed),
        polish=False,
        x0=_base_fractions(study),
        updating="deferred",
        vectorized=True,
    )


def _base_fractions(study: Study) -> list[float] | None:
    """Return the base design as fractions of the spans [1], where the search begins; None where it lies outside."""
    fractions = []
    for key, span in study.vary.items():
        table, _, name = key.partition(".")
        value = study.base.get(table, {}).get(name)
        if not isinstance(span, Span) or not _is_number(value) or not span.low <= value <= span.high:
            return None
        fractions.append(span.fraction_of(value))
    return fractions


def is_base(study: Study, candidate: Candidate) -> bool:
    """Say whether a candidate is the base design itself, where the search began."""
    return candidate.result.number == 0 and _base_fractions(study) is not None


def candidate_of(study: Study, result: PointResult) -> Candidate:
    """Return a point as a candidate: refused and failed ones have no value."""
    if result.status != "done":
        return Candidate(result=result, value=math.nan, violation=math.inf)
    value = result.values[study.goal.minimise]
    return Candidate(
        result=result,
        value=value if _is_number(value) else math.nan,
        violation=sum(_violation(name, result.values) for name in study.goal.under),
    )


def _violation(name: str, values: Mapping[str, object]) -> float:
    """Return by how much a verdict fails, or comes too near to its limit [1]; 0 where it passes."""
    value, limit, tolerance, passed = (
        values[f"verdicts.{name}.{field}"] for field in ("value", "limit", "tolerance", "passed")
    )
    if passed is None and name.startswith("printable."):
        return 0.0  # whether a process can make a spring is left to the run to decide
    if not _is_number(value) or not _is_number(limit):
        return 0.0 if passed else 1.0
    width = abs(tolerance) if _is_number(tolerance) else 0.0
    scale = abs(limit) or width or 1.0  # a limit of 0 is no measure of a distance, and without a tolerance the unit is
    distance = abs(value - limit) / scale
    if not passed:
        return MARGIN + distance
    return 0.0 if width else max(0.0, MARGIN - distance)  # a target is met on either side, a limit kept by a margin


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def refuse_occupied(folder: Path, *, force: bool = False) -> None:
    """Raise InputError where a search could not write its results into its folder, before anything is solved."""
    refuse_unusable(folder / RUN, force=force)
    refuse_taken([folder / DESIGN], "--out", force=force, renew=True)
    refuse_page(folder, force=force)


def prove(study: Study, candidates: Sequence[Candidate], folder: Path, *, force: bool = False) -> Proof | None:
    """Return the first of the best twenty candidates whose run passes all verdicts, else the last that was run.

    The outputs of its run are in `best`, and where it passes, its design file is `design.toml` in the folder. None
    where no candidate passes the verdicts of the search. Raises as a run, and InputError as `write_files`.
    """
    proof = None
    passing = [candidate for candidate in candidates if candidate.violation == 0.0]
    for candidate in passing[:MOST_RUNS]:
        design = replace(design_of(study, candidate.result.settings), name=study.name)
        passed = run(design, RunOptions(out=folder / RUN, tolerance=study.tol, force=force)).passed
        proof = Proof(candidate=candidate, design=None, passed=passed)
        if passed:
            text = design_as_toml(design)
            write_files({folder / DESIGN: text.encode()}, "--out", force=force, renew=True)
            return replace(proof, design=folder / DESIGN)
    if is_ours(folder / DESIGN):  # that of a shorter search, and `best` no longer holds its run
        (folder / DESIGN).unlink()
    return proof
