"""Four smooth loads on a block by direct finite elements: no half-space in closed form, no remainder, no punch table.

A quarter of the block in hexahedra of second order, loads even or odd at its mirror planes. Loads have normal
distributions as seen from above, so that a coarse mesh resolves them. E = 1, lengths in mm.
"""

import itertools

import numpy as np
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, FacetBasis, LinearForm, MeshHex, condense, solve
from skfem.helpers import ddot, eye, sym_grad, trace

PARITIES = tuple(itertools.product((1, -1), repeat=2))
# What a load at (+, +) does to itself, to its image across one plane and to that across both: signs of each parity.
IMAGES = ((0, 0), (1, 0), (1, 1))


def four_loads(block, place, deviation, lines):
    """Return the answers of loads at (+-place, +-place) [1/mm]: own, of the next, of the opposite one.

    `block` is side of the plan, height and Poisson's ratio; `lines` are the rising lines along x and y, and down z.
    """
    _, height, poisson = block
    mesh = MeshHex.init_tensor(lines[0], lines[0], lines[1])
    element = ElementVector(ElementHex2())
    basis = Basis(mesh, element, intorder=5)
    lame, shear = poisson / (1.0 + poisson) / (1.0 - 2.0 * poisson), 0.5 / (1.0 + poisson)

    @BilinearForm
    def stiffness(u, v, _):
        strain = sym_grad(u)
        return ddot(lame * eye(trace(strain), 3) + 2.0 * shear * strain, sym_grad(v))

    matrix = stiffness.assemble(basis)
    top = FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: x[2] < 1e-9), intorder=9)
    answers = []
    for parity in PARITIES:
        force = _load(parity, place, deviation).assemble(top)
        u = solve(*condense(matrix, force, D=_held(mesh, basis, parity, height)))
        answers.append(float(force @ u))
    return np.array([_image(answers, crossed) for crossed in IMAGES])


def _image(answers, crossed):
    signs = [parity[0] ** crossed[0] * parity[1] ** crossed[1] for parity in PARITIES]
    return float(np.dot(signs, answers)) / len(PARITIES)


def _load(parity, place, deviation):
    def line(s, sign):
        return sum(
            factor * np.exp(-0.5 * ((s - centre) / deviation) ** 2) for centre, factor in ((place, 1.0), (-place, sign))
        ) / (deviation * np.sqrt(2.0 * np.pi))

    @LinearForm
    def down(v, w):
        return line(w.x[0], parity[0]) * line(w.x[1], parity[1]) * v[2]

    return down


def _held(mesh, basis, parity, height):
    """Return the dofs that are held: the base, and on a mirror plane those across it when even, along it when odd."""
    held = [basis.get_dofs(mesh.facets_satisfying(lambda x: x[2] > height - 1e-9)).all()]
    for axis, sign in enumerate(parity):
        plane = basis.get_dofs(mesh.facets_satisfying(lambda x, axis=axis: x[axis] < 1e-9))
        held.append(plane.all([f"u^{k + 1}" for k in range(3) if (k == axis) == (sign > 0)]))
    return np.concatenate(held)
