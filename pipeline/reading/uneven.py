"""Errors of a modulus by uneven skin and flesh, for one press and for the mean of several at other places."""

import math
from collections.abc import Iterable

import numpy as np

from pipeline.reading.measurement import RiseModel
from pipeline.reading.reading_records import UnevenFruit
from pipeline.reading.rise import rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.theory.uneven_skin import correlations, wave_numbers


def uneven_fruit(design: Design, model: RiseModel, presses: Iterable[Floats]) -> UnevenFruit:
    """Return the additional errors of equally likely presses (samples, tips) [N] by uneven skin and flesh.

    The waves of the skin have random directions and phases, so the heights under tips closer than a wave are
    correlated. The flesh varies independently from tip to tip. Raises ReadingError for a press without a reading.
    """
    fruit, tips = design.fruit, design.tips
    rolling = rolling_domes(design, model.law.contrast.weights)
    axes = np.array(tips.places_mm)
    apart = np.linalg.norm(axes[:, None] - axes, axis=-1)
    if rolling is not None:
        apart = apart / rolling.rolling_factor
    waves, shares = wave_numbers(*fruit.roughness_wave_mm)
    together = np.array([correlations(k, apart) for k in waves])
    relative_radius = 0.0 if rolling is None else rolling.relative_radius
    slopes = [model.uneven(press, waves, relative_radius) for press in presses]
    by_skin = [shares @ np.einsum("wi,wij,wj->w", each.heights, together, each.heights) for each in slopes]
    by_flesh = [each.flesh @ each.flesh for each in slopes]
    # A flat face averages the skin to one height, which is an offset; the computed slope is only round-off.
    skin = 0.0 if rolling is None else 100.0 * fruit.roughness_mm * math.sqrt(np.mean(by_skin))
    flesh = fruit.flesh_scatter_percent * math.sqrt(np.mean(by_flesh))
    of_one = math.hypot(skin, flesh)
    count = (design.reading or ReadingRequirements()).presses
    return UnevenFruit(
        skin_percent=skin,
        flesh_percent=flesh,
        one_press_percent=of_one,
        presses=count,
        presses_percent=of_one / math.sqrt(count),
    )
