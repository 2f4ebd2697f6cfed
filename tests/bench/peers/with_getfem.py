"""A deck by GetFEM: its elements, its assembly, its direct solver MUMPS. `with_getfem.py deck TASK.npz`."""

import sys

import getfem
import numpy as np
from deck import REFERENCE, Clock, read_deck
from scipy.spatial import cKDTree

# Geometry, element and quadrature; an underintegrated element of 20 nodes has two Gauss points along each axis.
KINDS = {
    "C3D10": ("GT_PK(3,2)", "FEM_PK(3,2)", "IM_TETRAHEDRON(2)"),
    "C3D20R": ("GT_Q2_INCOMPLETE(3)", "FEM_Q2_INCOMPLETE(3)", "IM_GAUSS_PARALLELEPIPED(3,3)"),
    "C3D20": ("GT_Q2_INCOMPLETE(3)", "FEM_Q2_INCOMPLETE(3)", "IM_GAUSS_PARALLELEPIPED(3,5)"),
}


def elements(deck):
    """Return mesh, elements and quadrature of the deck, and the node of the deck at each node of the elements."""
    geometry, fem, rule = KINDS[deck.kind]
    order = np.lexsort(np.array(REFERENCE[deck.cells.shape[1]]).T)
    mesh = getfem.Mesh("empty", 3)
    mesh.add_convex(getfem.GeoTrans(geometry), np.asfortranarray(deck.nodes[deck.cells[:, order]].transpose(2, 1, 0)))
    displacement = getfem.MeshFem(mesh, 3)
    displacement.set_fem(getfem.Fem(fem))
    places = displacement.basic_dof_nodes()[:, ::3]
    distance, node = cKDTree(deck.nodes).query(places.T)
    if distance.max() > 1e-7:
        sys.exit(f"a node is missing by {distance.max():.1e} mm")
    return mesh, displacement, getfem.MeshIm(mesh, getfem.Integ(rule)), node


def solve(deck):
    """Return the answers to all steps."""
    mesh, displacement, rule, node = elements(deck)
    data = getfem.MeshFem(mesh, 1)
    data.set_fem(getfem.Fem("FEM_PK(3,0)" if deck.kind == "C3D10" else "FEM_QK(3,0)"))
    ones = np.ones(data.nbdof())
    first = deck.E * deck.poisson / ((1.0 + deck.poisson) * (1.0 - 2.0 * deck.poisson))
    shear = 0.5 * deck.E / (1.0 + deck.poisson)
    K = getfem.asm_linear_elasticity(rule, displacement, data, first * ones, shear * ones)
    count = displacement.nbdof()
    place = np.empty(len(deck.nodes), dtype=int)
    place[node] = np.arange(len(node))
    answers = []
    for step in deck.steps:
        dofs, values = deck.prescribed(step)
        fixed = 3 * place[dofs // 3] + dofs % 3
        free = np.setdiff1d(np.arange(count), fixed)
        loads = np.zeros(count)
        loads[3 * place[np.arange(len(step.loads))] + 2] = step.loads
        u = np.zeros(count)
        u[fixed] = values
        right = (loads - K.mult(u))[free]
        u[free] = np.ravel(getfem.linsolve_mumps(getfem.Spmat("copy", K, free, free), right))
        reaction = K.mult(u) - loads
        answers.append(deck.answer_of(step, u.reshape(-1, 3)[place], reaction.reshape(-1, 3)[place]))
    return count, answers


if __name__ == "__main__":
    clock = Clock()
    clock.print_answer(*solve(read_deck(sys.argv[2])))
