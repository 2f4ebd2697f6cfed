"""A deck by sfepy: its fields, its assembly, a direct solver of SciPy. `with_sfepy.py deck TASK.npz`."""

import sys

import numpy as np
from deck import Clock, read_deck
from scipy.spatial import cKDTree
from sfepy.base.base import output
from sfepy.discrete import Equation, Equations, FieldVariable, Integral, Material, Problem
from sfepy.discrete.fem import FEDomain, Field, Mesh
from sfepy.mechanics.matcoefs import stiffness_from_youngpoisson
from sfepy.terms import Term
from stiffness_solver import StiffnessSolver


def solve(deck):
    """Return the answers to all steps; sfepy's tetrahedra have straight edges, its hexahedra other nodes."""
    if deck.kind != "C3D10":
        sys.exit(f"{deck.kind}: sfepy has no such element")
    corners, cells = np.unique(deck.cells[:, :4], return_inverse=True)
    cells = cells.reshape(-1, 4).astype(np.int32)
    groups = np.zeros(len(corners), dtype=np.int32)
    mesh = Mesh.from_data("body", deck.nodes[corners], groups, [cells], [np.zeros(len(cells), dtype=np.int32)], ["3_4"])
    domain = FEDomain("domain", mesh)
    region = domain.create_region("Omega", "all")
    field = Field.from_args("displacement", np.float64, "vector", region, approx_order=2)
    u, v = FieldVariable("u", "unknown", field), FieldVariable("v", "test", field, primary_var_name="u")
    law = Material("law", D=stiffness_from_youngpoisson(3, deck.E, deck.poisson))
    term = Term.new("dw_lin_elastic(law.D, v, u)", Integral("i", order=2), region, law=law, v=v, u=u)
    K = assembled(term)
    solver = StiffnessSolver(K)
    node = cKDTree(field.get_coor()).query(deck.nodes)[1]
    answers = []
    for step in deck.steps:
        dofs, values = deck.prescribed(step)
        fixed = 3 * node[dofs // 3] + dofs % 3
        loads = np.zeros(K.shape[0])
        loads[3 * node[np.arange(len(step.loads))] + 2] = step.loads
        displacements = solver.displacements(fixed, values, loads)
        reaction = K @ displacements - loads
        answers.append(deck.answer_of(step, displacements.reshape(-1, 3)[node], reaction.reshape(-1, 3)[node]))
    return K.shape[0], answers


def assembled(term):
    """Return the matrix of a term on all dofs."""
    problem = Problem("body", equations=Equations([Equation("balance", term)]), active_only=False)
    problem.time_update()
    problem.update_materials()
    return problem.equations.evaluate(mode="weak", dw_mode="matrix", asm_obj=problem.mtx_a).tocsr()


if __name__ == "__main__":
    output.set_output(quiet=True)
    clock = Clock()
    clock.print_answer(*solve(read_deck(sys.argv[2])))
