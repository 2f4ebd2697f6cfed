"""Solution of a deck with felupe's assembly and SciPy's direct solver: `with_felupe.py deck TASK.npz`."""

import sys

import felupe
import numpy as np
from deck import Clock, read_deck
from stiffness_solver import StiffnessSolver

# felupe's orders of Gauss rules: two or three points along each axis.
HEXAHEDRA = {"C3D20R": 1, "C3D20": 2}


def build_region(deck):
    """Return felupe's mesh of a deck, and its elements with their quadrature."""
    if deck.kind == "C3D10":
        mesh = felupe.Mesh(deck.nodes, deck.cells, cell_type="tetra10")
        return mesh, felupe.RegionQuadraticTetra(mesh)
    mesh = felupe.Mesh(deck.nodes, deck.cells, cell_type="hexahedron20")
    rule = felupe.GaussLegendre(order=HEXAHEDRA[deck.kind], dim=3)
    return mesh, felupe.Region(mesh, element=felupe.QuadraticHexahedron(), quadrature=rule)


def solve(deck):
    """Return the number of dofs, and the answers of all steps of a deck.

    The dofs of a node are x, y and z, so the loads along z are at every third dof.
    """
    mesh, elements = build_region(deck)
    field = felupe.FieldContainer([felupe.Field(elements, dim=3)])
    body = felupe.SolidBody(umat=felupe.LinearElastic(E=deck.E, nu=deck.poisson), field=field)
    K = body.assemble.matrix().tocsr()
    solver = StiffnessSolver(K)
    answers = []
    for step in deck.steps:
        fixed, values = deck.prescribed(step)
        loads = np.zeros(3 * mesh.npoints)
        loads[2::3] = step.loads if len(step.loads) else 0.0  # the array is empty if no node is loaded
        u = solver.displacements(fixed, values, loads)
        reaction = K @ u - loads
        answers.append(deck.answer_of(step, u.reshape(-1, 3), reaction.reshape(-1, 3)))
    return 3 * mesh.npoints, answers


if __name__ == "__main__":
    clock = Clock()
    clock.print_answer(*solve(read_deck(sys.argv[2])))
