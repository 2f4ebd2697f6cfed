"""A study from its points to its store: what is solved already is left alone, what ends is kept at once."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import InputError
from pipeline.storage.plain import from_plain, to_plain
from pipeline.study.levels.contact_surrogate import ContactSurrogate
from pipeline.study.levels.sized import CLOSED_FORMS
from pipeline.study.levels.surrogate_fit import fitted_surrogate, may_interpolate, scene_keys
from pipeline.study.levels.unit_scene import UnitScene, scene_compliance, unit_scene
from pipeline.study.points import Point, design_of, point_count, points_between
from pipeline.study.store import StudyStore, study_store
from pipeline.study.study_file import Study
from pipeline.study.tasks import Task, lost_task, solve_task
from pipeline.study.workers import Engine, completed
from solve.fruit.compliance import FruitCompliance

Progress = Callable[[int, int], None]

RANGE = 500  # points of a task without a solve
GROUP = 32  # points of a task that share one solve
WINDOW = 20_000  # points that are sorted by their scenes at a time, so that a million need no memory
_SURROGATE = "surrogate"


@dataclass(frozen=True, kw_only=True)
class StudySummary:
    """How many points a study has and how each of them ended; seconds of this run, and `solved` points in it.

    `surrogate` stands for the contact where the study has one.
    """

    folder: Path
    points: int
    done: int
    refused: int
    failed: int
    solved: int
    seconds: float
    surrogate: ContactSurrogate | None


def run_study(study: Study, folder: Path, engine: Engine, progress: Progress | None = None) -> StudySummary:
    """Solve every point of a study that its folder does not hold yet, and return how all of them ended.

    `progress` is told how many points are solved, and of how many. Raises InputError where the folder cannot be used;
    a point that is refused or fails is kept with its message.
    """
    start = time.perf_counter()
    count = point_count(study)
    with study_store(folder, study) as store:
        before = solved = sum(store.counts().values())
        surrogate = _surrogate(study, count, store, engine)
        tasks = _tasks(study, store, surrogate, folder)
        with closing(completed(engine, solve_task, tasks, lost_task)) as ended:  # no worker outlives an error here
            for results in ended:
                store.put(results)
                solved += len(results)
                if progress is not None:
                    progress(solved, count)
        counts = store.counts()
    return StudySummary(
        folder=folder,
        points=count,
        solved=solved - before,
        seconds=time.perf_counter() - start,
        surrogate=surrogate,
        **counts,
    )


def _surrogate(study: Study, count: int, store: StudyStore, engine: Engine) -> ContactSurrogate | None:
    """Return the polynomial of a study, fitted once and kept in its store; raises InputError where one is asked for."""
    if not may_interpolate(study, count):
        return None
    kept = store.fact(_SURROGATE)
    if kept is not None:
        return from_plain(ContactSurrogate, kept) if kept else None

    def solve(scenes: Sequence[UnitScene]) -> list[FruitCompliance]:
        given = [(place, scene, study.tol) for place, scene in enumerate(scenes)]
        found = dict(completed(engine, _solved_scene, given, _lost_scene))
        return [found[place] for place in range(len(scenes))]

    fitted = fitted_surrogate(study, solve)
    if fitted is None and study.contact == _SURROGATE:
        msg = f"contact = 'surrogate': no polynomial is within half of tol = {study.tol:g}; set contact = 'solve'"
        raise InputError(msg)
    store.remember(_SURROGATE, {} if fitted is None else to_plain(fitted))
    return fitted


def _solved_scene(given: tuple[int, UnitScene, float]) -> tuple[int, FruitCompliance]:
    place, scene, tolerance = given
    return place, scene_compliance(scene, tolerance)


def _lost_scene(given: tuple[int, UnitScene, float]) -> tuple[int, FruitCompliance]:
    msg = f"the worker that solved the contact of tips of {given[1].scale:g} mm was lost again and again; free memory"
    raise InputError(msg)


def _tasks(study: Study, store: StudyStore, surrogate: ContactSurrogate | None, folder: Path) -> Iterator[Task]:
    """Yield tasks for the points that are not solved; among scenes that differ, those that share one together."""
    count, carried = point_count(study), study.without_rows
    one_scene = surrogate is not None or (study.level == "contact" and not scene_keys(study))
    size = GROUP if study.stages - CLOSED_FORMS or not one_scene else RANGE
    window = size if one_scene else WINDOW
    for start in range(0, count, window):
        stop = min(start + window, count)
        missing = store.missing(start, stop)
        if one_scene and not study.rows and len(missing) == stop - start:
            yield Task(study=study, start=start, stop=stop, surrogate=surrogate)
        elif missing:
            points = [point for point in points_between(study, start, stop) if point.number in missing]
            for group in [points] if one_scene else _groups(study, points):
                for place in range(0, len(group), size):
                    some = tuple(group[place : place + size])
                    yield Task(study=carried, points=some, surrogate=surrogate, folder=folder)


def _groups(study: Study, points: Iterable[Point]) -> Iterator[list[Point]]:
    """Yield points that share a scene of contact, and those that no design file takes by themselves."""
    groups: dict[UnitScene | None, list[Point]] = defaultdict(list)
    for point in points:
        try:
            scene = unit_scene(design_of(study, point.settings))
        except InputError:
            scene = None
        groups[scene].append(point)
    yield from groups.values()
