"""The read-out of a unit as source code for a microcontroller: a C99 header, or a MicroPython module."""

import inspect
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from instrument.firmware import ads1220
from instrument.press import press_core
from instrument.press.fruit_of_presses import chi_square_limit, own_constants
from instrument.press.fruit_reading import AT_THE_EDGE
from instrument.press.measuring import MeasuringUnit
from instrument.press.press_core import Unit
from instrument.press.presses import TARE_SAMPLES
from instrument.press.printed_unit import PrintedUnit
from instrument.press.seating import ROUNDS, seating_of
from instrument.press.signals import count_keys
from instrument.press.spikes import spike_constants
from instrument.template import render_template
from pipeline.reading.read_out import LevelReading
from pipeline.report.report import Report
from sensor.design.readout import AMPLIFIERS, BOARDS, Board, Readout
from sensor.design.signal_path import SignalPath
from sensor.quantity import validation_error
from sensor.theory.contrast_rise import FEWEST, LARGEST_BY_TIME, LARGEST_NOISE, LARGEST_TOUCH_FORCE, LEAST_RISE, RiseLaw
from sensor.turns import in_turn

_SKETCH = "sketch"
"""The name of the sketch for Arduino and of the folder that contains it."""
SADDLE_STEPS = 12
"""Iterations for the offset of a saddle; each leaves some per cent of the error."""
SETTLED = 1e-4  # largest change of the offset in the last step, relative to the springs' part of the contrast


@in_turn()
def c_header(report: Report, unit: PrintedUnit | str | Path | None = None) -> str:
    """Return the firmware of a unit as a C99 header, as `pipeline read --c-header` writes it.

    Parameters
    ----------
    report : Report
        The report of the design, from `read_report`.
    unit : PrintedUnit, str or Path, optional
        A calibrated unit or its unit.toml, as in `read_press`.

    Returns
    -------
    str
        The text of the header.

    Raises
    ------
    InputError
        If the flesh of the design relaxes, or the unit is not of this design.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # of pipeline run --out outputs/mine
    >>> header = twintip.c_header(report)
    >>> "twintip_end" in header
    True
    """
    return header_text(MeasuringUnit.from_report(report, unit))


@in_turn()
def micropython(report: Report, unit: PrintedUnit | str | Path | None = None) -> str:
    """Return the firmware of a unit as a MicroPython module, as `pipeline read --micropython` writes it.

    Parameters
    ----------
    report : Report
        The report of the design, from `read_report`.
    unit : PrintedUnit, str or Path, optional
        A calibrated unit or its unit.toml, as in `read_press`.

    Returns
    -------
    str
        The text of the module.

    Raises
    ------
    InputError
        If the flesh of the design relaxes, or the unit is not of this design.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # of pipeline run --out outputs/mine
    >>> module = twintip.micropython(report)
    >>> "class" in module
    True
    """
    return module_text(MeasuringUnit.from_report(report, unit))


def header_text(sensor: MeasuringUnit) -> str:
    """Return the read-out of a unit in single-precision C99 without heap, with the constants of the unit.

    Raises InputError for a design with fruit.relaxation.
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
    """Return the read-out of a unit as a MicroPython module: press_core.py with constants; it imports only math.

    Raises InputError for a design with fruit.relaxation.
    """
    core = inspect.getsource(press_core).partition("\nimport math\n")[2]
    constants = {name: repr(value) for name, value in _constants(sensor).items() if name in Unit.__annotations__}
    return _board_program(sensor, core=core.strip(), constants=constants)


def board_files(sensor: MeasuringUnit, *, calibrated: bool) -> dict[str, str]:
    """Return the programs of a design's board by their paths: in MicroPython, and as a sketch for Arduino.

    They print the counts of all channels; for a calibrated unit they also print E of each press. Raises InputError for
    an unknown board, for channels without calibration, and for a calibrated unit as `header_text` does.
    """
    _refuse_other_boards(sensor)
    if not calibrated:
        files = {"main.py": _board_program(sensor, core="", constants={})}
    elif sensor.unit.newtons_per_count:
        files = {"main.py": module_text(sensor), f"{_SKETCH}/unit.h": header_text(sensor)}
    else:
        hint = "calibrate with counts, or leave it out to print counts"
        raise validation_error("--unit", sensor.unit.method, "", "a unit whose counts are calibrated", hint)
    of_chip = {name: value for name, value in vars(ads1220).items() if name.isupper()}
    for name in ("ads1220.h", f"{_SKETCH}.ino"):
        about = _about(sensor) | {"calibrated": calibrated} | of_chip
        files[f"{_SKETCH}/{name}"] = render_template(f"firmware/{name}.j2", **about)
    return files


def _refuse_other_boards(sensor: MeasuringUnit) -> None:
    """Raise InputError for a design without a board, or with a circuit that the programs do not drive."""
    design = sensor.report.design
    if _board_of(sensor) is None:
        bound = "left out where the design has no [readout] with a channel for each tip"
        raise validation_error("--logger", design.name, "", bound, "add [readout], and run pipeline design again")
    readout, own = design.readout or Readout(), Readout()
    for name in ("rate_Hz", "bits", "full_scale_mV"):
        key = f"readout.{name}"
        value, driven = getattr(readout.circuit, name), getattr(own.circuit, name)
        if value != driven:
            bound = f"{driven:g} for --logger, as the {own.circuit.name} is driven"
            raise validation_error(key, value, "", bound, "write the program of that amplifier yourself")
    if readout.delay_ms is not None:
        bound = "left out for --logger, which converts the channels in turn"
        hint = "write the program of that amplifier yourself"
        raise validation_error("readout.delay_ms", list(readout.delay_ms), "ms", bound, hint)


def _board_program(sensor: MeasuringUnit, *, core: str, constants: dict[str, str]) -> str:
    """Return the MicroPython program of a board; with constants it also reads presses."""
    driver = inspect.getsource(ads1220).partition("\n\n\nRESET = ")
    return render_template(
        "firmware/board.py.j2",
        core=core,
        constants=constants,
        driver=(driver[1] + driver[2]).strip(),
        **_about(sensor),
    )


def _board_of(sensor: MeasuringUnit) -> Board | None:
    """Return the board of a design; None without a read-out that has a channel for each tip."""
    signal = sensor.report.read_out.signal
    if signal is None or len(sensor.report.tips) > AMPLIFIERS[signal.amplifier].channels:
        return None
    return BOARDS[signal.board]


def _about(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the values for templates that describe a unit, its channels and its board."""
    signal = sensor.report.read_out.signal
    board = _board_of(sensor)
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
        "board": board,
        "pins": board and board.pins,
        "wires": "SCLK, DIN, DOUT, CS and DRDY",
        "header": ",".join(["t_us", *count_keys(len(sensor.report.tips))]),
        "rate": 0.0 if signal is None or not signal.time_deviation else signal.rate_Hz,
        "inputs": [] if signal is None else _inputs(signal),
    }


def _constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the constants of a unit, as `press_core.Unit` describes them: forces [N], lengths [mm], moduli [MPa].

    Raises InputError for flesh that relaxes, because its reading needs the hold.
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


def _inputs(signal: SignalPath) -> list[int]:
    """Return the inputs of the amplifier in the order of conversion; inputs without a tip come last."""
    order = signal.conversion_order
    return [*order, *range(len(order), int(AMPLIFIERS[signal.amplifier].channels))]


def _level(rows: Sequence[LevelReading], stiffened: float, by_ball: float) -> dict[str, object]:
    """Return the level readings as logarithms, and the correction factor for a single row.

    Springs are stiffer in a press than at the weighing by the factor `stiffened` [1], so they read too low by it.
    `by_ball` is the factor of a reference ball.
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
    """Return the loads [N/mm] and forces [N] from which a press is summed, and the constants of the seating."""
    seating = seating_of(sensor)
    return {
        "loads": seating.loads,
        "load_forces": [force for forces in seating.least_forces for force in forces.tolist()],
        "per_offset": seating.per_offset,
        "by_skin": seating.by_skin,
        "rounds": ROUNDS,
    }


def _single(value: float) -> str:
    """Return a number as a single-precision literal of C."""
    text = f"{value:.9g}"
    return f"{text}f" if any(sign in text for sign in ".e") else f"{text}.0f"


def _contrast_constants(sensor: MeasuringUnit, law: RiseLaw) -> dict[str, object]:
    """Return the constants in the formulas of the contrast: forces [N], lengths [mm], moduli [MPa]."""
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
        # part of the fruit's compliance beyond the half-space
        "body": 0.0 if domes is None else (1.0 - domes.poisson**2) / math.pi,
        # what the body adds to a half-space
        "still": [] if domes is None else (weights @ (S - domes.S())).tolist(),
    }
