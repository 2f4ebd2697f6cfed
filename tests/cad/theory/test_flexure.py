import dataclasses
import math

import pytest

from cad.quantity import InputError
from cad.theory.flexure import Flexure

SIZES = {"thickness": 0.8, "length": 28.3, "depth": 10.0, "separation": 14.0, "fillet": 0.5}


@pytest.mark.parametrize("field", list(SIZES))
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, "1"])
def test_each_size_must_be_a_positive_number(field, value):
    with pytest.raises(InputError, match=rf"^flexure\.{field} = \S+ mm: must be .*greater than 0; choose another"):
        Flexure(**{**SIZES, field: value})


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("length", 1.0, "flexure.length = 1 mm: must be greater than 2 fillets = 1 mm; choose another process"),
        ("separation", 1.8, "flexure.separation = 1.8 mm: must be greater than thickness + 2 fillets = 1.8 mm; choose"),
    ],
)
def test_fillets_must_leave_a_straight_leaf_and_a_window(field, value, message):
    with pytest.raises(InputError) as caught:
        Flexure(**{**SIZES, field: value})
    assert str(caught.value).startswith(message)
    assert len(str(caught.value).splitlines()) == 1
    assert getattr(Flexure(**{**SIZES, field: value + 0.01}), field) == value + 0.01


def test_flexure_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'length'"):
        Flexure(**SIZES).length = 3.0
