"""Rigid cones and spheres on a half-space.

A sharp cone: F = 2 E* d^2 tan(alpha) / pi, contact radius 2 d tan(alpha) / pi. I. N. Sneddon, Int. J. Engng Sci. 3
(1965) 47, doi:10.1016/0020-7225(65)90019-4. A sphere: F = 4/3 E* sqrt(R) d^3/2, contact radius sqrt(R d). H. Hertz,
J. reine angew. Math. 92 (1882) 156; K. L. Johnson, Contact Mechanics (1985), section 4.2,
doi:10.1017/CBO9781139171731.
"""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.theory.hertz import force_factor
from sensor.theory.sneddon_cone import cone_contact_radius, cone_force, cone_mean_pressure
from sensor.tips.ball import Sphere
from sensor.tips.cone import Cone
from solve.contact.gap import tip_gap
from solve.contact.pressure_cells import contact_cells
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.contact.unilateral import UnilateralContact
from solve.fruit.footprints import Footprint
from solve.fruit.split import split_compliance

POISSON = 0.3
REDUCED = 1.0 / (1.0 - POISSON**2)
LARGE = Fruit(length_mm=1000.0, width_mm=1000.0, height_mm=1000.0, poisson=POISSON)
SIDE = 0.2
CELLS = 26


@pytest.fixture(scope="module")
def cells():
    """Return cells of a footprint 5000 times smaller than its block: the half-space to 2e-4."""
    return contact_cells(LARGE, [Footprint(0.0, 0.0, SIDE)], np.linspace(-0.5, 0.5, CELLS + 1))


def pressed(cells, tip, depth):
    """Return the force [N] and the radius of the contact's area [mm]."""
    touch = UnilateralContact(cells).solve(depth - tip_gap(tip, *cells.local.T), np.zeros((1, 1)))
    return touch.F, np.sqrt(cells.areas[touch.pressure > 0.0].sum() / np.pi)


@pytest.mark.parametrize(("half_angle", "radius"), [(50.0, 0.09), (70.3, 0.05), (85.0, 0.09)])
def test_force_radius_and_mean_pressure(cells, half_angle, radius):
    depth = radius / cone_contact_radius(1.0, half_angle)
    force, found = pressed(cells, Cone(side_mm=SIDE, half_angle_deg=half_angle), depth)
    np.testing.assert_allclose(force, cone_force(depth, half_angle, REDUCED), rtol=2e-3)
    np.testing.assert_allclose(found, radius, atol=0.5 * SIDE / CELLS)
    np.testing.assert_allclose(force / (np.pi * radius**2), cone_mean_pressure(half_angle, REDUCED), rtol=2e-3)


BALLS = [(Sphere(side_mm=2.0), 1.0, radius, 0.01) for radius in (0.05, 0.07, 0.09)]


@pytest.mark.parametrize(
    ("tip", "ball", "radius", "error"),
    [*BALLS, (Cone(side_mm=SIDE, half_angle_deg=70.0, blunt_mm=0.25), 0.25, 0.07, 0.02)],
)
def test_a_sphere_and_a_cone_that_touches_with_the_ball_at_its_point_press_as_hertz_says(
    cells, tip, ball, radius, error
):
    """A cell is 1/6 to 1/11 of the contact radius: force to the second order of that, radius to half a cell."""
    depth = radius**2 / ball
    force, found = pressed(cells, tip, depth)
    np.testing.assert_allclose(force, force_factor(REDUCED, ball) * depth**1.5, rtol=error)
    np.testing.assert_allclose(found, radius, atol=0.5 * SIDE / CELLS)


def test_two_far_cones_stay_inside_the_error_bar_of_the_response():
    spacing = 50.0
    tips = Tips(shape="cone", half_angle_deg=70.0, spacing_mm=spacing)
    scene = Scene(fruit=LARGE, tips=tips, press=PressMotion(travel_mm=0.15))
    travel = np.array([0.1, 0.15])
    response = scene_response(scene, split_compliance(LARGE, tips.flat), np.zeros((2, 2)), [1.0], travel)
    force = np.zeros(2)
    for _ in range(10):  # what one cone pushes the skin away under the other, as a point load
        depth = travel - force / (np.pi * REDUCED * spacing)
        force = cone_force(depth, 70.0, REDUCED)
    relative = np.abs(response.F[0] / force[:, None] - 1.0).max(axis=1)
    assert (relative <= response.F_error[0]).all()
    assert (response.F_error[0] < 0.05).all()
    np.testing.assert_allclose(response.P[0], 1.0, atol=1e-9)
