import math

import numpy as np
import pytest

from sensor.words import round_below, rounded, value_text, value_with_bar


@pytest.mark.parametrize(
    ("value", "settings", "text"),
    [
        (905.72087, {"unit": "N/m"}, "905.72 N/m"),
        (np.float64(0.123456), {"unit": "1", "digits": 3}, "0.123"),
        (-3e-13, {"unit": "mm"}, "0 mm"),
        (1e-12, {}, "1e-12"),
        (123456789, {"unit": "N"}, "123456789 N"),
        ("at least one", {"unit": "1"}, "at least one"),
        ("down", {"unit": "mm"}, "down"),
        (True, {}, "passed"),
        (False, {"absent": "-"}, "failed"),
        *((value, {"absent": "-", "unit": "N"}, "-") for value in (None, math.nan, math.inf, -math.inf)),
        (None, {}, ""),
    ],
)
def test_shown(value, settings, text):
    assert value_text(value, **settings) == text


@pytest.mark.parametrize(
    ("value", "bar", "unit", "in_percent", "text"),
    [
        (905.845, 0.34704, "N/m", False, "905.85 ± 0.35 N/m"),
        (20829.8, 11.718, "N/m", False, "20830 ± 12 N/m"),
        (23183.6, 201.7, "N/m", False, "23180 ± 200 N/m"),
        (0.05000386, 2.9058e-5, "1", False, "0.050004 ± 0.000029"),
        (1.0, 0.0996, "", False, "1.00 ± 0.10"),  # a bar that rounds up to the next power of ten
        (1.494, 0.1434, "MPa", True, "1.49 MPa ± 9.6 %"),
        (0.86, 1.2, "MPa", True, "0.9 MPa ± 140 %"),
        (-0.0001, 0.0047, "mm", False, "-0.0001 ± 0.0047 mm"),
        (3.2e-14, 1.04e-15, "", False, "3.2e-14 ± 1e-15"),
        (905.72087, None, "N/m", False, "905.72 N/m"),
        (905.72087, 0.0, "N/m", False, "905.72 N/m"),
        (5.0, math.inf, "", False, "5"),
    ],
)
def test_bar_has_two_digits_and_the_number_ends_with_it(value, bar, unit, in_percent, text):
    assert value_with_bar(value, bar, unit, in_percent=in_percent) == text


@pytest.mark.parametrize(
    ("value", "digits", "towards", "expected"),
    [
        (0.12345, 3, 0.0, 0.123),
        (0.12345, 3, 1.0, 0.124),
        (1234.0, 3, 0.0, 1230.0),
        (0.123, 3, 1.0, 0.123),
        (0.1230000001, 3, 1.0, 0.123),
        (-0.12345, 3, 0.0, -0.123),
        (0.9995, 3, math.inf, 1.0),
        (3e-4 * (1.0 - 1e-12), 1, 0.0, 3e-4),
        (0.12351, 3, None, 0.124),
        (3.2501, 2, None, 3.3),
        (0.0, 3, 1.0, 0.0),
        (0.0, 3, None, 0.0),
    ],
)
def test_rounded(value, digits, towards, expected):
    """On the side of the other number, or to the nearest without one."""
    assert rounded(value, digits, towards=towards) == expected


@pytest.mark.parametrize(("value", "step"), [(7.3, 5.0), (5.0, 5.0), (4.99, 2.0), (0.019, 0.01), (200.0, 200.0)])
def test_round_below(value, step):
    assert round_below(value) == pytest.approx(step, rel=1e-12)
