import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.theory.soft_tissue import (
    CONSTITUTIVE_SPREAD,
    LARGE_STRAIN_LOSS,
    LEAST_COMPRESSIBLE,
    constitutive_spread,
    interpolated,
    large_strain,
    no_slip,
)

ROUND_OFF = 1e-15  # absolute: heights lie under 0.1, and one division and one product round them


@pytest.mark.parametrize("curve", [LARGE_STRAIN_LOSS, CONSTITUTIVE_SPREAD])
@given(x=st.floats(-1.0, 2.0))
def test_straight_lines_are_those_of_numpy(curve, x):
    assert interpolated(x, curve) == pytest.approx(float(np.interp(x, *zip(*curve, strict=True))), abs=ROUND_OFF)


@pytest.mark.parametrize("curve", [LARGE_STRAIN_LOSS, CONSTITUTIVE_SPREAD])
def test_every_point_lies_on_its_curve(curve):
    assert [interpolated(x, curve) for x, _ in curve] == pytest.approx([y for _, y in curve], abs=ROUND_OFF)


def test_grip_is_that_of_spence():
    """(1 - nu) ln(3 - 4 nu) / (1 - 2 nu): ln 3 at nu = 0, and 1 where the flesh does not change its volume."""
    assert no_slip(0.0) == pytest.approx(math.log(3.0) - 1.0, rel=1e-12)
    assert no_slip(0.5) == no_slip(LEAST_COMPRESSIBLE) == pytest.approx(0.0, abs=1e-3)
    assert [round(100.0 * no_slip(nu), 1) for nu in (0.3, 0.45)] == [2.9, 0.3]


def test_large_strain_grows_stays_and_grows_again():
    deepest = large_strain(0.6, 0.3)
    assert [large_strain(depth, 0.3) / deepest for depth in (0.0, 0.15, 0.3, 1.2)] == pytest.approx(
        [0.0, 0.5, 1.0, 2.0]
    )


def test_constitutive_laws_part_with_the_depth_beyond_the_deepest():
    assert constitutive_spread(1.2) == pytest.approx(2.0 * constitutive_spread(0.6))
