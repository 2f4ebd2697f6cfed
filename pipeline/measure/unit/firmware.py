"""The read-out of a unit as source code for a microcontroller: a C99 header, or a MicroPython module."""

import math
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from cad.quantity import validation_error
from pipeline.measure.unit.fruit_reading import AT_THE_EDGE
from pipeline.measure.unit.measuring import SAME_DEPTH, MeasuringUnit

_TEMPLATES = Path(__file__).parent


def c_header(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit in single-precision C99, without heap, the unit's constants in it."""
    return _written("firmware.h.j2", sensor, _single)


def micropython(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit as a MicroPython module that imports math alone."""
    return _written("firmware.py.j2", sensor, repr)


def _written(template: str, sensor: MeasuringUnit, number: object) -> str:
    if sensor.deep is not None:
        bound = "'linear' for firmware, which holds the linear law"
        remedy = f"read with pipeline read, or run the design with press.strain=linear and {SAME_DEPTH}"
        raise validation_error("press.strain", sensor.design.press.strain, "", bound, remedy)
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["number"] = number
    return environment.get_template(template).render(**_constants(sensor)) + "\n"


def _single(value: float) -> str:
    """Return a number as C writes it in single precision."""
    text = f"{value:.9g}"
    return f"{text}f" if any(sign in text for sign in ".e") else f"{text}.0f"


def _constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return what the formulas of a layout need: forces [N], lengths [mm], moduli [MPa]."""
    least, largest = sensor.range_MPa
    shared = {
        "design": sensor.design.name,
        "method": sensor.unit.method,
        "tips": [tip.name for tip in sensor.report.tips],
        "gains": sensor.unit.gain,
        "least_forces": sensor.least_forces,
        "largest_forces": sensor.largest_forces,
        "least_E": least * (1.0 - AT_THE_EDGE),
        "largest_E": largest * (1.0 + AT_THE_EDGE),
        "reduced": sensor.reduced(1.0),
    }
    return {**shared, **(_of_pair(sensor) if sensor.law is None else _of_contrast(sensor))}


def _of_contrast(sensor: MeasuringUnit) -> dict[str, object]:
    law, rows = sensor.law, sensor.report.read_out.level
    if law is None:
        return {}

    def contracted(matrix: Sequence[Sequence[float]]) -> list[float]:
        return [
            math.fsum(w * row[tip] for w, row in zip(law.weights, matrix, strict=True)) for tip in range(len(matrix))
        ]

    return {
        "pair": False,
        "springs": contracted(law.C),
        "fruit": contracted(law.S),
        "domes": [law.hertz * weight for weight in law.weights],
        "gap": math.fsum(weight * gap for weight, gap in zip(law.weights, law.gaps, strict=True)),
        "level_logs": [math.log(row.read_MPa) for row in rows],
        "level_factor": rows[0].E_MPa / rows[0].read_MPa if rows else 1.0,
        "level_shifts": [math.log(row.E_MPa / row.read_MPa) for row in rows],
    }


def _of_pair(sensor: MeasuringUnit) -> dict[str, object]:
    C, noises = sensor.C, sensor.noises
    give = (C[0][0] - C[1][0], C[0][1] - C[1][1])
    squares = [noise * noise for noise in noises]
    return {
        "pair": True,
        "give": give,
        "noise_xx": sum(squares),
        "noise_xy": give[1] * squares[1] - give[0] * squares[0],
        "noise_yy": give[0] ** 2 * squares[0] + give[1] ** 2 * squares[1],
        "own_less_other": sensor.report.read_out.own_less_other_per_mm,
        "spacing": sensor.design.tips.spacing_mm,
    }
