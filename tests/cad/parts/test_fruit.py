import math

import pytest
from scipy.integrate import dblquad

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.parts.fruit import curved_fruit, fruit_block, fruit_half, fruit_quarter
from cad.quantity import InputError

ROUND_OFF = 1e-9
FRUIT = Fruit(length_mm=20.0, width_mm=16.0, height_mm=12.0)
TIPS = Tips(side_mm=1.5, spacing_mm=8.0)


@pytest.mark.parametrize(
    ("make", "areas"),
    [
        (fruit_block, {"base": 320.0, "top": 320.0 - 2.0 * 1.5**2, "low_tip": 1.5**2, "high_tip": 1.5**2}),
        (
            fruit_quarter,
            {"base": 80.0, "symmetry_x": 96.0, "symmetry_y": 120.0, "top": 80.0 - 1.5 * 0.75, "high_tip": 1.5 * 0.75},
        ),
    ],
)
def test_volume_and_faces_are_those_of_the_formulas(make, areas):
    part = make(FRUIT, TIPS)
    assert part.shape.isValid()
    assert part.shape.Volume() == pytest.approx(12.0 * areas["base"], rel=ROUND_OFF)
    assert {name: part.face_area(name) for name in part.faces} == pytest.approx(areas, rel=ROUND_OFF)


@pytest.mark.parametrize("offset", [0.0, 1.25, -2.0])
@pytest.mark.parametrize("make", [fruit_block, fruit_half])
def test_tips_stand_where_the_numbers_say(make, offset):
    tips = Tips(side_mm=1.5, spacing_mm=8.0, offset_mm=offset)
    part = make(FRUIT, tips)
    for name, x in {"low_tip": offset - 4.0, "high_tip": offset + 4.0}.items():
        centre = part.shape.Faces()[part.faces[name][0]].Center()
        assert centre.x == pytest.approx(x, abs=ROUND_OFF)
        assert centre.z == pytest.approx(0.0, abs=ROUND_OFF)


@pytest.mark.parametrize(
    ("make", "fruit", "tips", "field"),
    [
        (fruit_block, FRUIT, Tips(side_mm=1.5, spacing_mm=19.0), "tips.spacing_mm"),
        (fruit_half, FRUIT, Tips(spacing_mm=30.0), "tips.spacing_mm"),
        (fruit_quarter, FRUIT, Tips(offset_mm=0.5), "tips.offset_mm"),
        (fruit_half, Fruit(width_mm=1.0), TIPS, "tips.side_mm"),
        (curved_fruit, FRUIT, TIPS, "fruit.shape"),
    ],
)
def test_tips_that_stand_beyond_the_fruit_and_other_shapes_are_refused(make, fruit, tips, field):
    with pytest.raises(InputError) as refused:
        make(fruit, tips)
    assert refused.value.field == field


@pytest.mark.parametrize(("make", "share"), [(fruit_block, 1.0), (fruit_half, 0.5), (fruit_quarter, 0.5)])
def test_cylinders_leave_circles_with_their_extreme_points(make, share):
    part = make(FRUIT, Tips(shape="cylinder", side_mm=1.5, spacing_mm=8.0))
    assert part.shape.isValid()
    assert part.face_area("high_tip") == pytest.approx(share * math.pi * 0.75**2, rel=ROUND_OFF)
    corners = [point.toTuple() for point in part.shape.Faces()[part.faces["high_tip"][0]].Vertices()]
    for extreme in ((4.75, 0.0), (3.25, 0.0), (4.0, 0.75)):
        assert min(math.hypot(x - extreme[0], y - extreme[1]) for x, y, _ in corners) < ROUND_OFF


SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=16.0, thickness_mm=10.0)
ELLIPSOID = Fruit(shape="ellipsoid", radius_mm=40.0, radius_across_mm=30.0, length_mm=20.0, width_mm=20.0)
SPLINE = 1e-5  # relative, of areas and volumes of spline surfaces


@pytest.mark.parametrize("fruit", [SPHERE, ELLIPSOID])
@pytest.mark.parametrize("tips", [None, Tips(), Tips(shape="cylinder", side_mm=2.0, offset_mm=1.0)])
def test_volume_is_the_thickness_less_the_fall(fruit, tips):
    part = curved_fruit(fruit, tips)
    a, b = 0.5 * fruit.length_mm, 0.5 * fruit.width_mm
    expected = 4.0 * dblquad(lambda y, x: fruit.depth_mm - fruit.fall_mm(x, y), 0.0, a, 0.0, b)[0]
    assert part.shape.isValid()
    assert part.shape.Volume() == pytest.approx(expected, rel=SPLINE)
    assert part.face_area("base") == pytest.approx(fruit.length_mm * fruit.width_mm, rel=1e-9)
    assert set(part.faces) == {"base", "top"} | ({"low_tip", "high_tip"} if tips else set())


def test_outlines_of_the_tips_lie_where_the_tips_are():
    part = curved_fruit(SPHERE, Tips(offset_mm=1.0))
    faces = part.shape.Faces()
    for name, x in (("low_tip", -3.0), ("high_tip", 5.0)):
        centre = faces[part.faces[name][0]].Center()
        assert centre.x == pytest.approx(x, abs=0.01)
        assert centre.z == pytest.approx(-SPHERE.fall_mm(x, 0.0), abs=0.01)
        # area over its plan is 1 / cos of the slope, whose sine is x / R
        assert part.face_area(name) == pytest.approx(1.0 / math.cos(math.asin(x / 35.0)), rel=1e-3)
