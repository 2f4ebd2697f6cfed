"""Observed order on a manufactured displacement: L2 3, energy norm 2, and a reaction 4, with bounds on the errors.

u = (a sin px cos py cos pz, b cos px sin py cos pz, c cos px cos py sin pz), p = pi, in the unit cube on rollers:
its normal displacement and its shear traction vanish on every face, so no corner is singular. A-priori orders for
quadratic elements: Ciarlet, The Finite Element Method for Elliptic Problems (1978), chapter 3,
doi:10.1137/1.9780898719208; the reaction by duality, Babuska and Miller, Int. J. Numer. Meth. Engng 20 (1984) 1085,
doi:10.1002/nme.1620200610.
"""

import numpy as np
import pytest
from skfem import ElementHex1, ElementHexS2, ElementTetP1, ElementTetP2, LinearForm, MeshTet
from skfem.helpers import dot

from solve.elasticity import lame_parameters, stiffness_matrix, vector_basis
from solve.linear import factorised

E, POISSON = 2.0, 0.3
A = np.array([0.5, -0.3, 1.0])
FINE = 8  # polynomial degree at which loads and errors are integrated
AXES = "xyz"


def displacement(x):
    s, c = np.sin(np.pi * x), np.cos(np.pi * x)
    shapes = [s[0] * c[1] * c[2], c[0] * s[1] * c[2], c[0] * c[1] * s[2]]
    return np.stack([a * shape for a, shape in zip(A, shapes, strict=True)])


def gradient(x):
    """Return d u_i / d x_j."""
    s, c = np.sin(np.pi * x), np.cos(np.pi * x)

    def entry(i, j):
        # component i has its sine on axis i; the derivative turns the function on axis j into the other one
        factors = [s[k] if k == i else c[k] for k in range(3)]
        factors[j] = c[j] if i == j else -s[j]
        return np.pi * A[i] * factors[0] * factors[1] * factors[2]

    return np.stack([np.stack([entry(i, j) for j in range(3)]) for i in range(3)])


def body_force(x):
    """Return -(lambda + mu) grad div u - mu laplace u."""
    lam, mu = lame_parameters(E, POISSON)
    scale = np.pi**2 * ((lam + mu) * A.sum() / A + 3.0 * mu)
    return scale[:, None, None] * displacement(x)


def exact_reaction():
    """Return the work of the force on the face z = 0 in the displacement cos px cos py along z."""
    lam, mu = lame_parameters(E, POISSON)
    return -0.25 * np.pi * (lam * A.sum() + 2.0 * mu * A[2])


def errors(mesh, element, order, poisson=POISSON):
    """Return the relative errors of displacement (L2), stress (energy norm) and reaction."""
    basis = vector_basis(mesh, element, order)
    fine = vector_basis(mesh, element, FINE)
    load = LinearForm(lambda v, w: dot(body_force(w.x), v)).assemble(fine)
    K = stiffness_matrix(basis, E, poisson)
    rollers = [basis.get_dofs(f"{AXES[a]}={side}").all(f"u^{a + 1}") for a in range(3) for side in (0, 1)]
    u = factorised(K, np.concatenate(rollers)).solve(load)
    base = basis.get_dofs("z=0").all("u^3")
    x, y, _ = basis.doflocs[:, base]
    reaction = (K @ u - load)[base] @ (np.cos(np.pi * x) * np.cos(np.pi * y))
    field, at = fine.interpolate(u), np.asarray(fine.global_coordinates())
    exact = displacement(at), gradient(at)
    return np.array(
        [
            np.sqrt(squared(np.asarray(field) - exact[0], fine) / squared(exact[0], fine)),
            np.sqrt(energy(np.asarray(field.grad) - exact[1], fine) / energy(exact[1], fine)),
            abs(reaction / exact_reaction() - 1.0),
        ]
    )


def squared(field, basis):
    return np.sum(field**2 * basis.dx)


def energy(H, basis):
    lam, mu = lame_parameters(E, POISSON)
    strain = 0.5 * (H + H.swapaxes(0, 1))
    return np.sum((lam * np.trace(strain) ** 2 + 2.0 * mu * np.sum(strain**2, axis=(0, 1))) * basis.dx)


def bulge(x):
    """Return the cube with its inside moved, smoothly, and its faces where they were."""
    return x + 0.15 * np.prod(np.sin(np.pi * x), axis=0) * np.array([1.0, -0.7, 0.5])[:, None]


@pytest.fixture(scope="module")
def cubes(mapped_hexes):
    """Return a function that gives the cube cut n times along each edge."""

    def cut(kind, n):
        if kind == "tets":
            line = np.linspace(0.0, 1.0, n + 1)
            faces = {f"{AXES[a]}={v}": (lambda x, a=a, v=v: np.abs(x[a] - v) < 1e-9) for a in range(3) for v in (0, 1)}
            return MeshTet.init_tensor(line, line, line).with_boundaries(faces)
        return mapped_hexes({"hexes": lambda x: x, "curved hexes": bulge}[kind], (n, n, n))

    return cut


ORDERS = np.array([3.0, 2.0, 4.0])  # of displacement, energy and reaction
NEAR = 0.2  # of an observed order, two meshes of 4 and 8 elements along an edge

# element, degree of its quadrature, bounds on the relative errors of the finer mesh
CASES = {
    "hexes": (ElementHexS2, 5, (1e-3, 1e-2, 3e-4)),
    "hexes, 2^3 Gauss": (ElementHexS2, 3, (1e-3, 1e-2, 3e-4)),
    "curved hexes": (ElementHexS2, 5, (1e-3, 1e-2, 3e-4)),
    "tets": (ElementTetP2, 2, (3e-3, 3e-2, 3e-4)),
}


def orders_and_errors(cubes, case, element, order, poisson=POISSON):
    """Return the observed orders of two meshes and the errors of the finer one."""
    coarse, fine = (errors(cubes(case.partition(",")[0], n), element(), order, poisson) for n in (4, 8))
    return np.log2(coarse / fine), fine


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_observed_orders_and_errors(cubes, case):
    element, order, bounds = CASES[case]
    orders, fine = orders_and_errors(cubes, case, element, order)
    np.testing.assert_allclose(orders, ORDERS, atol=NEAR)
    assert (fine <= bounds).all()


@pytest.mark.parametrize(
    ("case", "element", "order", "poisson"),
    [
        ("hexes", ElementHexS2, 5, 0.305),
        pytest.param("tets", ElementTetP2, 2, 0.305, marks=pytest.mark.slow),
        ("hexes", ElementHex1, 5, POISSON),
        ("tets", ElementTetP1, 2, POISSON),
    ],
)
def test_planted_mistake_loses_an_order(cubes, case, element, order, poisson):
    displacement_order, _, reaction_order = orders_and_errors(cubes, case, element, order, poisson)[0] - ORDERS
    assert max(displacement_order, reaction_order) < -0.8
