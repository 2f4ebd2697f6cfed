"""What report.json holds: a result as plain data, keys with their unit; docs/report-json.md says what each means."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from importlib.metadata import version

import numpy as np

from cad.design.design_file import design_as_mapping
from cad.design.processes import Process
from cad.design.tips import Tips
from cad.theory.two_spring_law import PAPER_SPRINGS
from cad.verdict import Verdict
from pipeline.report.notes import notes
from pipeline.report.readings import reading_mapping
from pipeline.report.stored import SCHEMA
from pipeline.result import SensorResult
from pipeline.stages.characteristics import GAUGE_FACTOR, GRID_MM, SpringBehaviour
from pipeline.stages.response import spring_shares
from pipeline.stages.sizing import SpringSizing
from pipeline.stages.springs import FittedSpring
from pipeline.storage.plain import Plain
from pipeline.storage.seal import sealed_mapping
from pipeline.uncertainty.budget import Contribution, UncertaintyBudget
from pipeline.verdicts.scene_targets import SceneTargets
from solve.contact.linear_response import SensorResponse
from solve.housing.modes import Modes

SIZED_KEYS = ("K_l_N_per_m", "K_h_N_per_m")
FORCE_KEYS = ("F_l_N", "F_h_N")
STIFFNESS_VERDICTS = ("K_l", "K_h")
PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")


def report_mapping(result: SensorResult, files: Iterable[Mapping[str, str]] = ()) -> Plain:
    """Return the whole report with its own digest; `files` are its entries of path and sha256."""
    springs = result.springs
    report = {
        "schema": SCHEMA,
        "design": design_as_mapping(result.design),
        "springs": _sizing(result.sizing),
        "flexures": {spring.name: _spring(spring, result) for spring in springs.springs},
        "housing": None if springs.housing is None else asdict(springs.housing),
        "deflections_mm": list(springs.deflections),
        "material": _material(springs.process),
        "behaviour": _behaviour(result.behaviour),
        "contact": _contact(result),
        "response": _response(result),
        **reading_mapping(result.design.tips, result.read_out, result.readings),
        "level": _level(result.judgement.reached),
        "verdicts": _verdicts(result.verdicts),
        "remedy": result.judgement.remedy,
        "errors": {name: _budget(budget) for name, budget in vars(result.errors.budgets).items()},
        "paper": _paper(result.judgement.paper),
        "accuracy": _accuracy(result),
        "notes": notes(result),
        "versions": {name: version(name) for name in PACKAGES},
        "files": list(files),
        "seconds": result.seconds.wall,
        "cpu_seconds": result.seconds.cpu,
    }
    return sealed_mapping(report | _tolerance(result))


def _tolerance(result: SensorResult) -> Plain:
    """Return how far prints scatter, where fabrication was asked for; null where it is not known."""
    scatter = result.errors.scatter
    return {"tolerance": scatter and asdict(scatter)} if result.options.fabrication else {}


def _sizing(sizing: SpringSizing) -> Plain:
    return {
        "K_l_N_per_m": 1e3 * sizing.springs.K_l,
        "K_h_N_per_m": 1e3 * sizing.springs.K_h,
        "K_m_max_N_per_m": 1e3 * sizing.K_m_max,
        "K_m_over_E_mm": sizing.K_m_over_E,
        "fruit_stiffness": sizing.basis,
    }


def _material(process: Process) -> Plain:
    return {
        "name": process.material,
        "E_MPa": process.E_MPa,
        "poisson": process.poisson,
        "process": process.name,
    }


def _spring(spring: FittedSpring, result: SensorResult) -> Plain:
    """Return one spring; numbers of a spring that cannot be made are null."""
    K, strain, fitted = spring.K, spring.root_strain, result.springs.fitted
    return {
        "target_N_per_m": 1e3 * spring.target,
        "stiffness_N_per_m": None if K is None else 1e3 * K.value,
        "error_percent": None if K is None else K.percent,
        "dimensions_mm": None if spring.flexure is None else asdict(spring.flexure),
        "root_strain": None if strain is None else strain.value,
        "root_strain_error_percent": None if strain is None else strain.percent,
        "safety_factor": spring.safety_factor,
        "dofs": None if fitted is None else fitted.stiffness.info.dofs,
        "seconds": None if fitted is None else fitted.stiffness.info.seconds,
    }


def _behaviour(behaviour: SpringBehaviour | None) -> Plain | None:
    if behaviour is None:
        return None
    return {
        "crosstalk_C12_over_C22": behaviour.crosstalk,
        "gauge_factor": GAUGE_FACTOR,
        "gauge_grid_mm": GRID_MM,
        "gauges": behaviour.gauges,
        "modes": _modes(behaviour.modes),
        **{
            name: {
                "tilt_at_full_force_rad": arm.tilt_at_full_force_rad,
                "large_deflection_stiffening": arm.large_deflection_stiffening,
                "natural_frequency_Hz": arm.natural_frequency_Hz,
                "bridge_mV_per_V": list(arm.bridge_mV_per_V),
                "bridge_error_percent": None if arm.bridge_error is None else 100.0 * arm.bridge_error,
            }
            for name, arm in behaviour.arms.items()
        },
    }


def _modes(modes: Modes | None) -> list[Plain]:
    if modes is None:
        return []
    rows = zip(modes.frequencies_Hz, modes.errors, modes.shapes, strict=True)
    return [
        {"frequency_Hz": frequency, "error_percent": 100.0 * error, "shape": shape} for frequency, error, shape in rows
    ]


def _contact(result: SensorResult) -> Plain:
    contact = result.contact
    return {
        "error_percent": 100.0 * contact.error_pair,
        "s11_error_percent": 100.0 * contact.error_own,
        **asdict(contact.info),
        "compliance_per_mm": contact.S.tolist(),
        "K_m_over_E_mm": contact.K_m_over_E(),
    }


def _response(result: SensorResult) -> list[Plain]:
    """Return the response at each modulus with the errors of contact and springs; null where a tip is off the fruit."""
    table, springs = result.press.table, result.springs
    tips = result.design.tips
    relative = np.array(tips.each(*(spring.error / spring.stiffness for spring in springs.springs)))
    shares = [spring_shares(result.contact, springs.C, float(E)) * relative for E in table.E]
    return [_response_row(table, i, tips, shares[i]) for i in range(len(table.E))]


def _response_row(table: SensorResponse, i: int, tips: Tips, of_springs: np.ndarray) -> Plain:
    """Return the response at one modulus; `of_springs` (tips,) are the errors of the forces by the springs [1]."""
    soft, stiff = (table.F[i, :, list(kind)].mean(axis=0) for kind in tips.kinds)
    columns = {
        "F_l_N": soft,
        "F_h_N": stiff,
        "P": table.P[i],
        "slope_ratio": table.slope_ratio[i],
        "F_error_percent": 100.0 * (table.F_error[i] + of_springs.max()),
        "P_error_percent": 100.0 * (table.P_error[i] + of_springs.sum()),
    }
    row = {"E_MPa": float(table.E[i]), "x_mm": _numbers(table.x)}
    row |= {name: _numbers(values) for name, values in columns.items()}
    if tips.layout != "pair":
        row["F_N"] = [_numbers(forces) for forces in table.F[i].T]
    return row


def _level(reached: SceneTargets) -> Plain:
    """Return P_max and NL of a level sensor with flat sharp tips on flat fruit, whatever scene was asked for."""
    P_max, NL = reached.level
    return {"P_max": P_max.value, "P_max_error": P_max.error, "NL": NL.value, "NL_error": NL.error}


def _numbers(values: np.ndarray) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]


def _verdicts(verdicts: Iterable[Verdict]) -> list[Plain]:
    return [asdict(verdict) for verdict in verdicts]


def _budget(budget: UncertaintyBudget | None) -> Plain | None:
    if budget is None:
        return None
    return {
        "discretisation_percent": 100.0 * budget.numerical,
        "model": [_contribution(one) for one in budget.model],
        "inputs": [_contribution(one) for one in budget.input],
        "model_percent": 100.0 * budget.model_total,
        "inputs_percent": 100.0 * budget.input_total,
    }


def _contribution(contribution: Contribution) -> Plain:
    return {
        "effect": contribution.effect,
        "size_percent": 100.0 * contribution.size,
        "reason": contribution.reason,
    }


def _paper(verdicts: Iterable[Verdict] | None) -> Plain | None:
    if verdicts is None:
        return None
    return {
        "K_l_N_per_m": 1e3 * PAPER_SPRINGS.K_l,
        "K_h_N_per_m": 1e3 * PAPER_SPRINGS.K_h,
        "verdicts": _verdicts(verdicts),
    }


def _accuracy(result: SensorResult) -> Plain:
    """Return what accuracy was asked for [1], what was reached [%], and which model and mesh was chosen for it."""
    contact, fitted = result.contact, result.springs.fitted
    springs = None
    if fitted is not None:
        springs = {"error_percent": 100.0 * max(fitted.stiffness.error), "choice": fitted.stiffness.info.status}
    return {
        "tolerance": result.options.tolerance,
        "springs": springs,
        "contact": {
            "error_percent": 100.0 * contact.error_pair,
            "choice": f"{contact.info.method}: {contact.info.status}",
        },
    }
