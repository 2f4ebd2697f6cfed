"""Search for the passing design that minimises a number in its report, by differential evolution.

Source: R. Storn, K. Price, J. Global Optimization 11 (1997) 341, doi:10.1023/A:1008202821328, implemented in SciPy.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from pipeline.find.candidate import REFUSED_COST, Candidate
from pipeline.find.proved_candidate import Proof, prove_first
from pipeline.options import DEFAULT_TOLERANCE, RunOptions
from pipeline.report.keys import value_at
from pipeline.storage.files import check_paths_are_free, is_ours, write_files
from pipeline.storage.folder import refuse_unusable
from pipeline.storage.stopwatch import Count, Progress, ignore_progress
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

MAX_RUNS = 20  # maximum number of candidates for which a whole run is made
DESIGN = "design.toml"  # file of the best design, in the folder of the study
RUN = "best"  # folder of the run of the best design
FRONT = "front"  # folder of the designs and runs of a Pareto front
_MEMBERS = 8  # members of a generation for each varied key


@dataclass(frozen=True, kw_only=True)
class Place:
    """The paths to which the best design of a search and the outputs of its run are written.

    In a search for a Pareto front, `value` is the value of the front's key for this design; else it is None.
    """

    value: Setting | None
    design: Path
    run: Path


def places(study: Study, folder: Path) -> tuple[Place, ...]:
    """Return the paths of the results in the folder of a study: a place for each value of its front, or a single place.

    The place of a front is named after the front's key and its value.
    """
    if not study.front:
        return (Place(value=None, design=folder / DESIGN, run=folder / RUN),)
    front_places = []
    for value in study.front:
        key = study.goal.front_key.rpartition(".")[2]  # without the name of its table
        name = f"{key}-{front_number(value)}"
        front_places.append(Place(value=value, design=folder / FRONT / f"{name}.toml", run=folder / FRONT / name))
    return tuple(front_places)


def search(study: Study, folder: Path, engine: Engine, progress: Count | None = None) -> tuple[Candidate, ...]:
    """Search for the best design of a study, and return all candidates, the best first.

    All candidates are stored as points of the study in `folder`. An interrupted search can be continued: it goes
    through the same candidates again, and stored candidates are not solved again. A search with more `evaluations` also
    starts with the same candidates, because no step depends on the number of steps that follow. `engine` solves the
    candidates, and `progress` is called with the number of evaluated candidates and the total number.

    Raises InputError if a key has a normal distribution, or if the base is invalid for a value of the front. Also
    raises it if no candidate can have a verdict of the goal.
    """
    _refuse_missing_verdicts(study)
    for key, varied in study.vary.items():
        if isinstance(varied, Normal):
            bound = "a range, from and to, or a list"
            raise validation_error(key, "Normal", "", bound, "give the two ends of the search")
    for value in study.front:  # the design is only made to raise InputError if the base is invalid for this value
        study.base.design({**study.completing_settings, study.goal.front_key: value})
    with study_store(folder, study) as store:
        _evolve(study, store, engine, progress)
        candidates = [stored_candidate(study, result) for result in store.rows()]
    return tuple(sorted(candidates, key=lambda candidate: (candidate.cost, candidate.number)))


def _refuse_missing_verdicts(study: Study) -> None:
    """Raise InputError if a verdict of the goal needs a key or table that is neither set in the base nor varied.

    Without this key or table, the verdict does not exist for any candidate.
    """
    goal = study.goal
    goal_verdicts = [
        ("optimise.minimise", verdict_field(goal.minimise)[0]),
        *(("optimise.under", name) for name in goal.under),
    ]
    for field, name in goal_verdicts:
        for needed_name in row_of(name).given:  # the name of a table, or TABLE.KEY
            if _is_set_or_varied(study, needed_name):
                continue
            needed_text = needed_name if "." in needed_name else f"a [{needed_name}] table"
            bound = f"a verdict of the base, which has no {needed_name}"
            hint = (
                f"give {needed_text} in the base or under [set], or choose optimise.minimise and under without {name}"
            )
            raise validation_error(field, name, "", bound, hint)


def _is_set_or_varied(study: Study, name: str) -> bool:
    """Return whether the table or key `name` is set in the base of a study or varied; a key is named TABLE.KEY."""
    tables = study.base.tables
    table, _, key = name.partition(".")
    if key:
        return name in study.vary or key in tables.get(table, {})
    # any varied key of a table makes the table
    is_varied = any(varied.startswith(f"{table}.") for varied in study.vary)
    return is_varied or table in tables


def _evolve(study: Study, store: StudyStore, engine: Engine, progress: Count | None) -> None:
    """Run differential evolution over the varied keys until the evaluations of the study are used up.

    A member of a generation holds a fraction [1] for each varied key, from 0 at one end of its range to 1 at the other.
    All candidates are stored in `store`. A front is searched for one value after another. Each search after the first
    starts from the last generation of the previous search. `engine` solves a generation in parallel, and `progress` is
    called with the number of evaluated candidates and the total number.
    """
    front_fractions = _front_fractions(study)
    # the key of the front is fixed in each search
    searched_keys = len(study.vary) - 1 if study.front else len(study.vary)
    start = _base_fractions(study)
    initial_members: Literal["latinhypercube"] | Floats = "latinhypercube"
    max_evaluations = study.goal.evaluations * len(front_fractions)
    report_progress = None if progress is None else _progress_of_search(progress, max_evaluations)
    generations = study.goal.evaluations // (_MEMBERS * searched_keys)
    for front_fraction in front_fractions:
        evolution = differential_evolution(
            _costs,  # type: ignore[arg-type]  # `_costs` takes a whole generation, which the type stubs do not allow
            Bounds(np.zeros(searched_keys), np.ones(searched_keys)),
            args=(front_fraction, set(), study, store, engine, report_progress),
            maxiter=max(1, generations - 1),  # SciPy does not count the initial generation
            popsize=_MEMBERS,  # SciPy multiplies this number by the number of keys
            tol=0.0,  # only the number of evaluations ends the search
            rng=np.random.default_rng(study.seed),
            polish=False,
            init=initial_members,
            x0=start,
            updating="deferred",
            vectorized=True,  # a generation is solved in parallel by the worker processes
        )
        start = evolution.x
        initial_members = evolution.population


def _front_fractions(study: Study) -> list[list[float]]:
    """Return for each search of a study a list with the fraction [1] of the front's key, which is the last varied key.

    The range of this key is divided into one interval for each value of the front. The fraction is the middle of the
    interval. Without a front, there is one search, and its list is empty.
    """
    if not study.front:
        return [[]]
    values = len(study.front)
    return [[(i + 0.5) / values] for i in range(values)]


def _progress_of_search(progress: Count, max_evaluations: int) -> Count:
    """Return a function that reports the number of stored candidates out of all evaluations of a search.

    A store from an earlier search may have more candidates than this search evaluates. The total is then the number
    of stored candidates.
    """

    def report_progress(stored: int, _total_of_generation: int) -> None:
        progress(stored, max(max_evaluations, stored))

    return report_progress


def _costs(
    fractions: Floats,
    front_fraction: Sequence[float],
    requested: set[str],
    study: Study,
    store: StudyStore,
    engine: Engine,
    progress: Count | None,
) -> list[float]:
    """Return the cost of each member of a generation, which differential evolution minimises.

    `fractions` (keys, members) holds the members of the generation. `front_fraction` holds the fraction of the front's
    key; it is empty without a front. `engine` solves the members that are not in `store` yet, and `progress` is called
    for each of them.

    `requested` holds the settings, as text, of all candidates that were requested before for this value of the front.
    This function adds the new ones, so that it can count the evaluations. Members beyond the last evaluation of the
    `study` are not solved, and get the cost of a refused design.
    """
    member_settings = [study.settings_at([*member, *front_fraction]) for member in fractions.T.tolist()]
    texts = list(map(settings_text, member_settings))
    # Settings to evaluate, by their text. Members of a generation may be equal if all keys vary over lists.
    to_evaluate = {}
    for text, settings in zip(texts, member_settings, strict=True):
        if len(requested) < study.goal.evaluations:
            requested.add(text)
        if text in requested:
            to_evaluate[text] = settings
    missing_points = store.missing_points(to_evaluate.values())  # the store already has the others
    solve_missing(study, store, missing_points, len(missing_points), engine, progress)
    results = store.results(to_evaluate.values())
    costs = {text: stored_candidate(study, result).cost for text, result in zip(to_evaluate, results, strict=True)}
    return [costs.get(text, REFUSED_COST) for text in texts]


def _base_fractions(study: Study) -> Floats | None:
    """Return the base design, at which the search starts, as fractions [1] of the varied keys' ranges.

    The result has the shape (keys,). The result is None if a value of the base is outside its range. The key of a
    front, and keys with a normal distribution, are omitted.
    """
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
    """Return whether a candidate is the base design, at which a search starts.

    The first point of a search, number 0, is the base design if its values lie within the varied ranges. In a search
    for a front, its value must also be the front's value in the base.
    """
    if candidate.number != 0 or _base_fractions(study) is None:
        return False
    front = study.goal.front_key
    return not study.front or front_number(candidate.changes[front]) == front_number(_base_value(study, front))


def _base_value(study: Study, name: str) -> object:
    """Return the value of the key `name` of the base design.

    The value is None if the key is not set, or if the base design is incomplete, so that `study.design` is None.
    """
    table, _, key = name.partition(".")
    return getattr(getattr(study.design, table, None), key, None)


def stored_candidate(study: Study, result: PointResult) -> Candidate:
    """Return the candidate for a stored point of a study; a point that was refused or that failed has no verdicts."""
    candidate = Candidate(changes=result.settings, verdicts=None, number=result.number)
    if result.status != "done":
        return candidate
    value = result.values[study.goal.minimise]
    return replace(
        candidate,
        verdicts=tuple(_verdict(name, result.values) for name in study.goal.under),
        value=value if is_number(value) else math.nan,
        unit=_objective_scale(study, result),
    )


def _objective_scale(study: Study, result: PointResult) -> float:
    """Return the scale by which the objective is divided for comparisons [unit of the objective]; usually 1.

    The scale differs from 1 only for an uncertainty whose limit depends on the modulus. The scale is then this limit.
    Such an uncertainty is reported at the modulus where it is largest relative to its limit. This modulus differs
    between designs, so the uncertainty may jump from one design to the next. Its ratio to the limit does not jump.
    """
    base_limit = _base_value(study, "reading.uncertainty_limit")
    design_limit = result.settings.get("reading.uncertainty_limit", base_limit)
    if study.goal.minimise not in UNCERTAINTY_KEYS or not isinstance(design_limit, list | tuple):
        return 1.0
    limit = result.values[UNCERTAINTY_LIMIT]
    return limit if is_number(limit) else 1.0


def _verdict(name: str, values: Mapping[str, object]) -> Verdict:
    """Build the verdict `name` from the values of a stored point, by their keys in the report.

    The reference of the verdict is the text that states in how many poses the sensor has no reading. The cost of a
    candidate depends on this text.
    """
    stored: dict[str, Any] = {field: values[f"verdicts.{name}.{field}"] for field in VERDICT_FIELDS}
    return Verdict(name=name, unit="", reference=str(values.get(REFUSED)), **stored)


def refuse_occupied(study: Study, folder: Path, *, force: bool) -> None:
    """Raise InputError if a search could not write its results into `folder`; call this before anything is solved."""
    for place in places(study, folder):
        refuse_unusable(place.run, force=force)
        check_paths_are_free([place.design], "--out", force=force)
    refuse_page(folder, force=force)


def prove(
    study: Study,
    candidates: Sequence[Candidate],
    place: Place,
    *,
    force: bool = False,
    progress: Progress = ignore_progress,
) -> Proof | None:
    """Run the best candidates of a search one after another until a run passes, and return the last run.

    At most `MAX_RUNS` candidates that pass the search are run, the best first. For a Pareto front, only candidates with
    the front's value at `place` are run. The base design is run last even if it failed the search, because the search
    neglects the lateral compliance of printed plates. A candidate that is invalid or cannot be solved is treated as
    failed.

    The outputs of the run are written to `place`. If the run passes, its design file is written too. If no run passes,
    the design file of an earlier search is deleted. Returns None if there is no candidate to run. Raises the same
    errors as `write_files`, and OutputError if the output folder cannot be used.
    """
    to_run = _candidates_to_run(study, candidates, place)

    def make_design(candidate: Candidate) -> Design:
        """Report the run of a candidate, and return its design."""
        progress(f"running candidate {candidate.number}, the best that has not been run yet")
        # the design is named after the study, not after its base design
        return replace(study.base.design(candidate.changes), name=study.name)

    tolerance = min(study.tol, DEFAULT_TOLERANCE)  # the tolerance of a search may be too loose for a whole run
    proof = prove_first(to_run, make_design, RunOptions(out=place.run, tolerance=tolerance, force=force), len(to_run))
    if proof is not None and proof.passed:
        text = design_as_toml(make_design(proof.candidate))
        write_files({place.design: text.encode()}, "--out", force=force)
    elif is_ours(place.design):  # an earlier search wrote this design file, but its run has been replaced
        place.design.unlink()
    return proof


def _candidates_to_run(study: Study, candidates: Sequence[Candidate], place: Place) -> list[Candidate]:
    """Return the candidates that `prove` runs, in this order: the best ones that pass, and then the base design.

    `candidates` are sorted, the best first. For a Pareto front, only candidates with the front's value at `place` are
    returned.
    """
    eligible = list(candidates)
    if study.front:
        front_key = study.goal.front_key
        front_value = front_number(place.value)
        eligible = [candidate for candidate in candidates if front_number(candidate.changes[front_key]) == front_value]
    to_run = [candidate for candidate in eligible if candidate.passes][:MAX_RUNS]
    to_run += [candidate for candidate in eligible if is_base(study, candidate) and candidate not in to_run]
    return to_run


def value_of_run(study: Study, proof: Proof) -> float | None:
    """Return the objective of a run [unit of the objective]; None if the run failed or has no number for it."""
    if proof.result is None:
        return None
    try:
        value = value_at({**proof.result.report, "verdicts": proof.result.verdicts}, study.goal.minimise)
    except KeyError:
        return None
    return value if is_number(value) else None
