"""Many poses of one sensor: each as if it were pressed alone, and refused where a dome runs off its face."""

import dataclasses
from functools import cache

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError
from solve.contact.linear_response import spring_compliance
from solve.contact.pose_forces import Pose, Stand, pose_forces, posed_scene
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.split import split_compliance

PIECE = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0, length_mm=30.0, width_mm=30.0)
GENTLE = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.8, spacing_mm=6.0)
SPRINGS = spring_compliance(1.2, 20.0, 1.2, 20.0)
LEVEL = Pose(E=1.0, travel=0.4)
TILTED = Pose(E=0.5, travel=0.3, stand=Stand(tilt_deg=(1.0, -2.0), off_centre_mm=(0.3, 0.2), radii_mm=(42.0, 36.0)))
LINE = Tips(layout="line", order="LHL", spacing_mm=2.5, outer_mm=2.5**2 / 70.0)


@cache
def compliance(tips, fruit=PIECE):
    return split_compliance(fruit, tips, 1e-3)


def square(tips=GENTLE, fruit=PIECE):
    return Scene(fruit=fruit, tips=tips, press=PressMotion(travel_mm=0.4))


def forces(poses, tips=GENTLE, springs=SPRINGS, fruit=PIECE):
    return pose_forces(square(tips, fruit), compliance(tips, fruit), springs, poses)


def alone(pose, tips=GENTLE, springs=SPRINGS, fruit=PIECE):
    posed = posed_scene(square(tips, fruit), pose.stand)
    return scene_response(posed, compliance(tips, fruit), springs, [pose.E], [pose.travel])


def test_scene_of_a_pose():
    posed = posed_scene(square(), TILTED.stand)
    assert (posed.press.tilt_deg, posed.press.roll_deg) == (1.0, -2.0)
    assert posed.fruit.radius_mm == 42.0
    np.testing.assert_allclose(posed.centres, np.array(GENTLE.places_mm) + np.array([0.3, 0.2]))
    thinner = posed_scene(
        square(fruit=dataclasses.replace(PIECE, length_mm=None, width_mm=None)), Stand(thickness_mm=8.0)
    )
    assert thinner.fruit.is_whole
    assert thinner.fruit.length_mm == pytest.approx(2.0 * np.sqrt(35.0**2 - 27.0**2))
    piece = dataclasses.replace(PIECE, shape="ellipsoid", radius_across_mm=25.0)
    met = dataclasses.replace(TILTED.stand, azimuth_deg=30.0, thickness_mm=9.0)
    fruit = posed_scene(square(fruit=piece), met).fruit
    assert (fruit.radii_mm, fruit.azimuth_deg, fruit.depth_mm) == ((42.0, 36.0), 30.0, 9.0)
    assert (fruit.length_mm, fruit.width_mm) == (30.0, 30.0)


def test_domes_in_many_poses_are_pressed_each_as_alone():
    tilted = dataclasses.replace(TILTED, stand=dataclasses.replace(TILTED.stand, radii_mm=None))
    found = forces([LEVEL, tilted, LEVEL])
    np.testing.assert_allclose(found.F[0], alone(LEVEL).F[0, 0], rtol=1e-9)
    np.testing.assert_allclose(found.F[1], alone(tilted).F[0, 0], rtol=1e-9)
    np.testing.assert_array_equal(found.F[0], found.F[2])
    assert found.touching.all()
    np.testing.assert_allclose(found.mean_pressure, found.F / (np.pi * found.contact_radius**2), rtol=0.02)
    np.testing.assert_allclose(found.error, (found.F_error / found.F).max(axis=1), rtol=1e-9)


def test_pose_off_the_face_of_a_dome_has_no_number_and_names_the_width():
    narrow = dataclasses.replace(GENTLE, side_mm=4.5)
    found = forces([LEVEL, dataclasses.replace(LEVEL, travel=0.1)], narrow)
    assert np.isnan(found.F[0]).all()
    assert np.isfinite(found.F[1]).all()
    assert found.face_mm[0] > 4.5 > found.face_mm[1]
    with pytest.raises(InputError) as refused:
        alone(LEVEL, narrow)
    assert refused.value.field == "tips.side_mm"
    enough = float(refused.value.bound.split()[2])
    assert np.isfinite(alone(LEVEL, dataclasses.replace(GENTLE, side_mm=enough)).F).all()


@pytest.mark.slow
def test_line_of_flat_tips_in_many_poses_is_pressed_as_alone():
    """One coarse grid, moved with the sensor; alone on a finer grid of its own."""
    springs = spring_compliance(0.753, 17.3, 0.753)
    pose = Pose(E=1.0, travel=0.4, stand=Stand(tilt_deg=(2.0, 1.0), off_centre_mm=(0.0, 0.5)))
    found = forces([pose], LINE, springs)
    expected = alone(pose, LINE, springs)
    np.testing.assert_allclose(found.F[0], expected.F[0, 0], rtol=float(found.error[0] + expected.F_error[0, 0]))
    assert np.all(found.contact_radius <= np.sqrt(1.0 / np.pi) + 1e-9)
    np.testing.assert_array_equal(found.face_mm, 0.0)


@pytest.mark.parametrize("pose", [LEVEL, TILTED])
def test_too_steep(pose):
    steep = dataclasses.replace(pose, stand=dataclasses.replace(pose.stand, tilt_deg=(18.0, 12.0)))
    with pytest.raises(InputError) as refused:
        forces([pose, steep])
    assert refused.value.field == "press.tilt_deg"
