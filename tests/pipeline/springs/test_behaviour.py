"""What the printed springs do beside their stiffness: stiffening, frequency, tilt."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from stand_ins import DEFLECTIONS, PETG, default_housing, fitted_housing, housing_stiffness, springs_of

from pipeline.springs.behaviour import LONGEST_FRACTION, spring_behaviour, stiffening
from pipeline.springs.fitted_springs import FittedSprings
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from sensor.theory.leaf_spring import natural_frequency

LENGTHS = (30.0, 16.0)


def springs(**changes):
    """Return springs of 1 N/mm that were never solved."""
    housing = default_housing(lengths=LENGTHS)
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
