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
    lowered_tips,
    plane_through,
    read_modulus,
    smallest_root,
    stiffened_compliance,
)
from sensor.theory.hertz import hertz_factor

SQUARE = ((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0))
KINDS = ("low", "high", "low", "high")
LINE = ((-2.5, 0.0), (0.0, 0.0), (2.5, 0.0))
ROUND_OFF = 1e-9  # of E, as the issue of the layouts asks


def pose(rng, places):
    """Return what a rigid pose lowers each tip by [mm]: a travel, a tilt and a roll."""
    travel, tilt, roll = rng.uniform(0.3, 0.6), *np.tan(np.radians(rng.uniform(-2.0, 2.0, 2)))
    return travel + np.array(places) @ [tilt, roll]


def law_of(rng, places, kinds, hertz=0.0):
    stiffness = np.where(np.array(kinds) == "low", *rng.uniform((0.5, 10.0), (2.0, 30.0)))
    C = np.diag(1.0 / stiffness)
    apart = np.hypot(*(np.subtract.outer(axis, axis) for axis in np.array(places).T))
    S = 0.9 / np.where(apart > 0.0, np.pi * apart, 1.2)
    gaps = rng.uniform(0.0, 0.02, len(places))
    law = ContrastLaw(
        weights=contrast_weights(places, kinds), gaps=tuple(gaps), C=C.tolist(), S=S.tolist(), hertz=hertz
    )
    return law, C, S, gaps


@pytest.mark.parametrize(("places", "kinds"), [(SQUARE, KINDS), (LINE, ("low", "high", "low"))])
def test_flat_tips_are_read_exactly_in_any_pose(places, kinds):
    rng = np.random.default_rng(14)
    read = 0
    while read < 50:
        law, C, S, gaps = law_of(rng, places, kinds)
        E = 10.0 ** rng.uniform(-0.5, 0.7)
        forces = np.linalg.solve(C + S / E, pose(rng, places) - gaps)
        if forces.min() <= 0.0:
            continue
        assert read_modulus(law, forces.tolist()) == pytest.approx(E, rel=ROUND_OFF)
        read += 1


def domes(rng):
    """Return the law of a square of domes on springs and a modulus."""
    law, _, S, _ = law_of(rng, SQUARE, KINDS, hertz=hertz_factor(7.8, 0.3))
    law = replace(law, S=(S - np.diag(np.diag(S))).tolist())
    return law, 10.0 ** rng.uniform(-0.3, 0.55)


def dome_forces(law, E, lowered):
    """Return forces [N] of Hertz contact on springs, from a general solver of the equations of the tips; or None."""
    compliance = np.array(law.C) + np.array(law.S) / E

    def misfit(roots):
        return compliance @ roots**3 + law.hertz * E ** (-2.0 / 3.0) * roots**2 + law.gaps - lowered

    found = root(misfit, np.full(len(lowered), 0.8), tol=1e-13)
    return found.x**3 if found.success and found.x.min() > 0.05 else None


def test_domes_are_read_exactly_in_any_pose():
    rng = np.random.default_rng(15)
    for _ in range(50):
        law, E = domes(rng)
        forces = dome_forces(law, E, pose(rng, SQUARE))
        if forces is not None:
            assert read_modulus(law, forces.tolist()) == pytest.approx(E, rel=1e-7)


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


@pytest.mark.parametrize(
    "forces",
    [
        (0.5, 2.0, 0.5, 0.0),
        (0.5, math.nan, 0.5, 2.0),
        (0.5, 2.0),
        (5.0, 0.1, 5.0, 0.1),
    ],
)
def test_forces_that_tell_nothing_are_refused(forces):
    law, *_ = law_of(np.random.default_rng(1), SQUARE, KINDS)
    with pytest.raises(ReadingError):
        read_modulus(law, forces)


def test_tables_of_another_number_of_tips_are_refused():
    with pytest.raises(ValueError, match="2 tips"):
        ContrastLaw(weights=(1.0, -1.0), gaps=(0.0,), C=[[1.0]], S=[[1.0]])


def dome_reading():
    """Return the law of a square of domes, and forces that it reads as some modulus."""
    law, *_ = law_of(np.random.default_rng(18), SQUARE, KINDS, hertz=hertz_factor(7.8, 0.3))
    return law, np.array([0.30, 1.0, 0.34, 1.1])


def test_slopes_are_those_of_small_changes():
    law, forces = dome_reading()
    E = read_modulus(law, forces)
    slopes = contrast_slopes(law, forces, E)
    step = 1e-6

    def slope(read):
        """Return the relative slope of a reading at no change, from both sides."""
        return (read(step) - read(-step)) / (2.0 * step * E)

    for tip, at_tip in enumerate(np.eye(4)):
        by_force = slope(lambda change, at_tip=at_tip: read_modulus(law, forces + change * at_tip))
        assert slopes.forces[tip] == pytest.approx(by_force, rel=1e-5)
        by_spring = slope(
            lambda change, at_tip=at_tip: read_modulus(
                replace(law, C=stiffened_compliance(law.C, 1.0 + change * at_tip)), forces
            )
        )
        assert slopes.springs[tip] == pytest.approx(by_spring, rel=1e-5)
    of_high = np.array([0.0, 1.0, 0.0, 1.0])  # gaps that make a contrast of their own size
    by_contrast = slope(lambda change: read_modulus(replace(law, gaps=law.gaps + change * of_high), forces))
    assert slopes.contrast == pytest.approx(by_contrast, rel=1e-5)
    by_offset = slope(lambda change: read_modulus(law, forces, change))
    assert slopes.contrast == pytest.approx(by_offset, rel=1e-5)


def test_reading_tells_the_plane_of_its_pose():
    """Forces of flat tips in a known pose; a line tells the slope along it alone."""
    rng = np.random.default_rng(19)
    law, C, S, gaps = law_of(rng, SQUARE, KINDS)
    E, slopes = 2.0, (0.02, -0.03)
    forces = np.linalg.solve(C + S / E, 0.6 + np.array(SQUARE) @ slopes - gaps)
    assert plane_through(SQUARE, lowered_tips(law, forces.tolist(), E)) == pytest.approx((0.6, *slopes), rel=ROUND_OFF)
    assert plane_through(LINE, (0.5, 0.6, 0.7)) == (pytest.approx(0.6), pytest.approx(0.04), None)
    law, forces = dome_reading()
    lowered = lowered_tips(law, forces, read_modulus(law, forces))
    assert np.dot(law.weights, lowered) == pytest.approx(0.0, abs=ROUND_OFF)  # no contrast is left at the modulus read


@pytest.mark.parametrize("terms", [(0.0, 1.0, 1.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0)])
def test_cubic_without_a_root(terms):
    """Springs that differ in nothing, and terms of one sign, tell no modulus."""
    with pytest.raises(ReadingError):
        smallest_root(*terms)
