"""Four domes on a sphere: the law in closed form against boundary elements that find the contact cell by cell."""

import numpy as np
import pytest
from reference.domes_on_sphere import DomeSensor, complementary, dome_forces

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from solve.contact.linear_response import spring_compliance
from solve.contact.poses import Pose, pose_forces
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import level_compliance, nodes_between
from solve.fruit.split import contact_footprints

FRUIT = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0)
GENTLE = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.95, spacing_mm=6.0)
SPRINGS = spring_compliance(1.2, 20.0, 1.2, 20.0)
TRAVEL = 0.4
ALLOWED = 0.01
CELLS = 1.5e-3  # what 28 cells a side leave: their step from 20 to 28 is 0.2 % at most


def half_space(tips):
    """Return the compliance of a half-space, to which the body adds nothing."""
    footprints = contact_footprints(FRUIT, tips)
    S = level_compliance(footprints, FRUIT.poisson, np.zeros(()), nodes_between(footprints))
    info = SolveInfo(method="half-space", dofs=0, seconds=0.0, status="")
    return FruitCompliance(tips=tips.names, S=S, error_pair=0.0, error_own=0.0, info=info)


def reference(E, tilt, tips=GENTLE):
    places = np.array(tips.places_mm)
    sensor = DomeSensor(places=places, dome=tips.dome_radius_mm, C=SPRINGS, radius=35.0, poisson=FRUIT.poisson)
    forces, miss = dome_forces(sensor, E, TRAVEL, tilt)
    assert miss < 1e-8
    return forces


def product(E, tilt, tips=GENTLE):
    scene = Scene(fruit=FRUIT, tips=tips, press=Press(travel_mm=TRAVEL))
    return pose_forces(scene, half_space(tips), SPRINGS, [Pose(E=E, travel=TRAVEL, tilt_deg=tilt)])


@pytest.mark.slow
@pytest.mark.parametrize("E", [0.5, 3.5])
@pytest.mark.parametrize("tilt", [(2.0, 0.0), (3.0, 2.0)])
def test_four_forces(E, tilt):
    found, truth = product(E, tilt), reference(E, tilt)
    np.testing.assert_allclose(found.F[0], truth, rtol=ALLOWED)
    assert np.all(np.abs(found.F[0] - truth) <= found.F_error[0] + CELLS * truth)


@pytest.mark.slow
def test_small_domes_are_in_the_bar_that_their_profile_widens():
    small = Tips(layout="square", shape="dome", dome_radius_mm=1.0, side_mm=2.0, spacing_mm=4.0)
    found, truth = product(1.0, (2.0, 0.0), small), reference(1.0, (2.0, 0.0), small)
    assert np.all(np.abs(found.F[0] - truth) <= found.F_error[0] + CELLS * truth)
    assert np.any(np.abs(found.F[0] - truth) > found.F_error[0] - found.F_profile[0] + CELLS * truth)


@pytest.mark.slow
def test_another_crosstalk_would_be_seen():
    """Moved a tenth of a millimetre, the tips miss the bar."""
    moved = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.95, spacing_mm=6.2)
    found, truth = product(0.5, (2.0, 0.0), moved), reference(0.5, (2.0, 0.0))
    assert np.any(np.abs(found.F[0] - truth) > found.F_error[0] + CELLS * truth)


def test_reference_is_hertz_for_one_dome():
    """On a rigid spring; a sphere's own profile takes (a / r)^2 / 10 of the force at this depth."""
    alone = DomeSensor(places=np.zeros((1, 2)), dome=10.0, C=np.zeros((1, 1)), radius=35.0, poisson=0.3)
    forces, _ = dome_forces(alone, 1.0, 0.05, (0.0, 0.0), 20)
    hertz = 4.0 / 3.0 / (1.0 - 0.3**2) * np.sqrt(350.0 / 45.0) * 0.05**1.5
    np.testing.assert_allclose(forces, hertz, rtol=2e-3)


def test_reference_solves_a_complementarity_by_hand():
    """Two cells, the second pulled down by the first: it stays off."""
    matrix = np.array([[2.0, 1.0], [1.0, 2.0]])
    np.testing.assert_allclose(complementary(matrix, np.array([1.0, 0.4])), [0.5, 0.0], atol=1e-12)
