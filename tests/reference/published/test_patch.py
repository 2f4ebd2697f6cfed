"""Patch test for solids: a unit cube of seven distorted bricks carries uniform strain exactly.

R. H. MacNeal, R. L. Harder, Finite Elements in Analysis and Design 1 (1985) 3-20, figure 2,
doi:10.1016/0168-874X(85)90003-4: E = 1e6, nu = 0.25, u = 1e-3 (2 x + y + z) / 2 and so on in turn, which is a direct
stress of 2000 on every axis and a shear stress of 400 in every plane.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from skfem import ElementHex2, ElementHexS2, ElementTetP2, MeshHex, MeshHex2, MeshTet

from solve.elasticity import lame_parameters, stiffness_matrix, vector_basis
from solve.linear import factorise

E, POISSON = 1e6, 0.25
GRADIENT = 1e-3 * (np.eye(3) + np.ones((3, 3))) / 2.0
STRESS = 1600.0 * np.eye(3) + 400.0
FULL, REDUCED = 5, 3  # polynomial degrees: 3^3 and 2^3 Gauss points
EXACT = 1e-10

BITS = [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, 1)]  # scikit-fem's order
INNER = {
    (0, 0, 0): (0.249, 0.342, 0.192),
    (1, 0, 0): (0.826, 0.288, 0.288),
    (1, 1, 0): (0.850, 0.649, 0.263),
    (0, 1, 0): (0.273, 0.750, 0.230),
    (0, 0, 1): (0.320, 0.186, 0.643),
    (1, 0, 1): (0.677, 0.305, 0.683),
    (1, 1, 1): (0.788, 0.693, 0.644),
    (0, 1, 1): (0.165, 0.745, 0.702),
}


def seven_bricks():
    """Return the published mesh: an inner brick and six between its faces and those of the cube."""
    outer, inner = {bits: i for i, bits in enumerate(BITS)}, {bits: 8 + i for i, bits in enumerate(BITS)}
    bricks = [[inner[bits] for bits in BITS]]
    for axis, side in product(range(3), (0, 1)):
        flat = [tuple(side if a == axis else bit for a, bit in enumerate(bits)) for bits in BITS]
        bricks.append([(outer if bits[axis] == side else inner)[at] for bits, at in zip(BITS, flat, strict=True)])
    p = np.array([*BITS, *(INNER[bits] for bits in BITS)], dtype=float)
    return MeshHex(np.ascontiguousarray(p.T), np.ascontiguousarray(np.array(bricks).T))


def distorted_tetrahedra():
    """Return tetrahedra of the cube, those about its middle distorted by the corner of the inner brick."""
    mesh = MeshTet().refined(1)
    p = mesh.p.copy()
    p[:, mesh.interior_nodes()] = np.array(INNER[0, 0, 0])[:, None]
    return MeshTet(p, mesh.t)


def bent(mesh, size, rng):
    """Return the quadratic mesh with every node inside the cube moved at random, mid-side nodes too."""
    inside = np.all((mesh.doflocs > 1e-9) & (mesh.doflocs < 1.0 - 1e-9), axis=0)
    doflocs = mesh.doflocs.copy()
    doflocs[:, inside] += size * rng.uniform(-1.0, 1.0, size=(3, int(inside.sum())))
    return replace(mesh, doflocs=doflocs)


def faults(basis, poisson=POISSON, b_bar=False):
    """Return the largest error of displacement and of stress, each over the largest exact value."""
    exact = np.zeros(basis.N)
    everywhere = basis.get_dofs(elements=np.arange(basis.mesh.nelements))
    for component in range(3):
        dofs = everywhere.all(f"u^{component + 1}")
        exact[dofs] = GRADIENT[component] @ basis.doflocs[:, dofs]
    factor = factorise(stiffness_matrix(basis, E, poisson, b_bar=b_bar), basis.get_dofs().all())
    u = factor.solve(np.zeros(basis.N), exact[factor.fixed])
    gradient = np.asarray(basis.interpolate(u).grad)
    lam, mu = lame_parameters(E, POISSON)
    stress = lam * np.trace(gradient) * np.eye(3)[:, :, None, None] + mu * (gradient + gradient.swapaxes(0, 1))
    in_stress = np.abs(stress - STRESS[:, :, None, None]).max() / STRESS.max()
    return np.abs(u - exact).max() / np.abs(exact).max(), in_stress


STRAIGHT = [
    (seven_bricks, ElementHexS2, FULL, {}),
    (seven_bricks, ElementHexS2, REDUCED, {}),
    (seven_bricks, ElementHex2, FULL, {}),
    (seven_bricks, ElementHex2, FULL, {"b_bar": True}),
    (seven_bricks, ElementHex2, FULL, {"b_bar": True, "poisson": 0.4999}),
    (distorted_tetrahedra, ElementTetP2, 2, {}),
]


@pytest.mark.parametrize(("mesh", "element", "order", "law"), STRAIGHT)
def test_straight_elements(mesh, element, order, law):
    """Straight edges with centred mid-side nodes: 20 and 27 nodes pass, and 2^3 points are enough for 20."""
    assert max(faults(vector_basis(mesh(), element(), order), **law)) <= EXACT


def test_bent_bricks_pass_where_the_map_is_that_of_the_displacement(serendipity, rng):
    """Off-centre mid-side nodes pass too: 27 nodes always, 20 where face nodes follow from the edges."""
    mesh = bent(MeshHex2.from_mesh(seven_bricks()), 0.01, rng)
    for element, shape in ((ElementHexS2, serendipity(mesh)), (ElementHex2, mesh)):
        assert max(faults(vector_basis(shape, element(), FULL))) <= EXACT
