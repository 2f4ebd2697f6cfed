"""Spheres on a plane, a sphere and an ellipsoid: distances, curvatures and rigid turns."""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.domes.geometry import TOUCH_LIMIT, DomePoses, dome_poses
from solve.contact.scene import Scene

DOME = 3.0
UP = np.eye(3)[None]


def placed(centre, *axes):
    return DomePoses(DOME, np.array([[centre]], dtype=float), UP, np.array([axes], dtype=float))


def approach(poses):
    return poses.approach(np.zeros(poses.centres.shape))


def test_interference_with_a_sphere_is_that_of_the_centres():
    centre = np.array([8.0, -3.0, 1.5])
    found = approach(placed(centre, 35.0, 35.0, 35.0))
    apart = np.linalg.norm(centre + np.array([0.0, 0.0, 35.0]))
    np.testing.assert_allclose(found.interference, 35.0 + DOME - apart, rtol=1e-12)
    np.testing.assert_allclose(found.cosine, (centre[2] + 35.0) / apart, rtol=1e-12)
    np.testing.assert_allclose(found.radius, 35.0 * DOME / (35.0 + DOME), rtol=1e-9)
    np.testing.assert_allclose(found.depth_ratio, 1.0, atol=1e-12)


def test_nearest_point_of_an_ellipsoid():
    centre, axes = np.array([12.0, -6.0, 0.5]), np.array([40.0, 28.0, 40.0])
    found = approach(placed(centre, *axes))

    def distance(angles):
        turn, fall = angles
        unit = np.array([np.sin(fall) * np.cos(turn), np.sin(fall) * np.sin(turn), np.cos(fall)])
        return float(np.linalg.norm(axes * unit - [0.0, 0.0, axes[2]] - centre))

    least = minimize(distance, [-0.4, 0.4], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}).fun
    np.testing.assert_allclose(found.interference, DOME - least, rtol=1e-9)


def test_curvature_at_the_apex_of_an_ellipsoid():
    """Along x 1 / 40, along y 40 / 28^2; the ellipse eases by 1 - ln(ratio)^2 / 72."""
    found = approach(placed([0.0, 0.0, 2.9], 40.0, 28.0, 40.0))
    along, across = 1.0 / DOME + 1.0 / 40.0, 1.0 / DOME + 40.0 / 28.0**2
    np.testing.assert_allclose(found.radius, 1.0 / np.sqrt(along * across), rtol=1e-9)
    np.testing.assert_allclose(found.depth_ratio, 1.0 - np.log(across / along) ** 2 / 72.0, rtol=1e-9)


def square(tilt=0.0, roll=0.0, size=1.0, fruit="sphere"):
    curved = {"shape": "sphere", "radius_mm": 35.0} if fruit == "sphere" else {}
    tips = Tips(layout="square", shape="dome", dome_radius_mm=DOME, side_mm=3.0 * size, spacing_mm=6.0 * size)
    press = PressMotion(travel_mm=0.4, tilt_deg=tilt, roll_deg=roll)
    return Scene(fruit=Fruit(thickness_mm=12.0 if curved else None, **curved), tips=tips, press=press)


def test_level_domes_touch_a_ball_on_the_line_of_both_centres():
    """R / (R + r) of a tip's place from the apex, so r / (R + r) of it from the middle of its face."""
    scene = square()
    poses = dome_poses([scene], np.array([0.0]))
    found = approach(poses)
    np.testing.assert_allclose(found.interference, 0.0, atol=1e-12)
    places = np.array(scene.tips.places_mm)
    np.testing.assert_allclose(found.foot[0, :, :2], 35.0 / (35.0 + DOME) * places, rtol=1e-12)
    beside = DOME / (35.0 + DOME) * np.linalg.norm(places, axis=1)
    np.testing.assert_allclose(poses.distance_from_face_middle(found)[0], beside, rtol=1e-9)


def test_each_of_many_scenes_has_its_own_first_touch():
    """Without travel the deepest dome just touches, whatever differs between scenes, as near as touches are found."""
    scene = replace(square(), from_touch=True)
    scenes = [
        scene,
        replace(scene, fruit=Fruit(shape="sphere", radius_mm=50.0, thickness_mm=12.0)),
        replace(scene, press=replace(scene.press, tilt_deg=-3.0)),
        replace(scene, off_centre_mm=(1.5, -0.5)),
        replace(scene, height_offset_mm=(-0.1, -0.2, -0.3, -0.2)),
    ]
    poses = dome_poses(scenes, np.zeros(len(scenes)))
    found = approach(poses)
    np.testing.assert_allclose((found.interference / found.cosine).max(axis=1), 0.0, atol=TOUCH_LIMIT)
    level = [place for place, scene in enumerate(scenes) if not scene.press.tilt_deg]
    middles = poses.centres[level, :, :2].mean(axis=1)
    np.testing.assert_allclose(middles, [scenes[place].off_centre_mm for place in level], atol=1e-12)


def test_travel_of_a_level_sensor_counts_from_where_tips_touch_before_their_springs_sag():
    """On flat flesh domes that all sag by 0.1 mm are 0.1 mm off it without travel, and 0.2 mm in it after 0.3 mm."""
    scene = replace(square(fruit="block"), height_offset_mm=(-0.1,) * 4)
    found = approach(dome_poses([scene, scene], np.array([0.0, 0.3])))
    np.testing.assert_allclose(found.interference, np.multiply.outer([-0.1, 0.2], np.ones(4)), rtol=1e-9)
