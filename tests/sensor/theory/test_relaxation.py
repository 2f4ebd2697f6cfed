"""Prony series of flesh that relaxes: the moment of a reading, and its memory between samples."""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation

FLESH = Fruit(relaxation=((0.5, 1.0),))
HELD = PressMotion(speed_mm_per_s=0.5, hold_s=2.0)


def test_reading_is_taken_when_the_press_stops_unless_the_design_says_when():
    assert Design(fruit=FLESH, press=HELD).read_s == 0.6 / 0.5
    assert Design(fruit=FLESH, press=HELD, reading=ReadingRequirements(at_s=2.0)).read_s == 2.0
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
