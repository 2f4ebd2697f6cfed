"""A skin on the block against limits, and against figures from graded solids of others."""

import dataclasses
import math

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance, SkinTable
from solve.fruit.curved_body import STEPS, shape_change
from solve.fruit.footprints import Footprint
from solve.fruit.skin import layer_on, skin_compliance, table_moduli
from solve.fruit.split import LEVELS, contact_footprints, footprint_compliance, split_compliance
from solve.halfspace.layered import round_contact
from solve.halfspace.punch import circle_punch

SKINNED = Fruit(skin_mm=0.3, skin_E_MPa=10.0)
TIPS = Tips()
INFO = SolveInfo(method="", dofs=0, seconds=0.0, status="")


@pytest.fixture(scope="module")
def bare():
    return split_compliance(Fruit(), TIPS)


def under(fruit, bare):
    return skin_compliance(bare, fruit, contact_footprints(fruit, TIPS))


def test_the_table_gives_its_own_rows_and_goes_on_level():
    E = np.geomspace(0.1, 4.0, 7)
    power = E[:, None, None] ** 0.3 * np.array([[1.0, 0.1], [0.1, 1.0]])
    table = SkinTable(E=E, S=power)
    for modulus, within in ((1e-9, 0.1), (0.1, 0.1), (0.7, 0.7), (4.0, 4.0), (40.0, 4.0)):
        assert table.at(modulus)[0, 0] == pytest.approx(within**0.3, rel=2e-4)


def test_moduli_of_the_table():
    """They reach beyond what is shown by 1.3 to both sides, and down to the second point of a curve of P."""
    shown = table_moduli(Fruit(E_MPa=(0.1, 1.0), E_max_MPa=2.0))
    assert (shown[0], shown[-1]) == pytest.approx((0.1 / 1.3, 2.6))
    curve = table_moduli(Fruit(E_MPa=(1.0, 4.0), E_max_MPa=3.0))
    assert (curve[0], curve[-1]) == pytest.approx((3.0 / 24.0, 5.2))
    assert np.diff(np.log(curve)) == pytest.approx(np.log(curve[1] / curve[0]))


def test_layer_of_a_skin():
    """It is as stiff over the flesh as their moduli, of its own ratio where it has one."""
    layer = layer_on(dataclasses.replace(SKINNED, skin_poisson=0.42), 2.0)
    assert (layer.thickness, layer.modulus, layer.poisson, layer.poisson_below) == (0.3, 5.0, 0.42, 0.3)
    assert layer_on(SKINNED, 2.0).poisson == 0.3


def test_flesh_alone_is_itself_at_every_modulus(bare):
    assert bare.at(1.0) is bare


def test_tips_on_one_spring_are_one_under_a_skin_too():
    S = np.eye(4) + 0.1
    four = FruitCompliance(
        tips=("a", "b", "c", "d"),
        S=S,
        error_pair=0.0,
        error_own=0.0,
        info=INFO,
        skin=SkinTable(E=np.array([1.0, 2.0, 3.0]), S=np.array([S, 2.0 * S, 3.0 * S])),
    )
    pair = four.per_spring((0, 3), (1, 2))
    assert pytest.approx(2.0 * pair.S) == pair.at(2.0).S


@pytest.mark.slow
def test_a_skin_as_the_flesh_changes_nothing(bare):
    fruit = Fruit(skin_mm=0.6, skin_E_MPa=3.5)
    # what three solves leave between them
    assert pytest.approx(bare.S, abs=1e-5) == under(fruit, bare).at(3.5).S


SIDE = math.sqrt(math.pi) * 14.0  # of a block as wide as the cylinder
BLOCK = Fruit(length_mm=SIDE, width_mm=SIDE, skin_mm=0.3, skin_E_MPa=10.0)
PIECE = Fruit(
    shape="sphere", radius_mm=35.0, thickness_mm=12.0, length_mm=SIDE, width_mm=SIDE, skin_mm=0.3, skin_E_MPa=10.0
)
SLOW, STUDY = pytest.mark.slow, pytest.mark.study


@pytest.mark.parametrize(
    ("fruit", "radius", "ratios", "forces"),
    [
        pytest.param(
            PIECE, 0.564, (1.87825, 1.63961, 1.29292), (0.062728, 0.053777, 0.043280), id="sphere", marks=SLOW
        ),
        pytest.param(
            BLOCK,
            0.564,
            (1.86221, 1.63395, 1.29255),
            (0.048538, 0.041792, 0.033738),
            id="block",
        ),
        pytest.param(BLOCK, 1.2, (1.45863, 1.34567, 1.16666), (0.344543, 0.328706, 0.304476), id="wide", marks=STUDY),
        pytest.param(PIECE, 1.2, (1.47566, 1.35205, 1.16708), (0.446200, 0.422954, 0.390030), id="both", marks=STUDY),
    ],
)
def test_round_tips_on_a_skin_are_as_stiff_as_graded_solids(fruit, radius, ratios, forces):
    """Skin over no skin under a flat circle, and the force of a dome of 10 mm that would touch as far without a skin.

    At moduli of the flesh of 0.5, 1 and 3.5 MPa, by quadratic elements of revolution of which the skin is some, on a
    cylinder of radius 14 and height 12 mm or a piece of a ball of 35 mm, held at its base; to 0.3 % of both meshes.
    """
    circle = [Footprint(0.0, 0.0, 2.0 * radius, circle_punch)]
    change = np.zeros((1, 1))
    if fruit.radius_mm is not None:
        change = shape_change(fruit, circle, STEPS, along_normals=True).change
    S = footprint_compliance(fruit.equivalent_block, circle, LEVELS[0]).S + change
    flesh = FruitCompliance(tips=("tip",), S=S, error_pair=0.0, error_own=0.0, info=INFO, shape_change=change)
    skinned = skin_compliance(flesh, fruit, circle, along_normals=True)
    curvature = 0.1 + (1.0 / fruit.radius_mm if fruit.radius_mm else 0.0)
    depth = radius**2 * curvature
    for E, ratio, force in zip((0.5, 1.0, 3.5), ratios, forces, strict=True):
        own = skinned.at(E).S[0, 0]
        assert S[0, 0] / own == pytest.approx(ratio, rel=min(3e-3, skinned.error_own))
        contact = round_contact(layer_on(fruit, E), 6.0)
        beside = own - 1.0 / contact.flat_stiffness(radius)  # what the body adds to the layered half-space
        entered = contact.press(np.array((depth - beside * force) / curvature))[1] * curvature
        assert entered == pytest.approx(force, rel=3e-3)


@pytest.mark.study
def test_the_bar_holds_a_finer_mesh(bare, monkeypatch):
    coarse = under(SKINNED, bare)
    from solve.fruit import skin

    monkeypatch.setattr(skin, "FINE", dataclasses.replace(skin.FINE, fraction=2.0, most_dofs=20_000))
    fine = under(SKINNED, bare)
    assert coarse.error_pair < 2.5e-3
    for E in SKINNED.E_MPa:
        assert coarse.at(E).K_m_over_E() == pytest.approx(fine.at(E).K_m_over_E(), rel=coarse.error_pair)
