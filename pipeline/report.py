"""The report: what report.json holds, and the tables a person reads."""

import hashlib
import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from cad.design_file import design_as_mapping
from cad.finding import Finding
from pipeline.behaviour import behaviour_entry
from pipeline.flexures import FittedFlexures
from pipeline.judgement import Case, judge_paper, largest_pressure
from pipeline.springs import PrintedSpring, PrintedSprings
from pipeline.verdicts import PAPER, PAPER_TARGETS, Verdict
from solve.compliance import Compliance
from solve.scene_response import SceneResponse

SCHEMA = 1
PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")
WIDTH = 132
_WORD = {True: "[green]passed[/]", False: "[red]failed[/]", None: "[yellow]undecided[/]"}


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


def print_report(report: Mapping[str, Any]) -> None:
    """Print the verdicts, the springs, the response and the costs as tables."""
    console = _console()
    console.print(_verdict_table(f"twintip · {report['design']['name']}", report["verdicts"]))
    console.print(*_reasons(report["verdicts"]), sep="\n")
    console.print(_spring_table(report))
    console.print(_response_table(report["response"]))
    console.print(_paper_table(report["paper"]))
    console.print(*_closing_lines(report), *_tolerance_lines(report.get("tolerance")), sep="\n")


def print_findings(title: str, findings: Sequence[Finding]) -> None:
    """Print the findings on a file or folder as a table, and why each that did not pass did not."""
    rows = [asdict(finding) for finding in findings]
    console = _console()
    console.print(_verdict_table(title, rows))
    console.print(*_reasons(rows), sep="\n")


def _console() -> Console:
    return Console(width=None if sys.stdout.isatty() else WIDTH)


def _reasons(verdicts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return one line for every verdict that did not pass."""
    return [
        f"{_WORD[one['passed']]} {one['name']}: {one['reference']}" for one in verdicts if one["passed"] is not True
    ]


def _verdict_table(title: str, verdicts: Sequence[Mapping[str, Any]]) -> Table:
    table = Table("verdict", "value", "± error", "target", "tolerance", "", title=title, title_justify="left")
    for verdict in verdicts:
        table.add_row(
            verdict["name"],
            _shown(verdict["value"], verdict["unit"]),
            _shown(verdict.get("error"), ""),
            _shown(verdict["limit"], ""),
            _shown(verdict["tolerance"], ""),
            _WORD[verdict["passed"]],
        )
    return table


def _shown(value: object, unit: str) -> str:
    text = "" if value is None else f"{value:.5g}" if isinstance(value, int | float) else str(value)
    return f"{text} {unit}" if text and unit not in ("", "1") else text


def _spring_table(report: Mapping[str, Any]) -> Table:
    table = Table("spring", "target N/m", "FE N/m", "± %", "leaf L x t x w mm", "strain", "safety", "dofs", "s")
    for name, spring in report["flexures"].items():
        size = spring["dimensions_mm"] or {}
        leaf = " x ".join(f"{size[key]:g}" for key in ("length", "thickness", "depth") if key in size)
        numbers = ("stiffness_N_per_m", "error_percent")
        more = ("root_strain", "safety_factor", "dofs", "seconds")
        shown = [f"{spring['target_N_per_m']:.6g}", *(_shown(spring[key], "") for key in numbers), leaf]
        table.add_row(name, *shown, *(_shown(spring[key], "") for key in more))
    return table


def _response_table(responses: Sequence[Mapping[str, Any]]) -> Table:
    table = Table("E MPa", "P first", "P last", "F_l N", "F_h N", "slope ratio")
    for row in responses:
        ends = (row["P"][0], row["P"][-1], row["F_l_N"][-1], row["F_h_N"][-1], row["slope_ratio"][-1])
        table.add_row(f"{row['E_MPa']:g}", *(_shown(value, "") or "off" for value in ends))
    return table


def _paper_table(paper: Mapping[str, Any]) -> Table:
    title = f"the paper's springs, {paper['K_l_N_per_m']:g} and {paper['K_h_N_per_m']:g} N/m, under the same contact"
    return _verdict_table(title, paper["verdicts"])


def _tolerance_lines(bands_95: Mapping[str, Any] | None) -> list[str]:
    if bands_95 is None:
        return []
    ends = {key: value for key, value in bands_95.items() if isinstance(value, list | tuple)}
    shown = ", ".join(f"{key} {low:.4g} to {high:.4g}" for key, (low, high) in ends.items())
    calibrated = 100.0 * bands_95["calibrated_modulus_error"]
    return [
        f"before calibration 95 % of prints have: {shown}",
        f"with both stiffnesses of a unit known to 1 %, the modulus it reads is known to {calibrated:.1f} %",
    ]


def _closing_lines(report: Mapping[str, Any]) -> list[str]:
    contact, seconds, cpu = report["contact"], report["seconds"], report["cpu_seconds"]
    stages = ", ".join(f"{name} {value:.2f}/{cpu[name]:.2f}" for name, value in seconds.items())
    return [
        f"contact: K_m/E = {contact['K_m_over_E_mm']:.6g} mm ± {contact['error_percent']:.2g} %, "
        f"{contact['method']}, {contact['dofs']} dofs; {contact['status']}",
        *report["notes"],
        f"seconds (wall/processor): {stages}",
    ]
