"""Geometrically nonlinear finite elements against the elastica: total Lagrangian, Saint-Venant-Kirchhoff, full Newton.

Stiffening is the linear displacement over the true one under the same force, on the same mesh, less one.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementHexS2, ElementQuad2, MeshQuad, MeshQuad2

from cad.parts.housing import Housing
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.leaf_spring import Flexure
from mesh.housing.sweep import flexure_mesh
from solve.elasticity import lame_parameters, stiffness_matrix, vector_basis
from solve.housing.clamped_half import REDUCED
from solve.housing.stiffness import SPRINGS, tip_face
from solve.linear import factorised

E, NU = 2000.0, 0.38
LENGTH, SEPARATION, SHUTTLE = 28.935, 14.0, 6.0
HOUSING = Housing(
    low=Flexure(thickness=0.8, length=28.935, depth=10.0, separation=14.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=14.76, depth=10.0, separation=14.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5, lower_leaf_level=7.6,
    low_top_level=23.7, high_top_level=24.15, cavity_level=24.45, top_level=30.45, protrusion=1.7,
)  # fmt: skip
NEWTON_STEPS = 10
RESIDUAL = 1e-7  # of the largest nodal force; stiff parts that are carried along hold no more digits


@dataclass(frozen=True)
class Body:
    """A body with its moduli by element, what holds it, and the weights whose product with u is the loaded place."""

    basis: CellBasis
    lam: np.ndarray
    mu: np.ndarray
    fixed: np.ndarray
    place: np.ndarray


def forces(body, u):
    """Return nodal forces of the true strain, those of its largest share, and the tangent."""
    basis = body.basis
    scalar = basis.with_element(basis.elem.elem)
    G = np.stack([np.asarray(field[0].grad) for field in scalar.basis]).transpose(2, 3, 0, 1)  # (cells, points, n, d)
    cells, points, n, d = G.shape
    dofs = basis.element_dofs.T
    local = u[dofs].reshape(cells, n, d)
    H = np.einsum("eni,epnj->epij", local - local[:, :1], G)  # a cell's own translation would cost digits
    F = np.eye(d) + H
    strain = 0.5 * (H + H.swapaxes(2, 3) + np.einsum("epki,epkj->epij", H, H))
    lam, mu = body.lam[:, None, None, None], body.mu[:, None, None, None]
    S = lam * np.trace(strain, axis1=2, axis2=3)[..., None, None] * np.eye(d) + 2.0 * mu * strain
    inside = np.einsum("epij,epjk,epnk,ep->eni", F, S, G, scalar.dx, optimize=True).reshape(cells, n * d)
    B = np.einsum("epik,epnl->epnikl", F, G)
    B = (0.5 * (B + B.swapaxes(4, 5))).reshape(cells, points, n * d, d, d)
    trace = np.trace(B, axis1=3, axis2=4)
    K = np.einsum("ep,epa,epb->eab", body.lam[:, None] * scalar.dx, trace, trace, optimize=True)
    flat = B.reshape(cells, points, n * d, d * d)
    K += np.einsum("ep,epac,epbc->eab", 2.0 * body.mu[:, None] * scalar.dx, flat, flat, optimize=True)
    geometric = np.einsum("epnj,epjk,epmk,ep->enm", G, S, G, scalar.dx, optimize=True)
    K += np.einsum("enm,ij->enimj", geometric, np.eye(d)).reshape(K.shape)
    rows, columns = np.repeat(dofs, n * d, axis=1).ravel(), np.tile(dofs, (1, n * d)).ravel()
    tangent = csc_matrix((K.ravel(), (rows, columns)), shape=(basis.N, basis.N))
    total = np.bincount(dofs.ravel(), inside.ravel(), minlength=basis.N)
    return total, float(np.abs(inside).max()), tangent


def displacements(body, load):
    """Return the linear and the true displacement; Newton's residual is checked on what is free."""
    free = np.setdiff1d(np.arange(body.basis.N), body.fixed)
    u = np.zeros(body.basis.N)
    steps = []
    for _ in range(NEWTON_STEPS):
        inside, largest, tangent = forces(body, u)
        rest = load - inside
        if np.abs(rest[free]).max() <= RESIDUAL * max(largest, np.abs(load).max()) and steps:
            return steps[0], u
        steps.append(factorised(tangent, body.fixed).solve(rest))
        u = u + steps[-1]
    pytest.fail(f"no balance after {NEWTON_STEPS} Newton steps")


def stiffening(body, force):
    """Return stiffening and true deflection of the loaded place under a force [N]."""
    linear, u = displacements(body, force * body.place)
    return float(body.place @ linear / (body.place @ u)) - 1.0, float(body.place @ u)


def pair(thickness=0.8, *, midway, held_along=False):
    """Return two leaves from a wall to a shuttle in plane stress, loaded midway along the leaves or at the shuttle.

    Midway, an arm of the shuttle reaches back between the leaves: then no force runs along them.
    """
    t = thickness
    ends = np.array([0.0, 0.25, 0.6]) * t
    x = np.concatenate(
        [ends, np.linspace(t, LENGTH - t, 25), LENGTH - ends[::-1], LENGTH + np.linspace(1.5, SHUTTLE, 4)]
    )
    y = np.concatenate([[0.0], np.linspace(t, SEPARATION, 7), [SEPARATION + t]])
    rectangle = MeshQuad.init_tensor(x, y)
    centre = rectangle.p[:, rectangle.t].mean(axis=1)
    leaf = (centre[0] < LENGTH) & ((centre[1] < t) | (centre[1] > SEPARATION))
    middle = 0.5 * (SEPARATION + t)
    arm = (centre[0] > 0.5 * LENGTH) & (np.abs(centre[1] - middle) < 0.2 * SEPARATION) & midway
    kept = np.flatnonzero(leaf | (centre[0] > LENGTH) | arm)
    basis = vector_basis(MeshQuad2.from_mesh(rectangle.restrict(kept)), ElementQuad2(), order=5)
    lam, mu = lame_parameters(E, NU)
    rigid = np.where(leaf[kept], 1.0, 1e3)
    x, y = basis.doflocs
    at = 0.5 * LENGTH if midway else LENGTH + 0.5 * SHUTTLE
    across = np.zeros(basis.N, dtype=bool)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        across[dofs[1]] = True
    loaded = across & (np.abs(x - at) < 1e-6) & (np.abs(y - middle) < 0.2 * SEPARATION)
    walls = np.flatnonzero(x < 1e-9)
    along = np.flatnonzero((x > LENGTH + SHUTTLE - 1e-9) & ~across) if held_along else []
    return Body(
        basis,
        2.0 * lam * mu / (lam + 2.0 * mu) * rigid,
        mu * rigid,
        np.union1d(walls, along).astype(int),
        loaded / loaded.sum(),
    )


def beam_force(thickness, deflection):
    return 2.0 * E * (thickness / LENGTH) ** 3 * deflection


@pytest.fixture(scope="module")
def midway():
    return pair(midway=True)


def test_tangent_at_rest_is_the_linear_matrix(midway):
    lam, mu = lame_parameters(E, NU)
    body = Body(midway.basis, np.full_like(midway.lam, lam), np.full_like(midway.mu, mu), midway.fixed, midway.place)
    linear = stiffness_matrix(midway.basis, E, NU)
    assert abs(forces(body, np.zeros(midway.basis.N))[2] - linear).max() <= 1e-12 * abs(linear).max()


@pytest.mark.parametrize("deflection", [0.5018, 0.75, 3.0])
def test_pair_without_force_along_its_leaves_is_the_elastica(midway, deflection):
    """1 % of the stiffening: roots and shear make a leaf of L/t 36 act as one 0.4 % longer."""
    found, d = stiffening(midway, beam_force(0.8, deflection))
    assert d == pytest.approx(deflection, rel=0.02)
    assert found == pytest.approx(large_deflection_stiffening(LENGTH, d), rel=0.01)
    assert found != pytest.approx(large_deflection_stiffening(0.98 * LENGTH, d), rel=0.01)  # a length 2 % off shows


def test_housing_gains_at_most_what_the_elastica_says():
    """Both tips at full travel: frame and shuttle give, and forces run along the leaves, so that less is gained."""
    basis = vector_basis(flexure_mesh(HOUSING, 3.0), ElementHexS2(), order=REDUCED)
    tips = [np.isin(np.arange(basis.N), basis.get_dofs(tip_face(name)).all("u^3")) for name in SPRINGS]
    low, high = (tip / tip.sum() for tip in tips)
    fixed = np.union1d(basis.get_dofs("mounting_holes").all(), basis.get_dofs("symmetry").all("u^2"))
    lam, mu = (np.full(basis.mesh.nelements, one) for one in lame_parameters(E, NU))
    linear, u = displacements(Body(basis, lam, mu, fixed, low), 0.5 * (0.906 * 0.602 * low + 20.83 * 0.131 * high))
    for tip, length, deflection in ((low, 28.935, 0.602), (high, 14.76, 0.131)):
        d = float(tip @ u)
        assert d == pytest.approx(deflection, rel=0.01)
        gained = float(tip @ linear) / d - 1.0
        assert 0.0 < gained < large_deflection_stiffening(length, d)
