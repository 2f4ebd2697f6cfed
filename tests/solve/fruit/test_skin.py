"""A skin on the block against limits, and against figures from graded solids of others."""

import dataclasses
import math

import numpy as np
import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.quantity import InputError
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance, SkinTable
from solve.fruit.footprints import Footprint
from solve.fruit.skin import skin_compliance
from solve.fruit.split import LEVELS, contact_footprints, footprint_compliance, split_compliance
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "thickness", "told"),
    [
        (0.564, 0.1, (1.331, 1.252, 1.179, 1.122)),
        (0.564, 0.3, (1.862, 1.634, 1.439, 1.292)),
        (1.2, 0.3, (1.458, 1.345, 1.245, 1.167)),
        (2.0, 0.3, (1.311, 1.237, 1.170, 1.117)),
    ],
)
def test_a_circle_on_a_skinned_cylinder_is_as_stiff_as_graded_solids_say(radius, thickness, told):
    """A cylinder of radius 14 and height 12 held at its base, known to 0.3 %; here the block of the same plan area."""
    side = math.sqrt(math.pi) * 14.0
    fruit = Fruit(length_mm=side, width_mm=side, skin_mm=thickness, skin_E_MPa=10.0)
    circle = [Footprint(0.0, 0.0, 2.0 * radius, circle_punch)]
    S = footprint_compliance(fruit, circle, LEVELS[0]).S
    flesh = FruitCompliance(tips=("tip",), S=S, error_pair=0.0, error_own=0.0, info=INFO)
    assert 1.0 / S[0, 0] == pytest.approx({0.564: 1.290, 1.2: 2.876, 2.0: 5.090}[radius], rel=3e-3)
    skinned = skin_compliance(flesh, fruit, circle)
    for E, ratio in zip((0.5, 1.0, 2.0, 3.5), told, strict=True):
        assert S[0, 0] / skinned.at(E).S[0, 0] == pytest.approx(ratio, rel=3e-3 + skinned.error_own)


@pytest.mark.study
def test_the_bar_holds_a_finer_mesh(bare, monkeypatch):
    coarse = under(SKINNED, bare)
    from solve.fruit import skin

    monkeypatch.setattr(skin, "FINE", dataclasses.replace(skin.FINE, fraction=2.0, most_dofs=20_000))
    fine = under(SKINNED, bare)
    assert coarse.error_pair < 2.5e-3
    for E in SKINNED.E_MPa:
        assert coarse.at(E).K_m_over_E() == pytest.approx(fine.at(E).K_m_over_E(), rel=coarse.error_pair)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"skin_mm": 4.1}, "fruit.skin_mm"),
        ({"skin_E_MPa": 3.0}, "fruit.skin_E_MPa"),
        ({"skin_E_MPa": None}, "fruit.skin_mm"),
        ({"skin_mm": None}, "fruit.skin_mm"),
        ({"skin_poisson": 0.5}, "fruit.skin_poisson"),
    ],
)
def test_a_skin_that_is_none_is_refused(changes, field):
    with pytest.raises(InputError) as refused:
        dataclasses.replace(SKINNED, **changes)
    assert refused.value.field == field
