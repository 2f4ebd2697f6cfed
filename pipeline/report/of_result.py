"""Build the report of a run, key by key, from the results of its stages."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import version
from typing import Any

from pipeline.errors.error_records import UncertaintyBudget
from pipeline.errors.targets import force_errors_of_springs
from pipeline.options import run_key
from pipeline.report.notes import notes
from pipeline.report.parts import (
    AccuracyReport,
    ContactReport,
    CurveReport,
    MaterialReport,
    PaperReport,
    ReadingReport,
    RelaxationReport,
    ResponseReport,
    SizingReport,
    TipReport,
)
from pipeline.report.report import LeftOut, ListedFile, Report
from pipeline.result import SensorResult
from pipeline.sensor import Sensor
from pipeline.springs.fitted_springs import printable_leaves
from sensor.verdict import Verdict

PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")

OF_SENSOR: dict[str, Callable[[Sensor | SensorResult], Any]] = {
    "springs": lambda sensor: SizingReport.from_stage(sensor.sizing, _beam_law_leaves(sensor)),
    "flexures": lambda sensor: {} if sensor.springs.ideal else sensor.springs.springs,
    "deflections_mm": lambda sensor: sensor.sizing.deflections(sensor.design.full_travels_mm),
    "contact": lambda sensor: ContactReport.from_stage(sensor.contact),
    "response": lambda sensor: ResponseReport.rows(
        sensor.press.table,
        sensor.design.tips,
        [force_errors_of_springs(sensor.pressed, E) for E in sensor.press.table.E.tolist()],
    ),
    "reading": lambda sensor: None if sensor.readings is None else ReadingReport.from_stage(sensor.readings),
    "level": lambda sensor: sensor.level,
}
"""A function for each key that does not need a solid; a study may request any of these keys."""

OF_RESULT: dict[str, Callable[[SensorResult], Any]] = {
    "design": lambda result: result.design,
    "housing": lambda result: result.springs.housing,
    "material": lambda result: MaterialReport.from_stage(result.springs.process),
    "behaviour": lambda result: result.behaviour,
    "curve": lambda result: CurveReport.from_stage(result.errors.reading, result.design.tips),
    "tips": lambda result: TipReport.rows(result.design.tips),
    "read_out": lambda result: result.read_out,
    "verdicts": lambda result: result.verdicts,
    "remedy": lambda result: next((each.remedy for each in result.verdicts if each.remedy is not None), None),
    "errors": lambda result: _error_budgets(result),
    "paper": lambda result: None if result.paper is None else PaperReport.from_stage(result.paper),
    "accuracy": lambda result: AccuracyReport.from_stage(
        result.options.tolerance, result.springs.fitted, result.contact
    ),
    "notes": lambda result: tuple(notes(result)),
    "versions": lambda _: {name: version(name) for name in PACKAGES},
    "seconds": lambda result: result.seconds.wall,
    "cpu_seconds": lambda result: result.seconds.cpu,
    "relaxation": lambda result: None if result.over_time is None else RelaxationReport.from_stage(result.over_time),
    "tolerance": lambda result: result.errors.scatter if result.options.fabrication else LeftOut.LEFT_OUT,
    "key": lambda result: run_key(result.design, result.options),
}
"""A function for each of the other keys, which need a complete result."""


def report_of_result(result: SensorResult, files: Iterable[ListedFile] = ()) -> Report:
    """Return the report of a run; `files` are the files of its output folder."""
    values = {name: compute(result) for name, compute in (OF_SENSOR | OF_RESULT).items()}
    return Report(**values, files=tuple(files))


class SensorParts(Mapping[str, object]):
    """A mapping from the report keys that do not need a solid to their values, which are solved on first use.

    A study reads the keys that it requests from it, so that only the stages for these keys are solved.
    """

    def __init__(self, sensor: Sensor) -> None:
        """Store the sensor, whose stages are solved when a key needs them."""
        self._part = cache(lambda name: OF_SENSOR[name](sensor))  # cached, because dotted keys may share a part
        self._verdicts = _VerdictsByName(sensor)

    def __contains__(self, name: object) -> bool:
        """Return whether the mapping has a key, without solving anything."""
        return name in OF_SENSOR or name == "verdicts"

    def __getitem__(self, name: str) -> object:
        """Return the value of a key; raises KeyError for a key that needs a solid."""
        return self._verdicts if name == "verdicts" else self._part(name)

    def __iter__(self) -> Iterator[str]:
        """Yield the keys."""
        return iter((*OF_SENSOR, "verdicts"))

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(OF_SENSOR) + 1


class _VerdictsByName(Mapping[str, Verdict]):
    """A mapping from names to the verdicts on a sensor, which are evaluated on first use."""

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor
        self._verdict = cache(sensor.verdict)

    def __getitem__(self, name: str) -> Verdict:
        verdict = self._verdict(name)
        if verdict is None:
            raise KeyError(name)
        return verdict

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._verdict(name) is not None

    def __iter__(self) -> Iterator[str]:
        return (verdict.name for verdict in self._sensor.verdicts)

    def __len__(self) -> int:
        return len(self._sensor.verdicts)


def _beam_law_leaves(sensor: Sensor | SensorResult) -> tuple[float, ...] | None:
    """Return the leaf lengths by the beam law [mm], low spring first; None for a layout without a housing."""
    if not sensor.design.tips.tip_layout.has_housing:
        return None
    return tuple(spring.length_mm for spring in printable_leaves(sensor.design, sensor.sizing).values())


def _error_budgets(result: SensorResult) -> dict[str, UncertaintyBudget | None]:
    """Return the error budget of each number, keyed by its name; None if the number has no budget.

    A layout without a housing has no budgets of K_l and K_h, because its springs are given.
    """
    has_housing = result.design.tips.tip_layout.has_housing
    budgets = vars(result.errors.budgets)
    return {name: budget for name, budget in budgets.items() if has_housing or name not in ("K_l", "K_h")}
