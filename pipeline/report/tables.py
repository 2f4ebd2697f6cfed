"""The tables that a person reads of a report."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.table import Table

from cad.verdict import Verdict

WIDTH = 132
_WORD = {True: "[green]passed[/]", False: "[red]failed[/]", None: "[yellow]undecided[/]"}


def print_report(report: Mapping[str, Any]) -> None:
    """Print the verdicts, the springs, the response and the costs as tables."""
    console = _console()
    console.print(_verdict_table(f"twintip · {report['design']['name']}", report["verdicts"]))
    _print_reasons(console, report["verdicts"])
    console.print(_spring_table(report))
    console.print(_error_table(report["errors"]))
    console.print(_response_table(report["response"]))
    console.print(_paper_table(report["paper"]))
    console.print(*_closing_lines(report), *_tolerance_lines(report.get("tolerance")), sep="\n")


def print_findings(title: str, findings: Sequence[Verdict]) -> None:
    """Print the findings on a file or folder as a table, and why each that did not pass did not."""
    rows = [asdict(finding) for finding in findings]
    console = _console()
    console.print(_verdict_table(title, rows))
    _print_reasons(console, rows)


def _console() -> Console:
    return Console(width=None if sys.stdout.isatty() else WIDTH)


def _print_reasons(console: Console, verdicts: Sequence[Mapping[str, Any]]) -> None:
    """Print one line for every verdict that did not pass."""
    for one in verdicts:
        if one["passed"] is not True:
            console.print(f"{_WORD[one['passed']]} {one['name']}: {one['reference']}")


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


def _error_table(errors: Mapping[str, Mapping[str, Any] | None]) -> Table:
    """Return what each error is made of; verdicts use the first column, calibration of a print settles the last."""
    heads = ("error of", "mesh ± %", "left out of the model %", "scatter of the print ± %", "largest shares")
    table = Table(*heads)
    for name, made in errors.items():
        if made is not None:
            shares = sorted((*made["model"], *made["inputs"]), key=lambda one: -abs(one["size_percent"]))
            largest = ", ".join(f"{one['effect']} {one['size_percent']:+.2g}" for one in shares[:2])
            numbers = (f"{made[f'{kind}_percent']:.2g}" for kind in ("discretisation", "model", "inputs"))
            table.add_row(name, *numbers, largest)
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
    springs, asked = report["accuracy"]["springs"], report["accuracy"]["tolerance"]
    stages = ", ".join(f"{name} {value:.2f}/{cpu[name]:.2f}" for name, value in seconds.items())
    return [
        f"contact: K_m/E = {contact['K_m_over_E_mm']:.6g} mm ± {contact['error_percent']:.2g} %, "
        f"{contact['method']}, {contact['dofs']} dofs; {contact['status']}",
        *([] if springs is None else [f"springs, --tol {asked:g}: {springs['choice']}"]),
        *report["notes"],
        f"seconds (wall/processor): {stages}",
    ]
