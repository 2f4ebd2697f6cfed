import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest

from sensor.quantity import (
    Bounds,
    Estimate,
    InputError,
    check_fields,
    choice,
    nearest,
    parse_number,
    quantity,
    unknown_name,
    validation_error,
)


@dataclasses.dataclass(frozen=True)
class _Record:
    size: float = quantity("mm", Bounds(above=0.0, at_most=10.0), default=1.0, hint="take a small one")
    sizes: tuple[float, ...] = quantity("mm", Bounds(at_least=0.0), default=(1.0,), hint="list some")
    maybe: float | None = quantity("1", Bounds(below=1.0), default=None, hint="leave it out")
    kind: str = choice(("round", "square"), default="round")


def _refused(**values):
    with pytest.raises(InputError) as caught:
        check_fields(_Record(**values), "thing")
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message


@pytest.mark.parametrize(
    ("bounds", "inside", "outside"),
    [
        (Bounds(above=0.0), (1e-300, 1e300), (0.0, -1e-300)),
        (Bounds(at_least=0.0), (0.0, 1.0), (-1e-300,)),
        (Bounds(below=1.0), (math.nextafter(1.0, 0.0), -1e300), (1.0,)),
        (Bounds(at_most=1.0), (1.0,), (math.nextafter(1.0, 2.0),)),
        (Bounds(above=0.0, below=1.0), (0.5,), (0.0, 1.0)),
        (Bounds(), (0.0, -1e300), ()),
    ],
)
def test_bounds_are_open_and_closed_where_they_say(bounds, inside, outside):
    assert all(bounds.hold(value) for value in inside)
    assert not any(bounds.hold(value) for value in (*outside, math.nan, math.inf, -math.inf))


@pytest.mark.parametrize(
    ("values", "field", "bound"),
    [
        *(({"size": value}, "size", "greater than 0 and at most 10") for value in (0.0, math.nan, 10**400)),
        *(
            ({"size": value}, "size", "a number greater than 0 and at most 10")
            for value in (True, "5", None, np.bool_(True), [1.0], np.array([1.0]))
        ),
        *(({"sizes": value}, "sizes", "a list of at least one number, each at least 0") for value in ((), 1.0)),
        ({"sizes": (1.0, -2.0)}, "sizes", "at least 0"),
        ({"maybe": 1.0}, "maybe", "less than 1"),
        *(({"kind": value}, "kind", "one of round, square") for value in ("oval", "squ\nare")),
    ],
)
def test_error_has_field_and_bound(values, field, bound):
    with pytest.raises(InputError) as error:
        check_fields(_Record(**values), "thing")
    assert (error.value.field, error.value.bound) == (f"thing.{field}", bound)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("given", "stored"),
    [(np.float32(0.5), 0.5), (np.int64(2), 2), (np.array(0.5), 0.5), (np.float64(0.1), 0.1), (Fraction(1, 2), 0.5)],
)
def test_number_of_another_type_is_stored_as_one_of_python(given, stored):
    record = _Record(size=given, sizes=[given, 1])
    check_fields(record, "thing")
    assert record == _Record(size=stored, sizes=(stored, 1))
    assert [type(number) for number in (record.size, *record.sizes)] == [type(stored), type(stored), int]


def test_list_and_array_are_stored_as_a_tuple():
    for given in ([1.0, 2.0], np.array([1.0, 2.0])):
        record = _Record(sizes=given)
        check_fields(record, "thing")
        assert record.sizes == (1.0, 2.0)


def test_message_names_value_unit_bound_hint_and_the_nearest_option():
    """The form that every message has."""
    assert _refused(size=0.0) == "thing.size = 0 mm must be greater than 0 and at most 10. Take a small one."
    assert _refused(kind="oval") == (
        "thing.kind = 'oval' must be one of round, square. Choose one of these. Did you mean round?"
    )


def test_value_just_beyond_a_bound_does_not_read_as_the_bound():
    beyond = math.nextafter(10.0, 11.0)
    assert f"thing.size = {beyond!r} mm must be" in _refused(size=beyond)


def test_endless_value_is_cut_in_a_message():
    assert len(str(validation_error("NL", "x" * 10**6, "", "less than 0.5", "write 0.05"))) < 1000


@pytest.mark.parametrize(
    ("text", "number"),
    [(".03", 0.03), ("3e-2", 0.03), ("+1", 1.0), ("-.5E1", -5.0), ("1.", 1.0), (" 2 ", 2.0)]
    + [(text, None) for text in ("", ".", "e5", "1_000", "nan", "inf", "0x1", "1 2", "--1", "\u0661", "1.\u0665")],
)
def test_numbers_as_people_write_them(text, number):
    assert parse_number(text) == number


@pytest.mark.parametrize(
    ("name", "word", "closest"),
    [("sde_mm", None, "side_mm"), ("tips.sde", "sde", "side_mm"), ("tips_y", None, "tips_x")],
)
def test_unknown_name_is_refused_with_the_name_most_like_its_own_part(name, word, closest):
    error = unknown_name("key", name, ["side_mm", "tips_x"], word)
    assert (error.field, error.value, error.bound) == (name, word or name, "one of side_mm, tips_x")
    assert str(error).endswith(f"Did you mean {closest}?")


def test_nearest_name_is_found_whatever_its_case():
    assert nearest("PETG", ["sla-resin", "fdm-petg", "E_MPa"]) == "fdm-petg"
    assert nearest("e_mpa", ["sla-resin", "fdm-petg", "E_MPa"]) == "E_MPa"


def test_estimate_in_another_unit_has_the_same_relative_error():
    estimate = Estimate(2.0, 0.125, "N/mm").times(1e3, "N/m")
    assert (estimate.value, estimate.error, estimate.unit) == (2000.0, 125.0, "N/m")
    assert (estimate.relative, estimate.percent) == (0.0625, 6.25)
    assert Estimate(-2.0, 0.125).relative == 0.0625
    assert (Estimate(0.0, 0.0).relative, Estimate(0.0, 0.1).relative) == (0.0, math.inf)
