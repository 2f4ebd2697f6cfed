from functools import partial

import numpy as np
import pytest

from sensor.tips.ball import Dome, Sphere
from sensor.tips.flat import Cube, Cylinder
from solve.contact.gap import tip_gap
from solve.contact.scene import slopes_text
from solve.fruit.curved_shape import cap_gap

HALF = np.linspace(0.01, 0.59, 30)
AXIS = np.concatenate([-HALF[::-1], HALF])  # mirror-symmetric to the last bit, no point on an edge
X, Y = np.meshgrid(AXIS, AXIS, indexing="ij")
GAPS = {
    "cube": partial(tip_gap, Cube(side_mm=1.0, fillet_mm=0.1)),
    "cylinder": partial(tip_gap, Cylinder(side_mm=1.0, fillet_mm=0.1)),
    "sphere": partial(tip_gap, Sphere(side_mm=1.0)),
    "dome": partial(tip_gap, Dome(side_mm=1.0, dome_radius_mm=10.0)),
    "cap": lambda x, y: cap_gap(x, y, 35.0, 30.0),
}


@pytest.mark.parametrize("name", GAPS)
def test_gap_is_zero_at_the_centre_and_mirror_symmetric(name):
    gap = GAPS[name](X, Y)
    assert GAPS[name](np.zeros(1), np.zeros(1)) == 0.0
    assert gap.min() >= 0.0
    np.testing.assert_array_equal(gap, gap[::-1])
    np.testing.assert_array_equal(gap, gap[:, ::-1])


@pytest.mark.parametrize(
    ("name", "outside"),
    [
        ("cube", np.maximum(abs(X), abs(Y)) > 0.5),
        *((name, X**2 + Y**2 > 0.25) for name in ("cylinder", "sphere", "dome")),
    ],
)
def test_there_is_no_face_beyond_the_edge(name, outside):
    np.testing.assert_array_equal(np.isinf(GAPS[name](X, Y)), outside)


def test_fillet_is_a_quarter_circle():
    x = np.array([0.4, 0.45, 0.5])
    depth = 0.1 - np.sqrt(0.1**2 - (x - 0.4) ** 2)
    np.testing.assert_allclose(GAPS["cube"](x, 0.0 * x), depth, atol=1e-15)
    np.testing.assert_allclose(GAPS["cylinder"](0.0 * x, x), depth, atol=1e-15)


@pytest.mark.parametrize(("along", "across"), [(35.0, 35.0), (40.0, 30.0)])
def test_cap_has_the_curvatures_of_its_radii(along, across):
    step = 1e-3
    assert cap_gap(np.array(step), np.array(0.0), along, across) == pytest.approx(step**2 / (2.0 * along), rel=1e-6)
    assert cap_gap(np.array(0.0), np.array(step), along, across) == pytest.approx(step**2 / (2.0 * across), rel=1e-6)
    assert cap_gap(np.array(along), np.array(0.0), along, across) == pytest.approx(along, rel=1e-12)  # at the rim
    assert np.isinf(cap_gap(np.array(1.1 * along), np.array(0.0), along, across))


@pytest.mark.parametrize(
    ("slopes", "text"),
    [
        ((-5.07, 5.07, 5.07, -5.07), "±5.07"),
        ((3.0, 3.0), "3"),
        ((0.0, -0.0), "0"),
        ((1.0, -2.0), "1 and -2"),
    ],
)
def test_slopes_of_one_size_are_stated_once(slopes, text):
    assert slopes_text(slopes) == text
