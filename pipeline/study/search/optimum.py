"""The design that makes a number of its report least while verdicts pass, by differential evolution.

R. Storn, K. Price, J. Global Optimization 11 (1997) 341, doi 10.1023/A:1008202821328, as SciPy has it.
"""

import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution

from cad.design.parameters import Design
from cad.quantity import InputError, validation_error
from pipeline.study.levels.printed import PRINTED_KEYS
from pipeline.study.points import Point, design_of, point_at
from pipeline.study.store import STORE, StudyStore, study_store
from pipeline.study.study_file import Study
from pipeline.study.tasks import PointResult, Task, lost_task, solve_task
from pipeline.study.variation import Span
from pipeline.study.workers import Engine, completed

Floats = NDArray[np.float64]
Progress = Callable[[int, int], None]

MARGIN = 0.01  # of a limit, kept from it: the plate of printed springs moves each number by less
_INFEASIBLE, _REFUSED = 2.0, 4.0  # above the costs of designs that pass, which lie from -1 to 1
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
        return _bounded(self.value) if self.violation == 0.0 else _INFEASIBLE + _bounded(self.violation)


def _bounded(number: float) -> float:
    """Return v / (1 + |v|), between -1 and 1 and in the order of v [1]."""
    return number / (1.0 + abs(number))


def search(study: Study, folder: Path, engine: Engine, progress: Progress | None = None) -> tuple[Candidate, ...]:
    """Return every candidate of a search, the best first; all are points of the study's store.

    A search that was ended goes on: it asks for the same candidates again, and those that are stored are not solved.
    With more `evaluations` it asks for the same ones and then for more: no step of the method looks at how many are to
    come. Raises InputError where not all keys are those of a design that vary over spans, and where what is to be
    made least is no number.
    """
    for key, varied in study.vary.items():
        if not isinstance(varied, Span):
            raise validation_error(key, type(varied).__name__, "", "a span, from and to", "an optimum lies in a span")
        if key in PRINTED_KEYS:
            bound = "a key of the design: nobody chooses by how much a print misses its drawing"
            raise validation_error("vary", key, "", bound, "vary it in a study")
    if not (folder / STORE).exists():
        _refuse_no_number(study)
    with study_store(folder, study) as store:
        _Search(study, store, engine, progress).run()
        found = [candidate(study, result) for result in store.rows()]
    return tuple(sorted(found, key=lambda one: (one.cost, one.result.number)))


def _refuse_no_number(study: Study) -> None:
    """Solve the base itself; raise InputError where it has a text or a truth value for what is to be made least."""
    (own,) = solve_task(Task(study=study, points=(Point(number=0, settings={}),)))
    value = own.values.get(study.goal.minimise)
    if value is not None and not _is_number(value):
        bound = f"a key whose value is a number, and that of the base is {value!r}"
        raise validation_error("optimise.minimise", study.goal.minimise, "", bound, "name another key of report.json")


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def candidate(study: Study, result: PointResult) -> Candidate:
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
    """Return by how much a verdict fails [1]; whether a process can make a spring may be left to the run to decide."""
    words = ("value", "limit", "tolerance", "passed")
    value, limit, tolerance, passed = (values[f"verdicts.{name}.{word}"] for word in words)
    if passed is None and name.startswith("printable."):
        return 0.0
    if not isinstance(value, int | float) or not isinstance(limit, int | float):
        return 0.0 if passed else 1.0
    # A limit of 0 is no measure of a distance: its tolerance is, or the unit of the verdict.
    scale = abs(limit) or (abs(tolerance) if _is_number(tolerance) else 0.0) or 1.0
    distance = abs(value - limit) / scale
    if passed:  # a target has a tolerance, a limit has none
        return 0.0 if tolerance else max(0.0, MARGIN - distance)
    return MARGIN + distance


class _Search:
    """The generations of a search, each solved as tasks of its study."""

    def __init__(self, study: Study, store: StudyStore, engine: Engine, progress: Progress | None) -> None:
        self._study, self._store, self._engine, self._progress = study, store, engine, progress
        self._known = {result.number: result for result in store.rows()}
        self._next = 0

    def run(self) -> None:
        """Evolve until the points that the study allows are spent."""
        study = self._study
        members = _MEMBERS * len(study.vary)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns that a map of our own needs deferred updating, which it is given
            differential_evolution(
                _not_called,
                Bounds(np.zeros(len(study.vary)), np.ones(len(study.vary))),
                maxiter=max(1, study.goal.evaluations // members - 1),
                popsize=_MEMBERS,
                tol=0.0,
                rng=np.random.default_rng(study.seed),
                polish=False,
                x0=_own_shares(study),
                updating="deferred",
                workers=self._costs,
            )

    def _costs(self, _objective: object, members: Iterable[Sequence[float]]) -> list[float]:
        """Return the cost of each member of a generation, those that are stored from there."""
        points = [
            point_at(self._study, number, [float(share) for share in member])
            for number, member in enumerate(members, self._next)
        ]
        self._next += len(points)
        missing = [Task(study=self._study, points=(point,)) for point in points if not self._is_known(point)]
        with closing(completed(self._engine, solve_task, missing, lost_task)) as ended:
            for results in ended:
                self._store.put(results)
                self._known |= {result.number: result for result in results}
                if self._progress is not None:
                    self._progress(len(self._known), max(self._study.goal.evaluations, len(self._known)))
        return [candidate(self._study, self._known[point.number]).cost for point in points]

    def _is_known(self, point: Point) -> bool:
        kept = self._known.get(point.number)
        if kept is None:
            return False
        if kept.settings != point.settings:
            msg = f"{self._store.path}: must hold the candidates of this search, and point {point.number} is another"
            raise InputError(msg)
        return True


def _not_called(_shares: Floats) -> float:
    """Stand for the objective, which `workers` computes for whole generations [1]."""
    return math.nan


def _own_shares(study: Study) -> Floats | None:
    """Return the base design as shares of the spans [1], where the search begins; None where it lies outside."""
    design = design_of(study, {})
    shares = []
    for key, varied in study.vary.items():
        table, _, name = key.partition(".")
        own = getattr(getattr(design, table), name, None)
        if not isinstance(varied, Span) or not isinstance(own, int | float) or not varied.start <= own <= varied.end:
            return None
        shares.append(varied.share_of(float(own)))
    return np.array(shares)


def design_of_candidate(study: Study, found: Candidate, name: str) -> Design:
    """Return the design of a candidate under a name of its own."""
    return design_of(replace(study, base={**study.base, "name": name}), found.result.settings)
