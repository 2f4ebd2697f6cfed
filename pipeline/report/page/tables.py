"""Tables for the sliders of the page: solved presses over modulus and travel or tilt.

Nothing is solved for the page; tables.js interpolates in these tables.
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

_LABELS = {
    "E": ("Modulus of the fruit, E", "MPa"),
    "travel": ("Travel, x", "mm"),
    "tilt": ("Tilt along the tips", "degrees"),
}
_NOISE_PERCENT = 0.5  # noise of a design without readings

Reader = Callable[[Floats], tuple[float, Floats]]
"""A function from forces [N] to the modulus [MPa] and its relative change by noise in each force [1/N]."""


class Axis(NamedTuple):
    """The second axis of a table; with `log`, logarithms of the numbers are smooth over the logarithm of the nodes."""

    key: str
    nodes: list[float]
    log: bool = False


def page_tables(report: Report, result: SensorResult) -> Plain:
    """Return tables, sliders and their start; moduli in MPa, travel in mm, tilt in degrees, noise in % of full scale.

    A table holds numbers over its two axes; other variables have the values in `held`.
    """
    design = report.design
    tables = [_over_travel(design, report.read_out, result.press)]
    over_tilt = _over_tilt(result, report.read_out)
    if over_tilt is not None:
        tables.append(over_tilt)
    # The slider of the modulus covers the range that all tables share.
    moduli = [table["axes"][0]["nodes"] for table in tables]
    softest = max(min(design.fruit.E_MPa), *(nodes[0] for nodes in moduli))
    firmest = min(nodes[-1] for nodes in moduli)
    middle_E = design.fruit.E_MPa[len(design.fruit.E_MPa) // 2]
    noise = noise_percent(report)
    ends = {"E": (softest, firmest)}
    ends |= {axis["key"]: (axis["nodes"][0], axis["nodes"][-1]) for axis in (table["axes"][1] for table in tables)}
    sliders = [_slider(key, *_LABELS[key], *between) for key, between in ends.items()]
    if any(np.isfinite(table["numbers"]["E_read"]).any() for table in tables):
        sliders.append(_slider("noise", "Noise of each force", "% of full scale", 0.0, 4.0 * (noise or _NOISE_PERCENT)))
    start = {
        "E": min(max(middle_E, softest), firmest),
        "travel": design.press.travel_mm,
        "tilt": design.press.tilt_deg,
        "noise": noise,
    }
    return {"tables": tables, "sliders": sliders, "start": start, "bruise": list(design.fruit.bruise_limits_MPa)}


def _slider(key: str, label: str, unit: str, least: float, most: float) -> Plain:
    return {"key": key, "label": label, "unit": unit, "min": least, "max": most}


def noise_percent(report: Report) -> float:
    """Return the noise of the forces [% of full scale].

    The largest over its channels if the design names a read-out.
    """
    reading = report.design.reading
    if reading is None:
        return _NOISE_PERCENT
    signal = report.read_out.signal
    if signal is None:
        return reading.noise_percent
    return float(np.max(100.0 * np.divide(signal.errors_N, report.read_out.full_scale_N)))


def _over_travel(design: Design, read_out: ReadingConstants, press: ScenePress) -> Plain:
    """Return the table over modulus and travel: the curve of the response without its first, limiting modulus.

    Forces of flat faces are nearly linear in the travel, and forces of other tips nearly a power of it. A level pair is
    read by the force ratio of one moment; other readings need whole presses.
    """
    curve = press.curve
    F = curve.F[1:]
    is_read = design.tips.tip_layout.is_pair and press.level
    return _table(
        curve.E[1:].tolist(),
        Axis("travel", curve.x.tolist(), log=not design.tips.tip_shape.has_flat_face),
        forces=F,
        pressure=F / design.tips.face_mm2 if curve.mean_pressure is None else curve.mean_pressure[1:],
        held={"tilt": design.press.tilt_deg},
        read=readings(F, ratio_reader(read_out), read_out) if is_read else np.full((*F.shape[:2], 2), np.nan),
    )


def _over_tilt(result: SensorResult, read_out: ReadingConstants) -> Plain | None:
    """Return the table over modulus and tilt at full travel; None without readings that allow tilt."""
    design, presses = result.design, result.tilted
    if result.readings is None or presses is None or design.press.roll_deg != 0.0:
        return None
    if len(presses.moduli) < FEWEST_MODULI:
        return None
    F = presses.F[:, :, -1]
    is_dome = design.tips.dome_radius_mm is not None
    model = RiseModel(law=rise_law(design, read_out.contrast), level=result.readings.level)
    return _table(
        list(presses.moduli),
        Axis("tilt", [placement.tilt_deg[0] for placement in presses.placements]),
        forces=F,
        pressure=presses.mean_pressure[:, :, -1] if is_dome else F / design.tips.face_mm2,
        held={"travel": design.press.travel_mm},
        read=readings(presses.F, press_reader(model), read_out),
    )


def _table(
    moduli: list[float], second: Axis, *, forces: Floats, pressure: Floats, held: dict[str, float], read: Floats
) -> Plain:
    """Return the table of forces [N], (moduli, columns, tips), over the moduli [MPa] and the second axis.

    `pressure` [MPa], with the shape of `forces`, is the mean pressure of each contact; `read` comes from `readings`.
    Forces and pressures have one grid for each tip; the modulus read and its ratio to the noise have one grid each.
    """
    return {
        "axes": [axis._asdict() for axis in (Axis("E", moduli, log=True), second)],
        "held": held,
        "numbers": {
            "F": np.moveaxis(forces, 2, 0).tolist(),
            "pressure": np.moveaxis(pressure, 2, 0).tolist(),
            "E_read": read[..., 0].tolist(),
            "E_over_noise": read[..., 1].tolist(),
        },
    }


def readings(presses: Floats, reader: Reader, read_out: ReadingConstants) -> Floats:
    """Return the readings of forces [N], (moduli, columns, ...), as (moduli, columns, 2), nan without a reading.

    A reading is the modulus [MPa] and its ratio to its standard deviation, for noise of 1 % of full scale.
    """
    one_percent = 0.01 * np.array(read_out.full_scale_N)
    found = np.full((*presses.shape[:2], 2), np.nan)
    for place in np.ndindex(presses.shape[:2]):
        if np.isfinite(presses[place]).all():
            with suppress(ReadingError):
                E, per_force = reader(presses[place])
                found[place] = E, 1.0 / np.linalg.norm(per_force * one_percent)
    return found


def ratio_reader(read_out: ReadingConstants) -> Reader:
    """Return a reader of a pair by its forces at one moment, (tips,) [N]."""
    law = read_out.contrast

    def read(forces: Floats) -> tuple[float, Floats]:
        E = read_modulus(law, forces.tolist())
        slopes = contrast_slopes(law, forces.tolist(), E)
        return correct_reading(E, read_out.level), np.array(slopes.forces)

    return read


def press_reader(model: RiseModel) -> Reader:
    """Return a reader of whole presses by their forces, (samples, tips) [N].

    A press is measured with `PRESS_SAMPLES`, more than are solved here, so its noise is smaller.
    """

    def read(press: Floats) -> tuple[float, Floats]:
        found = model.reading(press, np.zeros(press.shape[1]))
        return found.E, np.array(found.slopes.noise) * math.sqrt(len(press) / PRESS_SAMPLES)

    return read
