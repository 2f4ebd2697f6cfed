"""What report.json holds: a result as plain data, keys with their unit; docs/report-json.md says what each means."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from importlib.metadata import version

import numpy as np

from cad.design.design_file import design_as_mapping
from cad.design.processes import Process
from cad.design.tips import Tips
from cad.theory.two_spring_law import PAPER_SPRINGS
from cad.verdict import Verdict
from pipeline.report.contact_keys import contact_mapping, level_mapping, response_row, sizing_mapping
from pipeline.report.notes import notes
from pipeline.report.readings import curve_mapping, reading_mapping
from pipeline.report.stored import SCHEMA
from pipeline.response.characteristics import GAUGE_FACTOR, GRID_MM, SpringBehaviour
from pipeline.response.scene_press import spring_shares
from pipeline.result import SensorResult
from pipeline.springs.fitted_spring import FittedSpring
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.storage.plain import Plain
from pipeline.storage.seal import sealed_mapping
from pipeline.verdicts.errors.budget import Contribution, UncertaintyBudget
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance
from solve.housing.modes import Modes

FORCE_KEYS = ("F_l_N", "F_h_N")
STIFFNESS_VERDICTS = ("K_l", "K_h")
PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")


def report_mapping(result: SensorResult, files: Iterable[Mapping[str, str]] = ()) -> Plain:
    """Return the whole report with its own digest; `files` are its entries of path and sha256."""
    springs = result.springs
    report = {
        "schema": SCHEMA,
        "design": design_as_mapping(result.design),
        "springs": sizing_mapping(result.sizing),
        "flexures": {spring.name: spring_mapping(spring, springs) for spring in springs.springs},
        "housing": None if springs.housing is None else asdict(springs.housing),
        "deflections_mm": list(springs.deflections),
        "material": _material(springs.process),
        "behaviour": _behaviour(result.behaviour),
        "contact": contact_mapping(result.contact),
        "response": _response(result),
        "curve": curve_mapping(result.errors.reading),
        **reading_mapping(result.design.tips, result.read_out, result.readings),
        "level": level_mapping(result.reached),
        "verdicts": _verdicts(result.verdicts),
        "remedy": _first_remedy(result.verdicts),
        "errors": {name: _budget(budget) for name, budget in vars(result.errors.budgets).items()},
        "paper": _paper(result.paper),
        "accuracy": _accuracy(result),
        "notes": notes(result),
        "versions": _versions(),
        "files": list(files),
        "seconds": result.seconds.wall,
        "cpu_seconds": result.seconds.cpu,
    }
    return sealed_mapping(report | _tolerance(result))


def _first_remedy(verdicts: Iterable[Verdict]) -> str | None:
    return next((one.remedy for one in verdicts if one.remedy is not None), None)


def _versions() -> dict[str, str]:
    return {name: version(name) for name in PACKAGES}


def _tolerance(result: SensorResult) -> Plain:
    """Return how far prints scatter, where fabrication was asked for; null where it is not known."""
    scatter = result.errors.scatter
    return {"tolerance": scatter and asdict(scatter)} if result.options.fabrication else {}


def _material(process: Process) -> Plain:
    return {
        "name": process.material,
        "E_MPa": process.E_MPa,
        "poisson": process.poisson,
        "process": process.name,
    }


def spring_mapping(spring: FittedSpring, springs: FittedSprings) -> Plain:
    """Return one of the springs [N/m]; numbers of a spring that cannot be made are null."""
    K, strain, fitted = spring.K, spring.root_strain, springs.fitted
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


def _response(result: SensorResult) -> list[Plain]:
    return response_mapping(result.design.tips, result.contact, result.springs, result.press.table)


def response_mapping(
    tips: Tips, contact: FruitCompliance, springs: FittedSprings, table: SensorResponse
) -> list[Plain]:
    """Return the response [N; 1] at each modulus with the errors of contact and springs; null where a tip is off."""
    relative = np.array(tips.each(*(spring.error / spring.stiffness for spring in springs.springs)))
    shares = [spring_shares(contact, springs.C, float(E)) * relative for E in table.E]
    return [response_row(table, i, tips, shares[i]) for i in range(len(table.E))]


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
