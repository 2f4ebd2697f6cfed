"""What uneven skin and flesh do to the modulus of one press, and of the mean of several at other places."""

import math
from collections.abc import Iterable

import numpy as np

from pipeline.reading.measurement import RiseModel
from pipeline.reading.records import UnevenFruit
from pipeline.reading.rise import rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import Reading
from sensor.theory.uneven_skin import correlations, wave_numbers


def uneven_fruit(design: Design, model: RiseModel, presses: Iterable[Floats]) -> UnevenFruit:
    """Return what uneven skin and flesh add to readings of presses (samples, tips) [N] that are equally likely.

    The waves of the skin have any direction and phase, so tips nearer than a wave stand on heights that belong
    together. The flesh differs from tip to tip. Raises ReadingError for a press that has no reading.
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
    # The face of a flat tip feels one height, which is an offset; only round-off is left of it.
    skin = 0.0 if rolling is None else 100.0 * fruit.roughness_mm * math.sqrt(np.mean(by_skin))
    flesh = fruit.flesh_scatter_percent * math.sqrt(np.mean(by_flesh))
    of_one = math.hypot(skin, flesh)
    count = (design.reading or Reading()).presses
    return UnevenFruit(
        skin_percent=skin,
        flesh_percent=flesh,
        one_press_percent=of_one,
        presses=count,
        presses_percent=of_one / math.sqrt(count),
    )
