"""Prony series of flesh that relaxes: what is refused, alone and beside other keys."""

import pytest

from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import Reading
from sensor.design.tips import Press
from sensor.quantity import InputError


@pytest.mark.parametrize(
    "arms",
    [
        (),
        0.5,
        "0.5",
        (0.5, 2.0),
        ((0.5,),),
        ((0.5, 2.0, 1.0),),
        ((0.0, 2.0),),
        ((-0.1, 2.0),),
        ((1.0, 2.0),),
        ((0.5, 0.0),),
        ((0.5, -1.0),),
        ((0.5, float("inf")),),
        ((float("nan"), 1.0),),
        (("0.5", 1.0),),
        ((True, 1.0),),
        ((0.5, 1.0), (0.5, 9.0)),
        ((0.4, 1.0), (0.7, 9.0)),
    ],
)
def test_anything_but_shares_below_one_and_times_above_nought_is_refused(arms):
    with pytest.raises(InputError) as refused:
        Fruit(relaxation=arms)
    assert refused.value.field == "fruit.relaxation"
    assert "\n" not in str(refused.value)


FLESH = Fruit(relaxation=((0.5, 1.0),))
HELD = Press(speed_mm_per_s=0.5, hold_s=2.0)


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("press.speed_mm_per_s", {"fruit": FLESH}),
        ("press.hold_s", {"fruit": FLESH, "press": Press(speed_mm_per_s=0.5)}),
        ("press.speed_mm_per_s", {"press": Press(speed_mm_per_s=0.5)}),
        ("press.hold_s", {"press": Press(hold_s=0.5)}),
        ("reading.at_s", {"reading": Reading(at_s=0.5)}),
        ("reading.at_s", {"fruit": FLESH, "press": HELD, "reading": Reading(at_s=1.1)}),
        ("reading.at_s", {"fruit": FLESH, "press": HELD, "reading": Reading(at_s=3.3)}),
    ],
)
def test_keys_of_time_belong_together_and_a_reading_to_the_hold(field, changes):
    with pytest.raises(InputError) as refused:
        Design(**changes)
    assert refused.value.field == field


def test_reading_is_taken_when_the_press_stops_unless_the_design_says_when():
    assert Design(fruit=FLESH, press=HELD).read_s == 0.6 / 0.5
    assert Design(fruit=FLESH, press=HELD, reading=Reading(at_s=2.0)).read_s == 2.0
    assert Design(fruit=FLESH, press=HELD).release_s == 0.6 / 0.5 + 2.0
