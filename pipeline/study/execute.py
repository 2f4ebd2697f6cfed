"""A study from its points to its store: what is solved already is left alone, what ends is kept at once."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import InputError
from pipeline.storage.plain import from_plain, to_plain
from pipeline.study.interpolated_contact import (
    SCENES,
    InterpolatedContact,
    contact_keys,
    fit_points,
    interpolated,
    may_interpolate,
)
from pipeline.study.points import Point, design_of, point_count, points_between
from pipeline.study.report_keys import parts_of
from pipeline.study.scenes import UnitScene, unit_scene
from pipeline.study.store import StudyStore, study_store
from pipeline.study.study_file import Study
from pipeline.study.tasks import Task, lost_task, solve_scene, solve_task
from pipeline.study.workers import Engine, completed
from solve.fruit.compliance import FruitCompliance

Progress = Callable[[int, int], None]

RANGE = 500  # points of a task without a solve
GROUP = 32  # points of a task that share one solve
WINDOW = 20_000  # points that are sorted by their scenes at a time, so that a million need no memory
_FRACTION = 0.5  # of the study's tolerance that interpolation may take: the other half is for the solves
_FACT = "interpolation"


@dataclass(frozen=True, kw_only=True)
class StudySummary:
    """How many points a study has and how each of them ended; seconds of this run, and `solved` points in it."""

    folder: Path
    points: int
    done: int
    refused: int
    failed: int
    solved: int
    seconds: float
    interpolation: InterpolatedContact | None


def run_study(study: Study, folder: Path, engine: Engine, progress: Progress | None = None) -> StudySummary:
    """Solve every point of a study that its folder does not hold yet, and return how all of them ended.

    `progress` is called with how many points are solved, and of how many. Raises InputError where the folder cannot be
    used; a point that is refused or fails is kept with its message.
    """
    start = time.perf_counter()
    count = point_count(study)
    with study_store(folder, study) as store:
        before = sum(store.counts().values())
        solved = before
        interpolation = _interpolation(study, count, store, engine)
        tasks = _tasks(study, store, interpolation, folder)
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
        interpolation=interpolation,
        **counts,
    )


def _interpolation(study: Study, count: int, store: StudyStore, engine: Engine) -> InterpolatedContact | None:
    """Return the interpolated contact of a study, made once and kept in its store, None where no one is good enough.

    Raises InputError where one is asked for that cannot be.
    """
    if not may_interpolate(study, count):
        return None
    kept = store.fact(_FACT)
    if kept is not None:
        return from_plain(InterpolatedContact, kept) if kept else None
    solved: dict[tuple[object, ...], FruitCompliance] = {}
    for scenes in SCENES:
        points = fit_points(study, scenes)
        missing = [point for point in points if _identity(point) not in solved]
        given = [(index, study, point) for index, point in enumerate(missing)]
        for index, contact in completed(engine, solve_scene, given, _lost_scene):
            solved[_identity(missing[index])] = contact
        model = interpolated(study, points, [solved[_identity(point)] for point in points])
        if model.error <= _FRACTION * study.tol:
            store.remember(_FACT, to_plain(model))
            return model
    if study.contact == "surrogate":
        bound = f"solve: no interpolation is within half of tol = {study.tol:g}"
        msg = f"contact = 'surrogate': must be {bound}"
        raise InputError(msg, field="contact", value="surrogate", bound=bound)
    store.remember(_FACT, {})
    return None


def _identity(point: Point) -> tuple[object, ...]:
    return tuple(point.settings.values())


def _lost_scene(given: tuple[int, Study, Point]) -> tuple[int, FruitCompliance]:
    msg = f"the worker that solved the contact of {dict(given[2].settings)} was lost again and again; free memory"
    raise InputError(msg)


def _tasks(study: Study, store: StudyStore, interpolation: InterpolatedContact | None, folder: Path) -> Iterator[Task]:
    """Yield tasks for the points that are not solved; among scenes that differ, those that share one together."""
    count = point_count(study)
    bare = study.without_rows
    one_scene = interpolation is not None or (study.level == "contact" and not contact_keys(study))
    quick = study.level == "contact" and not parts_of(study.wanted, reads="reading" in study.base, linear=True)
    size = RANGE if one_scene and quick else GROUP
    window = size if one_scene else WINDOW
    for start in range(0, count, window):
        stop = min(start + window, count)
        missing = store.missing(start, stop)
        if one_scene and not study.rows and len(missing) == stop - start:
            yield Task(study=study, start=start, stop=stop, interpolation=interpolation)
        elif missing:
            points = [point for point in points_between(study, start, stop) if point.number in missing]
            for group in [points] if one_scene else _by_scene(study, points):
                for first in range(0, len(group), size):
                    some = tuple(group[first : first + size])
                    yield Task(study=bare, points=some, interpolation=interpolation, folder=folder)


def _by_scene(study: Study, points: Iterable[Point]) -> Iterator[list[Point]]:
    """Yield points that share a scene of contact, and those that no design file takes by themselves."""
    groups: dict[UnitScene | None, list[Point]] = defaultdict(list)
    for point in points:
        try:
            scene = unit_scene(design_of(study, point.settings))
        except InputError:
            scene = None
        groups[scene].append(point)
    yield from groups.values()
