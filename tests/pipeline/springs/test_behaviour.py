"""What the printed springs do beside their stiffness: stiffening, frequency, tilt."""

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
HOUSING = default_housing(lengths=LENGTHS)
PAIR = (0.4, 2.0)  # [N] on the low and on the high tip


def behaviour(forces=PAIR, layout="pair", **changes):
    """Return the behaviour of springs of 1 N/mm under forces [N] on their tips at full travel."""
    stiffness = housing_stiffness((1.0, 1.0), **changes)
    springs = FittedSprings(
        springs={},
        printable={},
        process=PETG,
        deflections=DEFLECTIONS,
        fitted=fitted_housing(HOUSING, stiffness),
        tips=Tips(layout=layout),
    )
    return spring_behaviour(springs, press(forces))


def press(forces):
    """Return as much of a press as the behaviour reads: one modulus, forces [N] at first touch and at full travel."""
    return SimpleNamespace(table=SimpleNamespace(F=np.array([[np.zeros(len(forces)), forces]])))


def test_frequency_is_that_of_the_shuttle_and_its_leaves():
    """A neck whose sides go straight from those of the block to those of the tip, its volume by a sum."""
    low = HOUSING.arms[0]
    section = HOUSING.shuttle_width * HOUSING.depth
    sides = np.linspace(section**0.5, HOUSING.tip_side, 1001)
    neck = (HOUSING.neck_level - HOUSING.tip_height) * np.trapezoid(sides**2, dx=1e-3)
    shuttle = section * (low.top_level - HOUSING.neck_level) + neck + HOUSING.tip_side**2 * HOUSING.tip_height
    leaf = low.flexure.thickness * low.flexure.length * low.flexure.depth
    grams = 1e-3 * PETG.density_g_per_cm3
    expected = natural_frequency(0.906, grams * shuttle, grams * leaf)
    found = behaviour(C=np.diag([1.0 / 0.906, 1.0 / 20.8]))
    assert found.low.natural_frequency_Hz == pytest.approx(expected, rel=1e-4)


def test_stiffening_is_the_elastica_s_for_the_leaf_and_the_deflection_of_each_spring():
    """36/35 (d / L)^2 while d is small: 0.5 mm on 30 and 0.11 mm on 16; given for d up to half of L."""
    found = behaviour()
    for arm, d, L in zip((found.low, found.high), DEFLECTIONS, LENGTHS, strict=True):
        assert arm.large_deflection_stiffening == pytest.approx(36.0 / 35.0 * (d / L) ** 2, rel=1e-3)
    leaf = HOUSING.low
    assert stiffening(leaf, 10.0 * leaf.length) == stiffening(leaf, LONGEST_FRACTION * leaf.length)


@pytest.mark.parametrize(
    ("layout", "forces", "tilts"),
    [
        ("pair", PAIR, (0.4e-3, 0.4e-3)),
        # Tips of a square alternate between the kinds; the hardest pressed one of each counts.
        ("square", (0.1, 2.0, 0.4, 1.0), (0.4e-3, 0.4e-3)),
    ],
)
def test_tilt_is_the_solved_one_times_the_largest_force_on_a_spring(layout, forces, tilts):
    found = behaviour(forces, layout, tilt_per_N=(1e-3, 2e-4))
    assert (found.low.tilt_at_full_force_rad, found.high.tilt_at_full_force_rad) == pytest.approx(tilts)


def test_low_tip_moves_by_a_share_of_what_the_high_one_does_under_its_force():
    """C12 / C22 of the solve; springs that are not made do nothing."""
    assert behaviour(C=np.array([[1.0, 0.02], [0.02, 0.1]])).crosstalk_C12_over_C22 == pytest.approx(0.2)
    assert spring_behaviour(springs_of(Design(), made=False), press(PAIR)) is None
