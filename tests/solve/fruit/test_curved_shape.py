"""The block bent into a fruit: its skin lies on the ellipsoid, its volume is that of the fruit, and nothing folds."""

import math

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from solve.fruit.curved_shape import CurvedShape, Plan

PIECE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=16.0, thickness_mm=12.0)
BALL = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
CAP = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0)
EGG = Fruit(shape="ellipsoid", radius_mm=35.0, radius_across_mm=25.0, thickness_mm=50.0)
FRUITS = [PIECE, BALL, CAP, EGG]
CORE = Plan(7.0, 3.0)
COUNT = 41


def grid(fruit):
    """Return points of the block, shape (3, COUNT, COUNT, COUNT)."""
    line = np.linspace(-0.5, 0.5, COUNT)
    axes = fruit.length_mm * line, fruit.width_mm * line, fruit.depth_mm * (line + 0.5)
    return np.stack(np.meshgrid(*axes, indexing="ij"))


def bent(fruit):
    points = grid(fruit)
    return CurvedShape(fruit, CORE).bend(points.reshape(3, -1)).reshape(points.shape)


def off_the_ellipsoid(fruit, points):
    a, b, c = CurvedShape(fruit, CORE).semi_axes
    x, y, z = points
    return float(np.abs((x / a) ** 2 + (y / b) ** 2 + ((c - z) / c) ** 2 - 1.0).max())


@pytest.mark.parametrize("fruit", FRUITS)
def test_skin_lies_on_the_ellipsoid_and_base_on_the_table(fruit):
    points = bent(fruit)
    assert off_the_ellipsoid(fruit, points[:, :, :, 0]) < 1e-12
    assert np.abs(points[2, :, :, -1] - fruit.depth_mm).max() < 1e-12 * fruit.depth_mm
    if fruit.is_whole:
        sides = points[:, [0, -1]], points[:, :, [0, -1]]
        assert max(off_the_ellipsoid(fruit, side) for side in sides) < 1e-12


@pytest.mark.parametrize("fruit", FRUITS)
def test_plan_near_the_tips_stays_what_it_is(fruit):
    flat, points = grid(fruit)[:2, :, :, 0], bent(fruit)[:2, :, :, 0]
    inside = (np.abs(flat[0]) <= CORE[0]) & (np.abs(flat[1]) <= CORE[1])
    assert inside.sum() > 10
    assert np.abs(points - flat)[:, inside].max() < 1e-13 * fruit.length_mm


def jacobian(fruit):
    """Return the determinant of the map at points inside, by differences over a ten thousandth of the fruit."""
    points = 0.999 * grid(fruit)[:, ::2, ::2, ::2].reshape(3, -1)
    points[2] += 5e-4 * fruit.depth_mm
    step = 1e-4 * fruit.depth_mm
    shape = CurvedShape(fruit, CORE)
    columns = [
        (shape.bend(points + step * unit[:, None]) - shape.bend(points - step * unit[:, None])) / (2.0 * step)
        for unit in np.eye(3)
    ]
    return np.linalg.det(np.stack(columns).transpose(2, 1, 0))


@pytest.mark.parametrize("fruit", FRUITS)
def test_nothing_folds(fruit):
    assert jacobian(fruit).min() > 0.0


def test_slope_and_curvature_of_a_sphere_and_at_the_apex_of_an_ellipsoid():
    shape = CurvedShape(PIECE, CORE)
    assert math.degrees(math.atan(shape.slope(4.0, 3.0))) == pytest.approx(math.degrees(math.asin(5.0 / 35.0)))
    assert shape.mean_curvature(4.0, 3.0) == pytest.approx(1.0 / 35.0)
    assert CurvedShape(EGG, CORE).mean_curvature(0.0, 0.0) == pytest.approx(0.5 * (1.0 / 35.0 + 1.0 / 25.0))
