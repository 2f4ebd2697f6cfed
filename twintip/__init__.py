"""The public names of the product, for `import twintip`: docs/python.md lists them with examples.

Units are mm, N and MPa. A name is imported when it is first asked for, so that `import twintip` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sensor.turns import in_turn

if TYPE_CHECKING:
    import cadquery as cq

    from instrument.calibrate.calibration import Calibration
    from instrument.compress.bodies import CylinderOnEnd, CylinderOnSide, Ellipsoid, Plunger, RectangularBlock
    from instrument.compress.force_law import TestGeometry
    from instrument.compress.modulus import CompressionResult
    from instrument.press.fruit_reading import FruitReading
    from instrument.press.measuring import MeasuringUnit
    from instrument.press.printed_unit import PrintedUnit
    from pipeline.main_job import evaluate, run
    from pipeline.options import RunOptions, load_design
    from pipeline.report.report import Report, read_report
    from pipeline.result import SensorResult
    from pipeline.study.execute import StudySummary, run_study
    from pipeline.study.study_file import Study, read_study
    from pipeline.study.workers import process_engine
    from sensor.design.parameters import Design
    from sensor.quantity import InputError
    from sensor.theory.two_spring_law import Springs, force_ratio, fruit_stiffness, size_springs
    from sensor.verdict import Verdict

__all__ = [
    "Calibration",
    "CompressionResult",
    "CylinderOnEnd",
    "CylinderOnSide",
    "Design",
    "Ellipsoid",
    "FruitReading",
    "InputError",
    "Plunger",
    "PrintedUnit",
    "RectangularBlock",
    "Report",
    "RunOptions",
    "SensorResult",
    "Springs",
    "Study",
    "StudySummary",
    "TestGeometry",
    "Verdict",
    "c_header",
    "calibrate",
    "evaluate",
    "force_ratio",
    "fruit_stiffness",
    "housing",
    "load_design",
    "micropython",
    "modulus",
    "process_engine",
    "read_press",
    "read_report",
    "read_study",
    "run",
    "run_study",
    "size_springs",
]

_NAMES_OF = {
    "pipeline.main_job": ("evaluate", "run"),
    "instrument.calibrate.calibration": ("Calibration",),
    "instrument.compress.bodies": (
        "RectangularBlock",
        "CylinderOnEnd",
        "CylinderOnSide",
        "Ellipsoid",
        "Plunger",
    ),
    "instrument.compress.force_law": ("TestGeometry",),
    "instrument.compress.modulus": ("CompressionResult",),
    "instrument.press.fruit_reading": ("FruitReading",),
    "instrument.press.printed_unit": ("PrintedUnit",),
    "pipeline.options": ("RunOptions", "load_design"),
    "pipeline.report.report": ("Report", "read_report"),
    "pipeline.result": ("SensorResult",),
    "pipeline.study.execute": ("StudySummary", "run_study"),
    "pipeline.study.study_file": ("Study", "read_study"),
    "pipeline.study.workers": ("process_engine",),
    "sensor.design.parameters": ("Design",),
    "sensor.quantity": ("InputError",),
    "sensor.theory.two_spring_law": ("Springs", "force_ratio", "fruit_stiffness", "size_springs"),
    "sensor.verdict": ("Verdict",),
}
"""The names that are defined elsewhere, by their module."""
_MODULE_OF = {name: module for module, names in _NAMES_OF.items() for name in names}


@in_turn
def housing(result: SensorResult) -> cq.Workplane:
    """Return the housing of a result [mm] on a CadQuery workplane.

    It is the solid of housing.step, of a square one of its two equal plates. The axis x runs along the tips, whose
    faces lie at z = 0, and z points away from the fruit. Raises InputError where the springs are not made.
    """
    from cad.parts.assembly import on_workplane, sensor_of
    from sensor.quantity import validation_error

    made = result.springs.housing
    if made is None:
        hint = "see the verdicts printable.low and printable.high; a line of tips has no housing"
        raise validation_error("housing", result.design.name, "", "of a design whose springs are made", hint)
    return on_workplane(sensor_of(result.design, made).part)


@in_turn
def read_press(
    report: Report,
    file: str | Path,
    unit: PrintedUnit | str | Path | None = None,
    counts_as: Literal["unsigned", "offset"] | None = None,
) -> list[FruitReading]:
    """Return one reading for each press in a CSV file of forces or counts, as `pipeline read` does.

    `unit` is that of a calibration, or the path of its unit.toml. Without it the springs are taken as designed. Forces
    that tell no modulus give a reading with flags and without E. `counts_as` says how counts without signs are written.
    Raises InputError for a file that is no signal of the sensor.
    """
    from instrument.press.presses import readings_of
    from instrument.press.signals import Signal
    from pipeline.tables.rows import rows_of

    signal = Signal(rows_of(Path(file)), len(report.tips))
    return list(readings_of(_measuring(report, unit), signal, counts_as=counts_as))


@in_turn
def calibrate(
    report: Report,
    weights: str | Path,
    after_s: float | None = None,
    counts_as: Literal["unsigned", "offset"] | None = None,
) -> Calibration:
    """Return the calibration of a printed unit by a table of weights, as `pipeline calibrate` does.

    `after_s` is the time from the hanging of a weight to its reading [s] where the table has no times. `counts_as` is
    as in `read_press`. Raises InputError for a table that is no measurement of this design's springs.
    """
    from instrument.calibrate.calibration import calibrate_unit, measured_print
    from instrument.press.printed_unit import check_weighed_after
    from sensor.quantity import validation_error

    check_weighed_after("after_s", after_s)
    table = measured_print(weights, report, counts_as=counts_as)
    if "coupon" in table.texts:
        hint = "pipeline calibrate finds the modulus of a coupon"
        raise validation_error("weights", str(weights), "", "a table with a column tip", hint)
    return calibrate_unit(report, table, after_s=after_s)


@in_turn
def c_header(report: Report, unit: PrintedUnit | str | Path | None = None) -> str:
    """Return the read-out of a unit as a C99 header, as `pipeline read --c-header` writes it.

    `unit` is as in `read_press`. Raises InputError for a design with fruit.relaxation.
    """
    from instrument.firmware import firmware

    return firmware.c_header(_measuring(report, unit))


@in_turn
def micropython(report: Report, unit: PrintedUnit | str | Path | None = None) -> str:
    """Return the read-out of a unit as a MicroPython module, as `pipeline read --micropython` writes it.

    `unit` is as in `read_press`. Raises InputError for a design with fruit.relaxation.
    """
    from instrument.firmware import firmware

    return firmware.micropython(_measuring(report, unit))


def _measuring(report: Report, unit: PrintedUnit | str | Path | None) -> MeasuringUnit:
    """Return a unit as it measures, as designed if none is given; raises InputError for one of another design."""
    from instrument.press.measuring import MeasuringUnit

    return MeasuringUnit.from_report(report, unit)


@in_turn
def modulus(file: str | Path, geometry: TestGeometry) -> list[CompressionResult]:
    """Return the modulus [MPa] of each specimen in the file of a compression test, as `pipeline modulus` does.

    Raises InputError for a file that holds no force over travel, and for a curve that is no compression of a fruit.
    Raises SolveError where the force of such a body cannot be solved.
    """
    from instrument.compress.modulus import measured_modulus
    from instrument.compress.specimens import read_specimens

    return [measured_modulus(specimen, geometry) for specimen in read_specimens(Path(file))]


if not TYPE_CHECKING:  # which would take any name for one of this module

    def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has the name
        if name not in _MODULE_OF:
            msg = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(msg)
        return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return [*__all__]
