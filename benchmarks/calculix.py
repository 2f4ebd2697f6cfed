"""Run CalculiX on a deck, and check its results.

CalculiX may fail with exit code 0, so its output is searched for errors, and its reactions must balance.
"""

import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.usage import ONE_THREAD, resource_usage
from pipeline.storage.deck import Deck, LinearStep
from sensor.arrays import Floats
from solve.linear import SolveError

CALCULIX = "CalculiX (ccx)"
BALANCE_LIMIT = 1e-5  # largest unbalanced force divided by the applied force; CalculiX prints seven digits
# The heading of a table in a .dat file. Its groups are the quantity and the name of the node set.
_TABLE_HEADING = re.compile(r"^ *(total force|displacements) .*for set (\S+) and time.*$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """Total forces along z by node set [N], and u_z (nodes,) [mm], which is 0 at nodes that the deck does not print."""

    forces: dict[str, float]
    displacements: Floats


def is_installed() -> bool:
    """Return whether CalculiX is installed."""
    return shutil.which("ccx") is not None


def calculix(deck: Deck) -> tuple[list[StepResult], float]:
    """Run CalculiX on a deck, and return its results for each step [N, mm] and its CPU time [s].

    CalculiX runs on one thread in a temporary folder. Nodes are numbered as in the deck, including its ground nodes and
    mean nodes. Raises SolveError if the program is absent, stops, prints an error, or its reactions do not balance.
    """
    program = shutil.which("ccx")
    if program is None:
        msg = "CalculiX = absent: the program ccx must be on the path. Install it (Debian: calculix-ccx)."
        raise SolveError(msg)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.inp").write_text(deck.text(), encoding="ascii")
        (folder / "scene.dat").touch()  # so that the file can be read even if CalculiX stops before writing it
        usage = resource_usage([program, "-i", "scene"], folder, ONE_THREAD)
        printed = (folder / "scene.dat").read_text(encoding="ascii")
    error = re.search(r"\*ERROR.*", usage.out)
    if usage.exit_code or error or "Job finished" not in usage.out:
        reason = error.group() if error else "job not finished"
        raise SolveError(_failure(f"exit code {usage.exit_code}, {reason}"))
    return _parse_results(printed, deck), usage.cpu


def _failure(reason: str) -> str:
    """Return the error message for a run that failed for the given reason."""
    return f"CalculiX: {reason}. It must finish its job with reactions that balance. Look at its output."


def _parse_results(text: str, deck: Deck) -> list[StepResult]:
    """Return the results of each step of a `deck` from the `text` of its .dat file.

    In each step, CalculiX prints the total forces of the node sets, and then the displacements of the sets in
    `deck.printed`. Raises SolveError if a step is missing or its forces do not balance.
    """
    results: list[StepResult] = []
    forces: dict[str, float] = {}
    displacements = np.zeros(deck.node_count)
    # `split` also returns the groups of each heading. So the text before the first heading is followed by a quantity, a
    # node set and a table in turn.
    pieces = _TABLE_HEADING.split(text)[1:]
    for quantity, name, table in zip(pieces[::3], pieces[1::3], pieces[2::3], strict=True):
        numbers = np.array(table.split(), dtype=np.float64)
        if quantity == "total force":
            forces[name.lower()] = float(numbers[2])  # the z component of three
        else:  # the displacements of a node set
            # A row holds the number of a node, which starts at 1, and its displacements along x, y and z.
            displacements[numbers[::4].astype(int) - 1] = numbers[3::4]
            if name.lower() == deck.printed[-1]:  # the last table of a step
                results.append(StepResult(forces=forces, displacements=displacements))
                forces, displacements = {}, np.zeros(deck.node_count)
    if len(results) != len(deck.steps):
        raise SolveError(_failure(f"{len(results)} tables of results for {len(deck.steps)} steps"))
    for result, step in zip(results, deck.steps, strict=True):
        check_balance(CALCULIX, result.forces, step)
    return results


def check_balance(program: str, forces: Mapping[str, float], step: LinearStep) -> None:
    """Raise SolveError unless the supports balance the applied forces of a step.

    `forces` holds the total force along z that `program` reports for each node set [N]. Names of supports begin with
    "support". The applied forces are the nodal loads, and the forces on the sets whose displacement is prescribed.
    """
    support_force = sum(force for name, force in forces.items() if name.startswith("support"))
    applied_force = float(step.loads.sum()) + sum(forces[name] for name in step.pressed)
    is_loaded = np.isfinite(applied_force) and applied_force != 0.0
    # The two forces have opposite signs.
    if not (is_loaded and abs(applied_force + support_force) <= BALANCE_LIMIT * abs(applied_force)):
        msg = (
            f"{program}: the supports carry {support_force:.6g} N under an applied force of {applied_force:.6g} N. "
            f"They must balance to {BALANCE_LIMIT:.0e}. Look at the output of the program."
        )
        raise SolveError(msg)
