"""What the sliders of the page play: presses that the run has solved, as tables over modulus and travel or tilt.

Nothing is solved for the page. It interpolates in these tables, in tables.js.
"""

import math
from collections.abc import Callable, Sequence
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

_AXES = {"travel": ("Travel, x", "mm"), "tilt": ("Tilt along the tips", "degrees")}
_NOISE_PERCENT = 0.5  # where the design asks for no reading


class NodeReading(NamedTuple):
    """A modulus that is read [MPa], and that over its standard deviation by noise [1]; nan where nothing is read.

    The noise is one per cent of the full scale in every force.
    """

    E: float
    over_noise: float


NOT_READ = NodeReading(math.nan, math.nan)


def page_tables(report: Report, result: SensorResult) -> Plain:
    """Return tables, sliders and their start; moduli in MPa, travel in mm, tilt in degrees, noise in % of full scale.

    A table holds numbers over its two axes, at the `held` value of what it has no axis for.
    """
    design = report.design
    tables = [_over_travel(design, report.read_out, result.press)]
    over_tilt = _over_tilt(result, report.read_out)
    if over_tilt is not None:
        tables.append(over_tilt)
    # The slider of the modulus reaches as far as all tables do.
    moduli = [table["axes"][0]["nodes"] for table in tables]
    softest = max(min(design.fruit.E_MPa), *(nodes[0] for nodes in moduli))
    firmest = min(nodes[-1] for nodes in moduli)
    middle_E = design.fruit.E_MPa[len(design.fruit.E_MPa) // 2]
    start = {
        "E": min(max(middle_E, softest), firmest),
        "travel": design.press.travel_mm,
        "tilt": design.press.tilt_deg,
        "noise": _noise_percent(report),
    }
    sliders = [_slider("E", "Modulus of the fruit, E", "MPa", [softest, firmest])]
    for table in tables:
        axis = table["axes"][1]
        label, unit = _AXES[axis["key"]]
        sliders.append(_slider(axis["key"], label, unit, axis["nodes"]))
    if any(np.isfinite(table["numbers"]["E_read"]).any() for table in tables):
        most = 4.0 * start["noise"] or 4.0 * _NOISE_PERCENT
        sliders.append(_slider("noise", "Noise of each force", "% of full scale", [0.0, most]))
    return {"tables": tables, "sliders": sliders, "start": start, "bruise": list(design.fruit.bruise_limits_MPa)}


def _slider(key: str, label: str, unit: str, nodes: Sequence[float]) -> Plain:
    """Return a slider from the first to the last node."""
    return {"key": key, "label": label, "unit": unit, "min": nodes[0], "max": nodes[-1]}


def _noise_percent(report: Report) -> float:
    """Return the noise of the forces [% of full scale]; of a named read-out the largest over its channels."""
    reading = report.design.reading
    if reading is None:
        return _NOISE_PERCENT
    signal = report.read_out.signal
    if signal is None:
        return reading.noise_percent
    return float(np.max(100.0 * np.divide(signal.errors_N, report.read_out.full_scale_N)))


def _over_travel(design: Design, read_out: ReadingConstants, press: ScenePress) -> Plain:
    """Return the table over modulus and travel: the curve of the response, without the softest fruit there may be.

    Forces of flat faces are nearly straight over the travel, those of other tips are nearly a power of it. A level pair
    is read by the force ratio of one moment; other readings are those of whole presses.
    """
    curve = press.curve
    F = curve.F[1:]
    pressure = F / design.tips.face_mm2 if curve.mean_pressure is None else curve.mean_pressure[1:]
    is_read = design.tips.tip_layout.is_pair and press.level
    return _table(
        axes=(curve.E[1:], _axis("travel", curve.x, log=not design.tips.tip_shape.has_flat_face)),
        forces=F,
        pressure=pressure,
        held={"tilt": design.press.tilt_deg},
        read=lambda i, j: _by_ratio(read_out, F[i, j]) if is_read else NOT_READ,
    )


def _over_tilt(result: SensorResult, read_out: ReadingConstants) -> Plain | None:
    """Return the table over modulus and tilt at full travel; None without a reading that allows for tilt."""
    design, readings, presses = result.design, result.readings, result.tilted
    if readings is None or presses is None or design.press.roll_deg != 0.0:
        return None
    if len(presses.moduli) < FEWEST_MODULI:
        return None
    tilts = [placement.tilt_deg[0] for placement in presses.placements]
    F = presses.F[:, :, -1]
    is_dome = design.tips.dome_radius_mm is not None
    pressure = presses.mean_pressure[:, :, -1] if is_dome else F / design.tips.face_mm2
    model = RiseModel(law=rise_law(design, read_out.contrast), level=readings.level)
    one_percent = 0.01 * np.array(read_out.full_scale_N)
    return _table(
        axes=(np.array(presses.moduli), _axis("tilt", np.array(tilts))),
        forces=F,
        pressure=pressure,
        held={"travel": design.press.travel_mm},
        read=lambda i, j: _by_press(model, presses.F[i, j], one_percent),
    )


def _axis(key: str, nodes: Floats, *, log: bool = False) -> Plain:
    """Return an axis; along one with `log` the logarithms of numbers are smooth over that of the nodes."""
    return {"key": key, "nodes": nodes.tolist(), "log": log}


def _table(
    *,
    axes: tuple[Floats, Plain],
    forces: Floats,
    pressure: Floats,
    held: dict[str, float],
    read: Callable[[int, int], NodeReading],
) -> Plain:
    """Return the table of forces [N], (moduli, columns, tips); `axes` are the moduli [MPa] and the second axis.

    `pressure` [MPa], as `forces`, is the mean one of each contact; `read` gives the reading of a row and a column.
    Forces and pressures have a grid for each tip, the modulus that is read and that over its noise one each.
    """
    moduli, second = axes
    found = np.array([[read(i, j) for j in range(forces.shape[1])] for i in range(len(forces))])
    return {
        "axes": [_axis("E", moduli, log=True), second],
        "held": held,
        "numbers": {
            "F": np.moveaxis(forces, 2, 0).tolist(),
            "pressure": np.moveaxis(pressure, 2, 0).tolist(),
            "E_read": found[..., 0].tolist(),
            "E_over_noise": found[..., 1].tolist(),
        },
    }


def _by_ratio(read_out: ReadingConstants, forces: Floats) -> NodeReading:
    """Return the reading of a pair by its forces at one moment, (tips,) [N]."""
    law = read_out.contrast
    try:
        read = read_modulus(law, forces.tolist())
    except ReadingError:
        return NOT_READ
    by_noise = contrast_slopes(law, forces.tolist(), read).forces * (0.01 * np.array(read_out.full_scale_N))
    return NodeReading(correct_reading(read, read_out.level), 1.0 / float(np.linalg.norm(by_noise)))


def _by_press(model: RiseModel, press: Floats, one_percent: Floats) -> NodeReading:
    """Return the reading of a whole press by its forces, (samples, tips) [N]; `one_percent` of the full scale in N.

    A press is measured in `PRESS_SAMPLES`, more than are solved here: noise counts as so much less.
    """
    if not np.isfinite(press).all():
        return NOT_READ
    try:
        found = model.reading(press, np.zeros(press.shape[1]))
    except ReadingError:
        return NOT_READ
    by_noise = np.array(found.slopes.noise) * one_percent * math.sqrt(len(press) / PRESS_SAMPLES)
    return NodeReading(found.E, 1.0 / float(np.linalg.norm(by_noise)))
