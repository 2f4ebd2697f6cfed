import numpy as np
import pytest

from cad.parts.fruit import HALF, QUARTER, fruit_block
from reference.fruit_meshes import edge_size, fruit_mesh, fruit_meshes, fruit_size, solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

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
