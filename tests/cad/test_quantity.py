import dataclasses
import math

import pytest

from cad.quantity import Bounds, InputError, as_float, check_fields, choice, quantity, validation_error


@dataclasses.dataclass(frozen=True)
class _Record:
    size: float = quantity("mm", Bounds(above=0.0, at_most=10.0), default=1.0, remedy="take a small one")
    sizes: tuple[float, ...] = quantity("mm", Bounds(at_least=0.0), default=(1.0,), remedy="list some")
    maybe: float | None = quantity("1", Bounds(below=1.0), default=None, remedy="leave it out")
    kind: str = choice(("round", "square"), default="round")


def _refused(**values) -> str:
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
    ("bounds", "words"),
    [
        (Bounds(above=0.0, at_most=1000.0), "greater than 0 and at most 1000"),
        (Bounds(at_least=-30.0, below=0.5), "at least -30 and less than 0.5"),
        (Bounds(), "finite"),
    ],
)
def test_bounds_are_said_in_words(bounds, words):
    assert str(bounds) == words


KINDS = "round, square; choose one of these, did you mean "


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"size": 0.0}, "thing.size = 0 mm: must be greater than 0 and at most 10; take a small one"),
        ({"size": math.nan}, "thing.size = nan mm: must be greater than 0 and at most 10; take a small one"),
        ({"size": 10**400}, "thing.size = inf mm: must be greater than 0 and at most 10; take a small one"),
        ({"size": True}, "thing.size = True mm: must be a number greater than 0 and at most 10; take a small one"),
        ({"size": "5"}, "thing.size = '5' mm: must be a number greater than 0 and at most 10; take a small one"),
        ({"size": None}, "thing.size = None mm: must be a number greater than 0 and at most 10; take a small one"),
        ({"sizes": ()}, "thing.sizes = () mm: must be a list of at least one number, each at least 0; list some"),
        ({"sizes": 1.0}, "thing.sizes = 1 mm: must be a list of at least one number, each at least 0; list some"),
        ({"sizes": (1.0, -2.0)}, "thing.sizes = -2 mm: must be at least 0; list some"),
        ({"maybe": 1.0}, "thing.maybe = 1: must be less than 1; leave it out"),
        (
            {"kind": "oval"},
            "thing.kind = 'oval': must be one of round, square; choose one of these, did you mean round?",
        ),
        (
            {"kind": "squ\nare"},
            r"thing.kind = 'squ\nare': must be one of round, square; choose one of these, did you mean square?",
        ),
    ],
)
def test_message_names_value_unit_bound_and_remedy(values, message):
    assert _refused(**values) == message


def test_fields_within_bounds_pass():
    check_fields(_Record(), "thing")
    check_fields(_Record(size=10, sizes=(0.0, 5), maybe=-1.0, kind="square"), "thing")


def test_value_just_beyond_a_bound_does_not_read_as_the_bound():
    beyond = math.nextafter(10.0, 11.0)
    assert f"thing.size = {beyond!r} mm: must be" in _refused(size=beyond)


def test_fault_leaves_out_the_unit_one():
    assert (
        str(validation_error("NL", 0.5, "1", "less than 0.5", "write 0.05"))
        == "NL = 0.5: must be less than 0.5; write 0.05"
    )
    assert issubclass(InputError, ValueError)


@pytest.mark.parametrize(
    ("number", "expected"),
    [(3, 3.0), (0.5, 0.5), (10**400, math.inf), (-(10**400), -math.inf)],
    ids=["whole", "fraction", "huge", "hugely negative"],
)
def test_whole_numbers_beyond_floats_are_infinite(number, expected):
    assert as_float(number) == expected
