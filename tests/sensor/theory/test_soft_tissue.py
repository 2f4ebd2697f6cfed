import math

import numpy as np
import pytest

from sensor.theory.soft_tissue import (
    FLESH_LAWS,
    LARGEST_CHANGE,
    LEAST_COMPRESSIBLE,
    constitutive_spread,
    large_strain_factor,
    largest_solved_depth,
    no_slip_stiffness_change,
)


def test_grip_is_that_of_spence():
    """(1 - nu) ln(3 - 4 nu) / (1 - 2 nu): ln 3 at nu = 0, and 1 where the flesh does not change its volume."""
    assert no_slip_stiffness_change(0.0) == pytest.approx(math.log(3.0) - 1.0, rel=1e-12)
    assert no_slip_stiffness_change(0.5) == no_slip_stiffness_change(LEAST_COMPRESSIBLE) == pytest.approx(0.0, abs=1e-3)
    assert [round(100.0 * no_slip_stiffness_change(nu), 1) for nu in (0.3, 0.45)] == [2.9, 0.3]


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3, 0.42, 0.5])
@pytest.mark.parametrize("law", FLESH_LAWS)
def test_first_touch_is_linear_and_no_depth_is_beyond_the_limits(law, poisson):
    assert large_strain_factor(0.0, poisson, law) == 1.0
    depths = np.linspace(0.0, 100.0, 501)
    factors = [large_strain_factor(float(depth), poisson, law) for depth in depths]
    assert max(abs(factor - 1.0) for factor in factors) <= LARGEST_CHANGE * (1.0 + 1e-12)


@pytest.mark.parametrize(
    ("law", "poisson", "expected"),
    [
        ("neo-hooke", 0.3, [1.0238 / 1.0297, 1.0223 / 1.0297, 1.0316 / 1.0297]),
        ("neo-hooke", 0.45, [0.9894 / 1.0027, 0.9723 / 1.0027, 0.9547 / 1.0027]),
        ("hencky", 0.3, [1.024, 1.072, 1.128]),
        ("foam", 0.49, [0.981, 0.954, 0.950]),
    ],
)
def test_factors_are_those_of_an_independent_program(law, poisson, expected):
    """That of tests/reference/fits/test_flat_punch.py; both errors are 0.4 %."""
    found = [large_strain_factor(depth, poisson, law) for depth in (0.1, 0.3, 0.6)]
    assert found == pytest.approx(expected, abs=0.008)


def test_beyond_the_deepest_the_departure_grows_with_the_depth():
    deepest = largest_solved_depth()
    at, twice = (large_strain_factor(factor * deepest, 0.45) - 1.0 for factor in (1.0, 2.0))
    assert twice == pytest.approx(2.0 * at, rel=1e-12)


def test_laws_part_with_the_depth():
    spread = [constitutive_spread(depth, 0.3) for depth in (0.0, 0.1, 0.3, 0.6)]
    assert spread[0] == 0.0
    assert spread == sorted(spread)
    assert spread[-1] == pytest.approx(0.5 * (1.128 - 0.953), abs=0.008)
