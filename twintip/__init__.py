"""The public names of the product, for `import twintip`: docs/python.md lists them with examples.

Units are mm, N and MPa. A name is imported when it is first asked for, so that `import twintip` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import cadquery as cq

    from pipeline.evaluate import evaluate
    from pipeline.main_job import run
    from pipeline.measure.compression.bodies import CylinderOnEnd, CylinderOnSide, Ellipsoid, Plunger, RectangularBlock
    from pipeline.measure.compression.force_law import TestGeometry
    from pipeline.measure.compression.modulus import CompressionResult
    from pipeline.measure.unit.fruit_reading import FruitReading
    from pipeline.options import RunOptions, load_design
    from pipeline.report.report import Report, read_report
    from pipeline.result import SensorResult
    from sensor.design.parameters import Design
    from sensor.quantity import InputError
    from sensor.theory.two_spring_law import Springs, force_ratio, fruit_stiffness, size_springs
    from sensor.verdict import Verdict

__all__ = [
    "CompressionResult",
    "CylinderOnEnd",
    "CylinderOnSide",
    "Design",
    "Ellipsoid",
    "FruitReading",
    "InputError",
    "Plunger",
    "RectangularBlock",
    "Report",
    "RunOptions",
    "SensorResult",
    "Springs",
    "TestGeometry",
    "Verdict",
    "evaluate",
    "force_ratio",
    "fruit_stiffness",
    "housing",
    "load_design",
    "modulus",
    "read_press",
    "read_report",
    "run",
    "size_springs",
]

_NAMES_OF = {
    "pipeline.evaluate": ("evaluate",),
    "pipeline.main_job": ("run",),
    "pipeline.measure.compression.bodies": (
        "RectangularBlock",
        "CylinderOnEnd",
        "CylinderOnSide",
        "Ellipsoid",
        "Plunger",
    ),
    "pipeline.measure.compression.force_law": ("TestGeometry",),
    "pipeline.measure.compression.modulus": ("CompressionResult",),
    "pipeline.measure.unit.fruit_reading": ("FruitReading",),
    "pipeline.options": ("RunOptions", "load_design"),
    "pipeline.report.report": ("Report", "read_report"),
    "pipeline.result": ("SensorResult",),
    "sensor.design.parameters": ("Design",),
    "sensor.quantity": ("InputError",),
    "sensor.theory.two_spring_law": ("Springs", "force_ratio", "fruit_stiffness", "size_springs"),
    "sensor.verdict": ("Verdict",),
}
"""The names that are defined elsewhere, by their module."""
_MODULE_OF = {name: module for module, names in _NAMES_OF.items() for name in names}


def housing(result: SensorResult) -> cq.Workplane:
    """Return the housing of a result [mm] on a CadQuery workplane.

    It is the solid of housing.step, of a square one of its two equal plates. x runs along the tips, whose faces lie at
    z = 0, and z points away from the fruit. Raises InputError where the springs are not made.
    """
    from cad.parts.assembly import on_workplane, sensor_of
    from sensor.quantity import validation_error

    made = result.springs.housing
    if made is None:
        hint = "see the verdicts printable.low and printable.high; a line of tips has no housing"
        raise validation_error("housing", result.design.name, "", "of a design whose springs are made", hint)
    return on_workplane(sensor_of(result.design, made).part)


def read_press(report: Report, file: str | Path, unit: str | Path | None = None) -> list[FruitReading]:
    """Return one reading for each press in a CSV file of forces or counts, as `pipeline read` does.

    `unit` is the unit.toml of `pipeline calibrate`; without it the springs are taken as designed. Forces that tell no
    modulus give a reading with flags and without E. Raises InputError for a file that is no signal of the sensor.
    """
    from pipeline.measure.tables.rows import lines_of
    from pipeline.measure.unit.measuring import MeasuringUnit
    from pipeline.measure.unit.presses import readings_of
    from pipeline.measure.unit.printed_unit import nominal_unit, read_unit
    from pipeline.measure.unit.ripeness import ripeness_classes
    from pipeline.measure.unit.signals import Signal

    printed = nominal_unit(report) if unit is None else read_unit(Path(unit), report)
    classes = ripeness_classes(printed.classes, "unit.classes") if printed.classes else None
    signal = Signal(lines_of(Path(file)), str(file), len(report.tips))
    return list(readings_of(MeasuringUnit(report=report, unit=printed, classes=classes), signal))


def modulus(file: str | Path, geometry: TestGeometry) -> list[CompressionResult]:
    """Return the modulus [MPa] of each specimen in the file of a compression test, as `pipeline modulus` does.

    Raises InputError for a file that holds no force over travel, and for a curve that is no compression of a fruit;
    SolveError where the force of such a body cannot be solved.
    """
    from pipeline.measure.compression.modulus import measured_modulus
    from pipeline.measure.compression.specimens import read_specimens

    return [measured_modulus(specimen, geometry) for specimen in read_specimens(Path(file))]


if not TYPE_CHECKING:  # which would take any name for one of this module

    def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has the name
        if name not in _MODULE_OF:
            msg = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(msg)
        return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return [*__all__]
