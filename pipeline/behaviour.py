"""How the printed springs behave beside their stiffness: tilt, crosstalk, frequency, gauge output."""

from typing import Any

from cad.blade import gauge_strain, natural_frequency
from cad.flexure import Flexure
from cad.housing import Housing
from cad.materials import Process
from pipeline.springs import PrintedSprings
from solve.scene_response import SceneResponse

GAUGE_FACTOR = 2.1  # foil on plastic or steel, as makers give it
GRID_MM = 3.0


def behaviour_entry(printed: PrintedSprings, found: SceneResponse) -> dict[str, Any] | None:
    """Return tilt, crosstalk, frequency and bridge output at full travel; None where nothing is made.

    Frequency and bridge output are closed forms: Rayleigh's quotient, and the beam law for a full bridge of gauges
    at the roots of one leaf whose own stiffening is left out.
    """
    if printed.fitted is None:
        return None
    C, tilt = printed.fitted.stiffness.C, printed.fitted.stiffness.tilt_per_N
    last = [(float(one.F_l[-1]), float(one.F_h[-1])) for one in found.responses]
    entry: dict[str, Any] = {
        "crosstalk_C12_over_C22": float(C[0, 1] / C[1, 1]),
        "gauge_factor": GAUGE_FACTOR,
        "gauge_grid_mm": GRID_MM,
    }
    for index, spring in enumerate((printed.low, printed.high)):
        flexure, K = spring.flexure, spring.stiffness
        if flexure is None or K is None:
            continue
        entry[spring.name] = {
            "tilt_at_full_force_rad": float(tilt[index]) * max(forces[index] for forces in last),
            "natural_frequency_Hz": _frequency(printed.fitted.housing, flexure, K, printed.process, spring.name),
            "bridge_mV_per_V": [_bridge(flexure, forces[index] / K) for forces in last],
        }
    return entry


def _bridge(flexure: Flexure, deflection: float) -> float | None:
    if flexure.length < 2.0 * GRID_MM:
        return None
    return 1e3 * GAUGE_FACTOR * gauge_strain(flexure.thickness, flexure.length, deflection, GRID_MM)


def _frequency(housing: Housing, flexure: Flexure, K: float, process: Process, side: str) -> float:
    density = 1e-3 * process.density_g_per_cm3  # g/mm^3
    top = housing.low_top_level if side == "low" else housing.high_top_level
    block = housing.shuttle_width * housing.depth * (top - housing.neck_level)
    area, face = housing.shuttle_width * housing.depth, housing.tip_side**2
    neck = (housing.neck_level - housing.tip_height) * (area + face + (area * face) ** 0.5) / 3.0
    shuttle = density * (block + neck + face * housing.tip_height)
    leaf = density * flexure.thickness * flexure.length * flexure.depth
    return natural_frequency(K, shuttle, leaf)
