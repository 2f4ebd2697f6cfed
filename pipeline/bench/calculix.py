"""Other solvers on the meshes of this one: CalculiX where it is installed, and which others are absent.

CalculiX ends with exit code 0 on some failures, so its text is read and its reactions must balance.
"""

import importlib.util
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.bench.resources import ONE_THREAD, cost_of
from pipeline.storage.vtu import TETRA_EDGES, VTK_NODES
from solve.linear import SolveError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SkfemMesh = Any

PACKAGES = ("ngsolve", "felupe", "sfepy")
Z = 3  # components count from 1
BALANCE_LIMIT = 1e-5  # CalculiX prints seven digits
SAME_PLACE = 1e-7  # [mm]
_PER_LINE = 8
_MIRRORED = [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17]  # a brick seen in a mirror
# Corners, then midpoints of edges: CalculiX's order is VTK's; corners in this order span a positive volume.
_TWENTY = VTK_NODES["hexahedron27"][:20]


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Quadratic elements for a peer: nodes (3, n) [mm], node numbers (m, 10 or 20), element type of CalculiX."""

    nodes: Floats
    cells: Ints
    kind: str


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One static step: held components by node set, prescribed u_z by node set [mm], nodal forces along z [N]."""

    held: Mapping[str, Sequence[int]]
    pressed: Mapping[str, float]
    loads: Mapping[int, float]


@dataclass(frozen=True, kw_only=True)
class PeerResult:
    """What CalculiX gave: per step the total of force z by node set [N] and u_z by node of the asked sets [mm]."""

    forces: tuple[dict[str, float], ...]
    displacements: tuple[dict[int, float], ...]
    cpu: float


def absent() -> tuple[str, ...]:
    """Return the names of the peers that are not installed."""
    missing = [] if shutil.which("ccx") else ["CalculiX (ccx)"]
    return (*missing, *(name for name in PACKAGES if importlib.util.find_spec(name) is None))


def tetrahedra(mesh: SkfemMesh) -> Elements:
    """Return the ten-node tetrahedra of a straight tetrahedral mesh."""
    corners = np.asarray(mesh.t)
    p = np.asarray(mesh.p)
    a, b, c = (p[:, corners[i]] - p[:, corners[0]] for i in (1, 2, 3))
    corners = np.where(_turned(a, b, c), corners[[0, 2, 1, 3]], corners)
    edges = np.asarray(mesh.edges)
    where = {tuple(pair): p.shape[1] + i for i, pair in enumerate(np.sort(edges, axis=0).T.tolist())}
    middles = [[where[tuple(pair)] for pair in np.sort(corners[[i, j]], axis=0).T.tolist()] for i, j in TETRA_EDGES]
    nodes = np.hstack([p, 0.5 * (p[:, edges[0]] + p[:, edges[1]])])
    return Elements(nodes=nodes, cells=np.vstack([corners, np.array(middles)]).T, kind="C3D10")


def _turned(a: Floats, b: Floats, c: Floats) -> NDArray[np.bool_]:
    """Say of each cell with these edges (3, cells) from its first corner whether it is inside out."""
    return np.asarray(np.einsum("im,im->m", np.cross(a, b, axis=0), c) < 0.0)


def hexahedra(mesh: SkfemMesh, kind: str = "C3D20") -> Elements:
    """Return the twenty-node hexahedra of a quadratic (27-node) mesh; "C3D20R" integrates at eight points."""
    known = np.asarray(mesh.elem.doflocs)
    order = [int(np.argmin(np.abs(known - place).sum(axis=1))) for place in _TWENTY]
    cells = np.asarray(mesh.dofs.element_dofs)[order]
    nodes = np.asarray(mesh.doflocs)
    a, b, c = (nodes[:, cells[i]] - nodes[:, cells[0]] for i in (1, 3, 4))
    cells = np.where(_turned(a, b, c), cells[_MIRRORED], cells)
    used, compact = np.unique(cells, return_inverse=True)
    return Elements(nodes=nodes[:, used], cells=compact.reshape(cells.shape).T, kind=kind)


def node_set(elements: Elements, places: Floats) -> Ints:
    """Return the numbers of the nodes at places (3, n) [mm]; raises SolveError where a place has no node."""
    distance, index = cKDTree(elements.nodes.T).query(places.T)
    farthest = float(np.max(distance))
    if not farthest <= SAME_PLACE:
        msg = f"peer mesh: a node is missing by {farthest:.1e} mm: must be at its place; check the element type"
        raise SolveError(msg)
    return np.asarray(index, dtype=np.int64)


def calculix(
    elements: Elements, sets: Mapping[str, Ints], material: tuple[float, float], steps: Sequence[LinearStep], ask: str
) -> PeerResult:
    """Return CalculiX's answer to linear static steps; `material` is (E [MPa], nu), `ask` the set whose u_z is read.

    Raises SolveError when it is absent, stops, prints an error, or its reactions do not balance.
    """
    program = shutil.which("ccx")
    if program is None:
        msg = "CalculiX = absent: the program ccx must be on the path; install it (Debian: calculix-ccx)"
        raise SolveError(msg)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lines = _input_file(elements, sets, material, steps, ask)
        (folder / "scene.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
        cost = cost_of([program, "-i", "scene"], folder, ONE_THREAD)
        table = folder / "scene.dat"
        text = table.read_text(encoding="ascii") if table.is_file() else ""
    if cost.code or "*ERROR" in cost.out or "Job finished" not in cost.out:
        raise SolveError(_refused(f"exit code {cost.code}, {_reason(cost.out)}"))
    found = _read(text, len(steps))
    for step, (forces, _) in zip(steps, found, strict=True):
        _check_balance(forces, step)
    return PeerResult(
        forces=tuple(forces for forces, _ in found), displacements=tuple(u for _, u in found), cpu=cost.cpu
    )


def _refused(reason: str) -> str:
    return f"CalculiX: {reason}: must finish its job with reactions that balance; look at its text"


def _reason(text: str) -> str:
    return next((line.strip() for line in text.splitlines() if "*ERROR" in line), "job not finished")


def _input_file(
    elements: Elements, sets: Mapping[str, Ints], material: tuple[float, float], steps: Sequence[LinearStep], ask: str
) -> list[str]:
    lines = ["*NODE, NSET=EVERY"]
    lines += [f"{i + 1}, {_real(x)}, {_real(y)}, {_real(z)}" for i, (x, y, z) in enumerate(elements.nodes.T.tolist())]
    lines.append(f"*ELEMENT, TYPE={elements.kind}, ELSET=SOLID")
    for i, cell in enumerate(elements.cells.tolist()):
        lines += _wrapped([i + 1, *(node + 1 for node in cell)])
    for name, nodes in sets.items():
        lines += [f"*NSET, NSET={name.upper()}", *(f"{node + 1}," for node in nodes.tolist())]
    lines += ["*MATERIAL, NAME=ONE", "*ELASTIC", f"{_real(material[0])}, {_real(material[1])}"]
    lines.append("*SOLID SECTION, ELSET=SOLID, MATERIAL=ONE")
    for i, step in enumerate(steps):
        support = _support(step, sets)
        lines += [f"*NSET, NSET=SUPPORT{i}", *(f"{node + 1}," for node in support.tolist())]
    for i, step in enumerate(steps):
        lines += ["*STEP", "*STATIC", "*BOUNDARY, OP=NEW"]
        lines += [f"{name.upper()}, {k}, {k}" for name, held in step.held.items() for k in held]
        lines += [f"{name.upper()}, 3, 3, {_real(value)}" for name, value in step.pressed.items()]
        if step.loads:
            lines += ["*CLOAD, OP=NEW", *(f"{node + 1}, 3, {_real(force)}" for node, force in step.loads.items())]
        for name in (f"support{i}", *step.pressed):
            lines += [f"*NODE PRINT, NSET={name.upper()}, TOTALS=ONLY", "RF"]
        lines += [f"*NODE PRINT, NSET={ask.upper()}", "U", "*END STEP"]
    return lines


def _real(value: float) -> str:
    """Return a number in at most 20 characters, of which CalculiX reads no more."""
    return f"{value:.12e}"


def _support(step: LinearStep, sets: Mapping[str, Ints]) -> Ints:
    """Return the nodes whose u_z is held at zero, each once: sets meet along edges."""
    held = np.concatenate([sets[name] for name, components in step.held.items() if Z in components])
    pressed = [sets[name] for name in step.pressed]
    return np.setdiff1d(held, np.concatenate(pressed) if pressed else [])


def _wrapped(numbers: Sequence[int]) -> Iterable[str]:
    """Return numbers on lines of eight; a comma at the end of a line says that the next one goes on."""
    starts = [*range(0, len(numbers), _PER_LINE), len(numbers)]
    pieces = [", ".join(map(str, numbers[a:b])) for a, b in pairwise(starts)]
    return [f"{piece}," for piece in pieces[:-1]] + pieces[-1:]


def _read(text: str, steps: int) -> list[tuple[dict[str, float], dict[int, float]]]:
    """Return per step the totals of force z by set and u_z by node, from the text of a .dat file.

    The displacements are the last table that each step asks for.
    """
    found: list[tuple[dict[str, float], dict[int, float]]] = []
    name, is_force = "", True
    for line in text.splitlines():
        words = line.split()
        if "for set" in line:
            is_force, name = "force" in line, line.partition("for set")[2].split()[0].lower()
            if is_force and (not found or found[-1][1]):
                found.append(({}, {}))
        elif words and found:
            if is_force:
                found[-1][0][name] = float(words[2])
            else:
                found[-1][1][int(words[0]) - 1] = float(words[3])
    if len(found) != steps or not all(shifts for _, shifts in found):
        raise SolveError(_refused(f"{len(found)} tables of results for {steps} steps"))
    return found


def _check_balance(forces: Mapping[str, float], step: LinearStep) -> None:
    """Raise SolveError unless the support carries what presses."""
    support = sum(value for name, value in forces.items() if name.startswith("support"))
    pressed = sum(step.loads.values()) + sum(forces[name] for name in step.pressed)
    if not (np.isfinite(pressed) and pressed != 0.0 and abs(pressed + support) <= BALANCE_LIMIT * abs(pressed)):
        raise SolveError(_refused(f"{pressed:.6g} N pressed, {support:.6g} N carried"))
