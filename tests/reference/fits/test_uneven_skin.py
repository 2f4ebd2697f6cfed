"""The law of uneven skin and flesh against presses by boundary elements, which share nothing with it."""

import dataclasses
import functools

import numpy as np
import pytest
from mango_square import SQUARE, TRAVELS, on_cheek

from sensor.theory.contrast_rise import rise_modulus, select_rise, unevenness_sensitivity
from solve.presses.pressing import Pressing, press

SMALL = 0.002  # [mm] of a wave: half as much changes a slope by some per cent
USUAL = 0.016 * np.sqrt(2.0)  # [mm], of a wave of 0.016 mm rms


@functools.cache
def even(E):
    """Return the fruit, the forces of a press on it, its law and where its domes touch."""
    fruit, _, law = on_cheek(E)
    return fruit, press(SQUARE, fruit, TRAVELS), law, Pressing(SQUARE, fruit).touch


def log_E(E, **changes):
    """Return ln of the modulus that is read of a press on a changed fruit."""
    fruit, _, law, _ = even(E)
    return np.log(rise_modulus(law, select_rise(press(SQUARE, dataclasses.replace(fruit, **changes), TRAVELS), 4)))


def slopes(E, wave_mm=4.0):
    """Return the slopes of the law for one wave."""
    _, forces, law, _ = even(E)
    k = np.array([2.0 * np.pi / wave_mm])
    return unevenness_sensitivity(law, select_rise(forces, 4), k, law.rolling.relative_radius)


def wave(rng, wave_mm, amplitude):
    """Return a wave of any direction and phase [mm] as heights over x and y."""
    direction, phase = rng.uniform(0.0, 2.0 * np.pi, 2)
    kx, ky = 2.0 * np.pi / wave_mm * np.array([np.cos(direction), np.sin(direction)])
    return lambda x, y: amplitude * np.cos(kx * x + ky * y + phase)


@pytest.mark.parametrize(
    ("E", "wave_mm"),
    [
        pytest.param(1.4, 4.0, marks=pytest.mark.slow),
        pytest.param(0.5, 2.0, marks=pytest.mark.slow),
        pytest.param(3.5, 8.0, marks=pytest.mark.slow),
        *(pytest.param(*each, marks=pytest.mark.study) for each in ((0.5, 4.0), (0.5, 8.0), (3.5, 2.0), (3.5, 4.0))),
    ],
)
def test_small_waves_move_E_by_the_law(E, wave_mm):
    """Central differences, so that what is of second order drops out. Crests run nearly along both high tips.

    A standard uncertainty that is known to a fifth is as good as one of ten readings (JCGM 100:2008, table E.1). The
    weight of Hertz's pressure in place of the flat punch's misses it: its mean falls by 40 % less with the radius.
    """
    k = 2.0 * np.pi / wave_mm * np.array([np.cos(0.9), np.sin(0.9)])

    def heights(x, y):
        return SMALL * np.cos(k[0] * x + k[1] * y + 0.4)

    _, _, _, touch = even(E)
    found = 0.5 * (log_E(E, bumps=heights) - log_E(E, bumps=lambda x, y: -heights(x, y)))
    per_height = slopes(E, wave_mm).heights[0]
    assert per_height @ heights(*touch.T) == pytest.approx(found, abs=0.2 * SMALL * np.linalg.norm(per_height))


@pytest.mark.parametrize("tip", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "E", [1.4, pytest.param(0.5, marks=pytest.mark.study), pytest.param(3.5, marks=pytest.mark.study)]
)
def test_flesh_under_one_tip_moves_E_by_the_law(E, tip):
    """The local compliance of one tip is that of flesh which is softer by 5 %, and firmer."""
    changed = 0.05 * np.eye(4)[tip]
    found = (log_E(E, softness=tuple(1.0 - changed)) - log_E(E, softness=tuple(1.0 + changed))) / 0.1
    assert slopes(E).flesh[tip] == pytest.approx(found, rel=0.05)


@pytest.mark.study
@pytest.mark.parametrize("wave_mm", [2.0, 4.0, 8.0])
@pytest.mark.parametrize("E", [0.5, 3.5])
def test_size_on_skin_of_usual_unevenness(E, wave_mm):
    """The law of small waves, taken for ones of 0.016 mm rms, gives the size of what E moves by."""
    rng = np.random.default_rng(5)
    _, _, _, touch = even(E)
    none = log_E(E)
    found, by_law = [], []
    for _ in range(12):
        heights = wave(rng, wave_mm, USUAL)
        try:
            found.append(log_E(E, bumps=heights) - none)
        except ArithmeticError:  # contacts of several parts that do not settle
            continue
        by_law.append(slopes(E, wave_mm).heights[0] @ heights(*touch.T))
    ratio = np.linalg.norm(by_law) / np.linalg.norm(found)
    assert 1.0 / 1.4 < ratio < 1.4
