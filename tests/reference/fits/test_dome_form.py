"""The law of the form of domes against presses by boundary elements, which share nothing with it."""

import dataclasses

import numpy as np
import pytest
from mango_square import SQUARE, TRAVELS, on_cheek

from cad.parts.dome_form import CAPS
from sensor.theory.contrast_rise import form_slopes, rise_modulus, select_rise
from solve.presses.pressing import press

MODULI = [1.4, *(pytest.param(E, marks=pytest.mark.study) for E in (0.5, 3.5))]


def slopes(E):
    """Return the slopes of the law over radius and caps."""
    fruit, domes, law = on_cheek(E)
    return form_slopes(law, select_rise(press(SQUARE, fruit, TRAVELS), 4), domes, CAPS)


def log_E(E, **changes):
    """Return ln of the modulus that is read by domes of another form."""
    fruit, _, law = on_cheek(E)
    return np.log(rise_modulus(law, select_rise(press(dataclasses.replace(SQUARE, **changes), fruit, TRAVELS), 4)))


@pytest.mark.parametrize("E", MODULI)
def test_radius_moves_E_by_the_law(E):
    """The tenth of a standard uncertainty that the guide allows: JCGM 100:2008, 7.2.6, gives it two digits."""
    found = (log_E(E, dome_radius=1.05 * SQUARE.dome_radius) - log_E(E, dome_radius=0.95 * SQUARE.dome_radius)) / 0.1
    assert slopes(E)[0] == pytest.approx(found, rel=0.05)


@pytest.mark.slow
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
