"""Footprints anywhere on the fruit: what the symmetry of a layout says of their compliance, and superposition."""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.quantity import InputError
from solve.fruit.footprints import Footprint, closest_spacing, level_parities, mirror_images
from solve.fruit.split import LEVELS, check_domain, footprint_compliance

BLOCK = Fruit(length_mm=20.0, width_mm=20.0, height_mm=12.0, poisson=0.3)
SQUARE = tuple(Footprint(x, y, 1.0) for x, y in ((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)))
QUICK = LEVELS[0].coarser()
SYMMETRY = 1e-9


def test_square_of_four_has_the_symmetries_of_the_square():
    S = footprint_compliance(BLOCK, SQUARE, QUICK).S
    own, beside, across = S[0, 0], S[0, 1], S[0, 2]
    expected = [own, beside, across, beside]
    for i in range(4):
        np.testing.assert_allclose(S[i], np.roll(expected, i), rtol=SYMMETRY)
    assert own > 5.0 * beside > 5.0 * across > 0.0


def test_square_takes_a_quarter_of_the_block_with_all_parities():
    assert mirror_images(SQUARE) == ([1, 0, 3, 2], [3, 2, 1, 0])
    assert level_parities(SQUARE) == [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    on_axis = tuple(Footprint(x, 0.0, 1.0) for x in (-3.0, 0.0, 3.0))
    assert level_parities(on_axis) == [(1, 1), (-1, 1)]
    assert level_parities(on_axis[1:]) == [(0, 1)]
    assert level_parities((Footprint(1.0, 2.0, 1.0),)) == [(0, 0)]


def test_spacing_and_domain_count_both_axes():
    assert closest_spacing((Footprint(0.0, 0.0, 1.0), Footprint(0.9, 1.2, 1.0))) == pytest.approx(1.2)
    with pytest.raises(InputError):
        check_domain(BLOCK, (Footprint(0.0, 0.0, 1.0), Footprint(0.9, 0.9, 1.0)))
    with pytest.raises(InputError):
        check_domain(BLOCK, (Footprint(0.0, 8.6, 1.0),))
