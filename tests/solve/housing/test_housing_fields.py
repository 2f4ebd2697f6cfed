"""Fields for viewing: displacement is that of the stiffness, stress is exact in bending, leaves carry the peak."""

import numpy as np
import pytest
from skfem import ElementHexS2, MeshHex1, MeshHex2

from mesh.housing.sweep import flexure_mesh
from reference.small_housing import SMALL_HOUSING
from solve.elasticity import stress, vector_basis
from solve.housing.clamped_half import clamped_half
from solve.housing.housing_fields import fields_in, most_strained_node
from solve.housing.stiffness import STRAIN_ERROR_SHARE, displacements, tip_compliance

PETG = (2000.0, 0.38)
FORCES = (0.5, 2.0)


@pytest.fixture(scope="module")
def mesh():
    return flexure_mesh(SMALL_HOUSING, 2.0)


@pytest.fixture(scope="module")
def found(mesh):
    half = clamped_half(mesh, *PETG)
    return fields_in(mesh, *PETG, displacements(half) @ np.array(FORCES))


def test_leaves_carry_the_peak_that_the_strain_tells(mesh, found):
    """Both forces act, so the other spring's has its small part in the strain."""
    one = tip_compliance(mesh, *PETG)
    for index, side in enumerate(("low", "high")):
        inside = one.strain_inside_per_N[index] * FORCES[index]
        ends = one.strain_per_N[index] * FORCES[index]
        largest = found.largest_principal_strain[most_strained_node(mesh, f"{side}_leaves", found)]
        assert abs(largest - ends) < STRAIN_ERROR_SHARE * (ends - inside)


BENDING = 1e-3  # curvature [1/mm]


def bent_bar(poisson):
    """Return a bar |z| <= 1 along x as its half y >= 0, loaded at its ends, and the dofs of pure bending.

    u = k (x z, -nu y z, (nu (y^2 - z^2) - x^2) / 2) has the stress sigma_xx = E k z and no other (Love, Treatise,
    section 87); 20-node bricks hold these polynomials exactly.
    """
    ends = {"mounting_holes": lambda x: x[0] == 0.0, "low_tip": lambda x: x[0] == 6.0}
    straight = MeshHex1.init_tensor(np.array([0.0, 1.0, 3.5, 6.0]), np.array([0.0, 1.0]), np.array([-1.0, 1.0]))
    straight = straight.with_boundaries({**ends, "symmetry": lambda x: x[1] == 0.0})
    mesh = MeshHex2.from_mesh(straight).with_boundaries(straight.boundaries)
    basis = vector_basis(mesh, ElementHexS2(), order=3)
    x, y, z = basis.doflocs
    nu = poisson
    components = np.array([x * z, -nu * y * z, 0.5 * (nu * (y * y - z * z) - x * x)])
    u = np.empty(basis.N)
    for dofs in (basis.nodal_dofs, basis.edge_dofs):
        for component, of_it in enumerate(dofs):
            u[of_it] = BENDING * components[component, of_it]
    return mesh, basis, u


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_stress_of_pure_bending_is_exact_at_every_node(poisson):
    """One cell over the height: its mean, which has no bending in it, is zero where this is E k h / 2."""
    E = 2000.0
    mesh, basis, u = bent_bar(poisson)
    found = fields_in(mesh, E, poisson, u)
    z = mesh.doflocs[2, : len(found.displacement)]
    expected = np.zeros((3, 3, len(z)))
    expected[0, 0] = E * BENDING * z
    round_off = 1e2 * np.finfo(float).eps * 6.0**2 * BENDING * E / (1.0 - 2.0 * poisson)
    np.testing.assert_allclose(found.stress, expected, atol=round_off)
    np.testing.assert_allclose(found.von_mises, np.abs(expected[0, 0]), atol=round_off)
    np.testing.assert_allclose(found.largest_principal_strain, BENDING * np.abs(z), atol=round_off / E)
    middle = stress(np.asarray(basis.interpolate(u).grad).mean(axis=3), E, poisson)
    assert np.abs(middle).max() < round_off


def test_free_surface_carries_no_load_and_a_loaded_one_what_it_has():
    """A bar pulled along z would need a load on its top; where a surface is free, its stress has none."""
    mesh, basis, _ = bent_bar(0.3)
    u = np.zeros(basis.N)
    of_z = np.concatenate([basis.nodal_dofs[2], basis.edge_dofs[2]])
    u[of_z] = 1e-3 * basis.doflocs[2, of_z]
    found = fields_in(mesh, 2000.0, 0.3, u)
    x, _, z = mesh.doflocs[:, : len(found.displacement)]
    free = (np.abs(z) == 1.0) & (x > 0.0) & (x < 6.0) & (mesh.doflocs[1, : len(z)] < 1.0)
    assert np.abs(found.stress[2, 2, free]).max() < 1e-12
    ends = (np.abs(z) < 1.0) & (x == 0.0) & (mesh.doflocs[1, : len(z)] == 0.0)
    lam, mu = 2000.0 * 0.3 / (1.3 * 0.4), 2000.0 / 2.6
    np.testing.assert_allclose(found.stress[2, 2, ends], 1e-3 * (lam + 2.0 * mu), rtol=1e-9)
