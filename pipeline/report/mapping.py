"""The report of a run: every key of report.json from the results, in its unit; None where there is no number."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from importlib.metadata import version
from types import MappingProxyType

import numpy as np

from cad.design.tips import Tips
from cad.theory.two_spring_law import PAPER_SPRINGS
from pipeline.options import run_key
from pipeline.reading.analysis import Readings
from pipeline.reading.over_time import ReadingOverTime
from pipeline.report.notes import notes
from pipeline.report.stored import SCHEMA, StoredFile, as_data
from pipeline.response.scene_press import spring_shares
from pipeline.result import SensorResult
from pipeline.springs.behaviour import GAUGE_FACTOR, GRID_MM, SpringBehaviour
from pipeline.springs.fitted_springs import FittedSpring, FittedSprings
from pipeline.springs.sizing import SpringSizing
from pipeline.storage.digests import with_digest
from pipeline.storage.plain import Plain
from pipeline.verdicts.errors.budget import Contribution, UncertaintyBudget
from pipeline.verdicts.errors.sensor_errors import ReadingTable
from pipeline.verdicts.targets import SceneTargets
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance

PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")

PAPER_KEYS = {"K_l_N_per_m": 1e3 * PAPER_SPRINGS.K_l, "K_h_N_per_m": 1e3 * PAPER_SPRINGS.K_h}


def report_mapping(
    result: SensorResult, files: Iterable[StoredFile] = (), stale: Mapping[str, str] = MappingProxyType({})
) -> Plain:
    """Return the JSON data of the report of a run whose folder has these files, with its own digest.

    `stale` are those made from another design, by name, with the digest of that design.
    """
    springs = result.springs
    process = springs.process
    lines = notes(result)
    if stale:
        names = ", ".join(stale)
        lines.append(f"kept from another design, no part of this one: {names}; make them anew with pipeline design")
    report: dict[str, object] = {
        "schema": SCHEMA,
        "design": result.design,
        "springs": sizing_keys(result.sizing),
        **_flexures(result),
        "housing": springs.housing,
        "deflections_mm": springs.deflections,
        "material": {
            "name": process.material,
            "E_MPa": process.E_MPa,
            "poisson": process.poisson,
            "process": process.name,
        },
        "behaviour": None if result.behaviour is None else _behaviour(result.behaviour),
        "contact": contact_keys(result.contact),
        "response": response_keys(result.design.tips, result.contact, springs, result.press.table),
        "curve": _curve(result.errors.reading),
        "tips": tip_keys(result.design.tips),
        "read_out": result.read_out,
        "reading": None if result.readings is None else reading_keys(result.readings),
        "level": target_keys(result.reached),
        "verdicts": result.verdicts,
        "remedy": next((verdict.remedy for verdict in result.verdicts if verdict.remedy is not None), None),
        "errors": _errors(result),
        "paper": None if result.paper is None else {**PAPER_KEYS, "verdicts": result.paper},
        "accuracy": _accuracy(result),
        "notes": lines,
        "versions": {name: version(name) for name in PACKAGES},
        "files": tuple(files),
        "seconds": result.seconds.wall,
        "cpu_seconds": result.seconds.cpu,
    }
    if result.over_time is not None:
        report["relaxation"] = relaxation_keys(result.over_time)
    if result.options.fabrication:
        scatter = result.errors.scatter
        report["tolerance"] = None if scatter is None else asdict(scatter)
    if stale:
        report["stale"] = dict(stale)
    report["key"] = run_key(result.design, result.options)
    return with_digest(as_data(report))


def sizing_keys(sizing: SpringSizing) -> Plain:
    """Return the springs that were sized and the fruit stiffness that sized them."""
    return {
        "K_l_N_per_m": 1e3 * sizing.springs.K_l,
        "K_h_N_per_m": 1e3 * sizing.springs.K_h,
        "K_m_max_N_per_m": 1e3 * sizing.K_m_max,
        "K_m_over_E_mm": sizing.K_m_over_E,
        "fruit_stiffness": sizing.basis,
    }


def _flexures(result: SensorResult) -> Plain:
    """Return the table of flexures; a line of tips has none."""
    if not result.design.tips.tip_layout.has_housing:
        return {}
    springs = result.springs
    return {"flexures": {spring.name: spring_keys(spring, springs) for spring in springs.springs}}


def spring_keys(spring: FittedSpring, springs: FittedSprings) -> Plain:
    """Return one of the springs; numbers of a spring that cannot be made are None."""
    K = spring.K
    strain = spring.root_strain
    info = None if springs.fitted is None else springs.fitted.stiffness.info
    return {
        "target_N_per_m": 1e3 * spring.target,
        "stiffness_N_per_m": None if K is None else 1e3 * K.value,
        "error_percent": None if K is None else K.percent,
        "dimensions_mm": spring.flexure,
        "root_strain": None if strain is None else strain.value,
        "root_strain_error_percent": None if strain is None else strain.percent,
        "safety_factor": spring.safety_factor,
        "dofs": None if info is None else info.dofs,
        "seconds": None if info is None else info.seconds,
    }


def _behaviour(behaviour: SpringBehaviour) -> Plain:
    modes = []
    if behaviour.modes is not None:
        rows = zip(behaviour.modes.frequencies_Hz, behaviour.modes.errors, behaviour.modes.shapes, strict=True)
        for frequency, error, shape in rows:
            modes.append({"frequency_Hz": frequency, "error_percent": 100.0 * error, "shape": shape})
    return {
        "crosstalk_C12_over_C22": behaviour.crosstalk,
        "gauge_factor": GAUGE_FACTOR,
        "gauge_grid_mm": GRID_MM,
        "gauges": behaviour.gauges,
        "modes": modes,
        **behaviour.arms,
    }


def contact_keys(contact: FruitCompliance) -> Plain:
    """Return the compliance of the fruit with its errors and what it cost."""
    return {
        "error_percent": 100.0 * contact.error_pair,
        "s11_error_percent": 100.0 * contact.error_own,
        **asdict(contact.info),
        "compliance_per_mm": contact.S,
        "K_m_over_E_mm": contact.K_m_over_E(),
        **({} if contact.skin is None else {"skin": {"E_MPa": contact.skin.E, "compliance_per_mm": contact.skin.S}}),
    }


def response_keys(tips: Tips, contact: FruitCompliance, springs: FittedSprings, table: SensorResponse) -> list[Plain]:
    """Return the response at each modulus with the errors of contact and springs."""
    relative = np.array(tips.each(*(spring.error / spring.stiffness for spring in springs.springs)))
    rows = []
    for i, E in enumerate(table.E.tolist()):
        spring_errors = spring_shares(contact, springs.C, E) * relative  # of the force of each tip [1]
        low, high = (table.F[i, :, list(group)].mean(axis=0) for group in tips.spring_groups)
        row: Plain = {
            "E_MPa": E,
            "x_mm": table.x,
            "P": table.P[i],
            "F_l_N": low,
            "F_h_N": high,
            "slope_ratio": table.slope_ratio[i],
            "F_error_percent": 100.0 * (table.F_error[i] + spring_errors.max()),
            "P_error_percent": 100.0 * (table.P_error[i] + spring_errors.sum()),
        }
        if not tips.tip_layout.is_pair:
            row["F_N"] = table.F[i].T
        rows.append(row)
    return rows


def _curve(table: ReadingTable) -> Plain:
    """Return P at full travel over the modulus, with the moduli that may show it; the first modulus is no fruit's."""
    response = table.response
    return {
        "x_mm": float(response.x[-1]),
        "P_softest": _finite(float(response.P[0, -1])),
        "E_MPa": response.E[1:],
        "P": response.P[1:, -1],
        "E_lower_as_printed_MPa": table.printed[1:, -1, 0],
        "E_upper_as_printed_MPa": table.printed[1:, -1, 1],
        "E_lower_calibrated_MPa": table.calibrated[1:, -1, 0],
        "E_upper_calibrated_MPa": table.calibrated[1:, -1, 1],
    }


def tip_keys(tips: Tips) -> list[Plain]:
    """Return the tips in the order of the forces in every table."""
    rows = zip(tips.names, tips.places_mm, tips.springs, strict=True)
    return [{"name": name, "x_mm": x, "y_mm": y, "spring": spring} for name, (x, y), spring in rows]


def reading_keys(readings: Readings) -> Plain:
    """Return how good readings are, in per cent of the modulus, and how hard the tips press the skin."""
    bias = readings.bias
    uncertainty = readings.uncertainty
    moduli = []
    for row in readings.moduli:
        modulus = {
            "E_MPa": row.E,
            "E_bias_percent": 100.0 * row.bias.value,
            "worst": str(row.worst),
            "uncertainty_percent": 100.0 * row.sources.total,
            "sources": _percent(row.sources.contributions),
        }
        moduli.append(modulus)
    pressures = []
    for skin in readings.pressures:
        pressure = {
            "E_MPa": skin.E,
            "pressure_MPa": skin.pressure.value,
            "limit_MPa": skin.limit,
            "worst": str(skin.placement),
        }
        pressures.append(pressure)
    return {
        "E_bias_percent": None if bias is None else 100.0 * bias.value,
        "E_bias_error_percent": None if bias is None else 100.0 * bias.error,
        "uncertainty_percent": None if uncertainty is None else 100.0 * uncertainty.value,
        "sources": {} if uncertainty is None else _percent(readings.worst_uncertainty.sources.contributions),
        "method": readings.method,
        "touch_fraction": readings.touch.value,
        "noise_for_10_percent": readings.noise_percent,
        "refused": readings.refused,
        "moduli": moduli,
        "skin_pressure": pressures,
    }


def relaxation_keys(over_time: ReadingOverTime) -> Plain:
    """Return forces, P and the apparent modulus over time, and when a reading moves least."""
    moduli = []
    for i, E in enumerate(over_time.E.tolist()):
        row = {
            "E_MPa": E,
            "F_N": over_time.F[i].T,
            "P": over_time.P[i],
            "E_apparent_MPa": over_time.apparent[i],
        }
        moduli.append(row)
    moments = []
    for moment in over_time.moments:
        percent = _finite(100.0 * moment.moves)
        moments.append({"speed_mm_per_s": moment.speed_mm_per_s, "at_s": moment.at_s, "moves_percent": percent})
    return {
        "t_s": over_time.t,
        "stop_s": float(over_time.t[over_time.stop]),
        "at_s": float(over_time.t[over_time.at]),
        "moves_percent": _finite(100.0 * over_time.moves.value),
        "moves_error_percent": _finite(100.0 * over_time.moves.error),
        "moduli": moduli,
        "moments": moments,
    }


def target_keys(reached: SceneTargets) -> Plain:
    """Return P_max and NL of a level sensor with flat sharp tips on flat fruit, whatever scene was asked for."""
    P_max, NL = reached.level
    return {"P_max": P_max.value, "P_max_error": P_max.error, "NL": NL.value, "NL_error": NL.error}


def _errors(result: SensorResult) -> Plain:
    """Return the budget of each number; springs that a line is given have none."""
    budgets = {name: _budget(budget) for name, budget in vars(result.errors.budgets).items()}
    has_housing = result.design.tips.tip_layout.has_housing
    return {name: budget for name, budget in budgets.items() if has_housing or name not in ("K_l", "K_h")}


def _budget(budget: UncertaintyBudget | None) -> Plain | None:
    if budget is None:
        return None
    return {
        "discretisation_percent": 100.0 * budget.numerical,
        "model": _contributions(budget.model),
        "inputs": _contributions(budget.input),
        "model_percent": 100.0 * budget.model_total,
        "inputs_percent": 100.0 * budget.input_total,
    }


def _contributions(parts: Iterable[Contribution]) -> list[Plain]:
    return [{"effect": part.effect, "size_percent": 100.0 * part.size, "reason": part.reason} for part in parts]


def _accuracy(result: SensorResult) -> Plain:
    contact = result.contact
    accuracy: Plain = {
        "tolerance": result.options.tolerance,
        "springs": None,
        "contact": {
            "error_percent": 100.0 * contact.error_pair,
            "choice": f"{contact.info.method}: {contact.info.status}",
        },
    }
    if result.springs.fitted is not None:
        stiffness = result.springs.fitted.stiffness
        accuracy["springs"] = {"error_percent": 100.0 * max(stiffness.error), "choice": stiffness.info.status}
    return accuracy


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _percent(sources: Mapping[str, float]) -> Plain:
    return {f"{name.removesuffix('_percent')}_percent": 100.0 * value for name, value in sources.items()}
