"""The report: what report.json holds."""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from cad.design.design_file import design_as_mapping
from cad.verdict import Verdict
from pipeline.fit.leaf_lengths import FittedFlexures
from pipeline.stages.characteristics import behaviour_entry
from pipeline.stages.springs import PrintedSpring, PrintedSprings
from pipeline.stages.verdict_rules import PAPER, PAPER_TARGETS
from pipeline.stages.verdicts import Case, judge_paper, largest_pressure
from pipeline.uncertainty.budget import makeup
from solve.contact.response import SceneResponse
from solve.fruit.compliance import Compliance

SCHEMA = 1
PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")


def contact_entry(contact: Compliance) -> dict[str, Any]:
    """Return the contact's part of the report."""
    entry = asdict(contact)
    entry["compliance_per_mm"] = [list(row) for row in entry.pop("S")]
    return {**entry, "K_m_over_E_mm": contact.K_m_over_E_mm}


def response_entries(case: Case, printed: PrintedSprings, found: SceneResponse) -> list[dict[str, Any]]:
    """Return the response at each modulus with the errors of contact and springs; null where a tip is off the fruit."""
    entries = []
    for one, force_errors, P_errors in zip(found.responses, found.error_percent, found.P_error_percent, strict=True):
        low, high = case.spring_shares(printed, one.E)
        entries.append(
            {
                "E_MPa": one.E,
                "x_mm": _numbers(one.x),
                "F_l_N": _numbers(one.F_l),
                "F_h_N": _numbers(one.F_h),
                "P": _numbers(one.P),
                "slope_ratio": _numbers(one.slope_ratio),
                "F_error_percent": _numbers(force_errors + max(low, high)),
                "P_error_percent": _numbers(P_errors + low + high),
            }
        )
    return entries


def _numbers(values: np.ndarray) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]


def accuracy_entry(tolerance: float, contact: Compliance, printed: PrintedSprings) -> dict[str, Any]:
    """Return what accuracy was asked for [1], what was reached [%], and which model and mesh was chosen for it."""
    found = None if printed.fitted is None else printed.fitted.stiffness
    return {
        "tolerance": tolerance,
        "springs": None if found is None else {"error_percent": max(found.error_percent), "choice": found.status},
        "contact": {"error_percent": contact.error_percent, "choice": f"{contact.method}: {contact.status}"},
    }


def spring_entry(spring: PrintedSpring, cost: FittedFlexures | None) -> dict[str, Any]:
    """Return one spring's part of the report; numbers of a spring that cannot be made are null."""
    return {
        "target_N_per_m": 1e3 * spring.target,
        "stiffness_N_per_m": None if spring.stiffness is None else 1e3 * spring.stiffness,
        "error_percent": spring.error_percent,
        "dimensions_mm": None if spring.flexure is None else asdict(spring.flexure),
        "root_strain": spring.root_strain,
        "root_strain_error_percent": spring.strain_error_percent,
        "safety_factor": spring.safety_factor,
        "dofs": None if cost is None else cost.stiffness.dofs,
        "seconds": None if cost is None else cost.stiffness.seconds,
    }


def compose(case: Case, printed: PrintedSprings, found: SceneResponse, verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """Return the report but for its files, seconds and notes of other stages."""
    sizing, process = case.sizing, printed.process
    return {
        "schema": SCHEMA,
        "design": design_as_mapping(case.design),
        "springs": {
            "K_l_N_per_m": 1e3 * sizing.springs.K_l,
            "K_h_N_per_m": 1e3 * sizing.springs.K_h,
            "K_m_max_N_per_m": 1e3 * sizing.K_m_max,
            "K_m_over_E_mm": sizing.K_m_over_E,
            "fruit_stiffness": sizing.fruit_stiffness,
        },
        "flexures": {spring.name: spring_entry(spring, printed.fitted) for spring in (printed.low, printed.high)},
        "housing": None if printed.housing is None else asdict(printed.housing),
        "deflections_mm": list(printed.deflections),
        "material": {
            "name": process.material,
            "E_MPa": process.E_MPa,
            "poisson": process.poisson,
            "process": process.name,
        },
        "behaviour": behaviour_entry(printed, found),
        "contact": contact_entry(case.contact),
        "response": response_entries(case, printed, found),
        "verdicts": [asdict(verdict) for verdict in verdicts],
        "errors": makeup(case, printed, found),
        "paper": {
            "K_l_N_per_m": 1e3 * PAPER.K_l,
            "K_h_N_per_m": 1e3 * PAPER.K_h,
            "verdicts": [asdict(verdict) for verdict in judge_paper(case)],
        },
        "notes": notes(case, printed, found),
        "versions": versions(),
    }


def notes(case: Case, printed: PrintedSprings, found: SceneResponse) -> list[str]:
    """Return what a user must know beside the verdicts, each a sentence with its number."""
    design, paper = case.design, case.judged(PAPER)
    P, NL = paper.P_max()[0], paper.NL(PAPER_TARGETS)[0]
    press, process = design.press.travel_mm / design.tips.side_mm, printed.process
    pressure = largest_pressure(case, printed)
    leaves = (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm)
    low, high = (3.0 * process.accuracy_mm / thickness for thickness in leaves)
    return [
        f"the paper's own springs reach P_max {P:.3f} and NL {100.0 * NL:.2f} % under this contact "
        f"(targets {PAPER_TARGETS.P_max:g} and {100.0 * PAPER_TARGETS.NL:g} %)",
        f"the targets hold for this fruit and these tips, K_m/E = {case.contact.K_m_over_E_mm:.5g} mm (the paper's "
        "have 1.3226 mm; its tips on a cube of 12 mm 15 % less)",
        *_beyond_the_law(found),
        f"response: {found.method}; {found.status}",
        f"press: {press:.2g} tip sides at most; small strain is assumed, beyond 0.3 sides the force of real flesh "
        "departs by up to 1 % (Poisson 0.3) or 5 % (0.45)",
        f"bruise: mean pressure {pressure['pressure']:.2g} MPa at the largest E and full travel",
        f"calibrate each printed unit: leaves {process.accuracy_mm:g} mm off move K_l by {100.0 * low:.0f} % "
        f"and K_h by {100.0 * high:.0f} %",
    ]


def _beyond_the_law(found: SceneResponse) -> list[str]:
    """Return that P_max, NL and response.csv are a level sensor's, where this scene's response is another."""
    if not found.cells:
        return []
    P = found.responses[-1].P
    last = f"{P[-1]:.4g}" if math.isfinite(P[-1]) else "none, a tip is off"
    return [
        "P_max, NL and response.csv are those of a level sensor with flat sharp tips on flat fruit; this scene's own "
        f"response at {found.responses[-1].E:g} MPa and full travel is {last}"
    ]


def file_entries(folder: Path) -> list[dict[str, str]]:
    """Return path and sha256 of every file in the folder, in order of their names."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return [{"path": path.relative_to(folder).as_posix(), "sha256": file_digest(path)} for path in paths]


def file_digest(path: Path) -> str:
    """Return the sha256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def versions() -> dict[str, str]:
    """Return the version of each package that makes a number."""
    return {name: version(name) for name in PACKAGES}


def write_report(report: Mapping[str, Any], folder: Path) -> None:
    """Write report.json; raises ValueError when a number is not finite."""
    text = json.dumps(report, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / "report.json").write_text(text + "\n", encoding="utf-8")
