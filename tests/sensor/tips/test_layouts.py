"""Layouts: the turn between two presses of a fruit exchanges low and high tips."""

import math

import pytest

from sensor.tips.layouts import LAYOUTS


def turned(layout, order, degrees):
    """Return the springs by the places of their tips after a turn about the press."""
    angle = math.radians(degrees)
    return {
        (
            round(x * math.cos(angle) - y * math.sin(angle), 9) + 0.0,
            round(x * math.sin(angle) + y * math.cos(angle), 9) + 0.0,
        ): spring
        for (x, y), spring in zip(layout.positions, order, strict=True)
    }


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_least_turn_that_exchanges_low_and_high_tips(layout):
    for order in layout.orders:
        exchanged = {place: "HL"["LH".index(spring)] for place, spring in turned(layout, order, 0.0).items()}
        turns = [degrees for degrees in range(15, 360, 15) if turned(layout, order, degrees) == exchanged]
        assert layout.turn_deg == min(turns, default=None)
