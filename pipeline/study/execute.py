"""Execution of a study: points that are already stored are skipped, and each new result is stored immediately."""

import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from pipeline.storage.stopwatch import Count
from pipeline.study.engines import Engine, completed_items
from pipeline.study.points import Point, point_count, points_of
from pipeline.study.store import StudyStore, stored_study, study_store
from pipeline.study.study_file import Study
from pipeline.study.study_table import table_columns, table_rows
from pipeline.study.tasks import lost_points, solve_points
from sensor.input_file import path_of
from sensor.turns import in_turn

_MAX_POINTS_PER_TASK = 64  # a judgement: a lost worker loses all points of its task, so a task must not be too large
_MIN_TASKS_PER_WORKER = 16  # enough for all workers to finish at almost the same time


@dataclass(frozen=True, kw_only=True)
class StudySummary:
    """The outcome of a study, which `run_study` returns.

    `table` and `best` read the folder on each use, so that the points are not kept in memory.

    Attributes
    ----------
    folder : Path
        Folder that contains the results.
    points : int
        Number of points in the study.
    done, refused, failed : int
        Number of points with each outcome.
    solved : int
        Number of points that this run solved.
    seconds : float
        Duration of this run [s].
    best : dict or None
        The point with the smallest value of the first key in `wanted`, as a row of the table.

    Methods
    -------
    table()
        Return all points as columns for `pandas.DataFrame`: number, status, varied keys, requested outputs, and error.

    Examples
    --------
    >>> study = twintip.read_study(Path("springs.toml"))
    >>> with twintip.process_engine(processes=2) as engine:
    ...     solved = twintip.run_study(study, Path("outputs/springs"), engine)
    >>> solved.points, solved.done, solved.best["targets.P_max"]
    (4, 4, 7)
    """

    folder: Path
    points: int
    done: int
    refused: int
    failed: int
    solved: int
    seconds: float

    def table(self) -> dict[str, list[Any]]:
        """Return a table of all points.

        The columns of the table are the number, the status, each varied key, each requested output, and the error. They
        are lists of equal length, as for `pandas.DataFrame`. A missing value is None. Raises InputError if the study
        has been removed.
        """
        with stored_study(self.folder) as store:
            return table_columns(store)

    @property
    def best(self) -> dict[str, Any] | None:
        """Return the point with the smallest value of the first key in `wanted`, as a row of the table.

        This point is the first of the best designs on study.html. The result is None if no point has a number for this
        key. Raises InputError if the study has been removed.
        """
        with stored_study(self.folder) as store:
            key = store.wanted[0]
            if store.span(key) is None:  # no point has a number for the key
                return None
            return next(table_rows(store, store.best(key, 1)), None)


@in_turn()
def run_study(study: Study, folder: str | Path, engine: Engine, progress: Count | None = None) -> StudySummary:
    """Solve the points of a study that are not stored in its folder yet, and return the outcome of the whole study.

    If a point is refused or fails, its message is stored and the study continues.

    Parameters
    ----------
    study : Study
        The study, from `read_study`.
    folder : str or Path
        The folder for the results. It may already contain some of the points.
    engine : Engine
        The engine that solves the points, from `process_engine`.
    progress : callable, optional
        Function that is called with the number of finished points and the number of all points.

    Returns
    -------
    StudySummary
        The number of points with each outcome, and the table of all points.

    Raises
    ------
    InputError
        If the folder cannot be written, is in use, or contains another study.

    Examples
    --------
    >>> study = twintip.read_study(Path("springs.toml"))
    >>> with twintip.process_engine(processes=2) as engine:
    ...     solved = twintip.run_study(study, Path("outputs/springs"), engine)
    >>> sorted(solved.table())[:3]
    ['error', 'number', 'springs.K_l_N_per_m']
    """
    start = time.perf_counter()
    folder = path_of(folder, "folder")
    points = point_count(study)
    with study_store(folder, study) as store:
        counts_before = store.counts()
        stored_numbers = store.numbers()
        missing = (point for point in points_of(study) if point.number not in stored_numbers)
        solve_missing(study, store, missing, points - len(stored_numbers), engine, progress)
        counts = store.counts()
    solved = counts["done"] - counts_before["done"]  # only by this run
    seconds = time.perf_counter() - start
    return StudySummary(folder=folder, points=points, solved=solved, seconds=seconds, **counts)


def solve_missing(
    study: Study,
    store: StudyStore,
    missing: Iterable[Point],
    count: int,
    engine: Engine,
    progress: Count | None = None,
) -> None:
    """Solve the `missing` points of a study on the workers of an engine, and put the results into its store.

    `count` is the number of missing points. A task solves one or more points, and its results are stored as soon as it
    is finished. Then `progress` is called with the number of stored points and the number of all points.
    """
    stored = sum(store.counts().values())
    total = stored + count
    if progress is not None and count:
        progress(stored, total)
    # Each point contains its settings, so the rows of the study are removed from the data sent with each task.
    solve = partial(solve_points, replace(study, rows=()), store.path.parent)
    batches = _batches(missing, _points_per_task(study, count, engine.workers))
    tasks = completed_items(engine, solve, batches, partial(lost_points, study))
    with closing(tasks) as completed_tasks:  # closing also ends the workers after an error
        for _, results in completed_tasks:
            store.put(results)
            stored += len(results)
            if progress is not None:
                progress(stored, total)


def _points_per_task(study: Study, count: int, workers: int) -> int:
    """Return the number of points that a task solves, if `count` points are distributed among the workers.

    At the level `contact`, solving a point may take less time than the overhead of a task, so a task has several
    points. Each worker still gets at least `_MIN_TASKS_PER_WORKER` tasks if there are enough points. At higher levels,
    a point takes much longer, so a task has only one.
    """
    if study.level != "contact":
        return 1
    return max(1, min(_MAX_POINTS_PER_TASK, count // (_MIN_TASKS_PER_WORKER * workers)))


def _batches(points: Iterable[Point], size: int) -> Iterator[Sequence[Point]]:
    """Yield the points in batches of `size`; the last batch may be smaller."""
    waiting = iter(points)
    while batch := list(islice(waiting, size)):
        yield batch
