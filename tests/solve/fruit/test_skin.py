"""A skin on the block against limits, and against figures from graded solids of others."""

import dataclasses

import numpy as np
import pytest
from bars import bars, holds

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance, SkinTable
from solve.fruit.skin import layer_on, skin_compliance, table_moduli
from solve.fruit.split import contact_footprints, split_compliance

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


def test_tips_on_one_spring_are_one_under_a_skin_too():
    S = np.eye(4) + 0.1
    four = FruitCompliance(
        tips=("a", "b", "c", "d"),
        S=S,
        difference_error=0.0,
        s11_error=0.0,
        info=INFO,
        skin=SkinTable(E=np.array([1.0, 2.0, 3.0]), S=np.array([S, 2.0 * S, 3.0 * S])),
    )
    pair = four.as_pair((0, 3), (1, 2))
    assert pytest.approx(2.0 * pair.S) == pair.at(2.0).S


@pytest.mark.slow
def test_a_skin_as_the_flesh_changes_nothing(bare):
    fruit = Fruit(skin_mm=0.6, skin_E_MPa=3.5)
    # what three solves leave between them
    assert pytest.approx(bare.S, abs=1e-5) == under(fruit, bare).at(3.5).S


@pytest.mark.parametrize("name", bars("skin", "cube on a skin"))
def test_error_bar_holds(name):
    holds(name)
