"""Write the program that reads a unit on a microcontroller, as a C99 header or a MicroPython module."""

import inspect
import math
from pathlib import Path

import numpy as np

from instrument.firmware import ads1220
from instrument.press import press_core
from instrument.press.fruit_of_presses import chi_square_limit, press_deviation_constants
from instrument.press.fruit_reading import RANGE_TOLERANCE
from instrument.press.measuring import MeasuringUnit
from instrument.press.press_core import Unit
from instrument.press.presses import TARE_SAMPLES
from instrument.press.printed_unit import PrintedUnit
from instrument.press.seating import MAX_ITERATIONS, seating_of
from instrument.press.signals import count_keys
from instrument.press.spikes import spike_constants
from instrument.template import render_template
from pipeline.report.report import Report, check_report
from sensor.design.readout import AMPLIFIERS, BOARDS, Board, Readout
from sensor.design.signal_path import SignalPath
from sensor.quantity import validation_error
from sensor.theory.contrast_rise import FEWEST, LARGEST_BY_TIME, LARGEST_NOISE, LARGEST_TOUCH_FORCE, LEAST_RISE, RiseLaw
from sensor.turns import in_turn

_SKETCH = "sketch"
"""The name of the Arduino sketch and of its folder."""
SADDLE_STEPS = 12
"""Number of iterations for the offset of a saddle; each reduces the error to a few per cent of its previous value."""
SETTLED = 1e-4  # largest change of the offset in the last iteration, divided by the springs' part of the contrast


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
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run
    >>> header = twintip.c_header(report)
    >>> "twintip_end" in header
    True
    """
    check_report(report)
    return render_header(MeasuringUnit.from_report(report, unit))


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
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run
    >>> module = twintip.micropython(report)
    >>> "class" in module
    True
    """
    check_report(report)
    return render_module(MeasuringUnit.from_report(report, unit))


def render_header(sensor: MeasuringUnit) -> str:
    """Return a C99 header that reads presses of a unit, in single precision and without heap memory.

    The header contains the constants of the unit. Raises InputError for a design with fruit.relaxation.
    """
    return render_template(
        "firmware/firmware.h.j2",
        _single_literal,  # how the template writes a number
        most_presses=press_core.MOST_PRESSES,
        much_less_certain=press_core.MUCH_LESS_CERTAIN,
        **_describe_unit(sensor),
        **_constants_of_unit(sensor),
    )


def render_module(sensor: MeasuringUnit) -> str:
    """Return a MicroPython module that reads presses of a unit.

    The module consists of the source of press_core.py and the constants of the unit, and imports only math. Raises
    InputError for a design with fruit.relaxation.
    """
    # The template has its own docstring and import, so the source of press_core.py is copied from after its import.
    _, _, core = inspect.getsource(press_core).partition("\nimport math\n")
    # Some constants are only for the C header. The MicroPython module has the ones that `Unit` declares.
    used_names = Unit.__annotations__
    constants = {name: repr(value) for name, value in _constants_of_unit(sensor).items() if name in used_names}
    return _board_program(sensor, core=core.strip(), constants=constants)


def render_board_files(sensor: MeasuringUnit, *, calibrated: bool) -> dict[str, str]:
    """Return the files for a design's board: a MicroPython program and an Arduino sketch, as texts keyed by their path.

    The programs print the counts of all channels or, if `calibrated`, the modulus of each press. Raises InputError for
    a design without a board, and for a circuit that the programs do not support. If `calibrated`, InputError is also
    raised for a unit whose counts are not calibrated. Flesh that relaxes is refused too, because the firmware does not
    read the hold.
    """
    _check_board_is_supported(sensor)
    if calibrated and not sensor.unit.newtons_per_count:
        hint = "calibrate with counts, or omit --unit to print counts"
        raise validation_error("--unit", sensor.unit.method, "", "a unit whose counts are calibrated", hint)
    if calibrated:
        files = {"main.py": render_module(sensor), f"{_SKETCH}/unit.h": render_header(sensor)}
    else:
        files = {"main.py": _board_program(sensor, core="", constants={})}
    # The sketch shares the constants of the Python driver, which have names in capital letters.
    driver_constants = {name: value for name, value in vars(ads1220).items() if name.isupper()}
    values = _describe_unit(sensor) | {"calibrated": calibrated} | driver_constants
    for name in ("ads1220.h", f"{_SKETCH}.ino"):
        files[f"{_SKETCH}/{name}"] = render_template(f"firmware/{name}.j2", **values)
    return files


def _check_board_is_supported(sensor: MeasuringUnit) -> None:
    """Raise InputError for a design without a board, or with a circuit that the programs do not support.

    The programs support only the default circuit of a read-out. These programs convert the channels in turn, so
    InputError is also raised if the design states its own delays of the channels.
    """
    design = sensor.report.design
    if _board_of(sensor) is None:
        bound = "left out, because the design has no [readout] with one channel per tip"
        raise validation_error("--logger", design.name, "", bound, "add [readout], and run pipeline design again")
    readout = design.readout or Readout()
    default_circuit = Readout().circuit
    for name in ("rate_Hz", "bits", "full_scale_mV"):
        value = getattr(readout.circuit, name)
        supported = getattr(default_circuit, name)
        if value != supported:
            key = f"readout.{name}"
            bound = f"{supported:g}, the only value that --logger supports for the {default_circuit.name}"
            raise validation_error(key, value, "", bound, "use this value, or write the program yourself")
    if readout.delay_ms is not None:
        bound = "left out for --logger, whose programs convert the channels in turn"
        hint = "leave it out, or write the program yourself"
        raise validation_error("readout.delay_ms", list(readout.delay_ms), "ms", bound, hint)


def _board_program(sensor: MeasuringUnit, *, core: str, constants: dict[str, str]) -> str:
    """Return the MicroPython program of a board.

    `core` is the source of press_core.py without its docstring and import. `constants` maps the name of each constant
    of the unit to its source code. If both are empty, the program only prints counts.
    """
    # The driver is copied from its first constant on. Only type checkers need the protocols before it.
    _, first_constant, remaining_source = inspect.getsource(ads1220).partition("\n\n\nRESET = ")
    return render_template(
        "firmware/board.py.j2",
        core=core,
        constants=constants,
        driver=(first_constant + remaining_source).strip(),
        **_describe_unit(sensor),
    )


def _board_of(sensor: MeasuringUnit) -> Board | None:
    """Return the board of a design, or None if the design has no read-out with one channel per tip."""
    signal = sensor.report.read_out.signal
    if signal is None or len(sensor.report.tips) > AMPLIFIERS[signal.amplifier].channels:
        return None
    return BOARDS[signal.board]


def _describe_unit(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the values by which the templates describe a unit, its channels and its board, keyed by their names there.

    A design without a read-out has no board, no inputs, and the rate 0, with which the programs do not mention a
    sampling rate.
    """
    signal = sensor.report.read_out.signal
    board = _board_of(sensor)
    # The programs mention the sampling rate only if the sampling times have errors.
    has_time_errors = signal is not None and signal.time_deviation != 0.0
    return {
        "design": sensor.report.design.name,
        "method": sensor.unit.method,
        "radii": " and ".join(f"{radius:g}" for radius in sensor.radii_mm or ()),  # radii of the fruit [mm], if known
        "tips": [tip.name for tip in sensor.report.tips],
        "turn": sensor.report.design.tips.tip_layout.turn_deg,  # rotation of the sensor between presses [deg]
        "pair": sensor.report.read_out.is_pair,  # whether the sensor is a pair of tips
        "calibrated": bool(sensor.unit.newtons_per_count),  # whether counts can be converted to forces
        "staggered": signal is not None and bool(signal.delays),  # whether channels are converted one after another
        "tare_samples": TARE_SAMPLES,
        "board": board,
        "pins": None if board is None else board.pins,
        "wires": "SCLK, DIN, DOUT, CS and DRDY",  # between the board and the converter
        "header": ",".join(["t_us", *count_keys(len(sensor.report.tips))]),  # first line of the printed counts
        "rate": signal.rate_Hz if signal is not None and has_time_errors else 0.0,
        "inputs": [] if signal is None else _inputs(signal),  # in the order of conversion
    }


def _constants_of_unit(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the constants with which the firmware reads a unit, keyed by their names; `press_core.Unit` explains them.

    Forces are in N, lengths in mm and moduli in MPa. Raises InputError for flesh that relaxes, because its modulus
    cannot be read without the hold.
    """
    if sensor.report.design.fruit.relaxation is not None:
        bound = "left out for firmware, which does not read the hold"
        raise validation_error("fruit.relaxation", "given", "", bound, "read a press with pipeline read")
    softest, firmest = sensor.range_MPa
    signal = sensor.report.read_out.signal
    # Delay of each channel after the first conversion [sampling periods]; empty for simultaneous conversions.
    delays = [] if signal is None else list(signal.delays)
    return {
        "gains": [*sensor.unit.gain],  # force divided by channel reading
        # The matrix from counts to channel readings [N per count], row by row; empty if counts are not calibrated.
        "newtons": [newtons for row in sensor.unit.newtons_per_count for newtons in row],
        "saturation": sensor.unit.saturation_counts,
        # Forces outside of these limits are implausible.
        "lowest_forces": sensor.lowest_forces.tolist(),
        "largest_forces": sensor.largest_forces.tolist(),
        "later": delays,
        "spike_length": 2 if delays else 1,  # interpolation between two samples spreads a bad conversion over both
        # Standard deviation of the sampling times [sampling periods], and the largest allowed error of E due to it.
        "time_deviation": 0.0 if signal is None else signal.time_deviation,
        "largest_by_time": LARGEST_BY_TIME,
        # Moduli outside of these limits are out of the range of the design.
        "least_E": softest * (1.0 - RANGE_TOLERANCE),
        "largest_E": firmest * (1.0 + RANGE_TOLERANCE),
        "reduced": sensor.reduced(1.0),  # E / (1 - nu^2) for E = 1
        **_level_constants(sensor),
        **_contrast_constants(sensor, sensor.rise_law),
        **spike_constants(sensor),
        **_seating_constants(sensor),
        **press_deviation_constants(sensor),
        # One press cannot disagree with others, so the limits begin with two presses.
        "chi_squares": [chi_square_limit(presses) for presses in range(2, press_core.MOST_PRESSES + 1)],
    }


def _inputs(signal: SignalPath) -> list[int]:
    """Return the amplifier's inputs in the order of conversion; inputs without a tip come last."""
    inputs_of_tips = signal.conversion_order
    unused_inputs = range(len(inputs_of_tips), int(AMPLIFIERS[signal.amplifier].channels))
    return [*inputs_of_tips, *unused_inputs]


def _level_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the table by which the firmware corrects an uncorrected modulus, as `MeasuringUnit.correct_modulus` does.

    `level_logs` are the logarithms of uncorrected moduli [MPa], and `level_shifts` are the logarithms of the factors
    that correct them. The firmware interpolates the shifts linearly. An empty table corrects nothing. If the table has
    a single row, the C header uses only `level_factor`, the factor of the first row.

    Each factor corrects the creep of the springs and, by the level readings of the report, the shape and the skin of
    the fruit. The factor of the reference ball is included.
    """
    # Springs are stiffer in a press than under calibration weights, so uncorrected moduli are too low by this factor.
    creep_factor = sensor.press_stiffness_ratio()
    creep_shift = math.log(creep_factor)
    ball_factor = sensor.ball_factor
    ball_shift = math.log(ball_factor)
    level_readings = sensor.report.read_out.level_readings
    if level_readings:
        first = level_readings[0]
        return {
            "level_logs": [math.log(row.read_MPa) - creep_shift for row in level_readings],
            "level_shifts": [math.log(row.E_MPa / row.read_MPa) + creep_shift + ball_shift for row in level_readings],
            "level_factor": ball_factor * creep_factor * first.E_MPa / first.read_MPa,
        }
    if creep_factor == 1.0:
        return {"level_logs": [], "level_shifts": [], "level_factor": 1.0}
    # Without level readings, the factor is the same at every modulus, so any modulus may be in the only row.
    return {
        "level_logs": [-creep_shift],
        "level_shifts": [creep_shift + ball_shift],
        "level_factor": ball_factor * creep_factor,
    }


def _seating_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the constants that determine the part of a press in which flat tips are fully seated.

    The evaluated part begins at one of the `loads`, which are products of modulus and depth [N/mm]. `load_forces` [N]
    are the forces of all tips at the first load, then at the next load, and so on. The firmware chooses a load and
    reads the modulus again, up to `rounds` times.
    """
    seating = seating_of(sensor)
    return {
        "loads": seating.loads,
        "load_forces": [force for forces in seating.least_forces for force in forces.tolist()],
        # Tips are seated from the load E (per_offset |offset| + by_skin) on, with the offset of the press in mm.
        "per_offset": seating.per_offset,  # side of a tip divided by the tip spacing [1]
        "by_skin": seating.by_skin,  # side of a tip times the slope of the skin [mm]
        "rounds": MAX_ITERATIONS,
    }


def _single_literal(value: float) -> str:
    """Return a number as a single-precision C literal, for example 2.5f."""
    text = f"{value:.9g}"  # nine digits determine a single-precision number
    is_whole = "." not in text and "e" not in text
    return f"{text}.0f" if is_whole else f"{text}f"  # C does not accept 2f


def _contrast_constants(sensor: MeasuringUnit, law: RiseLaw) -> dict[str, object]:
    """Return the constants with which the firmware computes the contrast and reads a modulus from its rise.

    The contrast is a weighted sum over the tips in which travel and tilt cancel. Forces F are in N, lengths in mm and
    moduli E in MPa. A list holds one value per tip. `law` is the law by which the unit reads a rise. Raises InputError
    for a report without level readings of presses.
    """
    sensor.refuse_without_rise_level()
    weights, C, S = law.contrast.arrays
    return {
        "springs": (weights @ C).tolist(),  # weights of the forces F, through the deflections of the springs
        "fruit": (weights @ S).tolist(),  # weights of F / E, through the compliance of the fruit
        "domes": (law.contrast.hertz * weights).tolist(),  # weights of (F / E)^(2/3), through Hertz's flattening
        "gap": float(weights @ np.array(law.contrast.gaps)),  # contrast of the known gaps under the tips
        "noises": sensor.noises.tolist(),  # standard deviations of the forces
        # The firmware does not read a press outside of these limits.
        "fewest": FEWEST,  # minimum number of samples
        "latest_touch": LARGEST_TOUCH_FORCE,  # total force at the last touch, as a fraction of the largest total force
        "least_rise": LEAST_RISE * float(np.linalg.norm(sensor.noises)),  # standard deviation of the total force
        "largest_noise": LARGEST_NOISE,  # standard deviation of ln E due to noise
        **_rolling_constants(law),
    }


def _rolling_constants(law: RiseLaw) -> dict[str, object]:
    """Return the constants of the iteration for a saddle-shaped skin, on which domes roll so that their contacts move.

    `law` is the law by which the unit reads a rise. Tips without domes need only one step of the iteration. Because
    their `places` are empty, the firmware leaves the saddle out, and the other constants of the domes have no effect.
    """
    weights, _, S = law.contrast.arrays
    shared = {"settled": SETTLED, "weights": weights.tolist()}  # `weights` are the weights of the tips in the contrast
    domes = law.rolling
    if domes is None:
        unused = {
            "places": [],
            "dome_radius": 0.0,
            "rolled": 1.0,
            "contrast_of_xy": 1.0,
            "body": 0.0,
            "fixed_fruit_part": [],
        }
        return {"saddle_steps": 1, **shared, **unused}
    return {
        "saddle_steps": SADDLE_STEPS,
        **shared,
        "places": [coordinate for axis in domes.positions for coordinate in axis],  # x and y of each axis
        "dome_radius": domes.dome_radius,  # [mm]
        "rolled": domes.rolling_factor,  # distance of two axes divided by the distance of their contacts
        "contrast_of_xy": domes.contrast_of_xy,  # contrast of x y, the shape of a saddle
        # Boussinesq's solution: a force F lowers the surface of a half-space at distance r by `body` F / (E r).
        "body": (1.0 - domes.poisson**2) / math.pi,
        # The part of `fruit` that does not change as contacts move: the difference between fruit and half-space.
        "fixed_fruit_part": (weights @ (S - domes.S())).tolist(),
    }
