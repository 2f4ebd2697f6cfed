"""Every process that can make the default sensor: fitted leaves, FE against its targets, CalculiX on the same mesh.

`python -m benchmarks.processes` writes docs/measurements.md, and exits with 1 where a goal is missed.
"""

import sys
from functools import partial

from benchmarks.calculix import is_installed
from benchmarks.flexure import peer_stiffness
from benchmarks.harness import percent, section, signed_percent, timed, write_section
from mesh.housing.sweep import flexure_mesh
from pipeline.options import RunOptions
from pipeline.response.contact import fruit_compliance
from pipeline.springs.fitted_springs import springs_for
from pipeline.springs.sizing import spring_sizing
from sensor.design.parameters import Design, Print
from sensor.design.processes import PROCESSES
from solve.housing.stiffness import tip_compliance

TARGET = 1e-3  # goal, relative: FE to target
SAME_MESH = 1e-4  # goal, relative: CalculiX to FE on the same mesh
HEADS = ["process", "target N/m", "L mm", "FE N/m", "against target", "error bar", "CalculiX - FE", "fit CPU s"]
INTRODUCTION = """\
`python -m benchmarks.processes` writes this table. It has the springs of the default design for every process that can
make them. Each stiffness, in the mount that the design asks for, is compared with its target. CalculiX solves the same
mesh with the frame clamped at its holes. It is compared with our own solve, clamped in the same way. One fit finds both
springs."""


def rows_of(name: str) -> tuple[list[list[str]], bool]:
    """Return the rows of both springs of a process, and whether they meet every goal; no rows where it makes none."""
    design = Design(print=Print(process=name))
    options = RunOptions()
    sizing = spring_sizing(design, fruit_compliance(design, options), options)
    springs, cpu = timed(partial(springs_for, design, sizing, "fitted"))
    if springs.housing is None:
        return [], True
    material = (design.process.E_MPa, design.process.poisson)
    mesh = flexure_mesh(springs.housing, 1.0)
    clamped_at_holes = tip_compliance(mesh, *material)
    peer = peer_stiffness(mesh, ("hex 20, reduced", "C3D20R"), material).values if is_installed() else None
    lines = []
    good = True
    for index, (spring, arm) in enumerate(zip(springs.springs.values(), springs.housing.arms, strict=True)):
        miss = spring.stiffness / spring.target - 1.0
        good = good and abs(miss) <= TARGET
        apart = "-"
        if peer is not None:
            difference = peer[index] / clamped_at_holes.K[index] - 1.0
            good = good and abs(difference) <= SAME_MESH
            apart = signed_percent(difference)
        numbers = [f"{1e3 * spring.target:.6g}", f"{arm.flexure.length:.3f}", f"{1e3 * spring.stiffness:.6g}"]
        bar = percent(spring.error / spring.stiffness)
        lines.append([f"{name} {arm.name}", *numbers, signed_percent(miss), bar, apart, f"{cpu:.2g}"])
    return lines, good


def main() -> int:
    """Write and print the table."""
    table = []
    missed = []
    for name in PROCESSES:
        lines, good = rows_of(name)
        table += lines
        if not good:
            missed.append(name)
    goals = f"Goals: {percent(TARGET)} against target, {percent(SAME_MESH)} between CalculiX and FE. "
    goals += f"Missed by: {', '.join(missed) or 'none'}."
    page = section("Default design", HEADS, table, [goals])
    write_section("Springs of each process", INTRODUCTION, [page])
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
