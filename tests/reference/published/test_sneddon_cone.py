"""Rigid sharp cone on a half-space: F = 2 E* d^2 tan(alpha) / pi, contact radius 2 d tan(alpha) / pi.

I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4.
"""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.theory.hertz import force_factor
from sensor.theory.sneddon_cone import cone_contact_radius, cone_force, cone_mean_pressure
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


@pytest.mark.parametrize(("half_angle", "radius"), [(50.0, 0.09), (70.3, 0.05), (85.0, 0.09)])
def test_force_radius_and_mean_pressure(cells, half_angle, radius):
    depth = radius / cone_contact_radius(1.0, half_angle)
    gap = tip_gap(Cone(side_mm=SIDE, half_angle_deg=half_angle), *cells.local.T)
    touch = UnilateralContact(cells).solve(depth - gap, np.zeros((1, 1)))
    area = cells.areas[touch.pressure > 0.0].sum()
    np.testing.assert_allclose(touch.F, cone_force(depth, half_angle, REDUCED), rtol=2e-3)
    np.testing.assert_allclose(np.sqrt(area / np.pi), radius, atol=0.5 * SIDE / CELLS)
    np.testing.assert_allclose(touch.F / (np.pi * radius**2), cone_mean_pressure(half_angle, REDUCED), rtol=2e-3)


def test_a_ball_at_the_point_presses_as_hertz_has_it_while_the_flank_is_off(cells):
    cone = Cone(side_mm=SIDE, half_angle_deg=70.0, blunt_mm=0.25)
    depth = 0.07**2 / 0.25
    touch = UnilateralContact(cells).solve(depth - tip_gap(cone, *cells.local.T), np.zeros((1, 1)))
    np.testing.assert_allclose(touch.F, force_factor(REDUCED, 0.25) * depth**1.5, rtol=0.02)


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
