"""The compliance of a square of tips against direct finite elements under smooth loads at the same places.

What the block adds to a half-space is smooth: it is the same under rigid tips and under loads a little wider, but for
their second moments over the square of the height. The half-space under smooth loads is a closed form.
"""

import numpy as np
import pytest
from reference.square_loads import four_loads
from scipy.special import ive

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from pipeline.response.contact import contact_compliance
from solve.fruit.footprints import level_compliance, nodes_between
from solve.fruit.split import contact_footprints

BLOCK = Fruit()
DEVIATION, PLACE = 0.8, 2.0
LINES = np.array([0.0, 1.0, 2.0, 3.0, 4.4, 7.0, 10.0]), np.array([0.0, 0.6, 1.4, 2.6, 4.5, 8.0, 12.0])
ALLOWED = 2e-3  # of s11
FLAT = Tips(layout="square", spacing_mm=4.0)
DOMES = Tips(layout="square", spacing_mm=4.0, shape="dome", dome_radius_mm=5.0, side_mm=2.0)


def half_space(poisson):
    """Return the mean of 1 / distance between normal distributions, over pi, times 1 - nu^2 [1/mm]."""
    apart = np.array([0.0, 2.0 * PLACE, 2.0 * PLACE * np.sqrt(2.0)])
    ratio = 0.125 * (apart / DEVIATION) ** 2
    return (1.0 - poisson**2) / np.pi * np.sqrt(0.25 * np.pi) / DEVIATION * ive(0, ratio)


def body(tips, poisson=BLOCK.poisson):
    """Return what the block adds under each tip, from the next and from the opposite one [1/mm], and s11."""
    block = Fruit(poisson=poisson)
    footprints = contact_footprints(block, tips)
    S = contact_compliance(block, tips, tolerance=1e-4).S
    none = level_compliance(footprints, poisson, np.zeros(()), nodes_between(footprints))
    return (S - none)[0, :3], S[0, 0]


@pytest.fixture(scope="module")
def truth():
    return four_loads((20.0, 12.0, BLOCK.poisson), PLACE, DEVIATION, LINES)


@pytest.mark.parametrize("tips", [FLAT, DOMES], ids=["flat", "domes"])
def test_square(truth, tips):
    added, own = body(tips)
    np.testing.assert_allclose(half_space(BLOCK.poisson) + added, truth, rtol=0.0, atol=ALLOWED * own)


def test_another_fruit_would_be_seen(truth):
    added, own = body(FLAT, 0.35)
    assert np.any(np.abs(half_space(BLOCK.poisson) + added - truth) > ALLOWED * own)


def test_places_of_a_square_are_alike():
    S = contact_compliance(BLOCK, FLAT).S
    np.testing.assert_allclose(S[0, [0, 1, 2, 3]], S[2, [2, 3, 0, 1]], rtol=1e-12)
    np.testing.assert_allclose(S[0, 1], S[0, 3], rtol=1e-4)  # a square plan: alike along and across
    np.testing.assert_array_equal(S, S.T)
