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


def elastic(space, E, poisson, *, condensed=False):
    """Return the bilinear form of linear elasticity."""
    u, v = space.TnT()
    strain = ngs.Sym(ngs.Grad(u))
    shear, first = 0.5 * E / (1.0 + poisson), E * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    form = ngs.BilinearForm(space, symmetric=True, condense=condensed)
    form += (2.0 * shear * ngs.InnerProduct(strain, ngs.Sym(ngs.Grad(v))) + first * ngs.div(u) * ngs.div(v)) * ngs.dx
    return form.Assemble()


def held_space(mesh, order, held, pressed):
    """Return the space of displacements with held components; `held` has components, counted from 1, by boundary.

    The vertical component is also held on the boundaries in `pressed`, where it is prescribed.
    """
    names = {f"dirichlet{axis}": [name for name, c in held.items() if AXES.index(axis) + 1 in c] for axis in AXES}
    names["dirichletz"] = names["dirichletz"] + list(pressed)
    return ngs.VectorH1(mesh, order=order, **{key: "|".join(found) for key, found in names.items() if found})


def solved(form, u, right=None):
    """Solve for the free dofs of u by Cholesky factorisation; the other dofs keep their prescribed values."""
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


def force(form, u, names):
    """Return the force along z on boundaries [N], as the work of the residual on their unit displacement."""
    residual = u.vec.CreateVector()
    form.Apply(u.vec, residual)
    unit = ngs.GridFunction(u.space)
    unit.components[2].Set(1.0, definedon=u.space.mesh.Boundaries("|".join(names)))
    return float(ngs.InnerProduct(residual, unit.vec))


def pressed_answer(mesh, step, task):
    """Return the number of dofs and the answer of a step with prescribed displacements.

    `task` has order, E and poisson.
    """
    space = held_space(mesh, task["order"], step["held"], step["pressed"])
    u = ngs.GridFunction(space)
    for name, shift in step["pressed"].items():
        u.components[2].Set(shift, definedon=mesh.Boundaries(name))
    form = elastic(space, task["E"], task["poisson"], condensed=task["order"] > 2)
    solved(form, u)
    support = [name for name, components in step["held"].items() if VERTICAL in components]
    forces = {name: force(form, u, [name]) for name in step["pressed"]}
    forces[step["support"]] = force(form, u, support)
    return space.ndof, {"forces": forces, "displacements": []}


def answered(mesh, steps, task):
    """Return the dofs, and the answers to all steps."""
    answers = [pressed_answer(mesh, step, task) for step in steps]
    return answers[0][0], [answer for _, answer in answers]


def same_mesh(deck):
    """Return the tetrahedra of a deck with straight edges; its boundaries have the names of the sets."""
    mesh = netgen.meshing.Mesh(3)
    corners = np.unique(deck.cells[:, :4])
    points = {int(node): mesh.Add(netgen.meshing.MeshPoint(netgen.meshing.Pnt(*deck.nodes[node]))) for node in corners}
    mesh.SetMaterial(1, "body")
    for cell in deck.cells[:, (0, 1, 3, 2)]:
        mesh.Add(netgen.meshing.Element3D(1, [points[int(node)] for node in cell]))
    names = [name for name in deck.sets if not name.startswith("support")]
    for number, name in enumerate(names, start=1):
        mesh.Add(netgen.meshing.FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
        for facet in deck.facets(name):
            mesh.Add(netgen.meshing.Element2D(number, [points[int(node)] for node in facet]))
    return ngs.Mesh(mesh)


def deck_task(path):
    """Solve a deck with elements of order 2 on its own tetrahedra."""
    deck = read_deck(path)
    steps = [{"held": step.held, "pressed": step.pressed, "support": step.support} for step in deck.steps]
    return answered(same_mesh(deck), steps, {"order": 2, "E": deck.E, "poisson": deck.poisson})


def block_task(path):
    """Press the quarter of a block on a mesh that is refined towards the edges of the tip in `levels` steps."""
    task = scene_of(path)
    length, width, height = task["size"]
    (start, end), side = task["tip_x"], task["tip_y"]
    block = occ.Box(occ.Pnt(0, 0, -height), occ.Pnt(length, width, 0))
    tip = occ.WorkPlane(occ.Axes((start, 0, 0), n=occ.Z, h=occ.X)).Rectangle(end - start, side).Face()
    shape = occ.Glue([block, tip])
    for face in shape.faces:
        x, y, z = face.center
        name = {abs(x) < NEAR: "symmetry_x", abs(y) < NEAR: "symmetry_y", abs(z + height) < NEAR: "base"}.get(True)
        inside = abs(z) < NEAR and start < x < end and y < side
        face.name = name or ("high_tip" if inside else "free")
        if inside:
            face.maxh = task["tip_size"]
            for edge in face.edges:
                if edge.center[1] > NEAR:
                    edge.hpref = 1
            for vertex in face.vertices:
                vertex.hpref = 1
    mesh = ngs.Mesh(occ.OCCGeometry(shape).GenerateMesh(maxh=task["size_mm"], grading=0.4))
    if task["levels"]:
        mesh.RefineHP(task["levels"], factor=task["factor"])
    return answered(mesh, task["steps"], task)


def scene_of(path):
    """Return the numbers and names of a task."""
    with np.load(path) as file:
        return json.loads(str(file["scene"]))


TASKS = {"deck": deck_task, "block": block_task}

if __name__ == "__main__":
    ngs.ngsglobals.msg_level = 0
    clock = Clock()
    clock.print_answer(*TASKS[sys.argv[1]](sys.argv[2]))
