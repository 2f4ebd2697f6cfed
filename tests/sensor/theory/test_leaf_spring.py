import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.quantity import InputError
from sensor.theory.leaf_spring import (
    Flexure,
    natural_frequency,
    pair_length,
    pair_stiffness,
    root_strain,
)

ROUND_OFF = 1e-12
E, DEPTH, THICKNESS, LENGTH = 2000.0, 10.0, 0.8, 28.0
SIZE = st.floats(0.05, 100.0)


def test_pair_is_two_clamped_guided_beams_side_by_side():
    second_moment = DEPTH * THICKNESS**3 / 12.0
    one_leaf = 12.0 * E * second_moment / LENGTH**3  # Timoshenko, Strength of Materials I, art. 34
    assert pair_stiffness(E, DEPTH, THICKNESS, LENGTH) == pytest.approx(2.0 * one_leaf, rel=ROUND_OFF)


@given(E=st.floats(1.0, 1e6), depth=SIZE, thickness=SIZE, length=SIZE)
def test_length_is_the_inverse_of_stiffness(E, depth, thickness, length):
    K = pair_stiffness(E, depth, thickness, length)
    assert pair_length(E, depth, thickness, K) == pytest.approx(length, rel=ROUND_OFF)


def test_root_strain_is_that_of_the_moment_at_the_clamp():
    deflection = 0.5
    force_of_one_leaf = 0.5 * deflection * pair_stiffness(E, DEPTH, THICKNESS, LENGTH)
    moment = 0.5 * force_of_one_leaf * LENGTH  # guided: half of the moment at either end
    section_modulus = DEPTH * THICKNESS**2 / 6.0
    strain = root_strain(THICKNESS, LENGTH, deflection)
    assert strain == pytest.approx(moment / section_modulus / E, rel=ROUND_OFF)


def test_leaf_alone_counts_with_the_quotient_of_its_shape():
    """The guided shape 3 s^2 - 2 s^3 has a mean square of 13/35; 1 N/mm under 1 kg is sqrt(1000 / s^2) / 2 pi."""
    s = (np.arange(2000) + 0.5) / 2000
    share = float(((3.0 * s**2 - 2.0 * s**3) ** 2).mean())
    for shuttle, leaf in ((1000.0, 0.0), (0.0, 500.0 / share)):
        assert natural_frequency(1.0, shuttle, leaf) == pytest.approx(math.sqrt(1000.0) / (2.0 * math.pi), rel=1e-6)


SIZES = {"thickness": 0.8, "length": 28.3, "depth": 10.0, "separation": 14.0, "fillet": 0.5}


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *((field, value) for field in SIZES for value in (-0.1, math.inf, "1")),
        *((field, 0.0) for field in SIZES if field != "fillet"),
        ("length", 1.0),  # two fillets
        ("separation", 1.8),  # a leaf and two fillets
    ],
)
def test_size_that_no_flexure_has_is_refused(field, value):
    with pytest.raises(InputError) as error:
        Flexure(**{**SIZES, field: value})
    assert (error.value.field, error.value.value) == (f"flexure.{field}", value)


@pytest.mark.parametrize(("field", "value"), [("fillet", 0.0), ("length", 1.01), ("separation", 1.81)])
def test_flexure_may_have_no_fillets_and_hardly_a_window(field, value):
    assert getattr(Flexure(**{**SIZES, field: value}), field) == value
