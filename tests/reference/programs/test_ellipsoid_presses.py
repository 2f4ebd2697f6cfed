"""The boundary elements of presses on ellipsoids: Hertz, another program's forces, symmetries, and refinement."""

import math
from dataclasses import replace

import numpy as np
import pytest
from stored_presses import STORED

from reference.ellipsoid_presses import Fruit, Sensor, hertz_error, press, square

OTHERS = STORED["presses"]


def test_one_dome_presses_as_hertz_says():
    """The error of cells at the edge falls faster than their size: 0.2 % at 16, 0.03 % at 32, 0.01 % at 64."""
    assert np.abs(hertz_error(32)).max() < 6e-4
    assert np.abs(hertz_error(64)).max() < 1.2e-4


def test_one_dome_on_a_ball_and_a_spring():
    """Hertz's depth and the spring's add up; a true sphere is stiffer than its paraboloid by (a / r)^2 / 12 or less."""
    alone = Sensor(dome_radius=10.0, positions=np.zeros((1, 2)), K=np.array([0.5]))
    force = press(alone, Fruit(E=1.0, R1=40.0, R2=40.0), [0.6])[0, 0]
    depth = 0.6 - force / 0.5
    exact = 4.0 / 3.0 / 0.91 * math.sqrt(8.0) * depth**1.5
    assert force == pytest.approx(exact, rel=0.004)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=f"{case['E']}-{case['R1']}-{case['R2']}", marks=pytest.mark.slow if number else ())
        for number, case in enumerate(OTHERS)
    ],
)
def test_other_boundary_elements_give_the_same_forces(case):
    """Theirs converge to 0.2 % (level) and 0.5 % (tilted), small forces to as much of the largest."""
    fruit = Fruit(**{key: case[key] for key in ("E", "R1", "R2", "azimuth", "tilt", "tilt_azimuth")})
    theirs = np.array(case["forces"])[19::5]
    ours = press(square(), fruit, case["travel"][19::5])
    allowed = 0.005 if case["tilt"] else 0.002
    assert ours == pytest.approx(theirs, rel=allowed, abs=allowed * theirs.max())
    assert ours[-1] == pytest.approx(theirs[-1], rel=allowed)


@pytest.mark.slow
def test_finer_cells_move_forces_by_less_than_a_thousandth():
    fruit = Fruit(E=1.0, R1=45.0, R2=100.0, azimuth=40.0, tilt=3.0, tilt_azimuth=20.0)
    coarse, fine = (press(square(), fruit, [0.7, 0.9], cells) for cells in (32, 48))
    assert coarse == pytest.approx(fine, rel=1e-3)


@pytest.mark.slow
def test_a_turned_fruit_under_a_turned_tilt_is_the_mirror_image():
    fruit = Fruit(E=1.0, R1=45.0, R2=100.0, azimuth=30.0, tilt=2.0, tilt_azimuth=10.0)
    mirrored = replace(fruit, azimuth=60.0, tilt_azimuth=80.0)  # x and y change places: so do the tips 1 and 3
    ours, theirs = (press(square(), one, [0.8])[0] for one in (fruit, mirrored))
    assert ours == pytest.approx(theirs[[0, 3, 2, 1]], rel=1e-3)


@pytest.mark.slow
def test_a_place_beside_the_apex_is_a_tilt_there():
    """On a paraboloid the slope at the place is k times the way to the apex, and its curvature is the same."""
    beside = Fruit(E=1.0, R1=45.0, R2=100.0, azimuth=0.0, apex=(-2.0, 0.0))
    slope = math.degrees(math.atan(2.0 / 45.0))
    tilted = Fruit(E=1.0, R1=45.0, R2=100.0, azimuth=0.0, tilt=slope, tilt_azimuth=180.0)
    assert press(square(), beside, [0.8]) == pytest.approx(press(square(), tilted, [0.8]), rel=1e-6)


@pytest.mark.slow
def test_a_higher_dome_and_a_drifting_tilt_are_felt():
    level = Fruit(E=1.0, R1=60.0, R2=60.0)
    travels = [0.1, 0.2, 0.4, 0.6, 0.8]
    even = press(square(), level, travels)[-1]
    higher = press(square(), replace(level, heights=(0.0, 0.05, 0.0, 0.05)), travels)[-1]  # the first touch moves along
    assert higher[1] > even[1] * 0.999
    assert higher[0] < even[0]
    drifting = press(square(), level, travels, drift=(0.005, 0.0))[-1]
    assert drifting[1] > even[1]
    assert drifting[3] < even[3]
