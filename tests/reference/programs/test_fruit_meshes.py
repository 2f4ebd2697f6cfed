import math

import numpy as np
import pytest

from reference.fruit_meshes import (
    HALF,
    QUARTER,
    edge_size,
    fruit_block,
    fruit_mesh,
    fruit_meshes,
    fruit_size,
    solved_block,
)
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import InputError

ROUND_OFF = 1e-9
BLOCK = Fruit(length_mm=20.0, width_mm=16.0, height_mm=12.0)
APART = Tips(side_mm=1.5, spacing_mm=8.0)

FRUIT, TIPS = Fruit(), Tips()


def test_meshes_are_of_the_quarter_for_central_tips_and_of_the_half_otherwise(monkeypatch):
    monkeypatch.setattr("reference.fruit_meshes.REFINEMENTS", (2.0, 1.0))
    half = {"base", "top", "low_tip", "high_tip", "symmetry_y"}
    quarter = {"base", "top", "high_tip", "symmetry_x", "symmetry_y"}
    for tips, names in ((TIPS, quarter), (Tips(offset_mm=1.0), half)):
        assert [set(mesh.boundaries) for mesh in fruit_meshes(FRUIT, tips)] == [names, names]


def test_edge_of_the_footprint_carries_elements_of_the_asked_size():
    for scale in (2.0, 0.5):
        x, y, z = fruit_mesh(solved_block(FRUIT, TIPS), FRUIT, TIPS, scale).p
        on_side = (np.abs(y - 0.5) < 1e-9) & (np.abs(x - 4.0) < 0.5 + 1e-9) & (np.abs(z) < 1e-9)
        assert np.count_nonzero(on_side) - 1 == pytest.approx(1.0 / edge_size(TIPS, scale), abs=1)


def test_family_scales_the_edge_at_rate_one_and_the_smooth_part_at_rate_four():
    part = solved_block(FRUIT, TIPS)
    coarse, fine = (fruit_size(part, FRUIT, TIPS, scale) for scale in (1.0, 1.0 / 16.0))
    assert fine.smallest_mm == pytest.approx(coarse.smallest_mm / 16.0)
    assert fine.growth == pytest.approx(coarse.growth / 2.0)
    assert fine.largest_mm == pytest.approx(coarse.largest_mm / 2.0)


@pytest.mark.parametrize(
    ("fruit", "tips"),
    [
        (FRUIT, Tips(spacing_mm=19.0)),
        (Fruit(height_mm=2.0), Tips(spacing_mm=1.1)),
        (Fruit(width_mm=4.0), Tips(side_mm=4.0)),
    ],
)
def test_hard_shapes_can_be_meshed(fruit, tips):
    for mirrors in ((), HALF, QUARTER):
        mesh = fruit_mesh(fruit_block(fruit, tips, mirrors), fruit, tips, 4.0)
        assert mesh.p.min(axis=1)[2] == pytest.approx(-fruit.height_mm)


WHOLE_AREAS = {"base": 320.0, "top": 320.0 - 2.0 * 1.5**2, "low_tip": 1.5**2, "high_tip": 1.5**2}
QUARTER_AREAS = {
    "base": 80.0, "symmetry_x": 96.0, "symmetry_y": 120.0, "top": 80.0 - 1.5 * 0.75, "high_tip": 1.5 * 0.75,
}  # fmt: skip


@pytest.mark.parametrize(("mirrors", "areas"), [((), WHOLE_AREAS), (QUARTER, QUARTER_AREAS)])
def test_volume_and_faces_are_those_of_the_formulas(mirrors, areas):
    part = fruit_block(BLOCK, APART, mirrors)
    assert part.shape.isValid()
    assert part.shape.Volume() == pytest.approx(12.0 * areas["base"], rel=ROUND_OFF)
    assert {name: part.face_area(name) for name in part.faces} == pytest.approx(areas, rel=ROUND_OFF)


@pytest.mark.parametrize("offset", [0.0, -2.0])
def test_tips_stand_where_the_numbers_say_and_off_the_centre_a_half_is_solved(offset):
    tips = Tips(side_mm=1.5, spacing_mm=8.0, offset_mm=offset)
    solved = solved_block(BLOCK, tips)
    assert ("symmetry_x" in solved.faces) == (offset == 0.0)
    for part in (solved, fruit_block(BLOCK, tips, HALF)):
        for name, x in {"low_tip": offset - 4.0, "high_tip": offset + 4.0}.items():
            for index in part.faces.get(name, ()):
                centre = part.shape.Faces()[index].Center()
                assert (centre.x, centre.z) == pytest.approx((x, 0.0), abs=ROUND_OFF)


def test_tips_that_stand_beyond_the_fruit_are_refused():
    with pytest.raises(InputError) as refused:
        fruit_block(BLOCK, Tips(side_mm=1.5, spacing_mm=19.0))
    assert refused.value.field == "tips.spacing_mm"


@pytest.mark.parametrize(("mirrors", "share"), [((), 1.0), (QUARTER, 0.5)])
def test_cylinders_leave_circles_with_their_extreme_points(mirrors, share):
    part = fruit_block(BLOCK, Tips(shape="cylinder", side_mm=1.5, spacing_mm=8.0), mirrors)
    assert part.face_area("high_tip") == pytest.approx(share * math.pi * 0.75**2, rel=ROUND_OFF)
    corners = [point.toTuple() for point in part.shape.Faces()[part.faces["high_tip"][0]].Vertices()]
    for extreme in ((4.75, 0.0), (3.25, 0.0), (4.0, 0.75)):
        assert min(math.hypot(x - extreme[0], y - extreme[1]) for x, y, _ in corners) < ROUND_OFF
