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
BALANCE_LIMIT = 1e-5  # largest unbalanced force over the applied force; CalculiX prints seven digits
_TABLE = re.compile(r"^ *(total force|displacements) .*for set (\S+) and time.*$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """Total forces along z by node set [N], and u_z (nodes,) [mm], which is 0 at nodes that the deck does not print."""

    forces: dict[str, float]
    displacements: Floats


def is_installed() -> bool:
    """Return whether CalculiX is installed."""
    return shutil.which("ccx") is not None


def calculix(deck: Deck) -> tuple[list[StepResult], float]:
    """Return CalculiX's results for each step of a deck [N, mm], and its CPU seconds [s].

    Nodes are numbered as in the deck, including its ground nodes and mean nodes. Raises SolveError if the program is
    absent, stops, prints an error, or its reactions do not balance.
    """
    program = shutil.which("ccx")
    if program is None:
        msg = "CalculiX = absent: the program ccx must be on the path; install it (Debian: calculix-ccx)"
        raise SolveError(msg)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.inp").write_text(deck.text(), encoding="ascii")
        (folder / "scene.dat").touch()
        usage = resource_usage([program, "-i", "scene"], folder, ONE_THREAD)
        printed = (folder / "scene.dat").read_text(encoding="ascii")
    error = re.search(r"\*ERROR.*", usage.out)
    if usage.exit_code or error or "Job finished" not in usage.out:
        reason = error.group() if error else "job not finished"
        raise SolveError(_failure(f"exit code {usage.exit_code}, {reason}"))
    return _parse_results(printed, deck), usage.cpu


def _failure(reason: str) -> str:
    """Return the error message on a run that failed."""
    return f"CalculiX: {reason}: must finish its job with reactions that balance; look at its text"


def _parse_results(text: str, deck: Deck) -> list[StepResult]:
    """Return the results of each step from the text of a .dat file, in which displacements follow the forces.

    Raises SolveError if a step is missing or its forces do not balance.
    """
    results: list[StepResult] = []
    forces: dict[str, float] = {}
    displacements = np.zeros(deck.node_count)
    pieces = _TABLE.split(text)[1:]
    for kind, name, body in zip(pieces[::3], pieces[1::3], pieces[2::3], strict=True):
        numbers = np.array(body.split(), dtype=np.float64)
        if kind == "total force":
            forces[name.lower()] = float(numbers[2])
        else:
            displacements[numbers[::4].astype(int) - 1] = numbers[3::4]
            if name.lower() == deck.printed[-1]:
                results.append(StepResult(forces=forces, displacements=displacements))
                forces, displacements = {}, np.zeros(deck.node_count)
    if len(results) != len(deck.steps):
        raise SolveError(_failure(f"{len(results)} tables of results for {len(deck.steps)} steps"))
    for result, step in zip(results, deck.steps, strict=True):
        check_balance(CALCULIX, result.forces, step)
    return results


def check_balance(program: str, forces: Mapping[str, float], step: LinearStep) -> None:
    """Raise SolveError unless the supports balance the applied forces of a step.

    `forces` are the forces that `program` gives for each node set [N].
    """
    support = sum(value for name, value in forces.items() if name.startswith("support"))
    pressed = float(step.loads.sum()) + sum(forces[name] for name in step.pressed)
    if not (np.isfinite(pressed) and pressed != 0.0 and abs(pressed + support) <= BALANCE_LIMIT * abs(pressed)):
        msg = (
            f"{program}: {pressed:.6g} N pressed, {support:.6g} N carried: must carry what is pressed to "
            f"{BALANCE_LIMIT:.0e}; look at its text"
        )
        raise SolveError(msg)
