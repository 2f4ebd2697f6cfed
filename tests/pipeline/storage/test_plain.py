"""Records go to JSON and come back the same; data that do not fit are refused with their place."""

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.storage.plain import ROUND_OFF, first_largest, from_plain, to_plain
from sensor.design.fruit import Fruit


@dataclass(frozen=True, kw_only=True, eq=False)
class Inner:
    C: NDArray[np.float64]
    name: Literal["low", "high"] = "low"


@dataclass(frozen=True, kw_only=True)
class Outer:
    inner: Inner
    pairs: tuple[tuple[str, float], ...]
    two: tuple[int, str]
    maybe: Fruit | None
    sizes: dict[str, float]
    free: float | str | None = None


def outer(**changes):
    values = {
        "inner": Inner(C=np.array([[0.1 + 0.2, 1e-300], [2.0, 3.0]]), name="high"),
        "pairs": (("a", 1.0), ("b", 2.5)),
        "two": (3, "x"),
        "maybe": Fruit(height_mm=11.0),
        "sizes": {"a": 1.0},
    }
    return Outer(**{**values, **changes})


def through_json(record):
    return json.loads(json.dumps(to_plain(record), allow_nan=False))


@pytest.mark.parametrize("changes", [{}, {"maybe": None}, {"pairs": ()}, {"free": 2.0}, {"free": "greater than 0"}])
def test_record_comes_back_through_json_to_the_last_bit(changes):
    record = outer(**changes)
    again = from_plain(Outer, through_json(record))
    np.testing.assert_array_equal(again.inner.C, record.inner.C)
    assert dataclasses.replace(again, inner=record.inner) == record
    assert again.inner.name == "high"


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"two": [3]}, "two"),
        ({"pairs": [["a", "b"]]}, r"pairs\[0\]\[1\]"),
        ({"pairs": [["a", True]]}, r"pairs\[0\]\[1\]"),
        ({"inner": {"C": [[1.0]], "name": "middle"}}, r"inner\.name"),
        ({"inner": {"C": "x"}}, r"inner\.C"),
        ({"inner": {}}, r"required field missing @ Outer\.inner\.C"),
        ({"sizes": {"a": "x"}}, r"sizes\['a'\]"),
        ({"other": 1.0}, r"extra fields found \(other\)"),
    ],
)
def test_data_that_do_not_fit_are_refused_with_their_place(change, place):
    with pytest.raises(ValueError, match=rf"{place}.*; it must be as it was written"):
        from_plain(Outer, {**through_json(outer()), **change})


@pytest.mark.parametrize(
    ("values", "least", "place"),
    [
        ((1.0, 3.0, 2.0), 0.0, 1),
        ((1.0, 3.0 * (1.0 + 1e-12), 3.0), 0.0, 1),
        ((1.0, 3.0, 3.0 * (1.0 + 2.0 * ROUND_OFF)), 0.0, 2),
        ((1e-15, 2e-15), 0.0, 1),
        ((1e-15, 2e-15), 1.0, 0),
        ((math.nan, 1.0, math.inf, math.inf), 0.0, 2),
    ],
)
def test_first_of_the_largest_is_the_same_for_any_round_off(values, least, place):
    assert first_largest(values, least) == place


def test_no_number_is_no_largest():
    with pytest.raises(ValueError, match="empty"):
        first_largest([math.nan])
