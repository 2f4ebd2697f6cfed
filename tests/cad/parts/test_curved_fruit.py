import math

import pytest
from scipy.integrate import dblquad

from cad.design.parameters import Fruit, Tips
from cad.parts.curved_fruit import curved_fruit
from cad.quantity import InputError

SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=16.0, thickness_mm=10.0)
ELLIPSOID = Fruit(shape="ellipsoid", radius_mm=40.0, radius_across_mm=30.0)
KERNEL = 1e-5  # relative, of areas and volumes of spline surfaces


@pytest.mark.parametrize("fruit", [SPHERE, ELLIPSOID])
@pytest.mark.parametrize("tips", [None, Tips(), Tips(shape="cylinder", side_mm=2.0, offset_mm=1.0)])
def test_volume_is_the_thickness_less_the_fall(fruit, tips):
    part = curved_fruit(fruit, tips)
    a, b = 0.5 * fruit.length_mm, 0.5 * fruit.width_mm
    expected = 4.0 * dblquad(lambda y, x: fruit.depth_mm - fruit.fall_mm(x, y), 0.0, a, 0.0, b)[0]
    assert part.shape.isValid()
    assert part.shape.Volume() == pytest.approx(expected, rel=KERNEL)
    assert part.face_area("base") == pytest.approx(fruit.length_mm * fruit.width_mm, rel=1e-9)
    assert set(part.faces) == {"base", "top"} | ({"low_tip", "high_tip"} if tips else set())


def test_apex_is_the_origin_and_the_base_lies_at_the_thickness():
    box = curved_fruit(SPHERE).shape.BoundingBox()
    assert (box.zmin, box.zmax) == pytest.approx((-10.0, 0.0), abs=1e-6)


def test_outlines_of_the_tips_lie_where_the_tips_are():
    part = curved_fruit(SPHERE, Tips(offset_mm=1.0))
    faces = part.shape.Faces()
    for name, x in (("low_tip", -3.0), ("high_tip", 5.0)):
        centre = faces[part.faces[name][0]].Center()
        assert centre.x == pytest.approx(x, abs=0.01)
        assert centre.z == pytest.approx(-SPHERE.fall_mm(x, 0.0), abs=0.01)
        # area over its plan is 1 / cos of the slope, whose sine is x / R
        assert part.face_area(name) == pytest.approx(1.0 / math.cos(math.asin(x / 35.0)), rel=1e-3)


def test_a_block_is_refused():
    with pytest.raises(InputError, match=r"^fruit.shape = 'block': must be sphere or ellipsoid; take fruit_block"):
        curved_fruit(Fruit())
