"""Scenes as input decks of CalculiX: quadratic elements, sets of nodes, linear steps; N, mm, MPa."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TextIO

import numpy as np
from scipy.spatial import cKDTree
from skfem import ElementTetP2

from pipeline.storage.vtu import VTK_NODES
from reference.direct_fruit import FACES, MIDDLE, SIDE
from reference.element_study import boundary_places, element_basis, face_load
from sensor.arrays import Floats, Ints
from solve.housing.stiffness import SPRINGS, tip_face
from solve.linear import SolveError

SkfemMesh = Any

SAME_POSITION = 1e-7  # [mm]
# CalculiX numbers the nodes of an element as VTK does.
_NODES = {
    "C3D10": ElementTetP2().doflocs,
    "C3D20": VTK_NODES,
    "C3D20R": VTK_NODES,
}
_AXES = {10: (0, 1, 2, 3), 20: (0, 1, 3, 4)}  # a corner, and the ends of its edges


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Quadratic elements for a peer: nodes (3, n) [mm], node numbers (m, 10 or 20), element type of CalculiX."""

    nodes: Floats
    cells: Ints
    kind: str

    def at(self, positions: Floats) -> Ints:
        """Return the numbers of the nodes at positions, shape (3, n) [mm]; raises SolveError where there is none."""
        distance, index = cKDTree(self.nodes.T).query(positions.T)
        farthest = float(np.max(distance))
        if not farthest <= SAME_POSITION:
            msg = f"peer mesh: a node is missing by {farthest:.1e} mm: must be at its position; check the element type"
            raise SolveError(msg)
        return np.asarray(index, dtype=np.int64)


def peer_elements(mesh: SkfemMesh, choice: str, kind: str) -> Elements:
    """Return the nodes [mm] and cells that a choice of `reference.element_study` has on a mesh, as a peer's kind.

    A cell that is inside out is turned: CalculiX needs a positive volume.
    """
    basis = element_basis(mesh, choice)
    # Of the three dofs of a node the third, its u_z, stands for the node.
    numbers, cells = np.unique(np.asarray(basis.element_dofs)[2::3], return_inverse=True)
    cells = cells.reshape(len(_NODES[kind]), -1)
    nodes = np.asarray(basis.doflocs)[:, numbers]
    # The nodes of a cell in the peer's order, found by their positions in the reference cell; with x and y of that
    # exchanged the cell is turned.
    in_reference_cell = cKDTree(np.asarray(basis.elem.doflocs)[2::3])
    straight, turned = (cells[in_reference_cell.query(_NODES[kind][:, axes])[1]] for axes in ([0, 1, 2], [1, 0, 2]))
    first, *others = (nodes[:, straight[corner]] for corner in _AXES[len(cells)])
    inside_out = np.linalg.det(np.stack([(corner - first).T for corner in others], axis=1)) < 0.0
    return Elements(nodes=nodes, cells=np.where(inside_out, turned, straight).T, kind=kind)


def boundary_sets(elements: Elements, mesh: SkfemMesh, choice: str, names: Sequence[str]) -> dict[str, Ints]:
    """Return the node numbers of named boundaries of a mesh, each of shape (nodes,)."""
    return {name: elements.at(boundary_places(mesh, choice, name)) for name in names}


VERTICAL = 3  # components count from 1


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One static step: held components by node set, prescribed u_z by node set [mm], forces along z (nodes,) [N]."""

    held: Mapping[str, Sequence[int]]
    pressed: Mapping[str, float] = field(default_factory=dict)
    loads: Floats = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Deck:
    """A body of one material with its sets of nodes, E [MPa], and the steps that load it.

    The displacements of the set `asked` are printed in each step.
    """

    elements: Elements
    sets: Mapping[str, Ints]
    E: float
    poisson: float
    steps: Sequence[LinearStep]
    asked: str

    def text(self, heading: Sequence[str] = ()) -> str:
        """Return the deck, N, mm and MPa, with lines of a heading as comments before it."""
        file = io.StringIO()
        file.writelines(f"** {line}\n" for line in heading)
        supports = {f"support{number}": support_nodes(step, self.sets) for number, step in enumerate(self.steps)}
        write_model(file, self.elements, {**self.sets, **supports}, self.E, self.poisson)
        for support, step in zip(supports, self.steps, strict=True):
            _write_step(file, step, support, self.asked)
        return file.getvalue()


def write_model(file: TextIO, elements: Elements, sets: Mapping[str, Ints], E: float, poisson: float) -> None:
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
    """Write a step: what is held, prescribed and loaded, then reactions and the displacements of the set asked for."""
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


def support_nodes(step: LinearStep, sets: Mapping[str, Ints]) -> Ints:
    """Return the nodes (nodes,) whose u_z is held at zero, each once: sets meet along edges."""
    held = np.concatenate([sets[name] for name, components in step.held.items() if VERTICAL in components])
    pressed = [sets[name] for name in step.pressed]
    return np.setdiff1d(held, np.concatenate(pressed) if pressed else [])


TETRAHEDRA = ("tet P2", "C3D10")
HEXAHEDRA = ("hex 20, reduced", "C3D20R")
HELD_HALF = {"mounting_holes": (1, 2, 3), "symmetry": (2,)}


@dataclass(frozen=True, kw_only=True, eq=False)
class FlexureDeck:
    """The deck of the half housing with half a newton on each tip in turn, and the forces of 1 N by tip (nodes,) [N].

    The mean displacement of a tip's face is the product of displacements with the forces of 1 N.
    """

    deck: Deck
    forces: tuple[Floats, ...]


def flexure_deck(mesh: SkfemMesh, choice: str, kind: str, E: float, poisson: float) -> FlexureDeck:
    """Return the deck of the half housing y >= 0 [mm], its holes held, E [MPa].

    `choice` names the element of `reference.element_study` whose nodes and loads are taken, `kind` that of
    CalculiX. Raises SolveError where they do not fit.
    """
    elements = peer_elements(mesh, choice, kind)
    sets = boundary_sets(elements, mesh, choice, tuple(HELD_HALF))
    faces = [face_load(mesh, choice, tip) for tip in map(tip_face, SPRINGS)]
    count = elements.nodes.shape[1]
    forces = tuple(
        np.asarray(np.bincount(elements.at(face.places), face.forces, minlength=count), dtype=np.float64)
        for face in faces
    )
    sets["tips"] = np.flatnonzero(np.any(forces, axis=0))
    # Half the force on half the part.
    steps = [LinearStep(held=HELD_HALF, loads=np.asarray(0.5 * force)) for force in forces]
    return FlexureDeck(
        deck=Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, asked="tips"), forces=forces
    )


def contact_deck(mesh: SkfemMesh, E: float, poisson: float, shift: float) -> Deck:
    """Return the deck of the fruit [mm] under its rigid flat tips, whose u_z is prescribed [mm], E [MPa].

    The mesh is of the quarter x, y >= 0, of the half y >= 0 or of the whole, told by its boundaries. On a quarter the
    tips press alike in the first step, and against each other in the second; else one tip presses in each step.
    """
    boundaries = mesh.boundaries or {}
    tips = tuple(name for name in FACES if name in boundaries)
    planes = tuple(name for name in (SIDE, MIDDLE) if name in boundaries)
    elements = peer_elements(mesh, *TETRAHEDRA)
    sets = boundary_sets(elements, mesh, TETRAHEDRA[0], ("base", *planes, *tips))
    held = {"base": (1, 2, 3)} | ({SIDE: (2,)} if SIDE in planes else {})
    if MIDDLE in planes:
        pressed = {tips[-1]: shift}
        steps = [LinearStep(held={**held, MIDDLE: fixed}, pressed=pressed) for fixed in ((1,), (2, 3))]
    else:
        steps = [LinearStep(held=held, pressed={tip: shift if tip == one else 0.0 for tip in tips}) for one in tips]
    return Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, asked=tips[-1])
