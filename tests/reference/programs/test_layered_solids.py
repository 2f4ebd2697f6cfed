"""Solids in which the skin is elements: flat circles, domes and a cube at three ratios."""

import math

import numpy as np
import pytest

from benchmarks.bars.skin import DOME, MODULI
from benchmarks.bars.truths import BARS, TRUTHS
from reference.layered_solids import RoundSolid, SkinnedBlock, cube_stiffness
from sensor.design.fruit import Fruit
from solve.fruit.footprints import Footprint
from solve.fruit.split import LEVELS, footprint_compliance
from solve.halfspace.punch import circle_punch

SIDE = math.sqrt(math.pi) * 14.0  # of a block as wide as the round solid
BLOCK = Fruit(length_mm=SIDE, width_mm=SIDE)
ALLOWED = 3e-3  # of what two meshes find
RATIOS = [10.0 / E for E in MODULI]


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name == "ball" else pytest.mark.study) for name in BARS["skin"]],
)
def test_truth_of_a_skin_is_of_two_meshes(name):
    """Elements miss the edge of a flat contact by the first power of their size, in the skin one over their number."""
    case = BARS["skin"][name]
    ball = case["fruit"].get("radius_mm")
    coarse, fine = (RoundSolid(edge=case["radius"], skin=0.3, ball=ball, cells=cells) for cells in (8, 14))
    curvature = 1.0 / DOME + (1.0 / ball if ball else 0.0)
    depth = case["radius"] ** 2 * curvature
    of_coarse, of_fine = (
        np.array([solid.flat(ratio) / solid.flat(1.0) for ratio in RATIOS]) for solid in (coarse, fine)
    )
    forces = [fine.dome(ratio, curvature, depth) for ratio in RATIOS]
    found = [*(of_fine + (of_fine - of_coarse) * 8.0 / 6.0), *forces]
    assert found == pytest.approx(TRUTHS[case["truth"]].values, rel=0.1 * ALLOWED)


@pytest.mark.parametrize(
    ("radius", "others"),
    [
        pytest.param(0.564, 1.290, marks=pytest.mark.slow),
        (1.2, 2.876),
        pytest.param(2.0, 5.090, marks=pytest.mark.study),
    ],
)
def test_flat_circle_without_a_skin_is_as_stiff_as_solids(radius, others):
    """K_m over E [mm] of a cylinder of radius 14 and height 12 mm held at its base, and of a block of its area."""
    coarse, fine = (RoundSolid(edge=radius, skin=0.3, cells=cells).flat(1.0) for cells in (16, 20))
    cylinder = fine + (fine - coarse) * 16.0 / 4.0
    S = footprint_compliance(BLOCK, [Footprint(0.0, 0.0, 2.0 * radius, circle_punch)], LEVELS[0]).S
    assert cylinder == pytest.approx(others, rel=5e-4)
    assert 1.0 / S[0, 0] == pytest.approx(cylinder, rel=1e-3)


@pytest.mark.study
def test_truth_of_a_cube_on_a_skin_is_of_two_meshes():
    """The solid gives skin over no skin; the edges of the cube cost it the first power of its cells."""
    solid = SkinnedBlock(side=1.0, width=20.0, height=12.0, skin=0.3)
    coarse, fine = (np.array([cube_stiffness(solid, ratio, cells) for ratio in (1.0, *RATIOS)]) for cells in (4, 6))
    of_coarse, of_fine = coarse[1:] / coarse[0], fine[1:] / fine[0]
    found = of_fine + (of_fine - of_coarse) * 4.0 / 2.0
    assert found == pytest.approx(np.array(TRUTHS["skinned block under a cube"].values), rel=0.1 * ALLOWED)
