"""Tasks of a study: the work of one process, which solves some points and returns their results."""

import errno
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pipeline.options import RunOptions
from pipeline.report.of_result import SensorParts, report_of_result
from pipeline.sensor import Sensor, SpringsAs
from pipeline.study.points import Point
from pipeline.study.study_file import Study
from pipeline.study.wanted import PASSED, wanted_value
from sensor.quantity import InputError

Status = Literal["done", "refused", "failed"]

MACHINE = "machine: "
"""Prefix of the message of a point that failed due to a fault of the machine; the same command retries the point."""
LOST = f"{MACHINE}the worker that solved this point was lost repeatedly; free memory and run the same command again"
_DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_MACHINE_FAULTS = (OSError, MemoryError, BrokenExecutor)


@dataclass(frozen=True, kw_only=True)
class PointResult(Point):
    """A point with its result: its values by wanted key, or the reason why it was refused or failed.

    `seconds` is the CPU time that it took [s].
    """

    status: Status
    values: Mapping[str, object] = field(default_factory=dict)
    error: str | None = None
    seconds: float = 0.0


def solve_points(study: Study, folder: Path, points: Sequence[Point]) -> tuple[PointResult, ...]:
    """Solve some points of a study and return their results; a point that is refused or fails does not stop the others.

    The files of whole runs are written into `folder`, except for a search, which keeps none.
    """
    return tuple(_solve_point(study, folder, point) for point in points)


def lost_points(study: Study, points: Sequence[Point]) -> tuple[PointResult, ...]:
    """Return the results of points whose worker was lost: each of them failed.

    Raises BrokenExecutor in a search, because its next points depend on all earlier ones.
    """
    if study.how == "search":
        raise BrokenExecutor(LOST)
    return tuple(PointResult(**vars(point), status="failed", error=LOST) for point in points)


def _solve_point(study: Study, folder: Path, point: Point) -> PointResult:
    """Return the result of a point: its values, or the reason why it was refused or failed.

    An error due to a fault of the machine is raised if the disk is full. In a search it is always raised, because the
    next points depend on this one.
    """
    start = time.process_time()
    values: Mapping[str, object] = {}
    status: Status = "done"
    error = None
    try:
        values = _wanted_values(study, folder, point)
    except Exception as failure:
        fault = _fault_of_machine(failure)
        if fault is not None and (study.how == "search" or getattr(fault, "errno", None) in _DISK_FULL):
            raise
        refused = isinstance(failure, InputError) and fault is None
        status = "refused" if refused else "failed"
        message = str(failure) if refused else f"{type(failure).__name__}: {failure}"
        error = ("" if fault is None else MACHINE) + " ".join(message.split())
    return PointResult(**vars(point), status=status, values=values, error=error, seconds=time.process_time() - start)


def _fault_of_machine(failure: Exception) -> BaseException | None:
    """Return the fault of the machine that caused an error, or None if the design of the point caused it.

    A missing file is counted as an error of the design, because a key of the design may name the file.
    """
    for cause in (failure, failure.__cause__):
        if isinstance(cause, _MACHINE_FAULTS) and not isinstance(cause, FileNotFoundError):
            return cause
    return None


def _wanted_values(study: Study, folder: Path, point: Point) -> dict[str, object]:
    """Solve a point up to the level of its study, and return the values of its wanted keys.

    The level `files` is a whole run with all files. At lower levels only those parts of the report are solved that hold
    a wanted key, with springs fitted by finite elements, or at the level `contact` sized by closed forms.
    """
    design = study.base.design(point.settings)
    if study.level == "files":
        from pipeline import run  # the import takes seconds, and only these points need it

        out = None if study.how == "search" else folder / "designs" / f"{point.number:07d}"
        options = RunOptions(tolerance=study.tol, out=out)
        result = run(design, options, beside=False)  # the engine has one process for each core
        report: Mapping[str, object] = {**vars(report_of_result(result)), PASSED: result.passed}
    else:
        options = RunOptions(tolerance=study.tol)
        springs_as: SpringsAs = "sized" if study.level == "contact" else "fitted"
        report = SensorParts(Sensor(design=design, options=options, springs_as=springs_as))
    return {key: wanted_value(report, key) for key in study.wanted}
