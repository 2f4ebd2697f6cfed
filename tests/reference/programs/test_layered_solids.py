"""Solids in which the skin is elements: flat circles, domes and a cube at three ratios."""

import numpy as np
import pytest

from benchmarks.bars.skin import DOME, MODULI
from benchmarks.bars.truths import BARS, TRUTHS
from reference.layered_solids import RoundSolid, SkinnedBlock, cube_stiffness

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


@pytest.mark.study
def test_truth_of_a_cube_on_a_skin_is_of_two_meshes():
    """The solid gives skin over no skin; the edges of the cube cost it the first power of its cells."""
    solid = SkinnedBlock(side=1.0, width=20.0, height=12.0, skin=0.3)
    coarse, fine = (np.array([cube_stiffness(solid, ratio, cells) for ratio in (1.0, *RATIOS)]) for cells in (4, 6))
    of_coarse, of_fine = coarse[1:] / coarse[0], fine[1:] / fine[0]
    found = of_fine + (of_fine - of_coarse) * 4.0 / 2.0
    assert found == pytest.approx(np.array(TRUTHS["skinned block under a cube"].values), rel=0.1 * ALLOWED)
