"""The bench: work and precision of contact and flexures beside their peers, cost of the command, growth of cost."""

import dataclasses
import json
import math
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from cad.quantity import fault
from pipeline.bench import contact as bench_contact
from pipeline.bench import flexure as bench_flexure
from pipeline.bench.calculix import absent
from pipeline.bench.command import GOALS, PEAK_GOAL_MIB, CommandCost, command_costs
from pipeline.bench.plot import Curve, Panel, svg
from pipeline.bench.resources import module_cost
from pipeline.bench.table import Measured, Sheet, percent, seconds, work_sheet, write_whole

OUT = Path("outputs") / "bench"
WIDTH = 150
CONTACT_GOAL = 1e-4
FLEXURE_GOAL = 1e-3


def bench(*, as_json: bool, out: Path = OUT, quick: bool = False) -> int:
    """Measure, print the tables or JSON, write bench.json, bench.svg and bench.md into a folder; return 0.

    `quick` leaves out peers, fine meshes and the command. Raises InputError when a measurement does not end well or
    the folder cannot be written.
    """
    flags = ("--quick",) if quick else ()
    contact, flexure = _child("pipeline.bench.contact", flags), _child("pipeline.bench.flexure", flags)
    commands = () if quick else command_costs()
    sheets = [*contact_sheets(contact), flexure_sheet(flexure), *([command_sheet(commands)] if commands else [])]
    data = {
        "schema": 1,
        "machine": machine(),
        "absent": list(absent()),
        **{sheet.name: {"records": list(sheet.records), "notes": list(sheet.notes)} for sheet in sheets},
    }
    text = json.dumps(data, indent=2, allow_nan=False)
    drawing = svg([_panel("contact, s11 - s12", contact), _panel("flexures, the worse of both", flexure)])
    write_whole(out, {"bench.json": text + "\n", "bench.svg": drawing, "bench.md": _markdown(sheets)})
    if as_json:
        print(text)
    else:
        _print(sheets, out)
    return 0


def machine() -> dict[str, Any]:
    """Return what the seconds depend on: cores, processor family, Python."""
    return {"cores": os.cpu_count(), "processor": platform.machine(), "python": platform.python_version()}


def _child(module: str, flags: Sequence[str]) -> dict[str, Any]:
    cost = module_cost(module, *flags)
    if cost.code:
        raise fault(module, f"exit code {cost.code}", "", f"0; it says: {cost.last_error}", "run pipeline doctor")
    found: dict[str, Any] = json.loads(cost.out)
    found["refused"] = [line for line in cost.err.splitlines() if line.startswith("CalculiX:")]
    return found


def _measured(found: Mapping[str, Any]) -> list[Measured]:
    return [Measured(**row) for row in found["rows"]]


def contact_sheets(found: Mapping[str, Any]) -> list[Sheet]:
    """Return the table of the contact compliance and that of cost over dofs and scenes."""
    rows = _measured(found)
    r = bench_contact.REFERENCE
    notes = [
        f"paper's block 20 x 20 x 12 mm, nu 0.3, sides 1 mm, 8 mm apart; reference s11 {r['s11']:.6f}, s12 "
        f"{r['s12']:.6f} /mm +- {r['uncertainty']:g} by two independent methods; error 1 of s11 - s12, 2 of s11",
        "CPU seconds on one thread, after imports, meshing included; punch tables are built once a process",
        *_against_peer(rows, ("split", CONTACT_GOAL)),
        *_absences(found),
    ]
    sheet = work_sheet("contact", "contact compliance: work and precision", ("s11 - s12", "s11"), rows, notes)
    return [sheet, growth_sheet(rows, found["scenes"])] if found["scenes"] else [sheet]


def flexure_sheet(found: Mapping[str, Any]) -> Sheet:
    """Return the table of the flexures' stiffness."""
    r = bench_flexure.REFERENCE
    rows = _measured(found)
    notes = [
        f"both springs of the default sensor in PETG, half of the housing clamped at its holes; reference K_l "
        f"{1e3 * r['low']:.2f}, K_h {1e3 * r['high']:.1f} N/m +- {percent(r['uncertainty'])[1:]}: 20-node hexahedra at "
        "295k dofs, reduced and full integration extrapolated",
        "CPU seconds on one thread, after imports, meshing included; error bar of K_l",
        *_against_peer(rows, ("ours", FLEXURE_GOAL)),
        *_absences(found),
    ]
    if found["loop"]:
        loop = found["loop"]
        ratio = loop["loop"] / loop["once"]
        notes.append(
            f"closed loop for both springs to 0.1 %, dearest: {loop['fine']} fine, {loop['coarse']} coarse solves, "
            f"{seconds(loop['loop'])} CPU s = {ratio:.1f} x mesh + assembly + solve of the final mesh (goal 6)"
        )
    return work_sheet("flexure", "flexure stiffness: work and precision", ("K_l", "K_h"), rows, notes)


def _worst(row: Measured) -> float:
    return max(abs(row.error), abs(row.second or 0.0))


def _against_peer(rows: Sequence[Measured], ours: tuple[str, float]) -> list[str]:
    """Say how our cheapest row, error and bar within the goal, compares with the cheapest peer there or the nearest."""
    name, goal = ours
    within = [row for row in rows if row.method.startswith(name) and max(_worst(row), row.estimated or 0.0) <= goal]
    peers = [row for row in rows if row.method.startswith("CalculiX")]
    if not within or not peers:
        return []
    best = min(within, key=lambda row: row.cpu)
    reaching = [row for row in peers if _worst(row) <= goal]
    if reaching:
        peer = min(reaching, key=lambda row: row.cpu)
        words = f"cheapest peer within {percent(goal)[1:]}"
    else:
        peer = min(peers, key=_worst)
        words = f"no peer within {percent(goal)[1:]}; nearest"
    return [
        f"{best.method} at {percent(_worst(best))[1:]}: {seconds(best.cpu)} CPU s; {words}: {peer.method} at "
        f"{percent(_worst(peer))[1:]}, {seconds(peer.cpu)} CPU s, {peer.cpu / best.cpu:.2g} times as much"
    ]


def _absences(found: Mapping[str, Any]) -> list[str]:
    missing = absent()
    return [*([f"not installed, so not measured: {', '.join(missing)}"] if missing else []), *found["refused"]]


def command_sheet(costs: Sequence[CommandCost]) -> Sheet:
    """Return the table of the whole command."""
    rows = []
    for cost in costs:
        goal = GOALS.get(cost.name)
        rows.append(
            (cost.name, seconds(cost.wall), seconds(cost.cpu), f"{cost.ratio:.2f}",
             "-" if goal is None else f"{goal:g}", f"{cost.peak_MiB:.0f}", cost.failure)
        )  # fmt: skip
    notes = (
        "pipeline run --nl 0.05 with all its files beside python -c 'import cadquery, gmsh, skfem'; median of 3",
        f"memory of the largest process; goal {PEAK_GOAL_MIB:.0f} MiB",
    )
    return Sheet(
        name="command",
        title="whole command",
        heads=("run", "wall s", "CPU s", "ratio to imports", "goal", "peak MiB", "remark"),
        rows=tuple(rows),
        notes=notes,
        records=tuple(dataclasses.asdict(cost) for cost in costs),
    )


def growth_sheet(rows: Sequence[Measured], scenes: Mapping[str, float]) -> Sheet:
    """Return how error falls and time grows with dofs, as exponents over a family of meshes, and scenes over time."""
    cells, records = [], []
    for method in ("split", "direct P2 tets", "CalculiX C3D10"):
        family = [row for row in rows if row.method == method and row.dofs]
        if len(family) > 1:
            dofs = [float(row.dofs or 0) for row in family]
            error = exponent(dofs, [abs(row.error) for row in family])
            cpu = exponent(dofs, [row.cpu for row in family])
            cells.append((method, f"error ~ dofs^{error:.2f}", f"CPU ~ dofs^{cpu:.2f}"))
            records.append({"method": method, "error_exponent": error, "cpu_exponent": cpu})
    for name, cpu in scenes.items():
        cells.append((name, "-", f"{seconds(cpu)} CPU s"))
        records.append({"scene": name, "cpu": cpu})
    return Sheet(
        name="growth",
        title="growth of cost",
        heads=("what", "error", "time"),
        rows=tuple(cells),
        records=tuple(records),
    )


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Return the slope of log y over log x by least squares."""
    u, v = ([math.log(value) for value in values] for values in (x, y))
    mean_u, mean_v = sum(u) / len(u), sum(v) / len(v)
    rise = sum((a - mean_u) * (b - mean_v) for a, b in zip(u, v, strict=True))
    return rise / sum((a - mean_u) ** 2 for a in u)


def _panel(title: str, found: Mapping[str, Any]) -> Panel:
    curves: dict[str, list[tuple[float, float]]] = {}
    for row in _measured(found):
        if row.dofs is not None:
            curves.setdefault(row.method, []).append((row.cpu, _worst(row)))
    drawn = tuple(Curve(name=name, points=tuple(points)) for name, points in curves.items())
    return Panel(title=title, x_label="CPU seconds, one thread", y_label="relative error", curves=drawn)


def _markdown(sheets: Sequence[Sheet]) -> str:
    here = machine()
    head = f"Measured by `pipeline bench` on {here['cores']} cores, Python {here['python']}.\n"
    return "\n".join([head, *(sheet.markdown() for sheet in sheets), "![error against CPU seconds](bench.svg)\n"])


def _print(sheets: Sequence[Sheet], out: Path) -> None:
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    for sheet in sheets:
        sheet.print_on(console)
    console.print(f"written: {', '.join(str(out / name) for name in ('bench.json', 'bench.svg', 'bench.md'))}")
