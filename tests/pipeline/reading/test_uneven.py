"""What uneven skin and flesh add to a reading, against many drawn skins."""

from dataclasses import replace

import numpy as np
import pytest
from squares import GENTLE

from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import rolling_domes
from pipeline.reading.uneven import uneven_fruit
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.theory.contrast_law import contrast_weights, pair_law
from sensor.theory.contrast_rise import RiseLaw

# As of level domes with springs of 0.15 and 1.4 N/mm on flesh of 2 MPa, whose low tips carry a sixth of the high ones.
PRESS = np.linspace(0.1, 1.0, 16)[:, None] ** 1.3 * np.array([0.04, 0.26, 0.04, 0.26])
WEIGHTS = contrast_weights(GENTLE.tips.places_mm, GENTLE.tips.springs)
DOMES = rolling_domes(GENTLE, WEIGHTS)
MODEL = RiseModel(law=DOMES.law(np.diag([1.0 / 0.15, 1.0 / 1.4] * 2).tolist()))


def uneven(presses=(PRESS,), count=3.0, **fruit):
    """Return what an uneven fruit of the gentle square adds."""
    design = replace(GENTLE, fruit=replace(GENTLE.fruit, **fruit), reading=ReadingRequirements(presses=count))
    return uneven_fruit(design, MODEL, presses)


@pytest.mark.parametrize("waves", [(2.0, 8.0), (6.0, 12.0)])
def test_skin_is_that_of_random_waves(waves):
    """Long waves lift neighbouring tips together. 20,000 drawn waves know their size to 3 %, three deviations."""
    rng = np.random.default_rng(1)
    count = 20_000
    k = 2.0 * np.pi / np.exp(rng.uniform(*np.log(waves), count))
    direction, phase = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    touch = np.array(GENTLE.tips.places_mm) / DOMES.rolling_factor
    along = np.stack([np.cos(direction), np.sin(direction)], axis=1) @ touch.T
    heights = 0.016 * np.sqrt(2.0) * np.cos(k[:, None] * along + phase[:, None])
    moved = (MODEL.unevenness_slopes(PRESS, k, DOMES.relative_radius).heights * heights).sum(axis=1)
    found = uneven(roughness_wave_mm=waves).skin_percent
    assert found == pytest.approx(100.0 * np.sqrt(np.mean(moved**2)), rel=0.03)


def test_flesh_is_that_of_independent_tips():
    slopes = MODEL.unevenness_slopes(PRESS, np.ones(1), DOMES.relative_radius).flesh
    assert uneven(flesh_scatter_percent=10.0).flesh_percent == pytest.approx(10.0 * np.linalg.norm(slopes))


@pytest.mark.parametrize(
    ("changed", "skin", "flesh"),
    [
        ({"roughness_mm": 0.0}, 0.0, 1.0),
        ({"roughness_mm": 0.032}, 2.0, 1.0),
        ({"flesh_scatter_percent": 0.0}, 1.0, 0.0),
        ({"flesh_scatter_percent": 15.0}, 1.0, 3.0),
    ],
)
def test_each_cause_is_proportional_to_its_key_and_the_mean_of_several_presses_known_better(changed, skin, flesh):
    plain, found = uneven(), uneven(count=4.0, **changed)
    assert found.skin_percent == pytest.approx(skin * plain.skin_percent)
    assert found.flesh_percent == pytest.approx(flesh * plain.flesh_percent)
    assert found.one_press_percent == pytest.approx(np.hypot(found.skin_percent, found.flesh_percent))
    assert (found.presses, found.presses_percent) == (4.0, pytest.approx(0.5 * found.one_press_percent))


def test_presses_that_are_equally_likely_give_their_mean_square():
    firm = 1.5 * PRESS
    sizes = [uneven((press,)).skin_percent for press in (PRESS, firm)]
    assert uneven((PRESS, firm)).skin_percent == pytest.approx(np.sqrt(np.mean(np.square(sizes))))


def test_a_flat_face_feels_flesh_only():
    """Its height is an offset. Own flesh that is softer by 1 % is E that is less by 1 % of its part in the contrast."""
    own = 0.5
    pair = RiseModel(law=RiseLaw(contrast=pair_law(((1.0 / 0.753, 0.0), (0.0, 1.0 / 17.3)), own)))
    press = np.arange(1, 17)[:, None] * np.array([0.02, 0.06])
    found = uneven_fruit(Design(reading=ReadingRequirements()), pair, [press])
    parts = np.array([0.02, 0.06]) / (0.06 - 0.02)
    assert found.skin_percent == 0.0
    assert found.flesh_percent == pytest.approx(5.0 * np.linalg.norm(parts))
