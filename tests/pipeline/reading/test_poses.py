"""How a sensor stands on a fruit: the pose at a part of the press, the ends of what occurs, and its name in words."""

import dataclasses

import numpy as np
import pytest
from flat_square import square_design

from pipeline.reading.poses import Placement, occurring, read_moduli
from sensor.design.fruit import Fruit
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import Tips

DOMES = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.9, spacing_mm=6.0)


def test_pose_at_a_part_of_the_press():
    """The tilt changes in proportion to the travel."""
    placement = Placement(tilt_deg=(1.0, -2.0), off_centre_mm=(0.3, 0.4), turned_deg=(0.2, -0.6), thickness_mm=9.0)
    part = placement.after(0.25)
    assert part.turned_deg == pytest.approx((0.05, -0.15))
    assert dataclasses.replace(part, turned_deg=(0.2, -0.6)) == placement


def test_placements_by_hand():
    """At the ends of the ranges a hand ends at the largest tilt on each diagonal, beside the apex on the same side."""
    ball = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0)
    design = dataclasses.replace(square_design(), fruit=ball, tips=DOMES)
    reading = ReadingRequirements(tilt_deg=3.0, tilt_change_deg=0.5, off_centre_mm=1.5, radius_spread=0.2)
    turned = [place for place in occurring(design, reading) if any(place.turned_deg) and not place.is_drawn]
    diagonal = np.sqrt(0.5)
    expected = {(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)}
    for radius in (28.0, 42.0):
        corner = [place for place in turned if place.radii_mm == pytest.approx((radius, radius))]
        assert {tuple(np.sign(place.turned_deg).tolist()) for place in corner} == expected
        for place in corner:
            direction = diagonal * np.sign(place.turned_deg)
            assert place.turned_deg == pytest.approx(0.5 * direction)
            assert place.tilt_deg == pytest.approx(2.5 * direction)
            assert place.off_centre_mm == pytest.approx(1.5 * direction)
    steady = occurring(design, dataclasses.replace(reading, tilt_deg=0.2))
    by_hand = [place for place in steady if any(place.turned_deg) and not place.is_drawn]
    assert all(np.hypot(*place.turned_deg) == pytest.approx(0.2) for place in by_hand)
    assert all(place.tilt_deg == (0.0, 0.0) for place in by_hand)


def test_tilts():
    """They point in equal steps of an eighth of a turn; a level sensor has none."""
    square = square_design(tilt_deg=2.0)
    tilts = [place.tilt_deg for place in occurring(square, square.reading) if not place.is_drawn][1:]
    turns = np.arange(8) / 8.0
    expected = 2.0 * np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)], axis=1)
    assert np.array(tilts) == pytest.approx(expected)
    level = ReadingRequirements(tilt_deg=0.0, off_centre_mm=0.0)
    assert {place.tilt_deg for place in occurring(square, level)} == {(0.0, 0.0)}


@pytest.mark.parametrize(
    ("E_MPa", "E_max", "expected"),
    [
        ((0.5, 1.0, 2.0), 3.5, (0.5, 1.0, 2.0, 3.5)),
        ((0.5, 4.0), 4.0, (0.5, 1.0, 2.0, 4.0)),  # a factor of two between four
        ((2.0,), 2.0, (2.0,)),
    ],
)
def test_read_moduli(E_MPa, E_max, expected):
    """Readings are at no fewer than four moduli where there is a range."""
    assert read_moduli(Fruit(E_MPa=E_MPa, E_max_MPa=E_max)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("vector", "direction"),
    [
        ((2.0, 0.0), "+x"),
        ((0.0, 2.0), "+y"),
        ((-2.0, 0.0), "-x"),
        ((0.0, -2.0), "-y"),
        ((2.0, 2.0), "45 deg"),
        ((-2.0, 2.0), "135 deg"),
        ((1.0, -np.sqrt(3.0)), "-60 deg"),
    ],
)
def test_direction(vector, direction):
    """A direction is an axis or an angle to it."""
    assert f" {direction}" in str(Placement(tilt_deg=vector))
    assert f" {direction}" in str(Placement(off_centre_mm=vector))


def test_placement_on_another_fruit():
    """A placement names the fruit that it is on."""
    assert str(Placement()) == "level"
    assert "28 mm" in str(Placement(radii_mm=(28.0, 33.0)))
    turned = str(Placement(radii_mm=(28.0, 33.0), azimuth_deg=45.0, thickness_mm=8.0))
    assert [number in turned for number in ("28 and 33 mm", "45 deg", "8 mm")] == [True] * 3
