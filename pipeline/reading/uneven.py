"""Errors of the modulus caused by uneven skin and flesh, in one press and in the mean of presses at several places."""

import math
from collections.abc import Iterable

import numpy as np

from pipeline.reading.measurement import RiseModel
from pipeline.reading.reading_records import UnevenFruit
from pipeline.reading.rise import rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import Tips
from sensor.theory.contrast_rise import RollingDomes
from sensor.theory.uneven_skin import correlations, wave_numbers


def _contact_distances(tips: Tips, rolling: RollingDomes | None) -> Floats:
    """Return the distances between the contacts of the tips [mm], shape (tips, tips).

    `rolling` are the domes, or None for other tips. The contacts of domes on a curved skin are closer together than the
    axes of the domes.
    """
    tip_axes = np.array(tips.places_mm)
    distances = np.linalg.norm(tip_axes[:, None] - tip_axes, axis=-1)
    if rolling is not None:
        distances = distances / rolling.rolling_factor
    return np.asarray(distances)


def uneven_fruit(design: Design, model: RiseModel, presses: Iterable[Floats]) -> UnevenFruit:
    """Return the additional uncertainty of E due to uneven skin and flesh, averaged over equally likely presses.

    The skin has waves of random directions and phases, so its heights under tips closer than a wavelength are
    correlated. The modulus of the flesh varies independently from tip to tip. `presses` holds the forces (samples,
    tips) [N] of each press, which `model` reads. Raises ReadingError for a press without a reading.
    """
    fruit = design.fruit
    rolling = rolling_domes(design, model.law.contrast.weights)
    distances = _contact_distances(design.tips, rolling)
    # wave numbers [1/mm], and the fraction [1] of the variance of the heights that each wave has
    waves, variance_fractions = wave_numbers(*fruit.roughness_wave_mm)
    correlation = np.array([correlations(k, distances) for k in waves])  # of the heights, (waves, tips, tips)
    relative_radius = 0.0 if rolling is None else rolling.relative_radius
    slopes = [model.unevenness_slopes(press, waves, relative_radius) for press in presses]
    # If the heights have a variance of 1 mm^2, the variance of ln E in a press is g^T R g, averaged over the waves.
    # Here g are the slopes with respect to the heights under the tips, and R is the correlation of these heights.
    skin_variances = []
    for press_slopes in slopes:
        heights = press_slopes.heights  # (waves, tips) [1/mm]
        variance_by_wave = np.einsum("wi,wij,wj->w", heights, correlation, heights)
        skin_variances.append(variance_fractions @ variance_by_wave)
    # The same for a relative standard deviation of the flesh of 1. The flesh is independent from tip to tip, so R is
    # the identity matrix.
    flesh_variances = [press_slopes.flesh @ press_slopes.flesh for press_slopes in slopes]
    # A flat face averages the skin to one height, which is only an offset. The computed slope would be round-off.
    skin = 0.0 if rolling is None else 100.0 * fruit.roughness_mm * math.sqrt(np.mean(skin_variances))
    flesh = fruit.flesh_scatter_percent * math.sqrt(np.mean(flesh_variances))
    one_press = math.hypot(skin, flesh)
    count = (design.reading or ReadingRequirements()).presses
    return UnevenFruit(
        skin_percent=skin,
        flesh_percent=flesh,
        one_press_percent=one_press,
        presses=count,
        # Errors at different places of a fruit are independent.
        presses_percent=one_press / math.sqrt(count),
    )
