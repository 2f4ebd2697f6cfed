"""The bench of streams reads what it presses; its rates depend on the machine and are printed only."""

import pytest
from bench.stream import samples_a_second
from measured_units import MeasuredDesign


@pytest.mark.parametrize("name", ["mango", "paper"])
def test_each_press_is_one_reading(name):
    measured = MeasuredDesign(name, assessed=False)
    rate, count = samples_a_second(measured, 3000, every_sample=False)
    assert rate > 0.0
    assert count == 3
