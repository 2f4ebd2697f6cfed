"""Tasks of a study: in each task, a worker solves some points and returns their results."""

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
from sensor.design.parameters import Design
from sensor.quantity import InputError

Status = Literal["done", "refused", "failed"]

MACHINE = "machine: "
"""Prefix of the message of a point that failed because of a machine fault; repeating the command retries the point."""
LOST = f"{MACHINE}the worker that solved this point was lost repeatedly; free memory and run the same command again"
_DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_MACHINE_FAULTS = (OSError, MemoryError, BrokenExecutor)


@dataclass(frozen=True, kw_only=True)
class PointResult(Point):
    """A point and its result: the values of the requested outputs, or the reason why it was refused or failed.

    `seconds` is the CPU time [s] that was used to solve the point.
    """

    status: Status
    values: Mapping[str, object] = field(default_factory=dict)
    error: str | None = None
    seconds: float = 0.0


def solve_points(study: Study, folder: Path, points: Sequence[Point]) -> tuple[PointResult, ...]:
    """Solve some points of a study and return their results.

    If a point is refused or fails, the other points are still solved. The files of whole runs are written into
    `folder`, except in a search, which does not keep files.
    """
    return tuple(_solve_point(study, folder, point) for point in points)


def lost_points(study: Study, points: Sequence[Point]) -> tuple[PointResult, ...]:
    """Return results with the status "failed" for points whose worker was lost.

    Raises BrokenExecutor in a search, because its next points depend on the results of all earlier points.
    """
    if study.how == "search":
        raise BrokenExecutor(LOST)
    return tuple(PointResult(**vars(point), status="failed", error=LOST) for point in points)


def _solve_point(study: Study, folder: Path, point: Point) -> PointResult:
    """Solve a point of a study and return its values, or the reason why it was refused or failed.

    The files of a whole run are written into `folder`. An exception due to a machine fault is raised again if the disk
    is full, because no further point can then be stored. In a search, such an exception is always raised again, because
    the next points depend on the result of this one.
    """
    start = time.process_time()
    values: Mapping[str, object] = {}
    status: Status = "done"
    error = None
    try:
        values = _wanted_values(study, folder, point)
    except Exception as failure:  # every type is caught, because one point must not end the whole study
        fault = _fault_of_machine(failure)
        is_disk_full = getattr(fault, "errno", None) in _DISK_FULL
        if fault is not None and (study.how == "search" or is_disk_full):
            raise
        status, error = _status_and_message(failure, fault)
    return PointResult(**vars(point), status=status, values=values, error=error, seconds=time.process_time() - start)


def _status_and_message(failure: Exception, fault: BaseException | None) -> tuple[Status, str]:
    """Return the status of a point and its one-line message after the exception `failure`.

    A point is refused if its design is invalid. In any other case it failed, and the message names the type of the
    exception. If a machine `fault` is the cause, the message begins with `MACHINE`, so that the point is solved again.
    """
    if isinstance(failure, InputError) and fault is None:
        return "refused", _on_one_line(str(failure))
    prefix = "" if fault is None else MACHINE
    return "failed", prefix + _on_one_line(f"{type(failure).__name__}: {failure}")


def _on_one_line(message: str) -> str:
    """Return a message without line breaks and repeated spaces."""
    return " ".join(message.split())


def _fault_of_machine(failure: Exception) -> BaseException | None:
    """Return the machine fault that caused an exception, or None if the design of the point caused it.

    A missing file is attributed to the design, because a key of the design may name the file.
    """
    for cause in (failure, failure.__cause__):
        if isinstance(cause, _MACHINE_FAULTS) and not isinstance(cause, FileNotFoundError):
            return cause
    return None


def _wanted_values(study: Study, folder: Path, point: Point) -> dict[str, object]:
    """Solve a point to the level of its study, and return the values of the requested outputs, keyed by output.

    At the level `files`, the whole design is run and all files are written to `folder`, except in a search. At lower
    levels, only the parts of the report that contain a requested output are solved. The springs are fitted by finite
    elements at the level `flexures`, and sized by closed-form expressions at the level `contact`.
    """
    design = study.base.design(point.settings)
    report: Mapping[str, object]
    if study.level == "files":
        # A search keeps no files. Seven digits are enough for the number of any point below `MAX_POINTS`.
        out = None if study.how == "search" else folder / "designs" / f"{point.number:07d}"
        report = _report_of_run(design, RunOptions(tolerance=study.tol, out=out))
    else:
        options = RunOptions(tolerance=study.tol)
        springs_as: SpringsAs = "sized" if study.level == "contact" else "fitted"
        report = SensorParts(Sensor(design=design, options=options, springs_as=springs_as))
    return {key: wanted_value(report, key) for key in study.wanted}


def _report_of_run(design: Design, options: RunOptions) -> dict[str, object]:
    """Run a design, and return the parts of its report by name, together with the overall outcome `PASSED`."""
    from pipeline import run  # imported here, because the import takes seconds and only whole runs need it

    # A parallel CAD process would not help, because the engine already has one process per core.
    result = run(design, options, beside=False)
    return {**vars(report_of_result(result)), PASSED: result.passed}
