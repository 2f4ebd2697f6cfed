"""The contrast of a reading: exact for what it models, blind to the pose, refused where it tells nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from sensor.quantity import InputError
from sensor.theory.contrast_law import (
    ContrastLaw,
    ReadingError,
    contrast_slopes,
    contrast_weights,
    fit_plane,
    read_modulus,
    smallest_root,
    stiffened_compliance,
    tip_travels,
)
from sensor.theory.hertz import hertz_factor

SQUARE = ((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0))
KINDS = ("low", "high", "low", "high")
LINE = ((-2.5, 0.0), (0.0, 0.0), (2.5, 0.0))
DOMES = hertz_factor(7.8, 0.3)
ROUND_OFF = 1e-9  # of E, as the issue of the layouts asks


def law_of(rng, places=SQUARE, kinds=KINDS, hertz=DOMES):
    stiffness = np.where(np.array(kinds) == "low", *rng.uniform((0.5, 10.0), (2.0, 30.0)))
    apart = np.hypot(*(np.subtract.outer(axis, axis) for axis in np.array(places).T))
    S = 0.9 / np.where(apart > 0.0, np.pi * apart, math.inf if hertz else 1.2)
    return ContrastLaw(
        weights=contrast_weights(places, kinds),
        gaps=tuple(rng.uniform(0.0, 0.02, len(places))),
        C=np.diag(1.0 / stiffness).tolist(),
        S=S.tolist(),
        hertz=hertz,
    )


def forces_of(law, E, lowered):
    """Return forces [N] of tips that are lowered [mm], from a general solver of the equations of the tips."""
    compliance = np.array(law.C) + np.array(law.S) / E

    def misfit(roots):
        return compliance @ roots**3 + law.hertz * E ** (-2.0 / 3.0) * roots**2 + law.gaps - lowered

    found = root(misfit, np.full(len(lowered), 0.8), tol=1e-13)
    return found.x**3 if found.success and found.x.min() > 0.05 else None


@pytest.mark.parametrize(
    ("places", "kinds", "hertz"), [(SQUARE, KINDS, 0.0), (LINE, ("low", "high", "low"), 0.0), (SQUARE, KINDS, DOMES)]
)
def test_domes_are_read_exactly_in_any_pose(places, kinds, hertz, rng):
    """And flat tips, whose factor of Hertz is 0; the travels of all tips are found again too."""
    read = 0
    while read < 20:
        law, E = law_of(rng, places, kinds, hertz), 10.0 ** rng.uniform(-0.3, 0.55)
        lowered = rng.uniform(0.3, 0.6) + np.array(places) @ np.tan(np.radians(rng.uniform(-2.0, 2.0, 2)))
        forces = forces_of(law, E, lowered)
        if forces is not None:
            assert read_modulus(law, forces.tolist()) == pytest.approx(E, rel=ROUND_OFF)
            assert tip_travels(law, forces.tolist(), E) == pytest.approx(lowered, rel=ROUND_OFF)
            read += 1


@pytest.mark.parametrize(
    ("places", "kinds"),
    [
        (((-4.0, 0.0), (4.0, 0.0)), ("low", "high")),
        (SQUARE, ("low", "low", "high", "high")),  # equal springs belong on the diagonals
    ],
)
def test_layout_that_lets_a_tilt_through_is_refused(places, kinds):
    with pytest.raises(InputError) as error:
        contrast_weights(places, kinds)
    assert error.value.field == "tips.layout"


@pytest.mark.parametrize("forces", [(0.5, 2.0, 0.5, 0.0), (0.5, math.nan, 0.5, 2.0), (0.5, 2.0), (5.0, 0.1, 5.0, 0.1)])
def test_forces_that_tell_nothing_are_refused(forces, rng):
    with pytest.raises(ReadingError):
        read_modulus(law_of(rng, hertz=0.0), forces)


def test_tables_of_another_number_of_tips_are_refused():
    with pytest.raises(ValueError, match="2 tips"):
        ContrastLaw(weights=(1.0, -1.0), gaps=(0.0,), C=[[1.0]], S=[[1.0]])


def test_slopes_are_those_of_small_changes(rng):
    law, forces = law_of(rng), np.array([0.30, 1.0, 0.34, 1.1])
    E = read_modulus(law, forces)
    slopes = contrast_slopes(law, forces, E)

    def slope(read, step=1e-6):
        """Return the relative slope of a reading at no change, from both sides."""
        return (read(step) - read(-step)) / (2.0 * step * E)

    def stiffer(change):
        return replace(law, C=stiffened_compliance(law.C, 1.0 + change))

    each = np.eye(4)
    by_force = [slope(lambda change, one=one: read_modulus(law, forces + change * one)) for one in each]
    by_spring = [slope(lambda change, one=one: read_modulus(stiffer(change * one), forces)) for one in each]
    assert slopes.forces == pytest.approx(by_force, rel=1e-5)
    assert slopes.springs == pytest.approx(by_spring, rel=1e-5)
    assert slopes.contrast == pytest.approx(slope(lambda change: read_modulus(law, forces, change)), rel=1e-5)


def test_plane_through_tips_is_that_of_their_pose():
    """A line tells the slope along it only."""
    assert fit_plane(SQUARE, 0.6 + np.array(SQUARE) @ (0.02, -0.03)) == pytest.approx((0.6, 0.02, -0.03), rel=ROUND_OFF)
    assert fit_plane(LINE, (0.5, 0.6, 0.7)) == (pytest.approx(0.6), pytest.approx(0.04), None)


@pytest.mark.parametrize("terms", [(0.0, 1.0, 1.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0)])
def test_cubic_without_a_root(terms):
    """Springs that differ in nothing, and terms of one sign, tell no modulus."""
    with pytest.raises(ReadingError):
        smallest_root(*terms)
