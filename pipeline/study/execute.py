"""A study from its points to its store: what is solved already is left alone, what ends is kept at once."""

import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from pipeline.response.unit_scene import UnitScene, move_contact, unit_scene
from pipeline.study.points import Point, design_of, point_count, points_between
from pipeline.study.store import StudyStore, study_store
from pipeline.study.study_file import Study
from pipeline.study.tasks import lost_points, solve_points
from pipeline.study.wanted import parts_of
from pipeline.study.workers import Engine, ProgressReport, completed_items
from sensor.quantity import InputError
from sensor.turns import in_turn

QUICK = 500  # points of a task without a solve
SHARING = 32  # points of a task that share one solve, or have their readings solved
WINDOW = 20_000  # points that are sorted by their scenes at a time, so that a million need no memory


@dataclass(frozen=True, kw_only=True)
class StudySummary:
    """How many points a study has and how each of them ended; seconds of this run, and the points it `solved`."""

    folder: Path
    points: int
    done: int
    refused: int
    failed: int
    solved: int
    seconds: float


@in_turn
def run_study(study: Study, folder: Path, engine: Engine, progress: ProgressReport | None = None) -> StudySummary:
    """Solve every point of a study that its folder does not hold yet, and return how all of them ended.

    Raises InputError where the folder cannot be used; a point that is refused or fails is kept with its message.
    """
    start = time.perf_counter()
    count = point_count(study)
    with study_store(folder, study) as store:
        before = store.counts()
        ended_points = sum(before.values())
        # A worker gets its points with their settings: all rows of a file would be sent again with each task.
        solve = partial(solve_points, replace(study, rows=()), folder)
        tasks = _tasks(study, store)
        with closing(completed_items(engine, solve, tasks, lost_points)) as ended:  # no worker outlives an error here
            for _, results in ended:
                store.put(results)
                ended_points += len(results)
                if progress is not None:
                    progress(ended_points, count)
        counts = store.counts()
    seconds = time.perf_counter() - start
    return StudySummary(folder=folder, points=count, solved=counts["done"] - before["done"], seconds=seconds, **counts)


def _tasks(study: Study, store: StudyStore) -> Iterator[Sequence[Point]]:
    """Yield the points that are not solved, in groups for one worker: points that share a solve of contact together."""
    share_scenes = _shares_scenes(study)
    size = _task_size(study)
    count = point_count(study)
    for start in range(0, count, WINDOW):
        stop = min(start + WINDOW, count)
        solved = store.solved(start, stop)
        by_scene: dict[UnitScene | None, list[Point]] = defaultdict(list)
        for point in points_between(study, start, stop):
            if point.number not in solved:
                by_scene[_scene(study, point) if share_scenes else None].append(point)
        for group in by_scene.values():
            for first in range(0, len(group), size):
                yield group[first : first + size]


def _shares_scenes(study: Study) -> bool:
    """Say whether points are sorted by their scenes of contact, which differ and are all that is solved."""
    return study.level == "contact" and move_contact(study.vary)


def _task_size(study: Study) -> int:
    """Return the number of points in a task for one worker: fewer where a point costs more."""
    if study.level != "contact":
        return 1
    solves_more = parts_of(study.wanted, reads="reading" in study.base.tables, linear=True)
    return SHARING if _shares_scenes(study) or solves_more else QUICK


def _scene(study: Study, point: Point) -> UnitScene | None:
    """Return the scene of contact of a point, None for one that no design file takes."""
    try:
        return unit_scene(design_of(study, point.settings))
    except InputError:
        return None
