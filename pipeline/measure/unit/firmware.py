"""The read-out of a unit as source code for a microcontroller: a C99 header, or a MicroPython module."""

import math

import numpy as np

from cad.theory.contrast_law import ContrastLaw
from pipeline.measure.template import rendered
from pipeline.measure.unit.fruit_reading import AT_THE_EDGE
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.presses import TARE_SAMPLES


def c_header(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit in single-precision C99, without heap, the unit's constants in it."""
    return rendered("unit/firmware.h.j2", _single, **_constants(sensor))


def micropython(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit as a MicroPython module that imports math alone."""
    return rendered("unit/firmware.py.j2", repr, **_constants(sensor))


def _constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return what the templates name: forces [N], lengths [mm], moduli [MPa]."""
    least, largest = sensor.range_MPa
    law = _pair_constants(sensor) if sensor.law is None else _contrast_constants(sensor.law)
    rows = sensor.report.read_out.level
    signal = sensor.report.read_out.signal
    return {
        "design": sensor.design.name,
        "method": sensor.unit.method,
        "tips": [tip.name for tip in sensor.report.tips],
        "gains": sensor.unit.gain,
        "newtons": [slope for row in sensor.unit.newtons_per_count for slope in row],
        "saturation": sensor.unit.saturation_counts,
        "tare_samples": TARE_SAMPLES,
        "amplifier": "" if signal is None else signal.amplifier,
        "board": "" if signal is None else signal.board,
        "least_forces": sensor.least_forces.tolist(),
        "largest_forces": sensor.largest_forces.tolist(),
        "least_E": least * (1.0 - AT_THE_EDGE),
        "largest_E": largest * (1.0 + AT_THE_EDGE),
        "reduced": sensor.reduced(1.0),
        "level_logs": [math.log(row.read_MPa) for row in rows],
        "level_factor": rows[0].E_MPa / rows[0].read_MPa if rows else 1.0,
        "level_shifts": [math.log(row.E_MPa / row.read_MPa) for row in rows],
        **law,
    }


def _single(value: float) -> str:
    """Return a number as C writes it in single precision."""
    text = f"{value:.9g}"
    return f"{text}f" if any(sign in text for sign in ".e") else f"{text}.0f"


def _contrast_constants(law: ContrastLaw) -> dict[str, object]:
    """Return what the formulas of a contrast need: forces [N], lengths [mm], moduli [MPa]."""
    weights = np.array(law.weights)
    return {
        "pair": False,
        "springs": (weights @ np.array(law.C)).tolist(),
        "fruit": (weights @ np.array(law.S)).tolist(),
        "domes": (law.hertz * weights).tolist(),
        "gap": float(weights @ np.array(law.gaps)),
    }


def _pair_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return what fits a line y over x to a press, as in `cad/theory/pair_line.py`."""
    relative = np.subtract(sensor.C[0], sensor.C[1])
    x_and_y = np.array([[-1.0, 1.0], relative])
    (noise_xx, noise_xy), (_, noise_yy) = (x_and_y @ np.diag(sensor.noises**2) @ x_and_y.T).tolist()
    return {
        "pair": True,
        "relative": relative.tolist(),
        "noise_xx": noise_xx,
        "noise_xy": noise_xy,
        "noise_yy": noise_yy,
        "own_less_other": sensor.own_less_other,
        "spacing": sensor.design.tips.spacing_mm,
    }
