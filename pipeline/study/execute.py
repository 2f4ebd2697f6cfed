"""A study from its points to its store: what is solved already is left alone, what ends is kept at once."""

import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from pipeline.storage.stopwatch import Count
from pipeline.study.points import Point, point_count, points_of
from pipeline.study.store import StudyStore, stored_study, study_store
from pipeline.study.study_file import Study
from pipeline.study.table import table_columns, table_rows
from pipeline.study.tasks import lost_points, solve_points
from pipeline.study.workers import Engine, completed_items
from sensor.turns import in_turn

_MOST = 64  # points of a task, which is lost where its worker is
_TASKS = 16  # at least, for each worker: the last ones end at nearly the same time


@dataclass(frozen=True, kw_only=True)
class StudySummary:
    """How many points a study has and how each of them ended; seconds of this run, and the points it `solved`.

    `table` and `best` read the folder each time, so that a study needs no memory for its points.

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
        """Return every point as columns: number, status, each key that varies or is wanted, and error.

        What a point has no value for is None. The columns are lists of one length, as `pandas.DataFrame` takes them.
        Raises InputError where the folder has no study any more.
        """
        with stored_study(self.folder) as store:
            return table_columns(store)

    @property
    def best(self) -> dict[str, Any] | None:
        """Return the point with the least number of the first wanted key, as a row of the table; None without one.

        It is the first of the best designs of study.html. Raises InputError where the folder has no study any more.
        """
        with stored_study(self.folder) as store:
            key = store.wanted[0]
            return next(table_rows(store, store.best(key, 1)), None) if store.span(key) else None


@in_turn
def run_study(study: Study, folder: Path, engine: Engine, progress: Count | None = None) -> StudySummary:
    """Solve every point of a study that its folder does not hold yet, and return how all of them ended.

    Raises InputError where the folder cannot be used; a point that is refused or fails is kept with its message.

    Parameters
    ----------
    study : Study
        What `read_study` returns.
    folder : Path
        The folder of its store, which may hold some of its points.
    engine : Engine
        Where its points are solved: `process_engine`.
    progress : callable, optional
        Called with the numbers of points that ended, and of all.

    Examples
    --------
    >>> study = twintip.read_study(Path("springs.toml"))
    >>> with twintip.process_engine(processes=2) as engine:
    ...     solved = twintip.run_study(study, Path("outputs/springs"), engine)
    >>> sorted(solved.table())[:3]
    ['error', 'number', 'springs.K_l_N_per_m']
    """
    start = time.perf_counter()
    points = point_count(study)
    with study_store(folder, study) as store:
        before = store.counts()
        solved = store.numbers()
        missing = (point for point in points_of(study) if point.number not in solved)
        solve_missing(study, store, missing, points - len(solved), engine, progress)
        counts = store.counts()
    seconds = time.perf_counter() - start
    return StudySummary(folder=folder, points=points, solved=counts["done"] - before["done"], seconds=seconds, **counts)


def solve_missing(
    study: Study,
    store: StudyStore,
    missing: Iterable[Point],
    count: int,
    engine: Engine,
    progress: Count | None = None,
) -> None:
    """Solve the points that a store lacks, so many in all, and keep each as it ends."""
    kept = sum(store.counts().values())
    total = kept + count
    if progress is not None and count:
        progress(kept, total)
    # A point of the level contact may cost less than a task.
    size = max(1, min(_MOST, count // (_TASKS * engine.workers))) if study.level == "contact" else 1
    # A worker gets its points with their settings: all rows of a file would be sent again with each task.
    solve = partial(solve_points, replace(study, rows=()), store.path.parent)
    tasks = completed_items(engine, solve, _batches(missing, size), partial(lost_points, study))
    with closing(tasks) as ended:  # no worker outlives an error here
        for _, results in ended:
            store.put(results)
            kept += len(results)
            if progress is not None:
                progress(kept, total)


def _batches(points: Iterable[Point], size: int) -> Iterator[Sequence[Point]]:
    """Yield points in groups of a size, the last of which may be smaller."""
    waiting = iter(points)
    while batch := list(islice(waiting, size)):
        yield batch
