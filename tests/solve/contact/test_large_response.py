"""Level deep tips: forces against roots of the balance, errors, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from solve.contact.large_response import CROSSTALK, FINITE_BODY, check_large_strain, large_response
from solve.contact.linear_response import linear_response, spring_compliance
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.large_strain.force_curve import ForceCurve

INFO = SolveInfo(method="stand-in", dofs=0, seconds=0.0, status="made up")
S = np.array([[0.77, 0.03], [0.03, 0.8]])
CONTACT = FruitCompliance(S=S, error_pair=1e-4, error_own=1e-4, info=INFO)
C = spring_compliance(0.9, 20.8)
SCENE = Scene(fruit=Fruit(), tips=Tips(), press=Press(strain="large"))
MODULI, TRAVELS = np.array([0.5, 3.5]), np.array([0.1, 0.35, 0.6])
FALLING = ForceCurve(
    depths=(0.01, 0.2, 0.4, 0.6), factors=(1.0, 0.96, 0.93, 0.91), errors=(1e-3,) * 4, grip=1.0, asked=0.6, info=INFO
)


def response(curve=FALLING, scene=SCENE, contact=CONTACT):
    return large_response(scene, contact, C, curve, MODULI, TRAVELS)


def test_forces_balance_springs_flesh_and_crosstalk():
    found = response()
    for i, E in enumerate(MODULI):
        for j, x in enumerate(TRAVELS):

            def open_balance(depth, E=E, x=x):
                F = E / np.diag(S) * FALLING.factor(depth) * depth
                return C @ F + depth + (S - np.diag(np.diag(S))) @ F / E - x

            depth = fsolve(open_balance, [0.1 * x, 0.5 * x], xtol=1e-13)
            np.testing.assert_allclose(found.F[i, j], E / np.diag(S) * FALLING.factor(depth) * depth, rtol=1e-9)


def test_rates_are_slopes_of_the_forces():
    step = 1e-6
    found = large_response(SCENE, CONTACT, C, FALLING, MODULI, np.array([0.35 - step, 0.35, 0.35 + step]))
    slopes = (found.F[:, 2] - found.F[:, 0]) / (2.0 * step)
    np.testing.assert_allclose(found.slope_ratio[:, 1], slopes[:, 1] / slopes[:, 0], rtol=1e-6)


def test_factor_of_one_is_the_linear_law():
    found = response(replace(FALLING, factors=(1.0,) * 4))
    linear = linear_response(S, C, MODULI, TRAVELS)
    np.testing.assert_allclose(found.F, linear.F, rtol=1e-11)
    np.testing.assert_allclose(found.P, linear.P, rtol=1e-11)


def test_errors_hold_another_curve_within_its_bar():
    bar = 0.01
    found = response(replace(FALLING, errors=(bar,) * 4))
    for sign in (-1.0, 1.0):
        moved = response(replace(FALLING, factors=tuple(value + sign * bar for value in FALLING.factors)))
        assert (np.abs(moved.F / found.F - 1.0) <= found.F_error[..., None]).all()
        assert (np.abs(moved.P / found.P - 1.0) <= found.P_error).all()
    assert (found.P_error < 2.0 * (bar / 0.9 + CROSSTALK + FINITE_BODY + 2e-3) + 1e-4).all()


def test_tip_that_stands_back_carries_nothing_until_it_touches():
    scene = replace(SCENE, height_offset_mm=(0.0, -0.2))
    found = response(scene=scene)
    assert found.F[0, 0, 1] == 0.0
    assert np.isnan(found.P[0, 0])
    assert found.F[0, 1, 1] > 0.0


def test_depth_beyond_the_curve_is_refused():
    short = replace(FALLING, depths=(0.01, 0.1, 0.2, 0.3))
    with pytest.raises(InputError) as refused:
        response(short)
    assert refused.value.field == "depth"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"press": Press(strain="large", tilt_deg=1.0)}, "press.strain"),
        ({"tips": Tips(shape="sphere")}, "press.strain"),
        ({"fruit": Fruit(shape="sphere", radius_mm=35.0)}, "press.strain"),
        ({"fruit": Fruit(poisson=0.495)}, "fruit.poisson"),
    ],
)
def test_scene_that_is_not_solved_is_refused(change, field):
    with pytest.raises(InputError) as refused:
        check_large_strain(replace(SCENE, **change))
    assert refused.value.field == field
