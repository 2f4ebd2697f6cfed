"""The springs of the default sensor in every process, compared with their targets and with CalculiX on the same mesh.

`python -m benchmarks.processes` writes docs/measurements.md, and exits with 1 if a goal is missed.
"""

import sys
from functools import partial

from benchmarks.calculix import calculix, is_installed
from benchmarks.harness import percent, section, signed_percent, time_call, write_section
from mesh.housing.sweep import flexure_mesh
from pipeline.making.flexure_deck import flexure_deck
from pipeline.options import RunOptions
from pipeline.response.contact import fruit_compliance
from pipeline.springs.fitted_springs import FittedSprings, springs_for
from pipeline.springs.mounts import mount_layers
from pipeline.springs.sizing import spring_sizing
from pipeline.springs.spring import MadeSpring
from sensor.design.parameters import Design, Print
from sensor.design.processes import PROCESSES
from solve.housing.clamped_half import clamped_half

TARGET = 1e-3  # goal for the relative difference between FE and target
# Goal for the relative difference between our FE and CalculiX, which models the mount by springs at nodes.
SAME_MESH = 1e-4
HEADS = ["process", "target N/m", "L mm", "FE N/m", "against target", "error bar"]
HEADS += ["CalculiX N/m", "CalculiX - FE", "fit CPU s"]
INTRODUCTION = """\
`python -m benchmarks.processes` writes this table. It has the springs of the default design for every process that can
make them, in the mount that the design asks for. Each stiffness is compared with its target. CalculiX solves
`flexure.inp`, the deck that `pipeline run --fields` writes; it is compared with the stiffness of the run. One fit finds
both springs."""


def spring_rows(process: str) -> tuple[list[list[str]], bool]:
    """Return the table rows of both springs that a process makes, and whether they meet all goals.

    A process that cannot make the springs has no rows.
    """
    design = Design(print=Print(process=process))
    options = RunOptions()
    sizing = spring_sizing(design, fruit_compliance(design, options), options)
    springs, cpu = time_call(partial(springs_for, design, sizing, "fitted"))
    if springs.housing is None:
        return [], True
    # for each spring, CalculiX's stiffness [N/mm], or None if CalculiX is not installed
    peer_stiffnesses = calculix_stiffnesses(springs) if is_installed() else [None] * len(springs.springs)
    rows = []
    meets_goals = True
    springs_and_arms = zip(springs.springs.values(), springs.housing.arms, peer_stiffnesses, strict=True)
    for spring, arm, peer_stiffness in springs_and_arms:
        length_cell = f"{arm.flexure.length:.3f}"
        cells, meets_spring_goals = spring_cells(spring, length_cell, peer_stiffness)
        meets_goals = meets_goals and meets_spring_goals
        rows.append([f"{process} {arm.name}", *cells, f"{cpu:.2g}"])
    return rows, meets_goals


def spring_cells(spring: MadeSpring, length_cell: str, peer_stiffness: float | None) -> tuple[list[str], bool]:
    """Return the cells of a spring from its target to the comparison with CalculiX, and whether it meets all goals.

    `length_cell` is the length of its leaves as text. `peer_stiffness` [N/mm] is CalculiX's stiffness, or None.
    """
    target_error = spring.stiffness / spring.target - 1.0
    meets_goals = abs(target_error) <= TARGET
    calculix_cells = ["-", "-"]
    if peer_stiffness is not None:
        difference = peer_stiffness / spring.stiffness - 1.0
        meets_goals = meets_goals and abs(difference) <= SAME_MESH
        calculix_cells = [f"{1e3 * peer_stiffness:.6g}", signed_percent(difference)]
    # Stiffnesses are shown in N/m, and computed in N/mm.
    fit_cells = [f"{1e3 * spring.target:.6g}", length_cell, f"{1e3 * spring.stiffness:.6g}"]
    error_cells = [signed_percent(target_error), percent(spring.error / spring.stiffness)]
    return [*fit_cells, *error_cells, *calculix_cells], meets_goals


def calculix_stiffnesses(springs: FittedSprings) -> tuple[float, ...]:
    """Return CalculiX's stiffness of each spring of a housing in its mount [N/mm].

    A stiffness is the inverse of the displacement of a tip under a unit force. Raises SolveError if CalculiX fails.
    """
    process = springs.process
    half = clamped_half(flexure_mesh(springs.housing), process.E_MPa, process.poisson, mount_layers(springs.housing))
    deck = flexure_deck(half, process.E_MPa, process.poisson)
    results, _ = calculix(deck)  # one result per tip
    tips = zip(results, deck.mean_nodes.values(), strict=True)
    return tuple(1.0 / float(result.displacements[node]) for result, node in tips)


def main() -> int:
    """Write and print the table; the exit code is 1 if a process misses a goal."""
    all_rows = []
    missed = []  # names of the processes that miss a goal
    for process in PROCESSES:
        rows, meets_goals = spring_rows(process)
        all_rows += rows
        if not meets_goals:
            missed.append(process)
    goals = f"Goals: {percent(TARGET)} against target, {percent(SAME_MESH)} between CalculiX and FE. "
    goals += f"Missed by: {', '.join(missed) or 'none'}."
    page = section("Default design", HEADS, all_rows, [goals])
    write_section("Springs of each process", INTRODUCTION, [page])
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
