"""Layouts of tips: where they stand, on which springs, and what a design file may not ask of them."""

import pytest

from sensor.design.design_file import design_from_mapping
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings
from sensor.design.reading import Reading
from sensor.design.tips import Press, Tips

SPRINGS = GivenSprings(K_l_N_per_m=1200.0, K_h_N_per_m=20000.0)
LINE = Tips(layout="line", order="LHL", outer_mm=0.1, spacing_mm=2.5)
SQUARE = Tips(layout="square", spacing_mm=6.0)


def test_pair_stands_on_the_length_axis():
    tips = Tips()
    assert tips.names == ("low", "high")
    assert tips.places_mm == ((-4.0, 0.0), (4.0, 0.0))
    assert tips.spring_groups == ((0,), (1,))


def test_line_has_its_order_and_longer_ends():
    assert LINE.springs == ("low", "high", "low")
    assert LINE.names == ("low_1", "high", "low_2")
    assert LINE.places_mm == ((-2.5, 0.0), (0.0, 0.0), (2.5, 0.0))
    assert LINE.height_offset_mm == (0.0, -0.1, 0.0)
    assert Tips(layout="line", order="HLH", spacing_mm=2.5).spring_groups == ((1,), (0, 2))


def test_square_has_equal_springs_on_its_diagonals():
    assert SQUARE.places_mm == ((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0))
    assert SQUARE.springs == ("low", "high", "low", "high")
    assert SQUARE.each(1.0, 2.0) == (1.0, 2.0, 1.0, 2.0)
    low, high = SQUARE.spring_groups
    for kind in (low, high):
        first, second = (SQUARE.places_mm[tip] for tip in kind)
        assert first == (-second[0], -second[1])


def test_springs_that_are_given_leave_no_targets_unless_the_file_has_them():
    springs = {"K_l_N_per_m": 900.0, "K_h_N_per_m": 20000.0}
    assert design_from_mapping({"springs": springs}).targets is None
    assert design_from_mapping({"springs": springs, "targets": {"NL": 0.05}}).targets.NL == 0.05


def test_reading_lets_every_tip_travel_by_how_much_its_tilt_changes():
    """The farthest corner of a square of 6 mm is 4.24 mm away: 0.297 mm at 4 degrees. Travel counts from touch."""
    level = Design(targets=None, springs=SPRINGS, tips=SQUARE, press=Press(travel_mm=0.4))
    assert level.full_travels_mm == (0.4, 0.4)
    press = Press(travel_mm=0.4)
    read = Design(targets=None, springs=SPRINGS, tips=SQUARE, press=press, reading=Reading(tilt_deg=4.0))
    assert read.full_travels_mm == (0.4, 0.4)
    read = Design(targets=None, springs=SPRINGS, tips=SQUARE, press=press, reading=Reading(tilt_change_deg=4.0))
    assert read.full_travels_mm == pytest.approx((0.6967, 0.6967), abs=1e-4)


def test_one_bruise_limit_for_each_modulus():
    assert Fruit(E_MPa=(1.0, 2.0), bruise_limit_MPa=0.3).bruise_limits_MPa == (0.3, 0.3)
    assert Fruit(E_MPa=(1.0, 2.0), bruise_limit_MPa=(0.1, 0.2)).bruise_limits_MPa == (0.1, 0.2)
