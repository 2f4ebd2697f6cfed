"""Points of a study that one process solves, and what came out of each."""

import errno
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from cad.design.parameters import Design
from cad.quantity import InputError
from pipeline.evaluate import check_targets
from pipeline.options import RunOptions
from pipeline.report.mapping import (
    contact_keys,
    reading_keys,
    report_mapping,
    response_keys,
    sizing_keys,
    spring_keys,
    target_keys,
)
from pipeline.report.stored import as_data
from pipeline.response.scene_press import scene_of
from pipeline.result import Evaluation
from pipeline.storage.plain import Plain
from pipeline.study.points import Point, design_of
from pipeline.study.report_keys import parts_of, value_at_key
from pipeline.study.search.sized_sensor import sized_sensor
from pipeline.study.study_file import Study

Status = Literal["done", "refused", "failed"]

LOST = "the worker that solved this point was lost again and again; free memory, the same command tries it again"
_DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True, kw_only=True)
class PointResult(Point):
    """A point with what came out of it: values by wanted key or why it was refused or failed, and processor seconds."""

    status: Status
    values: Mapping[str, object] = field(default_factory=dict)
    error: str | None = None
    seconds: float = 0.0


def solve_points(study: Study, folder: Path | None, points: Sequence[Point]) -> tuple[PointResult, ...]:
    """Return the results of some points; one that is refused or fails does not stop the others.

    The files of whole runs go into the folder.
    """
    return tuple(_solved(study, folder, point) for point in points)


def lost_points(points: Sequence[Point]) -> tuple[PointResult, ...]:
    """Return points whose workers were lost, failed."""
    return tuple(PointResult(**vars(point), status="failed", error=LOST) for point in points)


def _solved(study: Study, folder: Path | None, point: Point) -> PointResult:
    start = time.process_time()
    values: Mapping[str, object] = {}
    status: Status = "done"
    error = None
    try:
        values = _values(study, folder, point)
    except Exception as failure:
        causes = (failure, failure.__cause__)
        if any(isinstance(cause, OSError) and cause.errno in _DISK_FULL for cause in causes):
            raise  # of the machine, not of the point, which is solved when there is room again
        refused = isinstance(failure, InputError)
        status = "refused" if refused else "failed"
        message = str(failure) if refused else f"{type(failure).__name__}: {failure}"
        error = " ".join(message.split())
    return PointResult(**vars(point), status=status, values=values, error=error, seconds=time.process_time() - start)


def _values(study: Study, folder: Path | None, point: Point) -> dict[str, object]:
    """Return the wanted values of a point, at the level of its study."""
    design = design_of(study, point.settings)
    if study.level == "contact":
        report = _sized_report(study, design)
    elif study.level == "flexures":
        report = evaluation_mapping(check_targets(design, RunOptions(tolerance=study.tol)))
    else:
        from pipeline import run  # with all that draws and writes, which takes seconds and only these points need

        out = None if folder is None else folder / "designs" / f"{point.number:07d}"
        result = run(design, RunOptions(tolerance=study.tol, out=out), beside=False)  # one process for each core
        report = {**report_mapping(result), "passed": result.passed}
    return {key: value_at_key(report, key) for key in study.wanted}


def _sized_report(study: Study, design: Design) -> Plain:
    """Return the part of report.json that follows from contact and springs as they were sized."""
    parts = parts_of(study.wanted, reads=design.reading is not None, linear=scene_of(design).linear)
    return evaluation_mapping(sized_sensor(design, study.tol, parts=parts).evaluation())


def evaluation_mapping(evaluation: Evaluation) -> Plain:
    """Return the part of report.json that an evaluation has: all that needs no solid."""
    springs = evaluation.springs
    readings = evaluation.readings
    report: dict[str, object] = {
        "springs": sizing_keys(evaluation.sizing),
        "deflections_mm": springs.deflections,
        "contact": contact_keys(evaluation.contact),
        "level": target_keys(evaluation.reached),
        "reading": None if readings is None else reading_keys(readings),
        "verdicts": evaluation.verdicts,
    }
    if not springs.ideal:
        report["flexures"] = {spring.name: spring_keys(spring, springs) for spring in springs.springs}
    if evaluation.press is not None:
        tips = evaluation.design.tips
        report["response"] = response_keys(tips, evaluation.contact, springs, evaluation.press.table)
    data: Plain = as_data(report)
    return data
