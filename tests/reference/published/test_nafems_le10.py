"""Thick elliptic plate under pressure: sigma_yy = -5.38 MPa at D, the corner of the inner ellipse on the loaded face.

NAFEMS, The Standard NAFEMS Benchmarks, TNSB rev. 3 (1990), test LE10. Lengths in m, stresses in MPa.
"""

import numpy as np
import pytest
from skfem import CellBasis, ElementHex1, ElementHexS2

from solve.elasticity import lame_parameters, stiffness_matrix, vector_basis
from solve.linear import factorise

E, POISSON, THICKNESS = 210e3, 0.3, 0.6
SIGMA_D = -5.38
D = np.array([2.0, 0.0, THICKNESS])
FULL, REDUCED = 5, 3  # polynomial degrees: 3^3 and 2^3 Gauss points
COARSE, MIDDLE, FINE = (6, 10, 2), (6, 10, 4), (6, 10, 6)  # across, along the ellipses, through the thickness
TOLERANCE = 0.005  # the published value has three digits: 0.1 % of it is its own rounding


def quarter_plate(x):
    """Return the plate between the ellipses 2 x 1 and 3.25 x 2.75, bunched towards the inner one."""
    s, angle = 0.5 * x[0] * (1.0 + x[0]), 0.5 * np.pi * x[1]
    return np.stack([(2.0 + 1.25 * s) * np.cos(angle), (1.0 + 1.75 * s) * np.sin(angle), THICKNESS * x[2]])


def supports(basis):
    """Return the fixed dofs: symmetry at both ends, the outer face in the plane, its middle line across."""
    held = [("y=0", ["u^2"]), ("y=1", ["u^1"]), ("x=1", ["u^1", "u^2"])]
    outer = basis.get_dofs("x=1").all(["u^3"])
    middle = outer[np.abs(basis.doflocs[2, outer] - 0.5 * THICKNESS) < 1e-9]
    return np.concatenate([*(basis.get_dofs(face).all(names) for face, names in held), middle])


def sigma_yy_at_D(basis, u, poisson):
    """Return the stress [MPa] of the one element that has D as a corner, there."""
    corner = np.argmin(np.linalg.norm(basis.mesh.p - D[:, None], axis=0))
    at, cell = np.nonzero(basis.mesh.t == corner)
    rule = (ElementHex1.doflocs[at[0]][:, None], np.ones(1))
    gradient = np.asarray(CellBasis(basis.mesh, basis.elem, elements=cell, quadrature=rule).interpolate(u).grad)
    lam, mu = lame_parameters(E, poisson)
    return (lam * np.trace(gradient) + 2.0 * mu * gradient[1, 1]).item()


@pytest.fixture(scope="module")
def sigma(mapped_hexes, face_load):
    """Return a function that solves the plate; its arguments are the places where a mistake can be planted."""

    def solve(counts, order=FULL, element=ElementHexS2, poisson=POISSON):
        basis = vector_basis(mapped_hexes(quarter_plate, counts), element(), order)
        load = face_load(basis, "z=1", lambda x: np.stack([0.0 * x[0], 0.0 * x[0], 0.0 * x[0] - 1.0]))
        u = factorise(stiffness_matrix(basis, E, poisson), supports(basis)).solve(load)
        return sigma_yy_at_D(basis, u, poisson)

    return solve


def test_stress_at_D_converges_to_the_published_value(sigma):
    coarse, middle, fine = (abs(sigma(counts) / SIGMA_D - 1.0) for counts in (COARSE, MIDDLE, FINE))
    assert fine <= TOLERANCE
    assert fine < 0.5 * middle < 0.25 * coarse
    assert abs(sigma(MIDDLE, REDUCED) / SIGMA_D - 1.0) <= TOLERANCE
