"""The read-out of a unit as source code for a microcontroller: a C99 header, or a MicroPython module."""

import inspect
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from instrument.press import press_core
from instrument.press.fruit_of_presses import chi_square_limit, own_constants
from instrument.press.fruit_reading import AT_THE_EDGE
from instrument.press.measuring import MeasuringUnit
from instrument.press.press_core import Unit
from instrument.press.presses import TARE_SAMPLES
from instrument.press.printed_unit import PrintedUnit
from instrument.press.seating import ROUNDS, seating_of
from instrument.press.spikes import spike_constants
from instrument.template import render_template
from pipeline.reading.read_out import LevelReading
from pipeline.report.report import Report
from sensor.design.readout import AMPLIFIERS
from sensor.quantity import validation_error
from sensor.theory.contrast_rise import FEWEST, LARGEST_BY_TIME, LARGEST_NOISE, LARGEST_TOUCH_FORCE, LEAST_RISE, RiseLaw
from sensor.turns import in_turn

SADDLE_STEPS = 12
"""Of finding the offset of a saddle: each leaves some per cent of the error of the step before."""
SETTLED = 1e-4  # of the springs' part of the contrast: an offset that moves more in the last step is of no press


@in_turn
def c_header(report: Report, unit: PrintedUnit | str | Path | None = None) -> str:
    """Return the read-out of a unit as a C99 header, as `pipeline read --c-header` writes it.

    `unit` is as in `read_press`. Raises InputError for a design with fruit.relaxation.
    """
    return header_text(MeasuringUnit.from_report(report, unit))


@in_turn
def micropython(report: Report, unit: PrintedUnit | str | Path | None = None) -> str:
    """Return the read-out of a unit as a MicroPython module, as `pipeline read --micropython` writes it.

    `unit` is as in `read_press`. Raises InputError for a design with fruit.relaxation.
    """
    return module_text(MeasuringUnit.from_report(report, unit))


def header_text(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit in single-precision C99, without heap, the unit's constants in it.

    Raises InputError where the design has fruit.relaxation.
    """
    return render_template(
        "firmware/firmware.h.j2",
        _single,
        most_presses=press_core.MOST_PRESSES,
        much_less_certain=press_core.MUCH_LESS_CERTAIN,
        **_about(sensor),
        **_constants(sensor),
    )


def module_text(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit as a MicroPython module that imports math alone: press_core.py with its constants.

    Raises InputError where the design has fruit.relaxation.
    """
    core = inspect.getsource(press_core).partition("\nimport math\n")[2]
    constants = {name: repr(value) for name, value in _constants(sensor).items() if name in Unit.__annotations__}
    return render_template("firmware/board.py.j2", core=core.strip(), constants=constants, **_about(sensor))


def _about(sensor: MeasuringUnit) -> dict[str, object]:
    """Return what the templates say of a unit, its channels and its board."""
    signal = sensor.report.read_out.signal
    return {
        "design": sensor.report.design.name,
        "method": sensor.unit.method,
        "radii": " and ".join(f"{radius:g}" for radius in sensor.radii_mm or ()),
        "tips": [tip.name for tip in sensor.report.tips],
        "turn": sensor.report.design.tips.tip_layout.turn_deg,
        "pair": sensor.report.read_out.is_pair,
        "calibrated": bool(sensor.unit.newtons_per_count),
        "staggered": signal is not None and bool(signal.delays),
        "tare_samples": TARE_SAMPLES,
        "amplifier": "" if signal is None else signal.amplifier,
        "board": "" if signal is None else signal.board,
        "rate": 0.0 if signal is None or not signal.time_deviation else signal.rate_Hz,
        "inputs": _inputs(sensor),
    }


def _constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the constants of a unit: forces [N], lengths [mm], moduli [MPa]; `press_core.Unit` says what they are.

    Raises InputError for flesh that relaxes, which is read by a press with its hold.
    """
    if sensor.report.design.fruit.relaxation is not None:
        bound = "left out for firmware, which reads no hold"
        raise validation_error("fruit.relaxation", "given", "", bound, "read a press with pipeline read")
    least, largest = sensor.range_MPa
    signal = sensor.report.read_out.signal
    later = [] if signal is None else list(signal.delays)
    return {
        "gains": [*sensor.unit.gain],
        "newtons": [slope for row in sensor.unit.newtons_per_count for slope in row],
        "saturation": sensor.unit.saturation_counts,
        "lowest_forces": sensor.lowest_forces.tolist(),
        "largest_forces": sensor.largest_forces.tolist(),
        "later": later,
        "several": 2 if later else 1,
        "time_deviation": 0.0 if signal is None else signal.time_deviation,
        "largest_by_time": LARGEST_BY_TIME,
        "least_E": least * (1.0 - AT_THE_EDGE),
        "largest_E": largest * (1.0 + AT_THE_EDGE),
        "reduced": sensor.reduced(1.0),
        **_level(sensor.report.read_out.level_readings, sensor.press_over_weighed(), sensor.ball_factor),
        **_contrast_constants(sensor, sensor.rise_law),
        **spike_constants(sensor),
        **_seating_constants(sensor),
        **own_constants(sensor),
        "chi_squares": [chi_square_limit(presses) for presses in range(2, press_core.MOST_PRESSES + 1)],
    }


def _inputs(sensor: MeasuringUnit) -> list[int]:
    """Return the inputs of the amplifier in the order of their conversion, those without a tip last."""
    signal = sensor.report.read_out.signal
    if signal is None:
        return []
    count = max(int(AMPLIFIERS[signal.amplifier].channels), len(sensor.report.tips))
    return [*signal.conversion_order, *range(len(sensor.report.tips), count)]


def _level(rows: Sequence[LevelReading], stiffened: float, by_ball: float) -> dict[str, object]:
    """Return level readings as logarithms, and the factor of one row, with that of a reference ball.

    Springs that are stiffer in a press of the design than in the weighing, `stiffened` [1], read as much too little.
    """
    if not rows and stiffened != 1.0:
        rows = [LevelReading(E_MPa=1.0, read_MPa=1.0)]
    by_creep = math.log(stiffened)
    return {
        "level_logs": [math.log(row.read_MPa) - by_creep for row in rows],
        "level_shifts": [math.log(row.E_MPa / row.read_MPa) + by_creep + math.log(by_ball) for row in rows],
        "level_factor": by_ball * stiffened * rows[0].E_MPa / rows[0].read_MPa if rows else 1.0,
    }


def _seating_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return from which loads [N/mm] and forces [N] on a press is summed, and what seats the tips."""
    seating = seating_of(sensor)
    return {
        "loads": seating.loads,
        "load_forces": [force for forces in seating.least_forces for force in forces.tolist()],
        "per_offset": seating.per_offset,
        "by_skin": seating.by_skin,
        "rounds": ROUNDS,
    }


def _single(value: float) -> str:
    """Return a number as C writes it in single precision."""
    text = f"{value:.9g}"
    return f"{text}f" if any(sign in text for sign in ".e") else f"{text}.0f"


def _contrast_constants(sensor: MeasuringUnit, law: RiseLaw) -> dict[str, object]:
    """Return what the formulas of a contrast need: forces [N], lengths [mm], moduli [MPa]."""
    sensor.refuse_without_rise_level()
    weights, C, S = law.contrast.arrays
    domes = law.rolling
    return {
        "springs": (weights @ C).tolist(),
        "fruit": (weights @ S).tolist(),
        "domes": (law.contrast.hertz * weights).tolist(),
        "gap": float(weights @ np.array(law.contrast.gaps)),
        "noises": sensor.noises.tolist(),
        "fewest": FEWEST,
        "latest_touch": LARGEST_TOUCH_FORCE,
        "least_rise": LEAST_RISE * float(np.linalg.norm(sensor.noises)),
        "largest_noise": LARGEST_NOISE,
        "saddle_steps": 1 if domes is None else SADDLE_STEPS,
        "settled": SETTLED,
        "weights": weights.tolist(),
        "places": [] if domes is None else [along for place in domes.positions for along in place],
        "dome_radius": 0.0 if domes is None else domes.dome_radius,
        "rolled": 1.0 if domes is None else domes.rolling_factor,
        "felt": 1.0 if domes is None else domes.contrast_of_xy,
        "body": 0.0 if domes is None else (1.0 - domes.poisson**2) / math.pi,
        # what the body adds to a half-space
        "still": [] if domes is None else (weights @ (S - domes.S())).tolist(),
    }
