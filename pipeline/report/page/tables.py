"""Tables for the sliders of the page: presses solved for several moduli, and several travels or tilts.

No press is solved only for the page; tables.js interpolates in these tables.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from pipeline.reading.measurement import RiseModel
from pipeline.reading.poses import FEWEST_MODULI
from pipeline.reading.read_out import ReadingConstants, correct_reading
from pipeline.reading.rise import rise_law
from pipeline.report.report import Report
from pipeline.response.scene_press import ScenePress
from pipeline.result import SensorResult
from pipeline.storage.plain import Plain
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import PRESS_SAMPLES
from sensor.theory.contrast_law import ReadingError, contrast_slopes, read_modulus

# The label and the unit of each slider, keyed by the axis that it sets
_LABELS = {
    "E": ("Modulus of the fruit, E", "MPa"),
    "travel": ("Travel, x", "mm"),
    "tilt": ("Tilt along the tips", "degrees"),
}
_NOISE_PERCENT = 0.5  # initial noise for a design without `[reading]` [% of full scale]
_NOISE_RANGE = 4.0  # end of the slider for the noise, divided by the initial noise

Reader = Callable[[Floats], tuple[float, Floats]]
"""A function that returns for forces [N] the modulus [MPa] and its relative change per noise in each force [1/N]."""


class Axis(NamedTuple):
    """An axis of a table: its key, and the values (nodes) at which presses were solved.

    With `log`, the page interpolates the logarithms of the numbers, which are smooth functions of the logarithm of the
    nodes.
    """

    key: str
    nodes: list[float]
    log: bool = False


def page_tables(report: Report, result: SensorResult) -> Plain:
    """Return the data of the section "Try it" of the page: tables, sliders, their initial values, and bruise limits.

    A table has two axes, the modulus and either the travel or the tilt, and holds the numbers of the presses at the
    nodes of the axes. All other variables have the fixed values in the table's entry `held`. Moduli are in MPa, travels
    in mm, tilts in degrees, and noise in % of full scale.
    """
    design = report.design
    tables = [_travel_table(design, report.read_out, result.press)]
    tilt_table = _tilt_table(result, report.read_out)
    if tilt_table is not None:
        tables.append(tilt_table)
    # The slider of the modulus covers the range that all tables have in common, from the softest fruit of the design.
    moduli_of_tables = [table["axes"][0]["nodes"] for table in tables]  # the first axis of each table, ascending
    softest = max(min(design.fruit.E_MPa), *(moduli[0] for moduli in moduli_of_tables))
    firmest = min(moduli[-1] for moduli in moduli_of_tables)
    noise = noise_percent(report)
    return {
        "tables": tables,
        "sliders": _sliders(tables, (softest, firmest), noise),
        "start": _initial_values(design, (softest, firmest), noise),
        "bruise": list(design.fruit.bruise_limits_MPa),
    }


def _initial_values(design: Design, moduli: tuple[float, float], noise: float) -> dict[str, float]:
    """Return the initial value of each slider: the middle modulus, the travel and the tilt of a design, and the noise.

    `moduli` are the ends of the slider for the modulus [MPa], which limit its initial value.
    """
    softest, firmest = moduli
    middle_E = design.fruit.E_MPa[len(design.fruit.E_MPa) // 2]
    return {
        "E": min(max(middle_E, softest), firmest),
        "travel": design.press.travel_mm,
        "tilt": design.press.tilt_deg,
        "noise": noise,
    }


def _sliders(tables: list[Plain], moduli: tuple[float, float], noise: float) -> list[Plain]:
    """Return the sliders of the page as page data: the modulus, the second axis of each table, and the noise.

    `moduli` are the ends of the slider for the modulus [MPa], and `noise` is the initial noise [% of full scale]. If no
    table has a reading, there is no slider for the noise, because noise affects only readings.
    """
    ranges = {"E": moduli}
    for table in tables:
        _, axis = table["axes"]  # the travel or the tilt
        ranges[axis["key"]] = (axis["nodes"][0], axis["nodes"][-1])
    sliders = [_slider(key, *_LABELS[key], *interval) for key, interval in ranges.items()]
    if any(np.isfinite(table["numbers"]["E_read"]).any() for table in tables):
        largest_noise = _NOISE_RANGE * (noise or _NOISE_PERCENT)  # an initial noise of 0 would give no range
        sliders.append(_slider("noise", "Noise of each force", "% of full scale", 0.0, largest_noise))
    return sliders


def _slider(key: str, label: str, unit: str, smallest: float, largest: float) -> Plain:
    """Return a slider as page data, with the ends of its range [unit]."""
    return {"key": key, "label": label, "unit": unit, "min": smallest, "max": largest}


def noise_percent(report: Report) -> float:
    """Return the initial value of the slider for the force noise [% of full scale].

    A design without `[reading]` has a default noise. For a design with `[reading]`, the noise is the largest error of a
    channel of the read-out, or the noise in `[reading]` if the design describes no read-out.
    """
    reading = report.design.reading
    if reading is None:
        return _NOISE_PERCENT
    signal = report.read_out.signal
    if signal is None:
        return reading.noise_percent
    return float(np.max(100.0 * np.divide(signal.errors_N, report.read_out.full_scale_N)))


def _travel_table(design: Design, read_out: ReadingConstants, press: ScenePress) -> Plain:
    """Return the table of forces, pressures and readings as functions of modulus and travel, as page data.

    `read_out` holds the constants that convert forces to a modulus. A level pair is read from the force ratio at one
    moment. Other sensors are read from whole presses, so this table has no readings for them.
    """
    curve = press.curve
    # The first modulus represents the softest possible fruit, which is only a limit, so all indices [1:] omit it.
    F = curve.F[1:]  # (moduli, travels, tips) [N]
    readings = np.full((*F.shape[:2], 2), np.nan)
    if design.tips.tip_layout.is_pair and press.level:
        readings = read_presses(F, ratio_reader(read_out), read_out)
    # Without a solved contact area, the whole face of a tip is assumed to touch.
    pressure = F / design.tips.face_mm2 if curve.mean_pressure is None else curve.mean_pressure[1:]
    # Forces on flat faces are nearly linear in the travel, so they are interpolated directly. Forces on other tips are
    # nearly a power of the travel, so their logarithms are interpolated.
    return _grid_table(
        curve.E[1:].tolist(),
        Axis("travel", curve.x.tolist(), log=not design.tips.tip_shape.has_flat_face),
        forces=F,
        pressure=pressure,
        held={"tilt": design.press.tilt_deg},
        readings=readings,
    )


def _tilt_table(result: SensorResult, read_out: ReadingConstants) -> Plain | None:
    """Return the table of forces, pressures and readings as functions of modulus and tilt, at full travel.

    `read_out` holds the constants that convert forces to a modulus. The result is None without readings or tilted
    presses, for a design with a roll, and if there are too few moduli for an interpolation.
    """
    design, presses = result.design, result.tilted
    if result.readings is None or presses is None or design.press.roll_deg != 0.0:
        return None
    if len(presses.moduli) < FEWEST_MODULI:
        return None
    F = presses.F[:, :, -1]  # the last sample of each press is at full travel: (moduli, tilts, tips) [N]
    pressure = F / design.tips.face_mm2  # the whole face of a flat tip touches
    if design.tips.dome_radius_mm is not None:
        pressure = presses.mean_pressure[:, :, -1]
    model = RiseModel(law=rise_law(design, read_out.contrast), level=result.readings.level)
    return _grid_table(
        list(presses.moduli),
        Axis("tilt", [placement.tilt_deg[0] for placement in presses.placements]),  # item 0 is the tilt along the tips
        forces=F,
        pressure=pressure,
        held={"travel": design.press.travel_mm},
        readings=read_presses(presses.F, press_reader(model), read_out),
    )


def _grid_table(
    moduli: list[float], second: Axis, *, forces: Floats, pressure: Floats, held: dict[str, float], readings: Floats
) -> Plain:
    """Return a table with the moduli [MPa] and a second axis as page data.

    `forces` [N] and `pressure` [MPa], the mean pressure in each contact, have the shape (moduli, nodes of the axis,
    tips). `readings` is the result of `read_presses`, and `held` holds the fixed values of other variables. In the
    table, forces and pressures have one grid for each tip.
    """
    return {
        "axes": [axis._asdict() for axis in (Axis("E", moduli, log=True), second)],
        "held": held,
        "numbers": {
            "F": np.moveaxis(forces, 2, 0).tolist(),  # the tips become the first axis
            "pressure": np.moveaxis(pressure, 2, 0).tolist(),
            "E_read": readings[..., 0].tolist(),
            "E_over_noise": readings[..., 1].tolist(),
        },
    }


def read_presses(presses: Floats, reader: Reader, read_out: ReadingConstants) -> Floats:
    """Read the modulus E of each press [MPa], and the ratio of E to its standard deviation for noise of 1 %.

    The noise of a force is a percentage of its full scale.

    `presses` holds forces [N] of the shape (moduli, nodes, ...); `reader` is called with the forces of one press.
    `read_out` has the full scale of each force. The result has the shape (moduli, nodes, 2), with nan for a press
    without a reading.
    """
    one_percent = 0.01 * np.array(read_out.full_scale_N)  # noise of each force [N]
    readings = np.full((*presses.shape[:2], 2), np.nan)
    for index in np.ndindex(presses.shape[:2]):
        if np.isfinite(presses[index]).all():
            with suppress(ReadingError):
                E, noise_slopes = reader(presses[index])
                # Noise is independent between the forces, so their contributions are added in quadrature.
                relative_deviation = np.linalg.norm(noise_slopes * one_percent)
                readings[index] = E, 1.0 / relative_deviation
    return readings


def ratio_reader(read_out: ReadingConstants) -> Reader:
    """Return a function that reads the modulus of a pair from its forces (tips,) [N] at one moment."""
    law = read_out.contrast

    def read(forces: Floats) -> tuple[float, Floats]:
        E = read_modulus(law, forces.tolist())
        slopes = contrast_slopes(law, forces.tolist(), E)
        return correct_reading(E, read_out.level), np.array(slopes.forces)

    return read


def press_reader(model: RiseModel) -> Reader:
    """Return a function that reads the modulus from the forces (samples, tips) [N] of a whole press.

    A real press has `PRESS_SAMPLES` samples, more than are solved here. The effect of noise is inversely proportional
    to the square root of this number, so it is reduced accordingly.
    """

    def read(press: Floats) -> tuple[float, Floats]:
        no_noise = np.zeros(press.shape[1])
        reading = model.read(press, no_noise)
        return reading.E, np.array(reading.slopes.noise) * math.sqrt(len(press) / PRESS_SAMPLES)

    return read
