import math
from dataclasses import replace

import cadquery as cq
import pytest
from scipy.integrate import dblquad

from cad.parts.fruit import whole_fruit
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

FRUIT = Fruit(length_mm=20.0, width_mm=16.0, height_mm=12.0)
SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=16.0, thickness_mm=10.0)
ELLIPSOID = Fruit(shape="ellipsoid", radius_mm=40.0, radius_across_mm=30.0, length_mm=20.0, width_mm=20.0)
SQUARE = Tips(layout="square", spacing_mm=6.0)
TIPS = (Tips(), Tips(shape="cylinder", side_mm=2.0, offset_mm=1.0))
SPLINE = 1e-5  # relative, of areas and volumes of spline surfaces


@pytest.mark.parametrize("fruit", [FRUIT, SPHERE, ELLIPSOID], ids=lambda fruit: fruit.shape)
@pytest.mark.parametrize("tips", [SQUARE, *TIPS], ids=["square", "pair", "cylinders"])
def test_volume_is_the_thickness_less_the_fall(fruit, tips):
    solid = whole_fruit(fruit, tips)
    a, b = 0.5 * fruit.length_mm, 0.5 * fruit.width_mm
    depth = dblquad(lambda y, x: fruit.depth_mm - fruit.fall_mm(x, y), 0.0, a, 0.0, b)[0]
    assert solid.isValid()
    assert solid.Volume() == pytest.approx(4.0 * depth, rel=SPLINE)


@pytest.mark.parametrize("fruit", [FRUIT, SPHERE, ELLIPSOID], ids=lambda fruit: fruit.shape)
@pytest.mark.parametrize("tips", TIPS, ids=["pair", "cylinders"])
def test_outlines_of_a_pair_lie_where_the_tips_are(fruit, tips):
    solid = whole_fruit(fruit, tips)
    assert len(solid.Faces()) == len(whole_fruit(fruit, SQUARE).Faces()) + 2
    for x in tips.centres_mm:
        middle = cq.Vector(x, 0.0, -fruit.fall_mm(x, 0.0))
        face = min(solid.Faces(), key=lambda face: (face.Center() - middle).Length)
        assert (face.Center() - middle).Length < 0.02
        slope = (fruit.fall_mm(x + 1e-4, 0.0) - fruit.fall_mm(x - 1e-4, 0.0)) / 2e-4
        # area over its plan is 1 / cos of the slope
        assert face.Area() == pytest.approx(tips.face_mm2 * math.hypot(1.0, slope), rel=1e-3)


def test_a_turned_fruit_has_its_top_where_the_formula_says():
    """Points 0.01 mm below the skin are inside, points 0.01 mm above it are not; a fruit not turned fails this."""
    turned = replace(ELLIPSOID, azimuth_deg=30.0)
    solid = whole_fruit(turned, SQUARE)
    places = [(x, y) for x in (-7.0, 0.0, 4.0) for y in (-6.0, 5.0)]
    for x, y in places:
        top = -turned.fall_mm(x, y)
        assert solid.isInside(cq.Vector(x, y, top - 0.01))
        assert not solid.isInside(cq.Vector(x, y, top + 0.01))
    assert max(abs(turned.fall_mm(x, y) - ELLIPSOID.fall_mm(x, y)) for x, y in places) > 0.02
