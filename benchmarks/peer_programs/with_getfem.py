"""Solution of a deck, or of contact with a rigid plane, by GetFEM: `with_getfem.py deck|contact TASK.npz`."""

import sys

import getfem
import numpy as np
from deck import REFERENCE, Clock, read_deck
from scipy.spatial import cKDTree

# Geometry, element and quadrature; the reduced element with 20 nodes has two Gauss points along each axis.
KINDS = {
    "C3D10": ("GT_PK(3,2)", "FEM_PK(3,2)", "IM_TETRAHEDRON(2)"),
    "C3D20R": ("GT_Q2_INCOMPLETE(3)", "FEM_Q2_INCOMPLETE(3)", "IM_GAUSS_PARALLELEPIPED(3,3)"),
    "C3D20": ("GT_Q2_INCOMPLETE(3)", "FEM_Q2_INCOMPLETE(3)", "IM_GAUSS_PARALLELEPIPED(3,5)"),
}
STIFF = 1e7  # penalty stiffness of a plane of symmetry, divided by E [1/mm]
TIP_REGION = 100  # number of the region of the pressed faces, larger than the numbers of the supports
NEAR = 1e-7  # largest distance between a node and its counterpart [mm]


def build_elements(deck):
    """Return the mesh, displacement space and quadrature of a deck, and GetFEM's number of each of its nodes.

    GetFEM numbers the nodes anew, so they are found by their positions. Ends the program if a node has no counterpart.
    """
    geometry, fem, rule = KINDS[deck.kind]
    # GetFEM orders the nodes of a cell by their local coordinates z, then y, then x.
    order = np.lexsort(np.array(REFERENCE[deck.cells.shape[1]]).T)
    cell_positions = deck.nodes[deck.cells[:, order]].transpose(2, 1, 0)  # (3, nodes of a cell, cells) [mm]
    mesh = getfem.Mesh("empty", 3)
    mesh.add_convex(getfem.GeoTrans(geometry), np.asfortranarray(cell_positions))
    displacement = getfem.MeshFem(mesh, 3)
    displacement.set_fem(getfem.Fem(fem))
    positions = displacement.basic_dof_nodes()[:, ::3]  # (3, nodes) [mm]; each node has three dofs
    distance, node = cKDTree(deck.nodes).query(positions.T)  # the nearest node of the deck to each node of GetFEM
    if distance.max() > NEAR:
        sys.exit(f"A node of GetFEM is {distance.max():.1e} mm from the nearest node of the deck, above {NEAR:g} mm.")
    number = np.empty(len(deck.nodes), dtype=int)  # the inverse of `node`
    number[node] = np.arange(len(node))
    return mesh, displacement, getfem.MeshIm(mesh, getfem.Integ(rule)), number


def lame_constants(deck):
    """Return the Lame constants lambda and mu of a deck's material [MPa]."""
    lam = deck.E * deck.poisson / ((1.0 + deck.poisson) * (1.0 - 2.0 * deck.poisson))
    return lam, 0.5 * deck.E / (1.0 + deck.poisson)


def stiffness_matrix(deck, mesh, displacement, rule):
    """Return the stiffness matrix (dofs, dofs) [N/mm] of a deck, from linear elasticity."""
    data = getfem.MeshFem(mesh, 1)  # the material is constant in each cell
    data.set_fem(getfem.Fem("FEM_PK(3,0)" if deck.kind == "C3D10" else "FEM_QK(3,0)"))
    ones = np.ones(data.nbdof())
    lam, mu = lame_constants(deck)
    return getfem.asm_linear_elasticity(rule, displacement, data, lam * ones, mu * ones)


def solve(deck):
    """Return the number of dofs, and the answers of all linear steps.

    The number of a dof is 3 * node + axis, both in the deck and in GetFEM. Only the numbers of the nodes differ.
    """
    mesh, displacement, rule, number = build_elements(deck)
    K = stiffness_matrix(deck, mesh, displacement, rule)
    count = displacement.nbdof()
    answers = []
    for step in deck.steps:
        dofs, values = deck.prescribed(step)
        fixed = 3 * number[dofs // 3] + dofs % 3
        free = np.setdiff1d(np.arange(count), fixed)
        loads = np.zeros(count)
        # Loads act along z, which is axis 2. `step.loads` is empty if no node is loaded.
        loads[3 * number[: len(step.loads)] + 2] = step.loads
        u = np.zeros(count)
        u[fixed] = values
        right = (loads - K.mult(u))[free]
        u[free] = np.ravel(getfem.linsolve_mumps(getfem.Spmat("copy", K, free, free), right))
        reaction = K.mult(u) - loads
        answers.append(deck.answer_of(step, u.reshape(-1, 3)[number], reaction.reshape(-1, 3)[number]))
    return count, answers


def solve_contact(deck):
    """Return the number of dofs, and the answer for unilateral contact with rigid tips whose faces lie in one plane.

    The contact is solved by the augmented Lagrangian of Alart and Curnier, without friction. The mesh must consist of
    tetrahedra. Ends the program if Newton's method does not converge.
    """
    (step,) = deck.steps
    mesh, displacement, rule, number = build_elements(deck)
    model = getfem.Model("real")
    model.add_fem_variable("u", displacement)
    lam, mu = lame_constants(deck)
    model.add_initialized_data("lambda", lam)
    model.add_initialized_data("mu", mu)
    model.add_isotropic_linearized_elasticity_brick(rule, "u", "lambda", "mu")
    add_supports(model, mesh, deck, step)
    add_contact(model, mesh, deck, step)
    _, converged = model.solve("max_iter", 60, "max_res", 1e-9, "lsolver", "mumps")
    if not converged:
        sys.exit("Newton's method does not converge in 60 iterations.")
    u = model.variable("u")
    reaction = stiffness_matrix(deck, mesh, displacement, rule).mult(u)
    answer = deck.answer_of(step, u.reshape(-1, 3)[number], reaction.reshape(-1, 3)[number])
    return displacement.nbdof(), [answer]


def add_contact(model, mesh, deck, step):
    """Add the contact between the pressed sets and the plane of the tips to a model."""
    height, slope = deck.plane
    scalar = getfem.MeshFem(mesh, 1)
    scalar.set_fem(getfem.Fem("FEM_PK(3,2)"))
    x, _, z = scalar.basic_dof_nodes()
    gap = (height + slope * x - z) / np.hypot(1.0, slope)  # distance along the normal of the plane [mm]
    model.add_initialized_fem_data("obstacle", scalar, gap)
    model.add_initialized_data("augmentation", 10.0 * deck.E)
    pressure = getfem.MeshFem(mesh, 1)
    pressure.set_fem(getfem.Fem("FEM_PK(3,1)"))
    mesh.set_region(TIP_REGION, np.hstack([faces_on(mesh, deck, name) for name in step.pressed]))
    model.add_filtered_fem_variable("pressure", pressure, TIP_REGION)
    rule = getfem.MeshIm(mesh, getfem.Integ("IM_TETRAHEDRON(6)"))
    option = 1  # GetFEM's number of the non-symmetric version of Alart and Curnier
    model.add_integral_contact_with_rigid_obstacle_brick(
        rule, "u", "pressure", "obstacle", "augmentation", TIP_REGION, option
    )


def add_supports(model, mesh, deck, step):
    """Add the supports to a model: clamped sets, and planes of symmetry.

    On a plane of symmetry only the normal component is held, by a penalty.
    """
    rule = getfem.MeshIm(mesh, getfem.Integ("IM_TETRAHEDRON(5)"))
    for number, (name, components) in enumerate(step.held.items(), start=1):
        mesh.set_region(number, faces_on(mesh, deck, name))
        if len(components) == 3:  # all components are held
            model.add_Dirichlet_condition_with_simplification("u", number)
        else:
            held_axes = np.diag([float(axis in components) for axis in (1, 2, 3)])
            model.add_initialized_data("zero", np.zeros(3))
            model.add_initialized_data("axes", held_axes.ravel(), (3, 3))
            model.add_generalized_Dirichlet_condition_with_penalization(
                rule, "u", STIFF * deck.E, number, "zero", "axes"
            )


def faces_on(mesh, deck, name):
    """Return the faces whose nodes are all in a node set, as element and local face numbers (2, faces)."""
    points = mesh.pid_from_coords(np.asfortranarray(deck.nodes[deck.sets[name]].T), NEAR)
    return mesh.faces_from_pid(points)


TASKS = {"deck": solve, "contact": solve_contact}

if __name__ == "__main__":
    clock = Clock()
    clock.print_answer(*TASKS[sys.argv[1]](read_deck(sys.argv[2])))
