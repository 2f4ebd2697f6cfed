"""Input decks for CalculiX: linear problems with second-order elements, node sets and static steps, in N, mm and MPa.

Node numbers begin at 0 in this module and at 1 in the text of a deck, so 1 is added to every number that is written.
The nodes of the elements come first. If there are springs to the ground, the ground node follows. The last nodes
represent the mean displacements.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TextIO

import numpy as np
from scipy.sparse import csc_matrix, triu
from scipy.spatial import cKDTree

from pipeline.storage.vtu import VTK_NODES
from sensor.arrays import Flags, Floats, Ints
from solve.linear import SolveError

SAME_POSITION = 1e-7  # maximum distance of two nodes that have the same position [mm]
GROUND = "ground"
VERTICAL = 3  # number of the displacement component u_z, counted from 1 as in CalculiX
_TET_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=np.float64)
_TET_EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
# Reference coordinates of the nodes of each element type. CalculiX numbers the nodes of an element as VTK does.
_NODES = {
    "C3D10": np.vstack([_TET_CORNERS, _TET_CORNERS[_TET_EDGES].mean(axis=1)]),
    "C3D20": VTK_NODES,
    "C3D20R": VTK_NODES,
}
# Numbers of four corner nodes of a cell, keyed by the number of nodes per cell. Three edges meet at the first corner,
# and the other corners are the opposite ends of these edges.
_EDGE_ENDS = {10: (0, 1, 2, 3), 20: (0, 1, 3, 4)}
_TERMS_PER_LINE = 4  # terms of an equation that are written in one line


class Basis(Protocol):
    """The attributes of a scikit-fem displacement basis that this module uses."""

    doflocs: Floats
    element_dofs: Ints
    elem: Any

    def get_dofs(self, facets: str) -> Any:  # noqa: ANN401 - a view of scikit-fem
        """Return the degrees of freedom on a named boundary."""


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Second-order elements: `nodes` (3, n) [mm], node numbers `cells` (m, 10 or 20), and the element type `kind`."""

    nodes: Floats
    cells: Ints
    kind: str

    @property
    def count(self) -> int:
        """Return the number of nodes."""
        return int(self.nodes.shape[1])

    def at(self, positions: Floats) -> Ints:
        """Return the numbers of the nodes at `positions` (3, n) [mm]; raises SolveError if one has no node."""
        distance, index = cKDTree(self.nodes.T).query(positions.T)
        farthest = float(np.max(distance))
        if not farthest <= SAME_POSITION:
            msg = f"deck: the nearest node is {farthest:.1e} mm from its position; check the element type"
            raise SolveError(msg)
        return np.asarray(index, dtype=np.int64)

    def nodal_values(self, basis: Basis, values: Floats) -> Floats:
        """Return the `values` (dofs,) at vertical degrees of freedom as values at the nodes (nodes,).

        The value is 0 at a node without such a degree of freedom.
        """
        dofs = np.flatnonzero(values)
        nodes = self.at(basis.doflocs[:, dofs])
        return np.asarray(np.bincount(nodes, values[dofs], minlength=self.count), dtype=np.float64)


def elements_of(basis: Basis, kind: str) -> Elements:
    """Convert the nodes [mm] and cells of a scikit-fem displacement basis to elements of CalculiX's type `kind`.

    The nodes of inverted cells are reordered, because CalculiX requires elements of positive volume.
    """
    # A node has three consecutive degrees of freedom: u_x, u_y and u_z. The slice [2::3] selects u_z, which identifies
    # the node here.
    vertical_dofs, node_numbers = np.unique(np.asarray(basis.element_dofs)[2::3], return_inverse=True)
    cells = node_numbers.reshape(len(_NODES[kind]), -1)  # (nodes of a cell, cells)
    nodes = np.asarray(basis.doflocs)[:, vertical_dofs]
    # CalculiX's node order follows from the positions in the reference cell. Each query returns, for every node of
    # CalculiX, the number of scikit-fem's node at the same position. Swapping x and y yields the node order of a
    # mirrored cell.
    reference_nodes = cKDTree(np.asarray(basis.elem.doflocs)[2::3])
    _, regular_order = reference_nodes.query(_NODES[kind])
    _, mirrored_order = reference_nodes.query(_NODES[kind][:, [1, 0, 2]])
    regular, mirrored = cells[regular_order], cells[mirrored_order]
    is_inverted = _are_inverted(nodes, regular)
    return Elements(nodes=nodes, cells=np.where(is_inverted, mirrored, regular).T, kind=kind)


def _are_inverted(nodes: Floats, cells: Ints) -> Flags:
    """Return for each cell whether its volume is negative in this node order, shape (cells,).

    `nodes` (3, n) are positions [mm], and `cells` (nodes of a cell, cells) are node numbers.
    """
    corner, *edge_ends = (nodes[:, cells[node]] for node in _EDGE_ENDS[len(cells)])
    # The triple product of the three edges at one corner has the sign of the volume.
    edges = np.stack([(end - corner).T for end in edge_ends], axis=1)  # (cells, edges, 3)
    return np.asarray(np.linalg.det(edges) < 0.0)


def boundary_sets(elements: Elements, basis: Basis, names: Sequence[str]) -> dict[str, Ints]:
    """Return the node numbers (nodes,) on each named boundary of the mesh of `basis`, keyed by name."""
    return {name: elements.at(basis.doflocs[:, basis.get_dofs(name).all("u^3")]) for name in names}


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One static step of a deck.

    For each node set, `held` lists the displacement components that are held at zero, from 1 for x to 3 for z, and
    `pressed` holds the prescribed u_z [mm]. `loads` (nodes,) are the forces along z [N].
    """

    held: Mapping[str, Sequence[int]]
    pressed: Mapping[str, float] = field(default_factory=dict)
    loads: Floats = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Deck:
    """A body of one material with modulus `E` [MPa], its node sets and its load steps.

    `springs` is an additional stiffness matrix (3 nodes, 3 nodes) [N/mm] that does not couple the axes. All springs to
    the ground end at one node, which the node set `ground` must contain. A mean is an additional node whose u_z is a
    weighted sum of the u_z of the body. `means` holds the weights (nodes,) [1] of each mean, keyed by its name. Each
    step prints the displacements of the means and of the node set `printed_set`.
    """

    elements: Elements
    sets: Mapping[str, Ints]
    E: float
    poisson: float
    steps: Sequence[LinearStep]
    springs: csc_matrix | None = None
    means: Mapping[str, Floats] = field(default_factory=dict)
    printed_set: str | None = None

    @property
    def mean_nodes(self) -> dict[str, int]:
        """Return the node number of each mean, keyed by its name."""
        first = self.elements.count + self._ground_count
        return {name: first + number for number, name in enumerate(self.means)}

    @property
    def _ground_count(self) -> int:
        """Return the number of ground nodes: 1 if the deck has springs, else 0."""
        return 0 if self.springs is None else 1

    @property
    def node_count(self) -> int:
        """Return the number of all nodes, including the ground and the means."""
        return self.elements.count + self._ground_count + len(self.means)

    @property
    def printed(self) -> tuple[str, ...]:
        """Return the names of the node sets whose displacements are printed in each step."""
        names = tuple(self.means)
        return names if self.printed_set is None else (*names, self.printed_set)

    def text(self, heading: Sequence[str] = ()) -> str:
        """Return the text of the deck, which begins with the lines of `heading` as comments."""
        file = io.StringIO()
        file.writelines(f"** {line}\n" for line in heading)
        # Each step has a further node set, because its total reaction is the force that the supports carry.
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
    """Write all nodes of a deck: the nodes of the elements, the ground node at the origin, and the nodes of the means.

    The position of a mean is the weighted mean of the positions of its nodes. Numbers have at most 20 characters,
    because CalculiX does not read more.
    """
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
    """Write the elements, node sets and material of a deck.

    `sets` are the node numbers of all sets, keyed by name, including the supports of the steps.
    """
    elements = deck.elements
    cells = np.column_stack([np.arange(1, len(elements.cells) + 1), elements.cells + 1])
    # The numbers of a cell are written in lines of 8, because CalculiX reads at most 16 numbers per line.
    line_formats = np.array_split(["%d"] * cells.shape[1], range(8, cells.shape[1], 8))
    file.write(f"*ELEMENT, TYPE={elements.kind}, ELSET=SOLID\n")
    np.savetxt(file, cells, ",\n".join(", ".join(line_format) for line_format in line_formats))
    for name, numbers in sets.items():
        file.write(f"*NSET, NSET={name.upper()}\n")
        np.savetxt(file, numbers + 1, "%d,")
    file.write(f"*MATERIAL, NAME=ONE\n*ELASTIC\n{deck.E:.12e}, {deck.poisson:.12e}\n")
    file.write("*SOLID SECTION, ELSET=SOLID, MATERIAL=ONE\n")


def _write_springs(file: TextIO, matrix: csc_matrix, elements: Elements) -> None:
    """Write the stiffness matrix of a deck [N/mm] as springs along each axis.

    `elements` are the elements of the deck, after which the springs are numbered. Springs with stiffnesses that agree
    to six digits share a card, because a card of CalculiX holds only one stiffness.
    """
    number = len(elements.cells)  # element number of the previous spring, counted from 1
    for axis in range(3):
        springs = _springs_along(matrix[axis::3, axis::3], elements.count)  # only the displacements along this axis
        cards: dict[str, list[str]] = {}  # the lines of the springs, keyed by their stiffness as text
        for first, second, stiffness in springs:
            number += 1
            cards.setdefault(f"{stiffness:.5e}", []).append(f"{number}, {first + 1}, {second + 1}\n")
        for card, (stiffness_text, lines) in enumerate(cards.items(), start=1):
            name = f"AXIS{axis + 1}_{card}"
            file.write(f"*ELEMENT, TYPE=SPRING2, ELSET={name}\n")
            file.writelines(lines)
            file.write(f"*SPRING, ELSET={name}\n{axis + 1}, {axis + 1}\n{stiffness_text}\n")


def _springs_along(matrix: csc_matrix, ground: int) -> list[tuple[int, int, float]]:
    """Return the springs along one axis, each as the numbers of its two nodes and its stiffness [N/mm].

    `matrix` (nodes, nodes) [N/mm] is the stiffness matrix along this axis, and `ground` is the number of the ground
    node. The spring between two nodes has the negative of their matrix entry as its stiffness. The spring from a node
    to the ground has the sum of the node's row as its stiffness.
    """
    upper = triu(matrix, 1).tocoo()  # each pair of nodes only once
    node_springs = zip(upper.row.tolist(), upper.col.tolist(), (-upper.data).tolist(), strict=True)
    ground_stiffness = np.asarray(matrix.sum(axis=1)).ravel()
    nodes = np.unique(matrix.tocoo().row).tolist()
    ground_springs = ((node, ground, ground_stiffness[node]) for node in nodes)
    return [*node_springs, *ground_springs]


def _write_mean(file: TextIO, node: int, weights: Floats) -> None:
    """Write the equation that makes u_z of `node` the mean of the other nodes' u_z, with `weights` (nodes,) [1].

    CalculiX sets the sum of all terms to 0, so the term of the mean itself is negative.
    """
    terms = [(node, -1.0), *((int(body_node), float(weights[body_node])) for body_node in np.flatnonzero(weights))]
    texts = [f"{number + 1}, {VERTICAL}, {weight:.12e}" for number, weight in terms]
    lines = [", ".join(texts[first : first + _TERMS_PER_LINE]) for first in range(0, len(texts), _TERMS_PER_LINE)]
    file.write(f"*EQUATION\n{len(terms)}\n" + "\n".join(lines) + "\n")


def _write_step(file: TextIO, step: LinearStep, support: str, printed: Sequence[str]) -> None:
    """Write a step: its supports, its prescribed displacements and loads, and the output that CalculiX prints.

    `support` is the node set with u_z held at zero. The output contains the total reactions of this set and of the sets
    with a prescribed displacement, and the displacements of the sets in `printed`.
    """
    file.write("*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n")
    for name, components in step.held.items():
        file.writelines(f"{name.upper()}, {component}, {component}\n" for component in components)
    for name, displacement in step.pressed.items():
        file.write(f"{name.upper()}, {VERTICAL}, {VERTICAL}, {displacement:.12e}\n")
    if step.loads.any():
        loaded_nodes = np.flatnonzero(step.loads)
        file.write("*CLOAD, OP=NEW\n")
        np.savetxt(file, np.column_stack([loaded_nodes + 1, step.loads[loaded_nodes]]), f"%d, {VERTICAL}, %.12e")
    for name in (support, *step.pressed):
        file.write(f"*NODE PRINT, NSET={name.upper()}, TOTALS=ONLY\nRF\n")
    for name in printed:
        file.write(f"*NODE PRINT, NSET={name.upper()}\nU\n")
    file.write("*END STEP\n")


def support_nodes(step: LinearStep, sets: Mapping[str, Ints]) -> Ints:
    """Return the numbers (nodes,) of the nodes whose u_z is held at zero in a step.

    Each node is listed only once, although sets may share the nodes of an edge. A node with a prescribed u_z is not
    included.
    """
    held_nodes = np.concatenate([sets[name] for name, components in step.held.items() if VERTICAL in components])
    pressed_sets = [sets[name] for name in step.pressed]
    if not pressed_sets:
        return np.unique(held_nodes)
    return np.setdiff1d(held_nodes, np.concatenate(pressed_sets))
