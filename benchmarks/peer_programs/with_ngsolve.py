"""Solution of tasks by NGSolve, on a given mesh or with high order on its own: `with_ngsolve.py NAME TASK.npz`."""

import json
import sys

import netgen.meshing
import ngsolve as ngs
import numpy as np
from deck import VERTICAL, Clock, read_deck
from netgen import occ

AXES = "xyz"
NEAR = 1e-9  # tolerance of coordinates [mm]


def elastic_form(space, E, poisson, *, condensed=False):
    """Return the assembled bilinear form of linear elasticity; `condensed` eliminates the dofs inside elements."""
    u, v = space.TnT()
    strain = ngs.Sym(ngs.Grad(u))
    mu, lam = 0.5 * E / (1.0 + poisson), E * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    form = ngs.BilinearForm(space, symmetric=True, condense=condensed)
    form += (2.0 * mu * ngs.InnerProduct(strain, ngs.Sym(ngs.Grad(v))) + lam * ngs.div(u) * ngs.div(v)) * ngs.dx
    return form.Assemble()


def held_space(mesh, order, held, pressed):
    """Return the space of displacements of the given polynomial `order`.

    `held` maps the name of each boundary to its fixed components, counted from 1. The vertical component is also fixed
    on the boundaries in `pressed`, where its value is prescribed. NGSolve joins the names of boundaries by `|`.
    """
    dirichlet = {}
    for component, axis in enumerate(AXES, start=1):
        names = [name for name, components in held.items() if component in components]
        if component == VERTICAL:
            names += list(pressed)
        if names:
            dirichlet[f"dirichlet{axis}"] = "|".join(names)
    return ngs.VectorH1(mesh, order=order, **dirichlet)


def solve_free_dofs(form, u, right=None):
    """Solve for the free dofs of u by Cholesky factorisation, and change u in place.

    The other dofs keep their prescribed values. `right` is the load vector, or None for no load. With static
    condensation, only the dofs that elements share are factorised. The dofs inside the elements follow from them.
    """
    space = u.space
    residual = u.vec.CreateVector()
    if right is None:
        residual[:] = 0.0
    else:
        residual.data = right.vec
    residual.data -= form.mat * u.vec
    if form.condense:
        residual.data += form.harmonic_extension_trans * residual
        free = space.FreeDofs(coupling=True)
        u.vec.data += form.mat.Inverse(free, inverse="sparsecholesky") * residual
        u.vec.data += form.harmonic_extension * u.vec
        u.vec.data += form.inner_solve * residual
    else:
        u.vec.data += form.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky") * residual


def boundary_force(form, u, names):
    """Return the force along z on the boundaries `names` [N]: the work of the residual on their unit displacement."""
    residual = u.vec.CreateVector()
    form.Apply(u.vec, residual)
    unit_displacement = ngs.GridFunction(u.space)
    unit_displacement.components[2].Set(1.0, definedon=u.space.mesh.Boundaries("|".join(names)))  # along z
    return float(ngs.InnerProduct(residual, unit_displacement.vec))


def solve_step(mesh, step, task):
    """Return the number of dofs, and the answer of a step with prescribed displacements and no loads.

    `step` holds the components that are held and the displacements that are pressed, by boundary. `task` holds the
    polynomial `order`, `E` [MPa] and `poisson`. The answer has only forces.
    """
    space = held_space(mesh, task["order"], step["held"], step["pressed"])
    u = ngs.GridFunction(space)
    for name, shift in step["pressed"].items():
        u.components[2].Set(shift, definedon=mesh.Boundaries(name))
    # Tetrahedra of order 2 have no dofs inside, so condensation would eliminate nothing.
    form = elastic_form(space, task["E"], task["poisson"], condensed=task["order"] > 2)
    solve_free_dofs(form, u)
    support = [name for name, components in step["held"].items() if VERTICAL in components]
    forces = {name: boundary_force(form, u, [name]) for name in step["pressed"]}
    forces[step["support"]] = boundary_force(form, u, support)
    return space.ndof, {"forces": forces, "displacements": []}


def answer_steps(mesh, steps, task):
    """Return the number of dofs, and the answers of all `steps`, each as in `solve_step`."""
    answers = [solve_step(mesh, step, task) for step in steps]
    return answers[0][0], [answer for _, answer in answers]


def mesh_of_deck(deck):
    """Return the mesh of a deck as straight tetrahedra, with the node sets of the deck as boundaries.

    Only the corners of the cells are used. The sets of the supports are left out, because their nodes are also in other
    sets.
    """
    mesh = netgen.meshing.Mesh(3)
    corners = np.unique(deck.cells[:, :4])
    points = {int(node): mesh.Add(netgen.meshing.MeshPoint(netgen.meshing.Pnt(*deck.nodes[node]))) for node in corners}
    mesh.SetMaterial(1, "body")
    for cell in deck.cells[:, (0, 1, 3, 2)]:  # Netgen orders the corners with the opposite orientation
        mesh.Add(netgen.meshing.Element3D(1, [points[int(node)] for node in cell]))
    names = [name for name in deck.sets if not name.startswith("support")]
    for number, name in enumerate(names, start=1):
        mesh.Add(netgen.meshing.FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
        for facet in deck.facets(name):
            mesh.Add(netgen.meshing.Element2D(number, [points[int(node)] for node in facet]))
    return ngs.Mesh(mesh)


def deck_task(path):
    """Return the number of dofs, and the answers of a deck in a file, with elements of order 2 on its tetrahedra."""
    deck = read_deck(path)
    steps = [{"held": step.held, "pressed": step.pressed, "support": step.support} for step in deck.steps]
    return answer_steps(mesh_of_deck(deck), steps, {"order": 2, "E": deck.E, "poisson": deck.poisson})


def block_task(path):
    """Return the number of dofs, and the answers of presses on the quarter of a block, from the task in a file.

    The mesh is refined `levels` times towards the edges of the tip. The planes x = 0 and y = 0 are planes of symmetry,
    and the tip lies on the top at z = 0.
    """
    task = read_scene(path)
    length, width, height = task["size"]
    (start, end), side = task["tip_x"], task["tip_y"]
    block = occ.Box(occ.Pnt(0, 0, -height), occ.Pnt(length, width, 0))
    tip = occ.WorkPlane(occ.Axes((start, 0, 0), n=occ.Z, h=occ.X)).Rectangle(end - start, side).Face()
    shape = occ.Glue([block, tip])
    for face in shape.faces:
        name = block_face_name(face.center, height, task)
        face.name = name
        if name == "high_tip":
            face.maxh = task["tip_size"]
            mark_for_refinement(face)
    mesh = ngs.Mesh(occ.OCCGeometry(shape).GenerateMesh(maxh=task["size_mm"], grading=0.4))
    if task["levels"]:
        mesh.RefineHP(task["levels"], factor=task["factor"])
    return answer_steps(mesh, task["steps"], task)


def mark_for_refinement(face):
    """Mark the corners and the edges of a tip's face, so that `RefineHP` refines the mesh towards them."""
    for edge in face.edges:
        if edge.center[1] > NEAR:  # not an edge in the plane of symmetry
            edge.hpref = 1
    for vertex in face.vertices:
        vertex.hpref = 1


def block_face_name(centre, height, task):
    """Return the name of the face of a block of this height [mm], from the position of its centre [mm]."""
    x, y, z = centre
    if abs(z + height) < NEAR:
        return "base"
    if abs(y) < NEAR:
        return "symmetry_y"
    if abs(x) < NEAR:
        return "symmetry_x"
    (start, end), side = task["tip_x"], task["tip_y"]
    is_under_tip = abs(z) < NEAR and start < x < end and y < side
    return "high_tip" if is_under_tip else "free"


def read_scene(path):
    """Return the numbers and names of a task, without its arrays."""
    with np.load(path) as file:
        return json.loads(str(file["scene"]))


TASKS = {"deck": deck_task, "block": block_task}

if __name__ == "__main__":
    ngs.ngsglobals.msg_level = 0
    clock = Clock()
    clock.print_answer(*TASKS[sys.argv[1]](sys.argv[2]))
