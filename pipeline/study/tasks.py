"""A piece of a study that one process solves: some points, and what came out of each."""

import errno
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from cad.design.parameters import Design
from cad.quantity import InputError
from pipeline.evaluate import check_targets
from pipeline.options import RunOptions
from pipeline.report.mapping import (
    report_mapping,
    stored_contact,
    stored_reading,
    stored_response,
    stored_row,
    stored_sizing,
    stored_spring,
    stored_targets,
)
from pipeline.report.stored import StoredResponse, as_data
from pipeline.response.scene_press import scene_of
from pipeline.result import Evaluation
from pipeline.springs.fitted_springs import ideal_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.plain import Plain
from pipeline.study.interpolated_contact import InterpolatedContact
from pipeline.study.points import Point, design_of, points_between
from pipeline.study.printed import printed_sizing
from pipeline.study.report_keys import parts_of, value_at_key
from pipeline.study.scenes import scene_compliance, unit_scene
from pipeline.study.study_file import Study
from pipeline.study.variation import Setting
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance

Status = Literal["done", "refused", "failed"]

LOST = "the worker that solved this point was lost again and again; free memory, the same command tries it again"
# Every class that a solve can raise, of libraries too: a point that meets a rare fault must not stop a million others.
FAILURES = (
    RuntimeError, ValueError, ArithmeticError, LookupError, TypeError, AttributeError, OSError, MemoryError,
    AssertionError, ImportError, EOFError,
)  # fmt: skip
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_SPREAD = 2654435761  # Knuth's multiplier: numbers that follow each other fall far apart
_HASHES = 2**32


@dataclass(frozen=True, kw_only=True)
class Task:
    """Points of a study for one process: those listed, and those from `start` up to, not including, `stop`.

    `folder` is where the files of whole runs go.
    """

    study: Study
    points: tuple[Point, ...] = ()
    start: int = 0
    stop: int = 0
    interpolation: InterpolatedContact | None = None
    folder: Path | None = None

    def all_points(self) -> tuple[Point, ...]:
        """Return the points that are listed and those of the range."""
        ranged = points_between(self.study, self.start, self.stop) if self.stop > self.start else ()
        return (*self.points, *ranged)


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
    return tuple(_solved(task, point) for point in task.all_points())


def lost_task(task: Task) -> tuple[PointResult, ...]:
    """Return the points of a task whose workers were lost, failed."""
    return tuple(_without_values(point, "failed", LOST, 0.0) for point in task.all_points())


def _without_values(point: Point, status: Status, error: str, seconds: float) -> PointResult:
    return PointResult(
        number=point.number, settings=point.settings, status=status, values={}, error=error, seconds=seconds
    )


def _solved(task: Task, point: Point) -> PointResult:
    start = time.process_time()
    study = task.study
    try:
        values = _values(task, point, task.interpolation)
        audited = task.interpolation is not None and _is_audited(point.number, study)
        audit = _values(task, point, None) if audited else None
    except FAILURES as failure:
        causes = (failure, failure.__cause__)
        if any(isinstance(cause, OSError) and cause.errno in _NO_ROOM for cause in causes):
            raise  # the disk is full: of the machine, not of the point, which is solved when there is room again
        refused = isinstance(failure, InputError)
        message = str(failure) if refused else f"{type(failure).__name__}: {failure}"
        status: Status = "refused" if refused else "failed"
        return _without_values(point, status, " ".join(message.split()), time.process_time() - start)
    return PointResult(
        number=point.number,
        settings=point.settings,
        status="done",
        values=values,
        error=None,
        seconds=time.process_time() - start,
        audit=audit,
    )


def _is_audited(number: int, study: Study) -> bool:
    """Say whether a point is drawn for a full solve: by its number, so that a resumed study draws the same ones."""
    return (number + study.seed + 1) * _SPREAD % _HASHES < study.audit * _HASHES


def _values(task: Task, point: Point, interpolation: InterpolatedContact | None) -> dict[str, object]:
    """Return the wanted values of a point, at the level of its study."""
    study = task.study
    design = design_of(study, point.settings)
    options = RunOptions(tolerance=study.tol)
    if study.level == "contact":
        report = _sized_report(study, design, point, interpolation)
    elif study.level == "flexures":
        report = evaluation_mapping(check_targets(design, options))
    else:
        from pipeline import run  # with all that draws and writes, which takes seconds and only these points need

        out = None if task.folder is None else task.folder / "designs" / f"{point.number:07d}"
        result = run(design, RunOptions(tolerance=study.tol, out=out), beside=False)  # one process for each core
        report = {**report_mapping(result), "passed": result.passed}
    return {key: value_at_key(report, key) for key in study.wanted}


def _sized_report(study: Study, design: Design, point: Point, interpolation: InterpolatedContact | None) -> Plain:
    """Return the part of report.json that follows from contact and springs as they were sized, or as printed."""
    scene = unit_scene(design)
    if interpolation is not None and interpolation.covers(scene):
        contact = interpolation.compliance(scene, study, point)
    else:
        contact = scene_compliance(scene, study.tol)
    drawn = spring_sizing(design, contact, RunOptions())
    sizing = printed_sizing(design, drawn, point.settings)
    springs = ideal_springs(design, drawn, sizing.springs)
    parts = parts_of(study.wanted, reads=design.reading is not None, linear=scene_of(design).linear)
    return evaluation_mapping(check_targets(design, contact=contact, sizing=sizing, springs=springs, parts=parts))


def evaluation_mapping(evaluation: Evaluation) -> Plain:
    """Return the part of report.json that an evaluation has: all that needs no solid."""
    springs = evaluation.springs
    readings = evaluation.readings
    report: dict[str, object] = {
        "springs": stored_sizing(evaluation.sizing),
        "contact": stored_contact(evaluation.contact),
        "level": stored_targets(evaluation.reached),
        "reading": None if readings is None else stored_reading(readings),
        "verdicts": evaluation.verdicts,
    }
    if not springs.ideal:
        report["flexures"] = {spring.name: stored_spring(spring, springs) for spring in springs.springs}
        report["deflections_mm"] = springs.deflections
    if evaluation.press is not None:
        report["response"] = _response(evaluation, evaluation.press.table)
    data: Plain = as_data(report)
    return data


def _response(evaluation: Evaluation, table: SensorResponse) -> Sequence[StoredResponse]:
    tips = evaluation.design.tips
    if not evaluation.springs.ideal:
        return stored_response(tips, evaluation.contact, evaluation.springs, table)
    exact = np.zeros(len(tips.springs))  # springs exactly as sized have no error
    return [stored_row(table, i, tips, exact) for i in range(len(table.E))]


def solve_scene(given: tuple[int, Study, Point]) -> tuple[int, FruitCompliance]:
    """Return an index with the compliance of the scene of a point [1/mm]."""
    index, study, point = given
    return index, scene_compliance(unit_scene(design_of(study, point.settings)), study.tol)
