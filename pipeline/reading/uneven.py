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


def _variance_by_wave(slopes: Floats, correlation: Floats) -> Floats:
    """Return the variance of ln E [1] that each wave of the skin causes in a press, shape (waves,).

    The variance is g^T R g for a wave whose heights have a standard deviation of 1 mm. Here g are the `slopes`
    (waves, tips) [1/mm] of ln E with respect to the heights under the tips. R is the `correlation` (waves, tips, tips)
    of these heights.
    """
    return np.asarray(np.einsum("wi,wij,wj->w", slopes, correlation, slopes))


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
    correlation = np.array([correlations(k, distances) for k in waves])  # between the heights, (waves, tips, tips)
    relative_radius = 0.0 if rolling is None else rolling.relative_radius
    slopes = [model.unevenness_slopes(press, waves, relative_radius) for press in presses]
    # variance of ln E in each press if the heights of the skin have a standard deviation of 1 mm
    skin_variances = [
        variance_fractions @ _variance_by_wave(press_slopes.heights, correlation) for press_slopes in slopes
    ]
    # Variance of ln E in each press if the modulus of the flesh has a relative standard deviation of 1. The moduli
    # under different tips are independent, so the squares of the slopes add.
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
