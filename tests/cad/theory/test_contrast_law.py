"""The contrast of a reading: exact for what it models, blind to the pose, refused where it tells nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from cad.quantity import InputError
from cad.theory.contrast_law import (
    ContrastLaw,
    ReadingError,
    contrast_slopes,
    contrast_weights,
    lowered_tips,
    plane_through,
    read_modulus,
    stiffened,
)
from cad.theory.hertz import hertz_factor

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
    while read < 200:
        law, C, S, gaps = law_of(rng, places, kinds)
        E = 10.0 ** rng.uniform(-0.5, 0.7)
        forces = np.linalg.solve(C + S / E, pose(rng, places) - gaps)
        if forces.min() <= 0.0:
            continue
        assert read_modulus(law, forces.tolist()) == pytest.approx(E, rel=ROUND_OFF)
        read += 1


def test_domes_are_read_exactly_in_any_pose():
    """Forces of Hertz contact on springs, from a general solver of the equations of the tips."""
    rng = np.random.default_rng(15)
    for _ in range(50):
        h = hertz_factor(7.8, 0.3)
        law, C, S, gaps = law_of(rng, SQUARE, KINDS, hertz=h)
        S = S - np.diag(np.diag(S))
        law = ContrastLaw(weights=law.weights, gaps=law.gaps, C=law.C, S=S.tolist(), hertz=h)
        E, lowered = 10.0 ** rng.uniform(-0.3, 0.55), pose(rng, SQUARE)

        def misfit(roots, E=E, C=C, S=S, lowered=lowered, gaps=gaps, h=h):
            F = roots**3
            return C @ F + h * E ** (-2.0 / 3.0) * roots**2 + S @ F / E + gaps - lowered

        found = root(misfit, np.full(4, 0.8), tol=1e-13)
        if not found.success or found.x.min() <= 0.05:
            continue
        assert read_modulus(law, (found.x**3).tolist()) == pytest.approx(E, rel=1e-7)


def test_pair_lets_a_tilt_through():
    with pytest.raises(InputError) as error:
        contrast_weights(((-4.0, 0.0), (4.0, 0.0)), ("low", "high"))
    assert error.value.field == "tips.layout"


def test_tips_on_the_sides_of_a_square_let_a_tilt_through():
    """Equal springs belong on the diagonals."""
    with pytest.raises(InputError) as error:
        contrast_weights(SQUARE, ("low", "low", "high", "high"))
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
    return law, (0.30, 1.0, 0.34, 1.1)


def test_slopes_are_those_of_small_changes():
    law, forces = dome_reading()
    E = read_modulus(law, forces)
    slopes = contrast_slopes(law, forces, E)
    step = 1e-6
    for tip in range(4):
        one = np.arange(4) == tip
        by_force = [read_modulus(law, np.array(forces) + sign * step * one) for sign in (1.0, -1.0)]
        by_spring = [
            read_modulus(replace(law, C=stiffened(law.C, 1.0 + sign * step * one)), forces) for sign in (1.0, -1.0)
        ]
        by_height = [
            read_modulus(replace(law, gaps=tuple(np.array(law.gaps) - sign * step * one)), forces)
            for sign in (1.0, -1.0)
        ]
        pairs = zip((by_force, by_spring, by_height), (slopes.forces, slopes.springs, slopes.heights), strict=True)
        for (more, less), slope in pairs:
            assert slope[tip] == pytest.approx((more - less) / (2.0 * step * E), rel=1e-5)


def test_reading_tells_the_plane_of_its_pose():
    """Forces of flat tips in a known pose; a line tells the slope along it alone."""
    rng = np.random.default_rng(19)
    law, C, S, gaps = law_of(rng, SQUARE, KINDS)
    E, slopes = 2.0, (0.02, -0.03)
    forces = np.linalg.solve(C + S / E, 0.6 + np.array(SQUARE) @ slopes - gaps)
    assert plane_through(SQUARE, lowered_tips(law, forces.tolist(), E)) == pytest.approx((0.6, *slopes), rel=ROUND_OFF)
    assert plane_through(LINE, (0.5, 0.6, 0.7)) == (pytest.approx(0.6), pytest.approx(0.04), None)
