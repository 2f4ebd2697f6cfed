"""How a sensor stands on a fruit: the pose at a part of the press, all that occurs, and its name in words."""

import dataclasses

import numpy as np
import pytest
from flat_square import square_design

from pipeline.reading.poses import Placement, occurring_fruits, occurring_placements, read_moduli
from sensor.design.fruit import Fruit
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import Tips

DOMES = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.9, spacing_mm=6.0)
BALL = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0)


def placements(fruit=None, **reading):
    """Return the ends of the ranges, then the drawn placements."""
    square = square_design()
    design = dataclasses.replace(square, fruit=fruit, tips=DOMES) if fruit else square
    places = list(occurring_placements(design, ReadingRequirements(**reading)))
    return [place for place in places if not place.is_random], [place for place in places if place.is_random]


def test_pose_at_a_part_of_the_press():
    """The tilt changes in proportion to the travel."""
    placement = Placement(tilt_deg=(1.0, -2.0), off_centre_mm=(0.3, 0.4), tilt_change_deg=(0.2, -0.6), thickness_mm=9.0)
    part = placement.after(0.25)
    assert part.tilt_change_deg == pytest.approx((0.05, -0.15))
    assert dataclasses.replace(part, tilt_change_deg=(0.2, -0.6)) == placement


def test_placements_by_hand():
    """At the ends of the ranges a hand ends at the largest tilt on each diagonal, beside the apex on the same side."""
    reading = {"tilt_deg": 3.0, "tilt_change_deg": 0.5, "off_centre_mm": 1.5, "radius_spread": 0.2}
    turned = [place for place in placements(BALL, **reading)[0] if any(place.tilt_change_deg)]
    directions = np.sqrt(0.5) * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    for radius in (28.0, 42.0):
        corner = [place for place in turned if place.radii_mm == pytest.approx((radius, radius))]
        for name, length in {"tilt_change_deg": 0.5, "tilt_deg": 2.5, "off_centre_mm": 1.5}.items():
            assert np.array([getattr(place, name) for place in corner]) == pytest.approx(length * directions)
    steady = [place for place in placements(BALL, **reading | {"tilt_deg": 0.2})[0] if any(place.tilt_change_deg)]
    assert {(round(float(np.hypot(*place.tilt_change_deg)), 9), place.tilt_deg) for place in steady} == {
        (0.2, (0.0, 0.0))
    }


def test_tilts():
    """They point in equal steps of an eighth of a turn; a level sensor has none."""
    turns = np.arange(8) / 8.0
    expected = 2.0 * np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)], axis=1)
    assert np.array([place.tilt_deg for place in placements(tilt_deg=2.0)[0][1:]]) == pytest.approx(expected)
    level, drawn = placements(tilt_deg=0.0, off_centre_mm=0.0)
    assert {place.tilt_deg for place in (*level, *drawn)} == {(0.0, 0.0)}


def test_poses_are_drawn_evenly_by_area():
    """The mean square is half of the largest; 48 draws of variance 1 / 12 of it."""
    _, drawn = placements(tilt_change_deg=0.5)
    for name, limit in {"tilt_deg": 3.5, "off_centre_mm": 1.0, "tilt_change_deg": 0.5}.items():
        lengths = np.hypot(*np.array([getattr(place, name) for place in drawn]).T)
        assert 0.9 * limit < lengths.max() <= limit
        assert np.mean(lengths**2) == pytest.approx(0.5 * limit**2, abs=3.5 * limit**2 / np.sqrt(12.0 * len(drawn)))


def test_fruits_of_an_ellipsoid_that_spread_keep_their_form():
    egg = Fruit(shape="ellipsoid", radius_mm=30.0, radius_across_mm=60.0, thickness_mm=12.0)
    assert occurring_fruits(egg, ReadingRequirements()).radius == pytest.approx((24.0, 36.0))
    met = np.array([place.radii_mm for places in placements(egg) for place in places if place.radii_mm])
    assert len(met) > 48
    assert met[:, 1] == pytest.approx(2.0 * met[:, 0])


def test_fruits_are_drawn_from_all_ranges_and_stand_at_their_ends():
    ranges = {"radius_mm": (42.0, 53.0), "radius_across_mm": (86.0, 144.0), "thickness_mm": (8.0, 20.0)}
    egg = Fruit(
        shape="ellipsoid", radius_mm=47.0, radius_across_mm=110.0, length_mm=24.0, width_mm=24.0, thickness_mm=12.0
    )
    ends, drawn = placements(egg, **ranges)
    corners = [(42.0, 86.0), (42.0, 144.0), (53.0, 86.0), (53.0, 144.0)]
    assert {(place.radii_mm, place.azimuth_deg) for place in ends if place.radii_mm} == {
        (radii, azimuth) for radii in corners for azimuth in (0.0, 45.0, 135.0)
    }
    assert {place.thickness_mm for place in ends} == {None, 8.0, 20.0}
    met = np.array([(*place.radii_mm, place.azimuth_deg) for place in drawn])
    for column, (low, high) in zip(met.T, ((42.0, 53.0), (86.0, 144.0), (0.0, 180.0)), strict=True):
        assert low <= column.min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < column.max() <= high


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
    ("placement", "words"),
    [
        ({}, ["level"]),
        ({"tilt_deg": (0.0, -2.0)}, ["tilted 2 deg", " -y"]),
        ({"off_centre_mm": (1.0, -np.sqrt(3.0))}, ["level", "2 mm off", " -60 deg"]),
        ({"radii_mm": (28.0, 33.0)}, ["28 mm"]),
        ({"radii_mm": (28.0, 33.0), "azimuth_deg": 45.0, "thickness_mm": 8.0}, ["28 and 33 mm", "45 deg", "8 mm"]),
    ],
)
def test_name_of_a_placement_has_its_numbers(placement, words):
    assert [word for word in words if word not in str(Placement(**placement))] == []
