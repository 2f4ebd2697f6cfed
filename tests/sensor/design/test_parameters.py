import dataclasses
import math

import pytest

from sensor.design.design_file import TABLE_TYPES
from sensor.design.parameters import Design, Print
from sensor.design.processes import PROCESSES
from sensor.design.tips import PressMotion
from sensor.quantity import InputError

KINDS = TABLE_TYPES
NUMBERS = [
    (table, item) for table, kind in KINDS.items() for item in dataclasses.fields(kind) if "unit" in item.metadata
]
CHOICES = [
    (table, item) for table, kind in KINDS.items() for item in dataclasses.fields(kind) if "options" in item.metadata
]
each_number = pytest.mark.parametrize(
    ("table", "item"), NUMBERS, ids=[f"{table}.{item.name}" for table, item in NUMBERS]
)
each_choice = pytest.mark.parametrize(
    ("table", "item"), CHOICES, ids=[f"{table}.{item.name}" for table, item in CHOICES]
)


def refused(table, key, value):
    with pytest.raises(InputError) as error:
        Design(**{table: KINDS[table](**{key: value})})
    return error.value


@each_number
def test_wrong_value_is_refused_with_its_bound_and_what_to_do(table, item):
    bounds = item.metadata["bounds"]
    outside = [limit for limit in (bounds.above, bounds.below) if limit is not None]
    if bounds.at_least is not None:
        outside.append(math.nextafter(bounds.at_least, -math.inf))
    if bounds.at_most is not None:
        outside.append(math.nextafter(bounds.at_most, math.inf))
    assert outside
    for value in (*outside, math.nan, "five", True):
        several = str(item.type).startswith("tuple")
        error = refused(table, item.name, (value,) if several else value)
        assert (error.field, str(error.value)) == (f"{table}.{item.name}", str(value))
        assert str(bounds) in error.bound
        assert item.metadata["hint"][1:].removesuffix(".") in str(error)  # its first letter becomes a capital


@each_choice
def test_choice_is_one_of_its_options(table, item):
    assert refused(table, item.name, "none of these").field == f"{table}.{item.name}"
    assert item.default is None or item.default in item.metadata["options"]


@pytest.mark.parametrize("tilt", [-3.0, 0.0, 5.0])
def test_tilt_lowers_the_high_tip_by_what_it_raises_the_low_one(tilt):
    design = Design(press=PressMotion(tilt_deg=tilt))
    step = 4.0 * math.tan(math.radians(tilt))
    assert design.full_travels_mm == pytest.approx((design.press.travel_mm - step, design.press.travel_mm + step))


@pytest.mark.parametrize("numbers", [{}, {"E_MPa": 1750.0}, {"leaf_thickness_low_mm": 1.2}])
def test_numbers_of_a_print_take_the_place_of_those_of_the_process(numbers):
    """The modulus of a coupon, and the thickness of leaves."""
    assert Design(print=Print(**numbers)).process == dataclasses.replace(PROCESSES["fdm-petg"], **numbers)
