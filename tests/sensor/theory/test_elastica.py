"""The elastica against elliptic integrals, and what it is not."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipeinc, ellipkinc

from sensor.quantity import InputError
from sensor.theory.elastica import cantilever, large_deflection_stiffening

ROUND_OFF = 1e-13


@given(slope=st.floats(0.02, 1.5))
def test_series_are_the_elliptic_integrals(slope):
    """Bisshopp and Drucker, (8) and (12): modulus sqrt((1 + sin slope) / 2), sin of the amplitude 1 / (k sqrt 2)."""
    k2 = 0.5 * (1.0 + math.sin(slope))
    start = math.asin(min(1.0, 1.0 / math.sqrt(2.0 * k2)))
    root = ellipkinc(0.5 * math.pi, k2) - ellipkinc(start, k2)
    deflection = 1.0 - 2.0 * (ellipeinc(0.5 * math.pi, k2) - ellipeinc(start, k2)) / root
    found = cantilever(math.sin(slope))
    # Differences of integrals lose digits where the slope is small: 1e-16 over its square.
    assert found.force == pytest.approx(root**2, rel=1e-6)
    assert found.deflection == pytest.approx(deflection, rel=1e-5)
    assert found.stiffening == pytest.approx(found.force / (3.0 * found.deflection) - 1.0, abs=1e-14, rel=ROUND_OFF)


def test_small_deflection_gains_with_its_square():
    """Expansion of force 2 s I^2 and deflection s J / I to the second power of s."""
    for share in (1e-3, 1e-6, 1e-12):
        assert large_deflection_stiffening(30.0, 30.0 * share) == pytest.approx(36.0 / 35.0 * share**2, rel=2.0 * share)
    assert large_deflection_stiffening(30.0, 0.0) == 0.0


@pytest.mark.parametrize("deflection", [-0.1, 15.1, math.nan])
def test_deflection_beyond_half_the_leaf_is_refused(deflection):
    with pytest.raises(InputError) as error:
        large_deflection_stiffening(30.0, deflection)
    assert error.value.field == "deflection / leaf length"


@pytest.mark.parametrize("sine", [-0.1, 1.0])
def test_end_that_turns_by_a_right_angle_is_refused(sine):
    with pytest.raises(InputError) as error:
        cantilever(sine)
    assert error.value.field == "sine of the end's slope"
