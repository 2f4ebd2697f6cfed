"""A piece of a study that one process solves: some points, and what came out of each."""

import errno
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cad.design.parameters import Design
from cad.quantity import InputError
from pipeline.storage.plain import Plain
from pipeline.study.levels.contact_surrogate import ContactSurrogate
from pipeline.study.levels.direct_solve import solved_report
from pipeline.study.levels.printed import print_miss
from pipeline.study.levels.sized import sized_report
from pipeline.study.levels.unit_scene import scene_compliance, unit_scene
from pipeline.study.points import Point, design_of, points_between
from pipeline.study.report_keys import value_at_key
from pipeline.study.study_file import Study
from pipeline.study.variation import Setting
from solve.fruit.compliance import FruitCompliance

Status = Literal["done", "refused", "failed"]

# Every class that a solve can raise, of libraries too: a point that meets a rare fault must not stop a million others.
FAILURES = (
    RuntimeError, ValueError, ArithmeticError, LookupError, TypeError, AttributeError, OSError, MemoryError,
    AssertionError, ImportError, EOFError,
)  # fmt: skip

_SPREAD = 2654435761  # Knuth's multiplier: numbers that follow each other fall far apart
_HASHES = 2**32
LOST = "the worker that solved this point was lost again and again; free memory, the same command tries it again"
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True, kw_only=True)
class Task:
    """Points of a study for one process: those listed, and those from `start` up to, not including, `stop`.

    A surrogate stands for the solves of contact. `folder` is where the files of whole runs go.
    """

    study: Study
    points: tuple[Point, ...] = ()
    start: int = 0
    stop: int = 0
    surrogate: ContactSurrogate | None = None
    folder: Path | None = None


@dataclass(frozen=True, kw_only=True)
class PointResult:
    """What came out of a point: its values by wanted key, or why it was refused or failed, and its processor seconds.

    `audit` are the values of the same point with contact solved in full, where it was drawn for that.
    """

    number: int
    settings: Mapping[str, Setting]
    status: Status
    values: Mapping[str, object]
    error: str | None
    seconds: float
    audit: Mapping[str, object] | None = None


def solve_task(task: Task) -> tuple[PointResult, ...]:
    """Return the results of the points of a task; a point that is refused or fails does not stop the others."""
    ranged = points_between(task.study, task.start, task.stop) if task.stop > task.start else ()
    return tuple(_solved(task, point) for point in (*task.points, *ranged))


def lost_task(task: Task) -> tuple[PointResult, ...]:
    """Return the points of a task whose workers were lost, failed."""
    ranged = points_between(task.study, task.start, task.stop) if task.stop > task.start else ()
    return tuple(
        PointResult(number=point.number, settings=point.settings, status="failed", values={}, error=LOST, seconds=0.0)
        for point in (*task.points, *ranged)
    )


def _solved(task: Task, point: Point) -> PointResult:
    start = time.process_time()
    status: Status = "done"
    values: Mapping[str, object] = {}
    error, audit = None, None
    try:
        design = design_of(task.study, point.settings)
        values = _wanted(task, design, point, task.surrogate)
        if task.surrogate is not None and _is_audited(point.number, task.study):
            audit = _wanted(task, design, point, None)
    except FAILURES as failure:
        if _lacks_room(failure):
            raise  # of the machine, not of the point: it is solved when there is room again
        refused = isinstance(failure, InputError)
        status = "refused" if refused else "failed"
        error = str(failure) if refused else f"{type(failure).__name__}: {failure}"
    return PointResult(
        number=point.number,
        settings=point.settings,
        status=status,
        values=values if error is None else {},
        error=None if error is None else " ".join(error.split()),
        seconds=time.process_time() - start,
        audit=audit,
    )


def _lacks_room(failure: BaseException) -> bool:
    """Say whether an error, or the one that it came from, is that of a full disk."""
    causes = failure, failure.__cause__
    return any(isinstance(one, OSError) and one.errno in _NO_ROOM for one in causes)


def _wanted(task: Task, design: Design, point: Point, surrogate: ContactSurrogate | None) -> dict[str, object]:
    study = task.study
    report = _report(task, design, point, surrogate)
    return {key: value_at_key(report, key) for key in study.wanted}


def _report(task: Task, design: Design, point: Point, surrogate: ContactSurrogate | None) -> Plain:
    study = task.study
    if study.level == "contact":
        contact = _contact(study, design, surrogate)
        return sized_report(design, contact, study.stages, print_miss(point.settings))
    out = None if task.folder is None else task.folder / "designs" / f"{point.number:07d}"
    return solved_report(design, study.level, study.tol, out)


def _contact(study: Study, design: Design, surrogate: ContactSurrogate | None) -> FruitCompliance:
    scene = unit_scene(design)
    return scene_compliance(scene, study.tol) if surrogate is None else surrogate.compliance(scene)


def _is_audited(number: int, study: Study) -> bool:
    """Say whether a point is drawn for a full solve: by its number, so that a resumed study draws the same ones."""
    return (number + study.seed + 1) * _SPREAD % _HASHES < study.audit * _HASHES
