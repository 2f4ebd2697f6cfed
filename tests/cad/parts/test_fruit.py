import math
from dataclasses import replace

import cadquery as cq
import pytest
from scipy.integrate import dblquad

from cad.parts.fruit import HALF, QUARTER, curved_fruit, fruit_block
from reference.fruit_meshes import solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import InputError

ROUND_OFF = 1e-9
FRUIT = Fruit(length_mm=20.0, width_mm=16.0, height_mm=12.0)
TIPS = Tips(side_mm=1.5, spacing_mm=8.0)
WHOLE_AREAS = {"base": 320.0, "top": 320.0 - 2.0 * 1.5**2, "low_tip": 1.5**2, "high_tip": 1.5**2}
QUARTER_AREAS = {
    "base": 80.0, "symmetry_x": 96.0, "symmetry_y": 120.0, "top": 80.0 - 1.5 * 0.75, "high_tip": 1.5 * 0.75,
}  # fmt: skip


@pytest.mark.parametrize(("mirrors", "areas"), [((), WHOLE_AREAS), (QUARTER, QUARTER_AREAS)])
def test_volume_and_faces_are_those_of_the_formulas(mirrors, areas):
    part = fruit_block(FRUIT, TIPS, mirrors)
    assert part.shape.isValid()
    assert part.shape.Volume() == pytest.approx(12.0 * areas["base"], rel=ROUND_OFF)
    assert {name: part.face_area(name) for name in part.faces} == pytest.approx(areas, rel=ROUND_OFF)


@pytest.mark.parametrize("offset", [0.0, -2.0])
def test_tips_stand_where_the_numbers_say_and_off_the_centre_a_half_is_solved(offset):
    tips = Tips(side_mm=1.5, spacing_mm=8.0, offset_mm=offset)
    solved = solved_block(FRUIT, tips)
    assert ("symmetry_x" in solved.faces) == (offset == 0.0)
    for part in (solved, fruit_block(FRUIT, tips, HALF)):
        for name, x in {"low_tip": offset - 4.0, "high_tip": offset + 4.0}.items():
            for index in part.faces.get(name, ()):
                centre = part.shape.Faces()[index].Center()
                assert (centre.x, centre.z) == pytest.approx((x, 0.0), abs=ROUND_OFF)


@pytest.mark.parametrize(
    ("make", "fruit", "tips", "field"),
    [
        (fruit_block, FRUIT, Tips(side_mm=1.5, spacing_mm=19.0), "tips.spacing_mm"),
        (curved_fruit, FRUIT, TIPS, "fruit.shape"),
    ],
)
def test_tips_that_stand_beyond_the_fruit_and_other_shapes_are_refused(make, fruit, tips, field):
    with pytest.raises(InputError) as refused:
        make(fruit, tips)
    assert refused.value.field == field


@pytest.mark.parametrize(("mirrors", "share"), [((), 1.0), (QUARTER, 0.5)])
def test_cylinders_leave_circles_with_their_extreme_points(mirrors, share):
    part = fruit_block(FRUIT, Tips(shape="cylinder", side_mm=1.5, spacing_mm=8.0), mirrors)
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
    half = curved_fruit(fruit, tips, half=True)
    assert half.shape.Volume() == pytest.approx(0.5 * expected, rel=SPLINE)
    assert part.face_area("base") == pytest.approx(2.0 * half.face_area("base"), rel=1e-9)
    assert set(half.faces) == {*part.faces, "symmetry_y"}
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


def test_a_turned_fruit_has_its_top_where_the_formula_says():
    """Points 0.01 mm below the skin are inside, points 0.01 mm above it are not; a fruit not turned fails this."""
    turned = replace(ELLIPSOID, azimuth_deg=30.0)
    solid = curved_fruit(turned).shape
    places = [(x, y) for x in (-7.0, 0.0, 4.0) for y in (-6.0, 5.0)]
    for x, y in places:
        top = -turned.fall_mm(x, y)
        assert solid.isInside(cq.Vector(x, y, top - 0.01))
        assert not solid.isInside(cq.Vector(x, y, top + 0.01))
    assert max(abs(turned.fall_mm(x, y) - ELLIPSOID.fall_mm(x, y)) for x, y in places) > 0.02
