"""Prony series of flesh that relaxes: what is refused, alone and beside other keys."""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import Reading
from sensor.design.tips import Press
from sensor.quantity import InputError
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation


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


def test_two_samples_of_one_time_keep_the_memory():
    """Nothing is lost in no time: elastic forces are felt whole, and what was lost before stays."""
    memory = Memory(Relaxation(((0.3, 2.0),)))
    memory.keep(np.array([[1.0, 2.0]]))
    memory.step(np.array([0.5]))
    memory.keep(np.array([[2.0, 3.0]]))
    fresh, lost = memory.step(np.array([0.0]))
    assert fresh == pytest.approx(np.ones((1, 1)))
    memory.keep(np.array([[2.0, 3.0]]))
    again, kept = memory.step(np.array([0.0]))
    assert (again, kept) == (pytest.approx(fresh), pytest.approx(lost))
