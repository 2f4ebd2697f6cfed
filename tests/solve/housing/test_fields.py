"""Fields for viewing: the displacement is that of the stiffness, stress is Hooke's, and the leaves carry the peak."""

import numpy as np
import pytest

from cad.parts.housing import Housing
from cad.theory.leaf_spring import Flexure
from mesh.housing.sweep import flexure_mesh
from solve.elasticity import stress, von_mises
from solve.housing.fields import flexure_fields
from solve.housing.stiffness import tip_compliance

HOUSING = Housing(
    low=Flexure(thickness=0.8, length=9.0, depth=4.0, separation=8.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=7.0, depth=4.0, separation=8.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=6.0, shuttle_width=4.0, neck_level=2.5, lower_leaf_level=4.7,
    low_top_level=15.0, high_top_level=15.2, cavity_level=15.5, top_level=20.0, protrusion=1.0, wall_width=6.0,
)  # fmt: skip
PETG = (2000.0, 0.38)
FORCES = (0.5, 2.0)


@pytest.fixture(scope="module")
def mesh():
    return flexure_mesh(HOUSING, 2.0)


@pytest.fixture(scope="module")
def found(mesh):
    return flexure_fields(mesh, *PETG, FORCES)


def test_tips_move_as_the_compliance_says(mesh, found):
    """A tip's face is not quite level: the mean of its nodes is the mean of the face to a part in a hundred."""
    wanted = tip_compliance(mesh, *PETG).C @ np.array(FORCES)
    for tip, moved in zip(("low_tip", "high_tip"), wanted, strict=True):
        nodes = np.unique(mesh.facets[:, mesh.boundaries[tip]])
        assert found.displacement[nodes, 2].mean() == pytest.approx(moved, rel=1e-2)


def test_clamped_nodes_stay_and_the_plane_of_symmetry_stays_a_plane(mesh, found):
    holes = np.unique(mesh.facets[:, mesh.boundaries["mounting_holes"]])
    plane = np.unique(mesh.facets[:, mesh.boundaries["symmetry"]])
    assert np.abs(found.displacement[holes]).max() == 0.0
    assert np.abs(found.displacement[plane, 1]).max() == 0.0


@pytest.mark.parametrize(("side", "index"), [("low", 0), ("high", 1)])
def test_leaves_carry_the_peak_that_the_strain_tells(mesh, found, side, index):
    """The mean over a cell lies under the largest surface stress E eps, and not far under it at a root."""
    leaves = mesh.boundaries[f"{side}_leaves"]
    cells = np.unique(mesh.f2t[0, leaves])
    peak = PETG[0] * tip_compliance(mesh, *PETG).strain_inside_per_N[index] * FORCES[index]
    assert 0.3 * peak < found.von_mises[cells].max() < 1.1 * peak


def test_fields_are_linear_in_the_forces(mesh, found):
    twice = flexure_fields(mesh, *PETG, (2.0 * FORCES[0], 2.0 * FORCES[1]))
    np.testing.assert_allclose(twice.von_mises, 2.0 * found.von_mises, rtol=1e-9)
    np.testing.assert_allclose(twice.displacement, 2.0 * found.displacement, rtol=1e-9, atol=1e-12)


def test_bar_in_tension_has_the_stress_of_hooke():
    strain = 1e-3
    gradient = np.diag([strain, -0.3 * strain, -0.3 * strain])
    sigma = stress(gradient, 200.0, 0.3)
    np.testing.assert_allclose(sigma, np.diag([0.2, 0.0, 0.0]), atol=1e-12)
    assert von_mises(sigma) == pytest.approx(0.2, rel=1e-12)


def test_shear_counts_root_three_and_a_turn_nothing():
    turn = np.array([[0.0, 1e-3, 0.0], [-1e-3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    shear = np.abs(turn)
    assert np.abs(stress(turn, 200.0, 0.3)).max() == 0.0
    G = 200.0 / 2.6
    assert von_mises(stress(shear, 200.0, 0.3)) == pytest.approx(np.sqrt(3.0) * 2e-3 * G, rel=1e-12)
    assert von_mises(stress(np.eye(3), 200.0, 0.3)) == pytest.approx(0.0, abs=1e-9)
