"""The law of the form of domes against presses by boundary elements, which share nothing with it."""

import dataclasses

import numpy as np
import pytest
from stored_presses import square

from sensor.theory.contrast_rise import RollingDomes, form_slopes, rise_modulus, rise_of
from sensor.theory.dome_form import CAPS
from solve.presses.bodies import EllipsoidFruit
from solve.presses.pressing import press

SQUARE = square(side=6.3, K_low=0.056, K_high=0.635, dome_radius=9.8)
WEIGHTS = (-0.5, 0.5, -0.5, 0.5)
TRAVELS = 1.13 * np.arange(1, 17) / 16.0
MODULI = [1.4, *(pytest.param(E, marks=pytest.mark.slow) for E in (0.5, 3.5))]


def of_fruit(E):
    """Return a fruit, the domes on it, and their law."""
    fruit = EllipsoidFruit(E=E, R1=47.0, R2=110.0, azimuth=30.0)
    domes = RollingDomes(
        positions=tuple(map(tuple, SQUARE.positions.tolist())),
        weights=WEIGHTS,
        dome_radius=SQUARE.dome_radius,
        mean_curvature=0.5 * (1.0 / fruit.R1 + 1.0 / fruit.R2),
        poisson=fruit.poisson,
    )
    return fruit, domes, domes.law(np.diag(1.0 / SQUARE.K).tolist())


def slopes(E):
    """Return the slopes of the law over radius and caps."""
    fruit, domes, law = of_fruit(E)
    return form_slopes(law, rise_of(press(SQUARE, fruit, TRAVELS), 4), domes, CAPS)


def log_E(E, **changes):
    """Return ln of the modulus that is read by domes of another form."""
    fruit, _, law = of_fruit(E)
    return np.log(rise_modulus(law, rise_of(press(dataclasses.replace(SQUARE, **changes), fruit, TRAVELS), 4)))


@pytest.mark.parametrize("E", MODULI)
def test_radius_moves_E_by_the_law(E):
    """The tenth of a standard uncertainty that the guide allows: JCGM 100:2008, 7.2.6, gives it two digits."""
    found = (log_E(E, dome_radius=1.05 * SQUARE.dome_radius) - log_E(E, dome_radius=0.95 * SQUARE.dome_radius)) / 0.1
    assert slopes(E)[0] == pytest.approx(found, rel=0.05)


@pytest.mark.parametrize("cap", range(len(CAPS)))
@pytest.mark.parametrize("E", MODULI)
def test_cap_moves_E_by_the_law(E, cap):
    """Caps of 0.02 mm, flat and pointed. The law leaves out that contacts lie beside the axes of the domes.

    A standard uncertainty that is known to a fifth is as good as one of ten readings (JCGM 100:2008, table E.1).
    """

    def form(r):
        return 0.02 * np.maximum(1.0 - np.square(r / CAPS[cap]), 0.0) ** 2

    found = (log_E(E, form=form) - log_E(E, form=lambda r: -form(r))) / 0.04
    assert slopes(E)[1 + cap] == pytest.approx(found, rel=0.2)
