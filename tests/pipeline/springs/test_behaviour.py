"""What the printed springs do beside their stiffness: bridges, stiffening, frequency, tilt."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from stand_ins import DEFLECTIONS, PETG, default_housing, fitted_housing, housing_stiffness, springs_of

from pipeline.springs.behaviour import LONGEST_FRACTION, spring_behaviour, stiffening
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.mounts import bonded_foils
from sensor.design.parameters import Design, Print
from sensor.design.tips import Tips
from sensor.theory.leaf_spring import natural_frequency

LENGTHS = (30.0, 16.0)


def springs(gauges="none", **changes):
    """Return springs of 1 N/mm that were never solved, their gauges under a given strain per newton."""
    housing = default_housing(Design(print=Print(gauges=gauges)), LENGTHS)
    stiffness = housing_stiffness((1.0, 1.0), **changes)
    return FittedSprings(
        springs=(),
        process=PETG,
        deflections=DEFLECTIONS,
        fitted=fitted_housing(housing, stiffness),
    )


def forces(low, high):
    """Return as much of a press as the behaviour reads: one modulus, forces [N] of both tips at full travel."""
    return SimpleNamespace(table=SimpleNamespace(F=np.array([[[0.0, 0.0], [low, high]]])))


def test_frequency_is_that_of_the_shuttle_and_its_leaves():
    """A neck whose sides go straight from those of the block to those of the tip, its volume by a sum."""
    given = springs()
    soft = dataclasses.replace(given.fitted, stiffness=housing_stiffness((0.906, 20.8)))
    behaviour = spring_behaviour(dataclasses.replace(given, fitted=soft), forces(0.4, 2.0))
    housing = soft.housing
    low = housing.arms[0]
    section = housing.shuttle_width * housing.depth
    sides = np.linspace(section**0.5, housing.tip_side, 1001)
    neck = (housing.neck_level - housing.tip_height) * np.trapezoid(sides**2, dx=1e-3)
    shuttle = section * (low.top_level - housing.neck_level) + neck + housing.tip_side**2 * housing.tip_height
    leaf = low.flexure.thickness * low.flexure.length * low.flexure.depth
    grams = 1e-3 * PETG.density_g_per_cm3
    expected = natural_frequency(0.906, grams * shuttle, grams * leaf)
    assert behaviour.arms["low"].natural_frequency_Hz == pytest.approx(expected, rel=1e-4)


def test_bridge_with_gauges_shows_the_strain_of_the_solve_with_them():
    """A full bridge gives gauge factor 2.1 x strain: 1e-3 a newton at 0.4 N is 0.84 mV/V."""
    gauged = springs("foil", gauge_strain_per_N=(1e-3, 2e-4), gauge_error=(0.03, 0.02))
    behaviour = spring_behaviour(gauged, forces(0.4, 2.0))
    assert behaviour.gauges == "foil"
    for name, error in (("low", 0.03), ("high", 0.02)):
        assert behaviour.arms[name].bridge_mV_per_V == pytest.approx([2.1 * 0.4])
        assert behaviour.arms[name].bridge_error_percent == 100.0 * error


def test_bridge_without_gauges_is_the_beam_s():
    """Root strain 3 t d / L^2 at 0.4 mm, less a tenth for a grid of 3 mm on 30."""
    low = spring_behaviour(springs(), forces(0.4, 2.0)).arms["low"]
    assert low.bridge_mV_per_V == pytest.approx([2.1e3 * 3.0 * 0.8 * 0.4 / 900.0 * 0.9])
    assert low.bridge_error_percent is None


def test_leaf_too_short_for_the_grid_has_no_bridge():
    given = springs()
    short = dataclasses.replace(given.fitted, housing=default_housing(lengths=(30.0, 5.0)))
    behaviour = spring_behaviour(dataclasses.replace(given, fitted=short), forces(0.4, 2.0))
    assert behaviour.arms["high"].bridge_mV_per_V == (None,)


def test_gauges_lie_on_the_upper_leaf_at_both_roots_and_on_both_faces():
    """Grids of 3 mm begin 1 mm off the roots; the sign is that of the strain under a force up."""
    housing = springs("foil").fitted.housing
    low = housing.arms[0]
    found = set()
    for foil in bonded_foils(housing):
        if foil.grid and foil.tip == 0:
            above = foil.z - housing.lower_leaf_level - 14.0
            found.add((foil.sign, round(above, 9), *(round(x, 9) for x in sorted(foil.grid[0]))))
    at_wall = tuple(round(low.wall + x, 9) for x in (1.0, 4.0))
    at_shuttle = tuple(round(low.shuttle - x, 9) for x in (4.0, 1.0))
    assert found == {
        (1.0, 0.4, *at_wall),
        (-1.0, -0.4, *at_wall),
        (-1.0, 0.4, *at_shuttle),
        (1.0, -0.4, *at_shuttle),
    }


def test_stiffening_is_the_elastica_s_for_the_leaf_and_the_deflection_of_each_spring():
    """36/35 (d / L)^2 while d is small: 0.5 mm on 30 and 0.11 mm on 16."""
    behaviour = spring_behaviour(springs(), forces(0.4, 2.0))
    for name, d, L in zip(("low", "high"), DEFLECTIONS, LENGTHS, strict=True):
        expected = 36.0 / 35.0 * (d / L) ** 2
        assert behaviour.arms[name].large_deflection_stiffening == pytest.approx(expected, rel=1e-3)


def test_stiffening_is_given_up_to_half_a_length():
    leaf = default_housing().arms[0].flexure
    most = stiffening(leaf, LONGEST_FRACTION * leaf.length)
    assert stiffening(leaf, 10.0 * leaf.length) == most


def test_tilt_and_crosstalk_are_those_of_the_solve():
    """Tilt per newton times the largest force; the low tip moves by C12 / C22 of what the high one does."""
    C = np.array([[1.0, 0.02], [0.02, 0.1]])
    behaviour = spring_behaviour(springs(C=C, tilt_per_N=(1e-3, 2e-4)), forces(0.4, 2.0))
    assert behaviour.crosstalk == pytest.approx(0.2)
    tilts = [behaviour.arms[name].tilt_at_full_force_rad for name in ("low", "high")]
    assert tilts == pytest.approx([4e-4, 4e-4])


def test_springs_that_are_not_made_do_nothing():
    assert spring_behaviour(springs_of(Design(), made=False), forces(0.4, 2.0)) is None


def test_behaviour_of_a_square_is_that_of_its_hardest_pressed_tips():
    """Tips alternate between the kinds: the tilt is in proportion to the largest force on a spring of the kind."""
    given = dataclasses.replace(springs(tilt_per_N=(1e-4, 2e-4)), tips=Tips(layout="square"))
    four = SimpleNamespace(table=SimpleNamespace(F=np.array([[[0.1, 2.0, 0.4, 1.0]]])))
    arms = spring_behaviour(given, four).arms
    assert arms["low"].tilt_at_full_force_rad == pytest.approx(0.4e-4)
    assert arms["high"].tilt_at_full_force_rad == pytest.approx(4e-4)
