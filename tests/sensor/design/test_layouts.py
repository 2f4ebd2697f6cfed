"""Layouts of tips: where they stand, on which springs, and what a design file may not ask of them."""

import math
from dataclasses import replace

import pytest

from sensor.design.design_file import design_from_mapping
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips

SPRINGS = GivenSprings(K_l_N_per_m=1200.0, K_h_N_per_m=20000.0)
SQUARE = Tips(layout="square", spacing_mm=6.0)


@pytest.mark.parametrize(
    ("tips", "names", "places", "groups", "heights"),
    [
        (Tips(), ("low", "high"), ((-4.0, 0.0), (4.0, 0.0)), ((0,), (1,)), (0.0, 0.0)),
        (
            Tips(layout="line", order="LHL", outer_mm=0.1, spacing_mm=2.5),
            ("low_1", "high", "low_2"),
            ((-2.5, 0.0), (0.0, 0.0), (2.5, 0.0)),
            ((0, 2), (1,)),
            (0.0, -0.1, 0.0),
        ),
        (
            Tips(layout="line", order="HLH", spacing_mm=2.5),
            ("high_1", "low", "high_2"),
            ((-2.5, 0.0), (0.0, 0.0), (2.5, 0.0)),
            ((1,), (0, 2)),
            (0.0, 0.0, 0.0),
        ),
        (
            SQUARE,  # equal springs on its diagonals
            ("low_1", "high_1", "low_2", "high_2"),
            ((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)),
            ((0, 2), (1, 3)),
            (0.0, 0.0, 0.0, 0.0),
        ),
    ],
)
def test_tips_stand_where_their_layout_says(tips, names, places, groups, heights):
    assert (tips.names, tips.places_mm, tips.spring_groups) == (names, places, groups)
    assert tips.height_offset_mm == heights
    assert tips.springs == tips.each("low", "high") == tuple(name.partition("_")[0] for name in names)


def test_springs_that_are_given_leave_no_targets_unless_the_file_has_them():
    springs = {"K_l_N_per_m": 900.0, "K_h_N_per_m": 20000.0}
    assert design_from_mapping({"springs": springs}).targets is None
    assert design_from_mapping({"springs": springs, "targets": {"NL": 0.05}}).targets.NL == 0.05


def test_reading_lets_every_tip_travel_by_how_much_its_tilt_changes():
    """The farthest corner of a square of 6 mm is 4.24 mm away: 0.297 mm at 4 degrees. Travel counts from touch."""
    design = Design(targets=None, springs=SPRINGS, tips=SQUARE, press=PressMotion(travel_mm=0.4))
    lowered = 3.0 * math.sqrt(2.0) * math.tan(math.radians(4.0))
    for reading, more in (
        (None, 0.0),
        (ReadingRequirements(tilt_deg=4.0), 0.0),
        (ReadingRequirements(tilt_change_deg=4.0), lowered),
    ):
        assert replace(design, reading=reading).full_travels_mm == pytest.approx(2 * (0.4 + more,), rel=1e-12)


def test_one_bruise_limit_for_each_modulus():
    assert Fruit(E_MPa=(1.0, 2.0), bruise_limit_MPa=0.3).bruise_limits_MPa == (0.3, 0.3)
    assert Fruit(E_MPa=(1.0, 2.0), bruise_limit_MPa=(0.1, 0.2)).bruise_limits_MPa == (0.1, 0.2)
