import numpy as np
import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.parts.fruit import HALF, QUARTER, fruit_block, solved_block
from mesh.fruit import REFINEMENTS, edge_size, fruit_mesh, fruit_meshes, fruit_size

FRUIT, TIPS = Fruit(), Tips()


def test_three_meshes_of_the_quarter_for_central_tips_and_of_the_half_otherwise():
    central = fruit_meshes(FRUIT, TIPS)
    assert [set(mesh.boundaries) for mesh in central] == 3 * [{"base", "top", "high_tip", "symmetry_x", "symmetry_y"}]
    off = fruit_meshes(FRUIT, Tips(offset_mm=1.0))
    assert [set(mesh.boundaries) for mesh in off] == 3 * [{"base", "top", "low_tip", "high_tip", "symmetry_y"}]


def test_edge_of_the_footprint_carries_elements_of_the_asked_size():
    for scale, mesh in zip(REFINEMENTS, fruit_meshes(FRUIT, TIPS), strict=True):
        x, y, z = mesh.p
        on_side = (np.abs(y - 0.5) < 1e-9) & (np.abs(x - 4.0) < 0.5 + 1e-9) & (np.abs(z) < 1e-9)
        assert np.count_nonzero(on_side) - 1 == pytest.approx(1.0 / edge_size(TIPS, scale), abs=1)


def test_family_scales_the_edge_at_rate_one_and_the_smooth_part_at_rate_four():
    part = solved_block(FRUIT, TIPS)
    coarse, fine = (fruit_size(part, FRUIT, TIPS, scale) for scale in (1.0, 1.0 / 16.0))
    assert fine.smallest_mm == pytest.approx(coarse.smallest_mm / 16.0)
    assert fine.growth == pytest.approx(coarse.growth / 2.0)
    assert fine.largest_mm == pytest.approx(coarse.largest_mm / 2.0)


@pytest.mark.parametrize("tips", [Tips(spacing_mm=19.0), Tips(spacing_mm=1.1), Tips(side_mm=4.0)])
@pytest.mark.parametrize("fruit", [FRUIT, Fruit(height_mm=2.0), Fruit(width_mm=4.0)])
def test_hard_shapes_can_be_meshed(fruit, tips):
    for mirrors in ((), HALF, QUARTER):
        mesh = fruit_mesh(fruit_block(fruit, tips, mirrors), fruit, tips, 4.0)
        assert mesh.p.min(axis=1)[2] == pytest.approx(-fruit.height_mm)
