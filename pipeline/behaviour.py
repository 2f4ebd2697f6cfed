"""How the printed springs behave beside their stiffness: sideways, tilt, crosstalk, frequency, gauge output."""

from dataclasses import asdict
from typing import Any

from cad.blade import gauge_strain, natural_frequency
from cad.flexure import Flexure
from cad.housing import Housing
from cad.materials import Process
from mesh.flexure import flexure_mesh
from pipeline.cache import remembered
from pipeline.flexures import COARSE
from pipeline.springs import PrintedSpring, PrintedSprings
from pipeline.verdicts import Verdict
from solve.flexure import sideways_stiffness
from solve.scene_response import SceneResponse

GAUGE_FACTOR = 2.1  # foil on plastic or steel, as makers give it
GRID_MM = 3.0
SIDEWAYS_LEAST = {"low": 3.0, "high": 1.2}  # of the travel stiffness
_MORE = 1.0  # of the step from the coarse mesh


def sideways_verdicts(printed: PrintedSprings) -> tuple[Verdict, ...]:
    """Return the verdicts on the stiffness across the plate over that along the press; none where nothing is made."""
    if printed.housing is None:
        return ()
    fine, coarse = _sideways(printed.housing, printed.process)
    return tuple(
        _sideways_verdict(spring, fine[index], abs(fine[index] - coarse[index]))
        for index, spring in enumerate((printed.low, printed.high))
    )


def _sideways(housing: Housing, process: Process) -> tuple[list[float], list[float]]:
    def solved() -> dict[str, list[float]]:
        scales = {"fine": 1.0, "coarse": COARSE}
        return {
            name: list(sideways_stiffness(flexure_mesh(housing, scale), process.E_MPa, process.poisson))
            for name, scale in scales.items()
        }

    found = remembered("sideways", {"housing": asdict(housing), "E": process.E_MPa, "nu": process.poisson}, solved)
    return found["fine"], found["coarse"]


def _sideways_verdict(spring: PrintedSpring, K: float, step: float) -> Verdict:
    stiffness, least = spring.stiffness or spring.target, SIDEWAYS_LEAST[spring.name]
    ratio, error = K / stiffness, _MORE * step / stiffness
    clear = abs(ratio - least) > error
    return Verdict(
        name=f"sideways.{spring.name}",
        value=ratio,
        unit="1",
        limit=least,
        tolerance=0.0,
        passed=ratio >= least if clear else None,
        reference="FE stiffness across the plate over that along the press; must be at least the limit",
        error=error,
    )


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
