"""The design with the least value of a number in its report among designs that pass, by differential evolution.

R. Storn, K. Price, J. Global Optimization 11 (1997) 341, doi 10.1023/A:1008202821328, as implemented in SciPy.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from pipeline.find.candidate import REFUSED_COST, Candidate
from pipeline.find.proved_candidate import Proof, first_proved
from pipeline.options import DEFAULT_TOLERANCE, RunOptions
from pipeline.report.keys import value_at
from pipeline.storage.files import is_ours, refuse_taken, write_files
from pipeline.storage.folder import refuse_unusable
from pipeline.storage.stopwatch import Count, Progress, silent
from pipeline.study.engines import Engine
from pipeline.study.execute import solve_missing
from pipeline.study.store import StudyStore, settings_text, study_store
from pipeline.study.study_file import REFUSED, UNCERTAINTY_KEYS, UNCERTAINTY_LIMIT, Study, front_number
from pipeline.study.study_page import refuse_page
from pipeline.study.tasks import PointResult
from pipeline.study.variation import Normal, Setting, is_number
from pipeline.study.wanted import VERDICT_FIELDS, verdict_field
from sensor.arrays import Floats
from sensor.design.design_file import design_as_toml
from sensor.design.parameters import Design
from sensor.quantity import validation_error
from sensor.verdict import Verdict, row_of

MOST_RUNS = 20
DESIGN = "design.toml"
RUN = "best"
FRONT = "front"
_MEMBERS = 8  # members of a generation per varied key


@dataclass(frozen=True, kw_only=True)
class Place:
    """The places for the best design of a search and the outputs of its run; `value` is the front's value, or None."""

    value: Setting | None
    design: Path
    run: Path


def places(study: Study, folder: Path) -> tuple[Place, ...]:
    """Return the place for each value of a front in the folder of a study; without a front there is one place."""
    if not study.front:
        return (Place(value=None, design=folder / DESIGN, run=folder / RUN),)
    found = []
    for value in study.front:
        name = f"{study.goal.front_key.rpartition('.')[2]}-{front_number(value)}"
        found.append(Place(value=value, design=folder / FRONT / f"{name}.toml", run=folder / FRONT / name))
    return tuple(found)


def search(study: Study, folder: Path, engine: Engine, progress: Count | None = None) -> tuple[Candidate, ...]:
    """Return every candidate of a search, the best first; all are points of the study's store.

    An interrupted search continues: it requests the same candidates again, and stored ones are not solved again. With
    more `evaluations` it requests the same candidates first, because no step depends on the number still to come.
    Raises InputError if a key has a distribution, or if the base is no design with a value of the front. It also
    refuses a verdict that no candidate can have.
    """
    _refuse_unjudged(study)
    for key, varied in study.vary.items():
        if isinstance(varied, Normal):
            bound = "a span, from and to, or a list"
            raise validation_error(key, "Normal", "", bound, "give the two ends of the search")
    for value in study.front:
        study.base.design({**study.completing_settings, study.goal.front_key: value})
    with study_store(folder, study) as store:
        _evolve(study, store, engine, progress)
        candidates = [candidate_of(study, result) for result in store.rows()]
    return tuple(sorted(candidates, key=lambda candidate: (candidate.cost, candidate.number)))


def _refuse_unjudged(study: Study) -> None:
    """Raise InputError for a verdict of the goal that needs a key which neither the base has nor the search varies."""
    tables = study.base.tables
    goal = study.goal
    verdicts = [
        ("optimise.minimise", verdict_field(goal.minimise)[0]),
        *(("optimise.under", name) for name in goal.under),
    ]
    for field, name in verdicts:
        for given in row_of(name).given:
            table, _, key = given.partition(".")
            varies = any(varied.startswith(given if key else f"{table}.") for varied in study.vary)
            if varies or (key in tables.get(table, {}) if key else table in tables):
                continue
            asked = given if key else f"a [{table}] table"
            bound = f"a verdict of the base, which has no {given}"
            hint = f"give {asked} in the base or under [set], or choose optimise.minimise and under without {name}"
            raise validation_error(field, name, "", bound, hint)


def _evolve(study: Study, store: StudyStore, engine: Engine, progress: Count | None) -> None:
    """Solve generations of candidates until the evaluations of the study are spent; all points enter its store.

    A front is searched value by value; each search after the first starts from the last generation of the one before.
    """
    values = len(study.front)
    keys = len(study.vary) - bool(values)
    start = _base_fractions(study)
    members: Literal["latinhypercube"] | Floats = "latinhypercube"
    most = study.goal.evaluations * max(1, values)
    told = None if progress is None else lambda kept, _: progress(kept, max(most, kept))
    for fixed in [[(i + 0.5) / values] for i in range(values)] or [[]]:
        ended = differential_evolution(
            _costs,  # type: ignore[arg-type]  # a whole generation at a time, which the stubs do not know
            Bounds(np.zeros(keys), np.ones(keys)),
            args=(fixed, set(), study, store, engine, told),
            maxiter=max(1, study.goal.evaluations // (_MEMBERS * keys) - 1),
            popsize=_MEMBERS,
            tol=0.0,
            rng=np.random.default_rng(study.seed),
            polish=False,
            init=members,
            x0=start,
            updating="deferred",
            vectorized=True,
        )
        start = ended.x
        members = ended.population


def _costs(
    fractions: Floats,
    fixed: Sequence[float],
    spent: set[str],
    study: Study,
    store: StudyStore,
    engine: Engine,
    progress: Count | None,
) -> list[float]:
    """Return the cost of each member of a generation, shape (keys, members); stored members are not solved again.

    `fixed` are the fractions of the front's key, and `spent` the candidates requested for this value until now. Members
    beyond the last evaluation are not solved, and cost as much as a refused design.
    """
    members = [study.settings_at([*member, *fixed]) for member in fractions.T.tolist()]
    texts = list(map(settings_text, members))
    allowed = {}  # if all keys vary over lists, members of a generation often coincide
    for text, settings in zip(texts, members, strict=True):
        if len(spent) < study.goal.evaluations:
            spent.add(text)
        if text in spent:
            allowed[text] = settings
    missing = store.missing_points(allowed.values())
    solve_missing(study, store, missing, len(missing), engine, progress)
    results = store.results(allowed.values())
    costs = {text: candidate_of(study, result).cost for text, result in zip(allowed, results, strict=True)}
    return [costs.get(text, REFUSED_COST) for text in texts]


def _base_fractions(study: Study) -> Floats | None:
    """Return the base design, where the search begins, as fractions [1] of the varied keys; None if it is outside."""
    fractions = []
    for key, varied in study.vary.items():
        if key == study.goal.front_key or isinstance(varied, Normal):
            continue
        fraction = varied.fraction_of(_base_value(study, key))
        if fraction is None:
            return None
        fractions.append(fraction)
    return np.array(fractions)


def is_base(study: Study, candidate: Candidate) -> bool:
    """Return whether a candidate is the base design, where a search begins."""
    if candidate.number != 0 or _base_fractions(study) is None:
        return False
    front = study.goal.front_key
    return not study.front or front_number(candidate.changes[front]) == front_number(_base_value(study, front))


def _base_value(study: Study, name: str) -> object:
    """Return the value of a key of the base design, or None; the base may be incomplete without the varied keys."""
    table, _, key = name.partition(".")
    return getattr(getattr(study.design, table, None), key, None)


def candidate_of(study: Study, result: PointResult) -> Candidate:
    """Return a point as a candidate; refused and failed points have no verdicts."""
    of_point = Candidate(changes=result.settings, verdicts=None, number=result.number)
    if result.status != "done":
        return of_point
    value = result.values[study.goal.minimise]
    return replace(
        of_point,
        verdicts=tuple(_verdict(name, result.values) for name in study.goal.under),
        value=value if is_number(value) else math.nan,
        unit=_unit(study, result),
    )


def _unit(study: Study, result: PointResult) -> float:
    """Return the scale on which the search compares its number between designs: usually 1 [unit of the number].

    An uncertainty with a limit at each modulus is reported at the modulus with the largest ratio to its limit. That
    modulus changes between designs, so the uncertainty jumps. Its multiple of the limit [1] does not.
    """
    of_base = _base_value(study, "reading.uncertainty_limit")
    asked = result.settings.get("reading.uncertainty_limit", of_base)
    if study.goal.minimise not in UNCERTAINTY_KEYS or not isinstance(asked, list | tuple):
        return 1.0
    limit = result.values[UNCERTAINTY_LIMIT]
    return limit if is_number(limit) else 1.0


def _verdict(name: str, values: Mapping[str, object]) -> Verdict:
    """Return a verdict from the values of a stored point; its reference holds the number of poses without a reading."""
    told: dict[str, Any] = {field: values[f"verdicts.{name}.{field}"] for field in VERDICT_FIELDS}
    return Verdict(name=name, unit="", reference=str(values.get(REFUSED)), **told)


def refuse_occupied(study: Study, folder: Path, *, force: bool) -> None:
    """Raise InputError if a search could not write its results into its folder, before anything is solved."""
    for place in places(study, folder):
        refuse_unusable(place.run, force=force)
        refuse_taken([place.design], "--out", force=force)
    refuse_page(folder, force=force)


def prove(
    study: Study,
    candidates: Sequence[Candidate],
    place: Place,
    *,
    force: bool = False,
    progress: Progress = silent,
) -> Proof | None:
    """Return the first of the best twenty candidates whose run passes, or else the last one that was run.

    For a front they have the value of the place. The base is run last even if it fails the search, because the search
    neglects the sideways compliance of printed plates. The place receives the outputs of the run and, if it passes, the
    design file. A candidate that a run refuses or cannot solve fails. Returns None if no candidate passes the search
    and the base is not among them. Raises InputError like `write_files`, and OutputError for an unusable folder.
    """
    if study.front:
        number = front_number(place.value)
        candidates = [one for one in candidates if front_number(one.changes[study.goal.front_key]) == number]
    passing = [one for one in candidates if one.passes][:MOST_RUNS]
    passing += [one for one in candidates if is_base(study, one) and one not in passing]

    def design(candidate: Candidate) -> Design:
        progress(f"runs candidate {candidate.number}, which was best of those not yet run")
        return replace(study.base.design(candidate.changes), name=study.name)

    tolerance = min(study.tol, DEFAULT_TOLERANCE)  # a search may be too rough for the stiffness of springs
    proof = first_proved(passing, design, RunOptions(out=place.run, tolerance=tolerance, force=force), len(passing))
    if proof is not None and proof.passed:
        text = design_as_toml(design(proof.candidate))
        write_files({place.design: text.encode()}, "--out", force=force)
    elif is_ours(place.design):  # written by a shorter search; the place no longer holds its run
        place.design.unlink()
    return proof


def value_of_run(study: Study, proof: Proof) -> float | None:
    """Return the minimised number of a run [its unit], or None."""
    if proof.result is None:
        return None
    try:
        value = value_at({**proof.result.report, "verdicts": proof.result.verdicts}, study.goal.minimise)
    except KeyError:
        return None
    return value if is_number(value) else None
