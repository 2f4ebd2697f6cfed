"""The format of tasks and answers that the benchmarks and a peer exchange.

The peer's own interpreter runs this file, so it needs only numpy. A task is a file of arrays in N, mm and MPa. A task
with a mesh has `nodes` (n, 3), `cells` (m, k) in the order of VTK, and the node numbers of each set as `set NAME`. Each
step has the held components and the prescribed u_z by set, and forces along z (n,).
"""

import json
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

VERTICAL = 3  # number of the component along z; components are counted from 1
_TETRA = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_HEXA = tuple((x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
_TETRA_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_HEXA_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
# Local coordinates of the nodes in a cell of 10 or 20 nodes, in the order of VTK.
REFERENCE = {
    len(corners) + len(edges): [
        *corners,
        *(tuple(0.5 * (a + b) for a, b in zip(corners[i], corners[j], strict=True)) for i, j in edges),
    ]
    for corners, edges in ((_TETRA, _TETRA_EDGES), (_HEXA, _HEXA_EDGES))
}
# The corners of each face of a cell.
FACES = {
    4: ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)),
    8: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


@dataclass(frozen=True)
class Step:
    """A load step: held components and prescribed u_z [mm] by set, forces along z (nodes,) [N], and the support set.

    Components are counted from 1. `loads` is empty if no node is loaded.
    """

    held: dict
    pressed: dict
    loads: np.ndarray
    support: str


@dataclass(frozen=True)
class Deck:
    """A body of one material, with node sets and load steps.

    `kind` is the CalculiX type of the elements. The answer has the displacements of the node set `printed_set`.
    """

    nodes: np.ndarray
    cells: np.ndarray
    kind: str
    E: float
    poisson: float
    sets: dict
    steps: list
    printed_set: str
    plane: tuple = (0.0, 0.0)  # height at x = 0 of the plane of rigid tips [mm], and its slope along x

    def prescribed(self, step):
        """Return the numbers of the dofs with prescribed displacements, in increasing order, and their values [mm].

        The number of a dof is 3 * node + axis, with the axes 0 to 2. Components are counted from 1 instead.
        """
        values = {}
        for name, components in step.held.items():
            for component in components:
                values |= {3 * int(node) + component - 1: 0.0 for node in self.sets[name]}
        for name, shift in step.pressed.items():
            values |= {3 * int(node) + VERTICAL - 1: shift for node in self.sets[name]}
        dofs = np.array(sorted(values))
        return dofs, np.array([values[dof] for dof in dofs])

    def facets(self, name):
        """Return the corner nodes (facets, 3 or 4) of the boundary faces whose corners are all in a node set.

        A face is on the boundary if it belongs to only one cell.
        """
        corner_count = 4 if len(self.cells[0]) == 10 else 8  # a tetrahedron has 10 nodes, a hexahedron 20
        faces = np.concatenate([self.cells[:, list(face)] for face in FACES[corner_count]])
        # Sorted corners make the same face of two cells equal.
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        boundary_faces = faces[first[count == 1]]
        return boundary_faces[np.isin(boundary_faces, self.sets[name]).all(axis=1)]

    def answer_of(self, step, u, reaction):
        """Return the answer of a step from displacements `u` [mm] and reactions [N], both (nodes, 3).

        It holds the total vertical force on each pressed set and on the support, and the vertical displacements.
        """
        forces = {name: float(reaction[self.sets[name], VERTICAL - 1].sum()) for name in (*step.pressed, step.support)}
        return {"forces": forces, "displacements": u[self.sets[self.printed_set], VERTICAL - 1].tolist()}


@dataclass
class Clock:
    """The CPU time since this clock was created. Scripts create it after their imports, which are not measured."""

    start: float = field(default_factory=time.process_time)

    def print_answer(self, dofs, steps):
        """Print the answer in one line of JSON: the CPU time [s], the number of dofs and the answers of all steps."""
        print(json.dumps({"cpu": time.process_time() - self.start, "dofs": int(dofs), "steps": steps}))


def read_deck(path):
    """Return the deck that a file of arrays holds."""
    with np.load(Path(path)) as file:
        arrays = dict(file)
    scene = json.loads(str(arrays["scene"]))
    steps = [Step(**step, loads=arrays[f"loads {number}"]) for number, step in enumerate(scene.pop("steps"))]
    sets = {name.partition(" ")[2]: numbers for name, numbers in arrays.items() if name.startswith("set ")}
    return Deck(nodes=arrays["nodes"], cells=arrays["cells"], sets=sets, steps=steps, **scene)
