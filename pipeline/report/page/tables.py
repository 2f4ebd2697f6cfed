"""What the sliders of the page play: presses that the run has solved, as tables over modulus and travel or tilt.

Nothing is solved for the page. It interpolates in these tables, in tables.js.
"""

from collections.abc import Sequence

import numpy as np

from cad.arrays import Floats
from cad.design.parameters import Design
from cad.theory.contrast_law import ReadingError, read_modulus
from cad.theory.contrast_rise import exact_modulus
from pipeline.reading.analysis import Readings
from pipeline.reading.poses import FEWEST_MODULI
from pipeline.reading.read_out import ReadOut, corrected
from pipeline.report.stored import StoredReport
from pipeline.response.scene_press import ScenePress
from pipeline.result import SensorResult
from pipeline.storage.plain import Plain

_NOISE_PERCENT = 0.5  # where the design asks for no reading
_STEP = 1e-4  # of a force, for slopes of the modulus


def page_tables(report: StoredReport, result: SensorResult) -> Plain:
    """Return tables, sliders and their start; moduli in MPa, travel in mm, tilt in degrees, noise in % of full scale.

    A table holds numbers over its two axes, at the `held` value of what it has no axis for.
    """
    design = report.design
    tables = [_over_travel(design, report.read_out, result.press)]
    over_tilt = _over_tilt(design, report.read_out, result.readings)
    if over_tilt is not None:
        tables.append(over_tilt)
    moduli = [table["axes"][0]["nodes"] for table in tables]
    softest = max(min(design.fruit.E_MPa), *(nodes[0] for nodes in moduli))
    firmest = min(nodes[-1] for nodes in moduli)
    shown = design.fruit.E_MPa[len(design.fruit.E_MPa) // 2]
    start = {
        "E": min(max(shown, softest), firmest),
        "travel": design.press.travel_mm,
        "tilt": design.press.tilt_deg,
        "noise": _noise_percent(report),
    }
    sliders = [_slider("E", "Modulus of the fruit, E", "MPa", [softest, firmest])]
    labels = {"travel": ("Travel, x", "mm"), "tilt": ("Tilt along the tips", "degrees")}
    for table in tables:
        axis = table["axes"][1]
        sliders.append(_slider(axis["key"], *labels[axis["key"]], axis["nodes"]))
    if any(np.isfinite(table["numbers"]["E_read"]).any() for table in tables):
        most = 4.0 * start["noise"] or 4.0 * _NOISE_PERCENT
        sliders.append(_slider("noise", "Noise of each force", "% of full scale", [0.0, most]))
    return {"tables": tables, "sliders": sliders, "start": start, "bruise": list(design.fruit.bruise_limits_MPa)}


def _slider(key: str, label: str, unit: str, nodes: Sequence[float]) -> Plain:
    """Return a slider from the first to the last node."""
    return {"key": key, "label": label, "unit": unit, "min": nodes[0], "max": nodes[-1]}


def _noise_percent(report: StoredReport) -> float:
    """Return the noise of the forces [% of full scale]; of a named read-out the largest over its channels."""
    reading = report.design.reading
    if reading is None:
        return _NOISE_PERCENT
    signal = report.read_out.signal
    if signal is None:
        return reading.noise_percent
    return float(np.max(100.0 * np.divide(signal.errors_N, report.read_out.full_scale_N)))


def _over_travel(design: Design, read_out: ReadOut, press: ScenePress) -> Plain:
    """Return the table over modulus and travel: the curve of the response, but for what stands for no fruit.

    Forces of flat faces are nearly straight over the travel, those of other tips are nearly a power of it.
    """
    curve = press.curve
    F = curve.F[1:]
    pressure = F / design.tips.face_mm2 if curve.mean_pressure is None else curve.mean_pressure[1:]
    is_read = not design.tips.tip_layout.is_pair or press.level
    return _table(
        read_out,
        axes=(curve.E[1:], _axis("travel", curve.x, log=not design.tips.tip_shape.has_flat_face)),
        presses=F[:, :, None],
        pressure=pressure,
        held={"tilt": design.press.tilt_deg},
        is_read=is_read,
    )


def _over_tilt(design: Design, read_out: ReadOut, readings: Readings | None) -> Plain | None:
    """Return the table over modulus and tilt at full travel; None without a reading that allows for tilt."""
    if readings is None or readings.tilted is None or design.press.roll_deg != 0.0:
        return None
    presses = readings.tilted
    if len(presses.moduli) < FEWEST_MODULI:
        return None
    tilts = [placement.tilt_deg[0] for placement in presses.placements]
    F = presses.F
    is_dome = design.tips.dome_radius_mm is not None
    pressure = presses.mean_pressure[:, :, -1] if is_dome else F[:, :, -1] / design.tips.face_mm2
    return _table(
        read_out,
        axes=(np.array(presses.moduli), _axis("tilt", np.array(tilts))),
        presses=F,
        pressure=pressure,
        held={"travel": design.press.travel_mm},
    )


def _axis(key: str, nodes: Floats, *, log: bool = False) -> Plain:
    """Return an axis; along one with `log` the logarithms of numbers are smooth over that of the nodes."""
    return {"key": key, "nodes": nodes.tolist(), "log": log}


def _table(
    read_out: ReadOut,
    *,
    axes: tuple[Floats, Plain],
    presses: Floats,
    pressure: Floats,
    held: dict[str, float],
    is_read: bool = True,
) -> Plain:
    """Return the table of presses [N], (moduli, columns, samples, tips); their last samples are its forces.

    `pressure` [MPa], (moduli, columns, tips), is the mean one of each contact; `axes` are the moduli [MPa] and the
    second axis. Forces and pressures have a grid for each tip, the modulus read and that over its noise one each.
    """
    moduli, second = axes
    F = presses[:, :, -1]
    E_read = np.full(F.shape[:2], np.nan)
    over_noise = np.full(F.shape[:2], np.nan)
    if is_read:
        for i, j in np.ndindex(*F.shape[:2]):
            E_read[i, j], over_noise[i, j] = _reading(read_out, presses[i, j])
    return {
        "axes": [_axis("E", moduli, log=True), second],
        "held": held,
        "numbers": {
            "F": np.moveaxis(F, 2, 0).tolist(),
            "pressure": np.moveaxis(pressure, 2, 0).tolist(),
            "E_read": E_read.tolist(),
            "E_over_noise": over_noise.tolist(),
        },
    }


def _reading(read_out: ReadOut, press: Floats) -> tuple[float, float]:
    """Return the modulus [MPa] read from a press [N], (samples, tips), and that over its standard deviation by noise.

    The latter [1] is for noise of one per cent of the full scale in every force, and grows over the travel as forces
    do; both are nan where nothing is read.
    """
    if not np.isfinite(press).all():
        return np.nan, np.nan
    one_percent = 0.01 * np.array(read_out.full_scale_N)
    try:
        read = _modulus(read_out, press)
        moves = []  # of the modulus by one per cent of noise in each force [MPa]
        for sample, tip in np.ndindex(*press.shape):
            step = np.zeros_like(press)
            step[sample, tip] = _STEP * press[-1, tip]
            slope = (_modulus(read_out, press + step) - _modulus(read_out, press - step)) / (2.0 * step[sample, tip])
            moves.append(slope * one_percent[tip])
    except ReadingError:
        return np.nan, np.nan
    return corrected(read, read_out.level), read / float(np.linalg.norm(moves))


def _modulus(read_out: ReadOut, press: Floats) -> float:
    """Return the modulus [MPa] of a press [N], (samples, tips), before the correction by level readings.

    A pair is read by the rise of its contrast where there are several samples; all else by the contrast of the last
    sample. Raises ReadingError.
    """
    if read_out.is_pair and len(press) > 1:
        return exact_modulus(read_out.contrast, press)
    return read_modulus(read_out.contrast, press[-1].tolist())
