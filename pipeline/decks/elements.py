"""Quadratic elements of a mesh as CalculiX numbers their nodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from pipeline.storage.vtu import VTK_NODES
from solve.arrays import Floats, Ints
from solve.housing.element_study import boundary_places, element_basis
from solve.linear import SolveError

SkfemMesh = Any

SAME_PLACE = 1e-7  # [mm]
# CalculiX numbers the nodes of an element as VTK does.
_NODES = {
    "C3D10": VTK_NODES["tetra10"],
    "C3D20": VTK_NODES["hexahedron20"],
    "C3D20R": VTK_NODES["hexahedron20"],
}
_AXES = {10: (0, 1, 2, 3), 20: (0, 1, 3, 4)}  # a corner, and the ends of its edges


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
