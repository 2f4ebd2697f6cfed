"""How the printed springs behave beside their stiffness: tilt, crosstalk, frequency, gauge output."""

from typing import Any

from cad.design.processes import Process
from cad.parts.housing import Housing
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.flexure import Flexure
from cad.theory.leaf_spring import gauge_strain, natural_frequency
from cad.theory.strain_gauge import FOIL
from pipeline.stages.springs import PrintedSprings
from solve.contact.response import SceneResponse

GAUGE_FACTOR = FOIL.gauge_factor
GRID_MM = FOIL.grid_length_mm


def behaviour_entry(printed: PrintedSprings, found: SceneResponse) -> dict[str, Any] | None:
    """Return tilt, crosstalk, stiffening, frequency and bridge output at full travel; None where nothing is made.

    The frequency is Rayleigh's quotient. The bridge is full, of gauges at both roots of one leaf: where they are
    fitted their strain is that of the solve with them; else the beam law's, their own stiffening left out.
    """
    if printed.fitted is None:
        return None
    stiffness, housing = printed.fitted.stiffness, printed.fitted.housing
    C, tilt, strain = stiffness.C, stiffness.tilt_per_N, stiffness.gauge_strain_per_N
    errors = stiffness.gauge_error_percent or (None, None)
    last = [(float(one.F_l[-1]), float(one.F_h[-1])) for one in found.responses]
    entry: dict[str, Any] = {
        "crosstalk_C12_over_C22": float(C[0, 1] / C[1, 1]),
        "gauge_factor": GAUGE_FACTOR,
        "gauge_grid_mm": GRID_MM,
        "gauges": housing.gauges,
    }
    for index, spring in enumerate((printed.low, printed.high)):
        flexure, K = spring.flexure, spring.stiffness
        if flexure is None or K is None:
            continue
        entry[spring.name] = {
            "tilt_at_full_force_rad": float(tilt[index]) * max(forces[index] for forces in last),
            "large_deflection_stiffening": _stiffening(flexure, printed.deflections[index]),
            "natural_frequency_Hz": _frequency(housing, flexure, K, printed.process, spring.name),
            "bridge_mV_per_V": [
                _bridge(flexure, forces[index] / K) if strain is None else bridge_output(strain[index] * forces[index])
                for forces in last
            ],
            "bridge_error_percent": errors[index],
        }
    return entry


def _stiffening(flexure: Flexure, deflection: float) -> float:
    """Return by how much the spring is stiffer at a deflection [mm] than at first touch, at most that at half L."""
    return large_deflection_stiffening(flexure.length, min(deflection, 0.5 * flexure.length))


def _bridge(flexure: Flexure, deflection: float) -> float | None:
    if flexure.length < 2.0 * GRID_MM:
        return None
    return bridge_output(gauge_strain(flexure.thickness, flexure.length, deflection, GRID_MM))


def bridge_output(strain: float) -> float:
    """Return the output of a full bridge whose four arms see a strain [mV/V]: gauge factor x strain."""
    return 1e3 * GAUGE_FACTOR * strain


def _frequency(housing: Housing, flexure: Flexure, K: float, process: Process, side: str) -> float:
    density = 1e-3 * process.density_g_per_cm3  # g/mm^3
    top = housing.low_top_level if side == "low" else housing.high_top_level
    block = housing.shuttle_width * housing.depth * (top - housing.neck_level)
    area, face = housing.shuttle_width * housing.depth, housing.tip_side**2
    neck = (housing.neck_level - housing.tip_height) * (area + face + (area * face) ** 0.5) / 3.0
    shuttle = density * (block + neck + face * housing.tip_height)
    leaf = density * flexure.thickness * flexure.length * flexure.depth
    return natural_frequency(K, shuttle, leaf)
