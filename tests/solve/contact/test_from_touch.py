"""Presses of a hand: against the local normal of the skin, counted from the first touch in their pose."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from scipy.spatial.transform import Rotation

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.domes.geometry import dome_poses
from solve.contact.linear_response import spring_compliance
from solve.contact.pose_forces import Pose, Stand, pose_forces, posed_scene
from solve.contact.scene import Scene
from solve.fruit.split import split_compliance

DOME = 9.0
TIPS = Tips(layout="square", shape="dome", dome_radius_mm=DOME, side_mm=5.8, spacing_mm=6.0)
FLAT_TIPS = Tips(layout="square", spacing_mm=6.0)
PIECE = {"length_mm": 30.0, "width_mm": 30.0, "thickness_mm": 12.0}
EGG = Fruit(shape="ellipsoid", radius_mm=45.0, radius_across_mm=110.0, azimuth_deg=30.0, **PIECE)
BLOCK = Fruit(length_mm=30.0, width_mm=30.0)
SPRINGS = spring_compliance(0.15, 1.4, 0.15, 1.4)


def scene(fruit=EGG, tips=TIPS):
    return Scene(fruit=fruit, tips=tips, press=PressMotion(travel_mm=0.8))


def hand(travel, **pose):
    return Pose(E=1.0, travel=travel, stand=Stand(from_touch=True, **pose))


def domes_in(pose, fruit=EGG):
    return dome_poses([posed_scene(scene(fruit), pose.stand)], np.array([pose.travel]))


AXES = np.array([45.0, math.sqrt(45.0 * 110.0), 45.0])  # of the ellipsoid whose apex is the origin
TURN = Rotation.from_euler("z", -30.0, degrees=True)  # into its principal directions


def skin(x, y):
    """Return the point of the skin at a place, by the equation of the ellipsoid."""
    u, v, _ = TURN.apply([x, y, 0.0]) / AXES
    return np.array([x, y, AXES[2] * (math.sqrt(1.0 - u**2 - v**2) - 1.0)])


def normal_of_skin(x, y):
    normal = TURN.inv().apply(TURN.apply(skin(x, y) + np.array([0.0, 0.0, AXES[2]])) / AXES**2)
    return normal / np.linalg.norm(normal)


def distance(centre):
    """Return the least distance of the skin from a point above it, by a search over places."""
    start = centre[:2] + 0.3 * np.array([[0, 0], [1, 0], [0, 1]])
    options = {"xatol": 1e-9, "fatol": 1e-14, "initial_simplex": start}
    return math.sqrt(
        minimize(
            lambda place: np.square(skin(*place) - centre).sum(), centre[:2], method="Nelder-Mead", options=options
        ).fun
    )


def turned_to(axis):
    """Return the rotation that takes the vertical to an axis the shortest way."""
    cross = np.cross([0.0, 0.0, 1.0], axis)
    angle = math.acos(axis[2])
    return Rotation.from_rotvec(cross / max(np.linalg.norm(cross), 1e-300) * angle)


@pytest.mark.parametrize("off", [(0.0, 0.0), (1.5, -1.0), (-4.0, 3.0)])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (3.0, -2.0)])
def test_travel_is_along_the_axis_from_the_first_touch_of_a_sphere(tilt, off):
    """Lowered along their axis, through the point aimed at, until the least gap of true spheres is 0, and by travel."""
    found = domes_in(hand(0.7, tilt_deg=tilt, off_centre_mm=off))
    axis = found.frame[0, 2]
    places = turned_to(axis).apply(np.column_stack([TIPS.places_mm, np.full(4, DOME)]))
    aimed = skin(*off)

    def gap(height):
        return min(distance(aimed + height * axis + place) for place in places) - DOME

    height = brentq(gap, -1.0, 1.0, xtol=1e-9)
    np.testing.assert_allclose(found.centres[0], aimed + (height - 0.7) * axis + places, atol=1e-7)


def test_level_press_in_the_middle_is_that_of_a_stand():
    by_hand, stand = (domes_in(dataclasses.replace(hand(0.5), stand=one)) for one in (hand(0.5).stand, Stand()))
    np.testing.assert_allclose(by_hand.centres, stand.centres, atol=1e-9)


@pytest.mark.parametrize("off", [(1.5, -1.0), (-4.0, 3.0)])
def test_tilt_is_against_the_normal_of_the_skin_where_the_sensor_is_set_down(off):
    normal = normal_of_skin(*off)
    upright = domes_in(hand(0.3, off_centre_mm=off)).frame[0, 2]
    np.testing.assert_allclose(upright, normal, atol=1e-12)
    tilted = domes_in(hand(0.3, off_centre_mm=off, tilt_deg=(3.0, 0.0))).frame[0, 2]
    slope = np.degrees(np.arccos(normal[2]))
    # Angles along and across add up but for the square of the slope.
    assert np.degrees(np.arccos(normal @ tilted)) == pytest.approx(3.0, rel=np.radians(slope) ** 2)


def test_tilt_changes_about_the_middle_of_the_tips():
    """The middle of the faces moves by no more than its depth times the angle; the tips turn about it as one body."""
    change = 0.5
    pose = hand(0.6, tilt_deg=(2.0, 1.0))
    before, after = domes_in(pose), domes_in(hand(0.6, tilt_deg=(2.0, 1.0), tilt_change_deg=(change, 0.0)))
    middles = [poses.centres[0].mean(axis=0) - DOME * poses.frame[0, 2] for poses in (before, after)]
    assert np.linalg.norm(middles[1] - middles[0]) < 1.01 * np.linalg.norm(middles[0]) * math.radians(change)
    lowered = (before.centres - after.centres)[0, :, 2]
    np.testing.assert_allclose(
        lowered - lowered.mean(), np.array(TIPS.places_mm)[:, 0] * math.radians(change), rtol=0.01, atol=1e-4
    )


@pytest.fixture(scope="module")
def flat():
    return scene(BLOCK, FLAT_TIPS), split_compliance(BLOCK, FLAT_TIPS, 1e-3)


def test_flat_tips_on_a_tilt_count_from_the_edge_that_touches_first(flat):
    """On a flat fruit the farthest edges are lowered by half of the pattern times the slope."""
    slope = math.tan(math.radians(2.0))
    edge = 0.5 * (6.0 + FLAT_TIPS.side_mm) * slope
    by_hand = hand(0.4, tilt_deg=(2.0, 0.0))
    stand = Pose(E=1.0, travel=0.4 - edge, stand=Stand(tilt_deg=(2.0, 0.0)))
    found = pose_forces(*flat, SPRINGS, [by_hand, stand, dataclasses.replace(by_hand, travel=1e-4)]).F
    # Contact is found at the middles of cells, the outer ones less than 2 % of a side from the edge: 0.7 um of 0.4 mm.
    np.testing.assert_allclose(found[0], found[1], rtol=5e-3)
    assert 0.0 < found[2].max() < 1e-2 * found[0].max()


def test_error_of_flat_tips_that_is_alike_in_all_is_that_of_softer_flesh(flat):
    """By forces on a fruit that gives way by a thousandth more, of which the fraction of the whole force is told.

    Tips that are off take no part.
    """
    built, compliance = flat
    pose = Pose(E=2.0, travel=0.4)
    found = pose_forces(built, compliance, SPRINGS, [pose])
    softer = pose_forces(built, compliance, SPRINGS, [dataclasses.replace(pose, E=2.0 / 1.001)]).F
    fall = (found.F - softer)[0]
    expected = fall * found.error[0] * found.F.sum() / fall.sum()
    np.testing.assert_allclose(found.common_error[0], expected, rtol=2e-3)
    lifted = pose_forces(built, compliance, SPRINGS, [Pose(E=1.0, travel=0.1, stand=Stand(tilt_deg=(4.0, 0.0)))])
    assert lifted.touching.sum() == 2
    np.testing.assert_array_equal(lifted.common_error > 0.0, lifted.touching)
