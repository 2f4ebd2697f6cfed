"""CalculiX, another solver, on the meshes and with the elements of this one.

It ends with exit code 0 on some failures, so its text is read and its reactions must balance.
"""

import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from scipy.spatial import cKDTree

from pipeline.bench.resources import ONE_THREAD, resource_usage
from pipeline.storage.vtu import VTK_NODES
from solve.arrays import Floats, Ints
from solve.housing.element_study import boundary_places, element_basis
from solve.linear import SolveError

SkfemMesh = Any

CALCULIX = "CalculiX (ccx)"
VERTICAL = 3  # components count from 1
BALANCE_LIMIT = 1e-5  # CalculiX prints seven digits
SAME_PLACE = 1e-7  # [mm]
# CalculiX numbers the nodes of an element as VTK does.
_NODES = {
    "C3D10": VTK_NODES["tetra10"],
    "C3D20": VTK_NODES["hexahedron20"],
    "C3D20R": VTK_NODES["hexahedron20"],
}
_AXES = {10: (0, 1, 2, 3), 20: (0, 1, 3, 4)}  # a corner, and the ends of its edges
_TABLE = re.compile(r"^ *(total force|displacements) .*for set (\S+) and time.*$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Quadratic elements for a peer: nodes (3, n) [mm], node numbers (m, 10 or 20), element type of CalculiX."""

    nodes: Floats
    cells: Ints
    kind: str

    def at(self, places: Floats) -> Ints:
        """Return the numbers of the nodes at places, shape (3, n) [mm]; raises SolveError where there is none."""
        distance, index = cKDTree(self.nodes.T).query(places.T)
        farthest = float(np.max(distance))
        if not farthest <= SAME_PLACE:
            msg = f"peer mesh: a node is missing by {farthest:.1e} mm: must be at its place; check the element type"
            raise SolveError(msg)
        return np.asarray(index, dtype=np.int64)


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One static step: held components by node set, prescribed u_z by node set [mm], forces along z (nodes,) [N]."""

    held: Mapping[str, Sequence[int]]
    pressed: Mapping[str, float] = field(default_factory=dict)
    loads: Floats = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """Totals of force z by node set [N], and u_z (nodes,) [mm], 0 outside the set that was asked for."""

    forces: dict[str, float]
    displacements: Floats


def is_installed() -> bool:
    """Say whether CalculiX can be called."""
    return shutil.which("ccx") is not None


def peer_elements(mesh: SkfemMesh, choice: str, kind: str) -> Elements:
    """Return the nodes [mm] and cells that a choice of `solve.housing.element_study` has on a mesh, as a peer's kind.

    A cell that is inside out is turned: CalculiX needs a positive volume.
    """
    basis = element_basis(mesh, choice)
    numbers, cells = np.unique(np.asarray(basis.element_dofs)[2::3], return_inverse=True)
    cells = cells.reshape(len(_NODES[kind]), -1)
    nodes = np.asarray(basis.doflocs)[:, numbers]
    element = cKDTree(np.asarray(basis.elem.doflocs)[2::3])
    straight, turned = (cells[element.query(_NODES[kind][:, axes])[1]] for axes in ([0, 1, 2], [1, 0, 2]))
    first, *others = (nodes[:, straight[corner]] for corner in _AXES[len(cells)])
    inside_out = np.linalg.det(np.stack([(corner - first).T for corner in others], axis=1)) < 0.0
    return Elements(nodes=nodes, cells=np.where(inside_out, turned, straight).T, kind=kind)


def boundary_sets(elements: Elements, mesh: SkfemMesh, choice: str, names: Sequence[str]) -> dict[str, Ints]:
    """Return the node numbers of named boundaries of a mesh, each of shape (nodes,)."""
    return {name: elements.at(boundary_places(mesh, choice, name)) for name in names}


def calculix(
    elements: Elements, sets: Mapping[str, Ints], E: float, poisson: float, steps: Sequence[LinearStep], asked: str
) -> tuple[list[StepResult], float]:
    """Return CalculiX's answer to linear static steps [N, mm from E in MPa], and its CPU seconds [s].

    The displacements are those of the set `asked`. Raises SolveError when the program is absent, stops, prints an
    error, or its reactions do not balance.
    """
    program = shutil.which("ccx")
    if program is None:
        msg = "CalculiX = absent: the program ccx must be on the path; install it (Debian: calculix-ccx)"
        raise SolveError(msg)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        supports = {f"support{number}": _support(step, sets) for number, step in enumerate(steps)}
        with (folder / "scene.inp").open("w", encoding="ascii") as file:
            _write_model(file, elements, {**sets, **supports}, E, poisson)
            for support, step in zip(supports, steps, strict=True):
                _write_step(file, step, support, asked)
        (folder / "scene.dat").touch()
        usage = resource_usage([program, "-i", "scene"], folder, ONE_THREAD)
        text = (folder / "scene.dat").read_text(encoding="ascii")
    error = re.search(r"\*ERROR.*", usage.out)
    if usage.exit_code or error or "Job finished" not in usage.out:
        reason = error.group() if error else "job not finished"
        raise SolveError(_refusal(f"exit code {usage.exit_code}, {reason}"))
    return _checked_results(text, steps, elements.nodes.shape[1]), usage.cpu


def _refusal(reason: str) -> str:
    return f"CalculiX: {reason}: must finish its job with reactions that balance; look at its text"


def _write_model(file: TextIO, elements: Elements, sets: Mapping[str, Ints], E: float, poisson: float) -> None:
    """Write nodes, elements, sets and material; CalculiX reads 16 numbers of a line, and 20 characters of a number."""
    nodes = np.column_stack([np.arange(1, elements.nodes.shape[1] + 1), elements.nodes.T])
    cells = np.column_stack([np.arange(1, len(elements.cells) + 1), elements.cells + 1])
    words = np.array_split(["%d"] * cells.shape[1], range(8, cells.shape[1], 8))
    file.write("*NODE, NSET=EVERY\n")
    np.savetxt(file, nodes, "%d, %.12e, %.12e, %.12e")
    file.write(f"*ELEMENT, TYPE={elements.kind}, ELSET=SOLID\n")
    np.savetxt(file, cells, ",\n".join(", ".join(line) for line in words))
    for name, numbers in sets.items():
        file.write(f"*NSET, NSET={name.upper()}\n")
        np.savetxt(file, numbers + 1, "%d,")
    file.write(f"*MATERIAL, NAME=ONE\n*ELASTIC\n{E:.12e}, {poisson:.12e}\n")
    file.write("*SOLID SECTION, ELSET=SOLID, MATERIAL=ONE\n")


def _write_step(file: TextIO, step: LinearStep, support: str, asked: str) -> None:
    file.write("*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n")
    for name, components in step.held.items():
        file.writelines(f"{name.upper()}, {component}, {component}\n" for component in components)
    for name, shift in step.pressed.items():
        file.write(f"{name.upper()}, {VERTICAL}, {VERTICAL}, {shift:.12e}\n")
    if step.loads.any():
        loaded = np.flatnonzero(step.loads)
        file.write("*CLOAD, OP=NEW\n")
        np.savetxt(file, np.column_stack([loaded + 1, step.loads[loaded]]), f"%d, {VERTICAL}, %.12e")
    for name in (support, *step.pressed):
        file.write(f"*NODE PRINT, NSET={name.upper()}, TOTALS=ONLY\nRF\n")
    file.write(f"*NODE PRINT, NSET={asked.upper()}\nU\n*END STEP\n")


def _support(step: LinearStep, sets: Mapping[str, Ints]) -> Ints:
    """Return the nodes whose u_z is held at zero, each once: sets meet along edges."""
    held = np.concatenate([sets[name] for name, components in step.held.items() if VERTICAL in components])
    pressed = [sets[name] for name in step.pressed]
    return np.setdiff1d(held, np.concatenate(pressed) if pressed else [])


def _checked_results(text: str, steps: Sequence[LinearStep], count: int) -> list[StepResult]:
    """Return the results of each step from the text of a .dat file; displacements are the last table of a step."""
    results: list[StepResult] = []
    forces: dict[str, float] = {}
    pieces = _TABLE.split(text)[1:]
    for kind, name, body in zip(pieces[::3], pieces[1::3], pieces[2::3], strict=True):
        numbers = np.array(body.split(), dtype=np.float64)
        if kind == "total force":
            forces[name.lower()] = float(numbers[2])
        else:
            displacements = np.zeros(count)
            displacements[numbers[::4].astype(int) - 1] = numbers[3::4]
            results.append(StepResult(forces=forces, displacements=displacements))
            forces = {}
    if len(results) != len(steps):
        raise SolveError(_refusal(f"{len(results)} tables of results for {len(steps)} steps"))
    for result, step in zip(results, steps, strict=True):
        _check_balance(result.forces, step)
    return results


def _check_balance(forces: Mapping[str, float], step: LinearStep) -> None:
    """Raise SolveError unless the support carries what presses."""
    support = sum(value for name, value in forces.items() if name.startswith("support"))
    pressed = float(step.loads.sum()) + sum(forces[name] for name in step.pressed)
    if not (np.isfinite(pressed) and pressed != 0.0 and abs(pressed + support) <= BALANCE_LIMIT * abs(pressed)):
        raise SolveError(_refusal(f"{pressed:.6g} N pressed, {support:.6g} N carried"))
