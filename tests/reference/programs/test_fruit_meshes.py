import pytest

from reference.fruit_meshes import HALF, QUARTER, fruit_block, solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

ROUND_OFF = 1e-9
BLOCK = Fruit(length_mm=20.0, width_mm=16.0, height_mm=12.0)
WHOLE_AREAS = {"base": 320.0, "top": 320.0 - 2.0 * 1.5**2, "low_tip": 1.5**2, "high_tip": 1.5**2}
QUARTER_AREAS = {
    "base": 80.0, "symmetry_x": 96.0, "symmetry_y": 120.0, "top": 80.0 - 1.5 * 0.75, "high_tip": 1.5 * 0.75,
}  # fmt: skip


@pytest.mark.parametrize(("mirrors", "areas"), [((), WHOLE_AREAS), (QUARTER, QUARTER_AREAS)])
def test_volume_and_faces_are_those_of_the_formulas(mirrors, areas):
    part = fruit_block(BLOCK, Tips(side_mm=1.5, spacing_mm=8.0), mirrors)
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
