"""Fruit with a skin against solids in which the skin is elements: flat circles and domes at three ratios."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from reference.layered_solids import RoundSolid, SkinnedBlock, cube_stiffness
from sensor.design.fruit import Fruit
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import STEPS, shape_change
from solve.fruit.footprints import Footprint
from solve.fruit.skin import layer_on, skin_compliance
from solve.fruit.split import LEVELS, footprint_compliance
from solve.halfspace.layered import round_contact
from solve.halfspace.punch import circle_punch, square_punch

MODULI = (0.5, 1.0, 3.5)  # of the flesh: the skin is 20, 10 and 2.9 times as stiff
SIDE = math.sqrt(math.pi) * 14.0  # of a block as wide as the round solid
SKIN = {"skin_mm": 0.3, "skin_E_MPa": 10.0}
BLOCK = Fruit(length_mm=SIDE, width_mm=SIDE, **SKIN)
PIECE = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0, length_mm=SIDE, width_mm=SIDE, **SKIN)
DOME = 10.0  # [mm]
ALLOWED = 3e-3  # besides the bar
INFO = SolveInfo(method="", dofs=0, seconds=0.0, status="")


def compliances(fruit, footprint):
    """Return the compliance of a fruit under one tip without its skin, and with it."""
    S = footprint_compliance(fruit.equivalent_block, [footprint], LEVELS[0]).S
    change = np.zeros((1, 1))
    if fruit.radius_mm is not None:
        change = shape_change(fruit, [footprint], STEPS, along_normals=True).change
    bare = FruitCompliance(tips=("tip",), S=S + change, error_pair=0.0, error_own=0.0, info=INFO, shape_change=change)
    return bare, skin_compliance(bare, fruit, [footprint], along_normals=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fruit", "radius"),
    [
        pytest.param(BLOCK, 0.564, id="block", marks=pytest.mark.study),
        pytest.param(BLOCK, 1.2, id="block, wide", marks=pytest.mark.study),
        pytest.param(PIECE, 0.564, id="sphere"),
        pytest.param(PIECE, 1.2, id="sphere, wide", marks=pytest.mark.study),
    ],
)
def test_round_tips_on_a_skin_are_as_stiff_as_solids(fruit, radius):
    """A flat circle, and a dome that a fruit without a skin would meet in the same circle."""
    bare, skinned = compliances(fruit, Footprint(0.0, 0.0, 2.0 * radius, circle_punch))
    coarse, fine = (RoundSolid(edge=radius, skin=0.3, ball=fruit.radius_mm, cells=cells) for cells in (8, 14))
    curvature = 1.0 / DOME + (1.0 / fruit.radius_mm if fruit.radius_mm else 0.0)
    depth = radius**2 * curvature
    for E in MODULI:
        ratio = 10.0 / E
        # Elements miss the edge of a flat contact by the first power of their size, in the skin one over their number.
        of_coarse, of_fine = (solid.flat(ratio) / solid.flat(1.0) for solid in (coarse, fine))
        expected = of_fine + (of_fine - of_coarse) * 8.0 / 6.0
        found = bare.S[0, 0] / skinned.at(E).S[0, 0]
        assert found == pytest.approx(expected, rel=ALLOWED)
        assert abs(found / expected - 1.0) < skinned.error_own

        contact = round_contact(layer_on(fruit, E), 6.0)
        body = skinned.at(E).S[0, 0] - 1.0 / contact.flat_stiffness(radius)

        def force(entered, contact=contact):
            return float(contact.press(np.array(entered / curvature))[1]) * curvature

        entered = brentq(lambda q, body=body, force=force: q + body * force(q) - depth, 1e-6, 2.0 * depth)
        assert force(entered) == pytest.approx(fine.dome(ratio, curvature, depth), rel=ALLOWED)


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
def test_a_cube_on_a_skin_is_as_stiff_as_a_solid():
    """The solid gives skin over no skin; the edges of the cube cost it the first power of its cells."""
    block = Fruit(length_mm=20.0, width_mm=20.0, **SKIN)
    bare, skinned = compliances(block, Footprint(0.0, 0.0, 1.0, square_punch))
    solid = SkinnedBlock(side=1.0, width=20.0, height=12.0, skin=0.3)
    ratios = (1.0, *(10.0 / E for E in MODULI))
    coarse, fine = (np.array([cube_stiffness(solid, ratio, cells) for ratio in ratios]) for cells in (4, 6))
    of_coarse, of_fine = coarse[1:] / coarse[0], fine[1:] / fine[0]
    expected = of_fine + (of_fine - of_coarse) * 4.0 / 2.0
    found = [bare.S[0, 0] / skinned.at(E).S[0, 0] for E in MODULI]
    np.testing.assert_allclose(found, expected, rtol=ALLOWED)
