"""Domes whose spheres stand farther out than their tips: where they touch, and how far that is from their faces."""

import numpy as np
import pytest
from reference import pressed_domes

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from pipeline.options import RunOptions, load_design
from pipeline.reading.analysis import analyse_readings
from pipeline.reading.measurement import pressed_sensor
from pipeline.response.contact import fruit_compliance
from pipeline.springs.fitted_springs import ideal_springs
from pipeline.springs.sizing import spring_sizing
from solve.contact.domes.geometry import dome_poses
from solve.contact.scene import Scene

RADIUS = 35.0
DOME = 14.0
SIZES = (0.9, 0.6)  # under contacts that are half as wide again as those of mango


def square(**keys):
    tips = Tips(layout="square", shape="dome", dome_radius_mm=DOME, side_mm=6.0, spacing_mm=7.0, **keys)
    return Scene(
        fruit=Fruit(shape="sphere", radius_mm=RADIUS, thickness_mm=12.0), tips=tips, press=Press(travel_mm=0.5)
    )


def touched(scene):
    """Return where unmoved domes touch the fruit, by the line of both centres, and what the product says of it."""
    poses = dome_poses([scene], np.array([0.0]))
    approach = poses.approach(np.zeros((1, 4, 3)))
    by_centres = RADIUS / (RADIUS + DOME) * np.array(scene.tips.axes_mm)
    return by_centres, approach, poses.from_face_middle(approach)[0]


def test_level_dome_touches_its_fruit_in_the_middle_of_its_face():
    scene = square(seat_radius_mm=RADIUS)
    by_centres, approach, from_middle = touched(scene)
    np.testing.assert_allclose(by_centres, scene.tips.places_mm, rtol=1e-12)
    np.testing.assert_allclose(approach.foot[0, :, :2], by_centres, rtol=1e-12)
    np.testing.assert_allclose(approach.interference, 0.0, atol=1e-12)
    np.testing.assert_allclose(from_middle, 0.0, atol=1e-12)


@pytest.mark.parametrize("seat", [None, 25.0, 60.0])
def test_on_another_fruit_it_touches_as_far_beside_as_two_spheres_do(seat):
    scene = square(seat_radius_mm=seat)
    by_centres, approach, from_middle = touched(scene)
    np.testing.assert_allclose(approach.foot[0, :, :2], by_centres, rtol=1e-12)
    beside = np.linalg.norm(np.array(scene.tips.places_mm) - scene.tips.axes_mm + DOME / RADIUS * by_centres, axis=1)
    np.testing.assert_allclose(from_middle, beside, rtol=1e-9)


def test_low_domes_that_stand_farther_out_fall_behind_on_a_rounder_fruit():
    """By delta (1 / (r + R')^2 - 1 / (r + R)^2)-like lengths: the exact fall of two spheres, on two fruits."""
    farther = 0.08
    scene = square(seat_radius_mm=RADIUS, low_outward_mm=farther)
    behind = {}
    for radius in (28.0, RADIUS):
        both = DOME + radius
        gaps = both - np.sqrt(both**2 - np.square(scene.tips.axes_mm).sum(axis=1))
        behind[radius] = gaps[0] - gaps[1]
        fruit = Fruit(shape="sphere", radius_mm=radius, thickness_mm=12.0)
        poses = dome_poses([Scene(fruit=fruit, tips=scene.tips, press=scene.press)], np.array([0.0]))
        interference = poses.approach(np.zeros((1, 4, 3))).interference[0]
        np.testing.assert_allclose(interference[1::2], 0.0, atol=1e-12)  # the high ones touch first
        cosine = np.sqrt(1.0 - np.square(scene.tips.axes_mm[0]).sum() / both**2)
        np.testing.assert_allclose(interference[::2], -behind[radius] * cosine, rtol=5e-3)
    assert behind[28.0] > behind[RADIUS] > 0.0


@pytest.fixture(scope="module")
def sharp():
    """Return the preset, its measurement model on springs just as stiff as given, and the bias that it states [1]."""
    design = load_design("mango-sharp")
    contact = fruit_compliance(design, RunOptions())
    springs = ideal_springs(design, spring_sizing(design, contact, RunOptions()))
    bias = analyse_readings(design, contact, springs).bias
    return design, pressed_sensor(design, contact, springs.C).model, bias.value + bias.error


@pytest.mark.study
@pytest.mark.parametrize("E", [0.5, 1.0, 3.5])
@pytest.mark.parametrize("radius", [28.0, 35.0, 42.0])
@pytest.mark.parametrize(("tilt", "off_centre"), [(0.0, 0.0), (4.0, -1.0), (4.0, 1.0)])
def test_forces_of_solids_in_nine_poses_are_read_within_the_stated_bias(sharp, E, radius, tilt, off_centre):
    """By a program of its own, flesh at finite strain; low tip 1 is lowered, tips 2 and 4 are alike by symmetry."""
    design, model, bias = sharp
    tips = design.tips
    low, high = (float(np.hypot(*beside)) for beside in tips.beside_mm[:2])
    press = pressed_domes.Press(
        E=E,
        K=(1e-3 * design.springs.K_l_N_per_m, 1e-3 * design.springs.K_h_N_per_m),
        travel=design.press.travel_mm,
        tilt_deg=tilt,
        off_centre=off_centre,
        radius=radius,
        ball=tips.dome_radius_mm,
        side=tips.spacing_mm,
        outward=(low, high),
        plan=design.fruit.length_mm,
    )
    forces = pressed_domes.extrapolated_forces(press, sizes=SIZES)
    lowered, beside = forces[:2]
    lifted = forces[-1] if len(forces) > 2 else lowered
    read = model.modulus(np.array([[lowered, beside, lifted, beside]]))
    assert read == pytest.approx(E, rel=bias)
