"""Peers: other finite-element programs with a Python interface.

An interpreter of their own runs the peers, so that they are never imported here. `make bench-peers` creates its
environment. If a peer crashes, hangs or prints an invalid answer, SolveError is raised, and the tables show the reason
instead of a number.
"""

import json
import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.calculix import CALCULIX, StepResult, calculix, check_balance, is_installed
from benchmarks.usage import ONE_THREAD, resource_usage
from pipeline.storage.deck import Deck, LinearStep, support_nodes
from sensor.arrays import Floats
from solve.linear import SolveError

ROOT = Path(__file__).parents[1]
# The environment of `make bench-peers`, and Debian's interpreter for the packages that only Debian has.
INTERPRETERS = (ROOT / ".venv-peers" / "bin" / "python", Path("/usr/bin/python3"))
SCRIPTS = ROOT / "benchmarks" / "peer_programs"
DEADLINE = 1200.0  # maximum wall-clock time of one task [s]


@dataclass(frozen=True, kw_only=True)
class Peer:
    """A program that solves the same tasks: its name in the tables, and the CalculiX types of elements that it has."""

    name: str
    kinds: tuple[str, ...] = ("C3D10",)

    @property
    def package(self) -> str:
        """Return the name of the Python package, which is the name of the program in lower case."""
        return self.name.lower()

    @property
    def interpreter(self) -> Path | None:
        """Return the interpreter that has the package, or None if it is not installed."""
        return _interpreter(self.package, INTERPRETERS) if (SCRIPTS / self.script).is_file() else None

    @property
    def script(self) -> str:
        """Return the name of the script that uses the package."""
        return f"with_{self.package}.py"


EVERY_KIND = ("C3D10", "C3D20R", "C3D20")
NGSOLVE, FELUPE, GETFEM = PEERS = (
    Peer(name="NGSolve"),
    Peer(name="felupe", kinds=EVERY_KIND),
    Peer(name="GetFEM", kinds=EVERY_KIND),
)
PEER_NAMES = ("CalculiX", *(peer.name for peer in PEERS))
Solver = Callable[[Deck], tuple[Sequence[StepResult], float]]


@dataclass(frozen=True, kw_only=True, eq=False)
class PeerTask:
    """A task for a peer: its kind, its numbers and names (`scene`), its arrays, and its load steps."""

    kind: str
    scene: Mapping[str, object]
    steps: Sequence[LinearStep]
    arrays: Mapping[str, Any] = field(default_factory=dict)

    def write(self, path: Path) -> None:
        """Write the task as a file of arrays, in the format of `peer_programs/deck.py`."""
        steps = [
            {"held": step.held, "pressed": step.pressed, "support": f"support{number}"}
            for number, step in enumerate(self.steps)
        ]
        loads: Mapping[str, Any] = {f"loads {number}": step.loads for number, step in enumerate(self.steps)}
        np.savez(path, scene=json.dumps({**self.scene, "steps": steps}), **loads, **self.arrays)


@dataclass(frozen=True, kw_only=True)
class PeerAnswer:
    """The checked answer of a peer to each step, its number of dofs, and its CPU time after imports [s]."""

    results: tuple[StepResult, ...]
    dofs: int
    cpu: float


def deck_task(deck: Deck) -> PeerTask:
    """Return the task to solve a deck on its own mesh.

    The answer has the displacements of the node set that the deck names in `printed_set`.
    """
    supports = {f"support{number}": support_nodes(step, deck.sets) for number, step in enumerate(deck.steps)}
    sets = {f"set {name}": numbers for name, numbers in {**deck.sets, **supports}.items()}
    arrays = {"nodes": deck.elements.nodes.T, "cells": deck.elements.cells, **sets}
    scene = {"kind": deck.elements.kind, "E": deck.E, "poisson": deck.poisson, "printed_set": deck.printed_set}
    return PeerTask(kind="deck", scene=scene, steps=deck.steps, arrays=arrays)


def deck_solvers(kind: str) -> dict[str, Solver]:
    """Return the installed programs, by name, that solve a deck with elements of this type of CalculiX."""
    solvers: dict[str, Solver] = {"CalculiX": calculix} if is_installed() else {}
    return solvers | {
        peer.name: partial(_solve_deck, peer) for peer in PEERS if peer.interpreter and kind in peer.kinds
    }


def absent_peers() -> list[str]:
    """Return the names of the peers that are not installed."""
    programs = [] if is_installed() else [CALCULIX]
    return programs + [peer.name for peer in PEERS if peer.interpreter is None]


def _solve_deck(peer: Peer, deck: Deck) -> tuple[Sequence[StepResult], float]:
    """Return a peer's results on a deck, one per step, and its CPU time [s].

    The displacements cover all nodes; outside the set `printed_set` they are 0. A peer may leave the displacements out.
    Raises SolveError if the peer fails, or if it returns a wrong number of displacements.
    """
    answer = peer_answer(peer, deck_task(deck))
    printed_nodes = deck.sets[deck.printed_set]
    results = []
    for result in answer.results:
        displacements = np.zeros(deck.node_count)
        if len(result.displacements) not in (0, len(printed_nodes)):
            raise _failure(peer, f"{len(result.displacements)} displacements of {len(printed_nodes)} nodes")
        if len(result.displacements):
            displacements[printed_nodes] = result.displacements
        results.append(StepResult(forces=result.forces, displacements=displacements))
    return results, answer.cpu


def peer_answer(peer: Peer, task: PeerTask) -> PeerAnswer:
    """Run a peer on a task, and return its answer [N, mm].

    The peer reads the task from a temporary file, and prints its answer in the last line. An answer must have the
    forces of every step, reactions that balance, and no more CPU time than the process used. Raises SolveError if it
    does not, and if the peer is absent, fails, or takes longer than `DEADLINE`.
    """
    interpreter = peer.interpreter
    if interpreter is None:
        msg = f"{peer.name} is not installed. Run make bench-peers."
        raise SolveError(msg)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "task.npz"
        task.write(path)
        # A symbolic link must not be resolved here: Python finds its virtual environment by the path of the
        # interpreter.
        command = [str(interpreter), str(SCRIPTS / peer.script), task.kind, str(path)]
        usage = resource_usage(command, Path(folder), ONE_THREAD, deadline=DEADLINE)
    if usage.wall >= DEADLINE:
        raise _failure(peer, f"still at work after {DEADLINE:g} s")
    if usage.exit_code:
        raise _failure(peer, f"exit code {usage.exit_code}, {usage.last_line}")
    last_line = (usage.out.strip().splitlines() or [""])[-1]
    return _parse_answer(peer, task, last_line, usage.cpu)


def _failure(peer: Peer, reason: str) -> SolveError:
    """Return the error for a peer that failed."""
    requirement = "It must answer each step with reactions that balance"
    return SolveError(f"{peer.name} failed: {reason}. {requirement}; look at {peer.script}.")


def _parse_answer(peer: Peer, task: PeerTask, line: str, process_cpu: float) -> PeerAnswer:
    """Return the answer in the last `line` of a peer's output, after checking it.

    `process_cpu` is the CPU time of the peer's whole process [s]. The peer itself counts the time after its imports.
    Raises SolveError if the line is not an answer, if its numbers are impossible, or if its forces do not balance.
    """
    try:
        answer = json.loads(line)
        results = tuple(_parse_step(step) for step in answer["steps"])
        dofs, cpu = int(answer["dofs"]), float(answer["cpu"])
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise _failure(peer, f"not an answer, {line[:60]!r}") from error
    if len(results) != len(task.steps):
        raise _failure(peer, f"{len(results)} results, but the task has {len(task.steps)} steps")
    if not 0.0 < cpu <= process_cpu:
        raise _failure(peer, f"{cpu:g} CPU s counted, {process_cpu:g} used")
    for number, (step, result) in enumerate(zip(task.steps, results, strict=True)):
        if set(result.forces) != {*step.pressed, f"support{number}"} or not _is_finite(result):
            raise _failure(peer, f"forces {result.forces}")
        check_balance(peer.name, result.forces, step)
    return PeerAnswer(results=results, dofs=dofs, cpu=cpu)


def _parse_step(step: Mapping[str, Any]) -> StepResult:
    """Return the result of one step from its object in JSON."""
    forces = {str(name): float(value) for name, value in step["forces"].items()}
    displacements: Floats = np.array(step["displacements"], dtype=np.float64)
    return StepResult(forces=forces, displacements=displacements)


def _is_finite(result: StepResult) -> bool:
    """Return whether all forces and displacements are finite numbers."""
    return all(map(math.isfinite, result.forces.values())) and bool(np.isfinite(result.displacements).all())


@lru_cache
def _interpreter(package: str, interpreters: tuple[Path, ...]) -> Path | None:
    """Return the first interpreter that can import a package, or None.

    Each interpreter is started for this test, so the result is cached. An interpreter that does not start is skipped.
    """
    program = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({package!r}) is None)"
    for interpreter in interpreters:
        if interpreter.is_file():
            try:
                usage = resource_usage([str(interpreter), "-c", program], deadline=DEADLINE)
            except OSError:
                continue
            if usage.exit_code == 0:
                return interpreter
    return None
