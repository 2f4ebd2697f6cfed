"""Linear problems as CalculiX decks: quadratic elements, named sets of nodes, static steps; N, mm, MPa.

Node numbers begin with 0 here and with 1 in the text. After the nodes of the elements come the ground node, if springs
lead to it, and one node for each mean.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TextIO

import numpy as np
from scipy.sparse import csc_matrix, triu
from scipy.spatial import cKDTree

from pipeline.storage.vtu import VTK_NODES
from sensor.arrays import Floats, Ints
from solve.linear import SolveError

SAME_POSITION = 1e-7  # [mm]
GROUND = "ground"
VERTICAL = 3  # the third component, u_z
_TET_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=np.float64)
_TET_EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
# CalculiX numbers the nodes of an element as VTK does.
_NODES = {
    "C3D10": np.vstack([_TET_CORNERS, _TET_CORNERS[_TET_EDGES].mean(axis=1)]),
    "C3D20": VTK_NODES,
    "C3D20R": VTK_NODES,
}
_AXES = {10: (0, 1, 2, 3), 20: (0, 1, 3, 4)}  # a corner, and the ends of its edges
_TERMS_A_LINE = 4  # terms of an equation in one line


class Basis(Protocol):
    """The used part of a scikit-fem basis of displacements."""

    doflocs: Floats
    element_dofs: Ints
    elem: Any

    def get_dofs(self, facets: str) -> Any:  # noqa: ANN401 - a view of scikit-fem
        """Return the dofs on a named boundary."""


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Quadratic elements: nodes (3, n) [mm], node numbers (m, 10 or 20), element type of CalculiX."""

    nodes: Floats
    cells: Ints
    kind: str

    @property
    def count(self) -> int:
        """Return the number of nodes."""
        return int(self.nodes.shape[1])

    def at(self, positions: Floats) -> Ints:
        """Return the numbers of the nodes at positions, shape (3, n) [mm]; raises SolveError if there is none."""
        distance, index = cKDTree(self.nodes.T).query(positions.T)
        farthest = float(np.max(distance))
        if not farthest <= SAME_POSITION:
            msg = f"deck: a node is missing by {farthest:.1e} mm: must be at its position; check the element type"
            raise SolveError(msg)
        return np.asarray(index, dtype=np.int64)

    def of_dofs(self, basis: Basis, values: Floats) -> Floats:
        """Return the values of vertical dofs (dofs,) at the nodes (nodes,), 0 at other nodes."""
        dofs = np.flatnonzero(values)
        nodes = self.at(basis.doflocs[:, dofs])
        return np.asarray(np.bincount(nodes, values[dofs], minlength=self.count), dtype=np.float64)


def elements_of(basis: Basis, kind: str) -> Elements:
    """Return the nodes [mm] and cells of a basis of displacements as CalculiX elements of a kind.

    Inverted cells are turned, because CalculiX needs a positive volume.
    """
    # The third dof of a node, its u_z, represents the node.
    numbers, cells = np.unique(np.asarray(basis.element_dofs)[2::3], return_inverse=True)
    cells = cells.reshape(len(_NODES[kind]), -1)
    nodes = np.asarray(basis.doflocs)[:, numbers]
    # The order of CalculiX's nodes in a cell is found by their positions in the reference cell; exchanging x and y
    # there turns the cell.
    in_reference_cell = cKDTree(np.asarray(basis.elem.doflocs)[2::3])
    straight, turned = (cells[in_reference_cell.query(_NODES[kind][:, axes])[1]] for axes in ([0, 1, 2], [1, 0, 2]))
    first, *others = (nodes[:, straight[corner]] for corner in _AXES[len(cells)])
    inside_out = np.linalg.det(np.stack([(corner - first).T for corner in others], axis=1)) < 0.0
    return Elements(nodes=nodes, cells=np.where(inside_out, turned, straight).T, kind=kind)


def boundary_sets(elements: Elements, basis: Basis, names: Sequence[str]) -> dict[str, Ints]:
    """Return the node numbers of named boundaries of a basis' mesh, each of shape (nodes,)."""
    return {name: elements.at(basis.doflocs[:, basis.get_dofs(name).all("u^3")]) for name in names}


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One static step: held components by node set, prescribed u_z by node set [mm], forces along z (nodes,) [N]."""

    held: Mapping[str, Sequence[int]]
    pressed: Mapping[str, float] = field(default_factory=dict)
    loads: Floats = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Deck:
    """A body of one material with its sets of nodes, E [MPa], and load steps.

    `springs` is an additional stiffness matrix [N/mm], shape (3 nodes, 3 nodes), without coupling between axes. Springs
    to the ground end at one node, which must be the set `ground`. A mean is a node whose u_z is a weighted sum, with
    weights (nodes,) [1], of the body's u_z. Each step prints the displacements of the means and of the set `asked`.
    """

    elements: Elements
    sets: Mapping[str, Ints]
    E: float
    poisson: float
    steps: Sequence[LinearStep]
    springs: csc_matrix | None = None
    means: Mapping[str, Floats] = field(default_factory=dict)
    asked: str | None = None

    @property
    def mean_nodes(self) -> dict[str, int]:
        """Return the number of the node of each mean."""
        first = self.elements.count + (self.springs is not None)
        return {name: first + number for number, name in enumerate(self.means)}

    @property
    def node_count(self) -> int:
        """Return the number of all nodes, including ground and means."""
        return self.elements.count + (self.springs is not None) + len(self.means)

    @property
    def printed(self) -> tuple[str, ...]:
        """Return the names of the sets whose displacements each step prints."""
        return (*self.means, *(() if self.asked is None else (self.asked,)))

    def text(self, heading: Sequence[str] = ()) -> str:
        """Return the deck in N, mm and MPa, with the lines of a heading as comments."""
        file = io.StringIO()
        file.writelines(f"** {line}\n" for line in heading)
        supports = {f"support{number}": support_nodes(step, self.sets) for number, step in enumerate(self.steps)}
        _write_nodes(file, self)
        _write_body(file, self, {**self.sets, **supports})
        if self.springs is not None:
            _write_springs(file, self.springs, self.elements)
        for name, node in self.mean_nodes.items():
            _write_mean(file, node, self.means[name])
        for support, step in zip(supports, self.steps, strict=True):
            _write_step(file, step, support, self.printed)
        return file.getvalue()


def _write_nodes(file: TextIO, deck: Deck) -> None:
    """Write all nodes, a mean at the centre of its face; CalculiX reads 20 characters of a number."""
    positions = deck.elements.nodes.T
    nodes = np.column_stack([np.arange(1, len(positions) + 1), positions])
    file.write("*NODE, NSET=EVERY\n")
    np.savetxt(file, nodes, "%d, %.12e, %.12e, %.12e")
    if deck.springs is not None:
        file.write(f"*NODE\n{deck.elements.count + 1}, 0.0, 0.0, 0.0\n")
    for name, number in deck.mean_nodes.items():
        x, y, z = (deck.means[name] @ positions).tolist()
        file.write(f"*NODE, NSET={name.upper()}\n{number + 1}, {x:.12e}, {y:.12e}, {z:.12e}\n")


def _write_body(file: TextIO, deck: Deck, sets: Mapping[str, Ints]) -> None:
    """Write elements, sets and material; CalculiX reads 16 numbers per line."""
    elements = deck.elements
    cells = np.column_stack([np.arange(1, len(elements.cells) + 1), elements.cells + 1])
    words = np.array_split(["%d"] * cells.shape[1], range(8, cells.shape[1], 8))
    file.write(f"*ELEMENT, TYPE={elements.kind}, ELSET=SOLID\n")
    np.savetxt(file, cells, ",\n".join(", ".join(line) for line in words))
    for name, numbers in sets.items():
        file.write(f"*NSET, NSET={name.upper()}\n")
        np.savetxt(file, numbers + 1, "%d,")
    file.write(f"*MATERIAL, NAME=ONE\n*ELASTIC\n{deck.E:.12e}, {deck.poisson:.12e}\n")
    file.write("*SOLID SECTION, ELSET=SOLID, MATERIAL=ONE\n")


def _write_springs(file: TextIO, matrix: csc_matrix, elements: Elements) -> None:
    """Write springs along each axis for a stiffness matrix [N/mm]; springs that agree to six digits share a card.

    The spring between two nodes is the negative of their entry in the matrix. The sum of a row is the spring from its
    node to the ground.
    """
    number = len(elements.cells)
    for axis in range(3):
        of_axis = matrix[axis::3, axis::3]
        between = triu(of_axis, 1).tocoo()
        ends = zip(between.row.tolist(), between.col.tolist(), (-between.data).tolist(), strict=True)
        to_ground = np.asarray(of_axis.sum(axis=1)).ravel()
        held = np.unique(of_axis.tocoo().row).tolist()
        springs = [*ends, *((node, elements.count, to_ground[node]) for node in held)]
        cards: dict[str, list[str]] = {}
        for first, second, stiffness in springs:
            number += 1
            cards.setdefault(f"{stiffness:.5e}", []).append(f"{number}, {first + 1}, {second + 1}\n")
        for card, (stiffness, lines) in enumerate(cards.items(), start=1):
            name = f"AXIS{axis + 1}_{card}"
            file.write(f"*ELEMENT, TYPE=SPRING2, ELSET={name}\n")
            file.writelines(lines)
            file.write(f"*SPRING, ELSET={name}\n{axis + 1}, {axis + 1}\n{stiffness}\n")


def _write_mean(file: TextIO, node: int, weights: Floats) -> None:
    """Write the equation of a node's u_z as the weighted mean [1] of others."""
    terms = [(node, -1.0), *((int(one), float(weights[one])) for one in np.flatnonzero(weights))]
    words = [f"{one + 1}, {VERTICAL}, {weight:.12e}" for one, weight in terms]
    lines = [", ".join(words[first : first + _TERMS_A_LINE]) for first in range(0, len(words), _TERMS_A_LINE)]
    file.write(f"*EQUATION\n{len(terms)}\n" + "\n".join(lines) + "\n")


def _write_step(file: TextIO, step: LinearStep, support: str, printed: Sequence[str]) -> None:
    """Write a step: supports, prescribed displacements and loads, then the output of reactions and displacements."""
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
    for name in printed:
        file.write(f"*NODE PRINT, NSET={name.upper()}\nU\n")
    file.write("*END STEP\n")


def support_nodes(step: LinearStep, sets: Mapping[str, Ints]) -> Ints:
    """Return the nodes (nodes,) whose u_z is held at zero, each once, because sets meet along edges."""
    held = np.concatenate([sets[name] for name, components in step.held.items() if VERTICAL in components])
    pressed = [sets[name] for name in step.pressed]
    return np.setdiff1d(held, np.concatenate(pressed) if pressed else [])
