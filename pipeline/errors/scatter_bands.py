"""Scatter of prints before calibration, as bands that contain most prints.

The bands are computed from a sample of prints. In each print, every cause that scatters from print to print has a
single value, which all springs share.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from pipeline.errors.budget import LevelPress
from pipeline.errors.causes import Cause, known_springs
from pipeline.errors.error_records import Interval, ScatterBands
from pipeline.errors.targets import force_ratio_curve
from pipeline.reading.pressed_sensor import PressedSensor
from sensor.arrays import Floats
from sensor.quantity import COVERAGE
from sensor.theory.two_spring_law import curve_nonlinearity

SAMPLES = 1024  # number of prints in the sample; a Sobol sequence is balanced only if this is a power of two
LEVEL = 0.95  # fraction of the prints that a band contains


def scatter_bands(pair: PressedSensor, level: LevelPress) -> ScatterBands | None:
    """Return the bands that contain 95 % of the prints of a pair before calibration, or None without a housing.

    The spring stiffnesses vary over a sample of prints. For each print, the `level` presses of the pair give the force
    ratio P_max on the firmest fruit and the nonlinearity NL. They also give the relative error of the modulus that is
    read on the firmest fruit, if the reading assumes the nominal stiffnesses.
    """
    if pair.springs.housing is None:
        return None
    # Only these causes scatter from print to print and change the springs.
    print_causes = [cause for cause in level.causes if cause.scatters and cause.calibrated and cause.springs.any()]
    factors = _sampled_factors(print_causes)
    # All prints are evaluated at once, as a cause with the shape (springs, 1, samples). The samples broadcast against
    # the axis of the travels, so only the full travel is evaluated.
    prints = Cause(name="prints", reason="", springs=factors[:, None, :] - 1.0)
    at_full_travel = replace(level, travel=level.travel[-1:])
    P = at_full_travel.ratio(prints, 1.0)  # (moduli, samples); the last modulus is the firmest fruit
    E = level.E[:, 0]
    K_l, K_h = (1e3 * K * factor for K, factor in zip(level.K, factors, strict=True))  # [N/m]
    modulus_at = force_ratio_curve(pair).modulus_converter(at_full_travel.ratio()[:, 0], E)
    if modulus_at is None:  # P does not increase with the modulus, so no modulus can be read
        modulus_at = _unknown_modulus
    calibrated_error = _calibrated_modulus_error(at_full_travel, modulus_at)
    return ScatterBands(
        K_l_N_per_m=_band(K_l),
        K_h_N_per_m=_band(K_h),
        P_max=_band(P[-1]),
        NL=_band([curve_nonlinearity(curve, E.tolist(), level.NL_definition) for curve in P.T.tolist()]),
        modulus_error=_band([modulus_at(P_max) / E[-1] - 1.0 for P_max in P[-1].tolist()]),
        calibrated_modulus_error=calibrated_error if math.isfinite(calibrated_error) else None,
    )


def _unknown_modulus(_P: float) -> float:
    """Return nan as the modulus for any force ratio."""
    return math.nan


def _calibrated_modulus_error(level: LevelPress, modulus_at: Callable[[float], float]) -> float:
    """Return the relative error [1] of a modulus read on the firmest fruit with calibrated springs.

    `level` holds the presses at full travel, and `modulus_at` converts a force ratio to a modulus [MPa]. The errors due
    to the two springs add.
    """
    error = 0.0
    for cause in known_springs():
        modulus_if_softer = modulus_at(float(level.largest_ratio(cause, -1.0)))
        modulus_if_stiffer = modulus_at(float(level.largest_ratio(cause, 1.0)))
        error += 0.5 * abs(modulus_if_stiffer - modulus_if_softer) / float(level.E[-1, 0])
    return error


def _sampled_factors(causes: Sequence[Cause]) -> Floats:
    """Return the stiffness of each spring in a sample of prints, divided by its nominal value [1].

    The shape is (2, `SAMPLES`), with the low spring first. The input of each cause has a normal distribution, and the
    stiffness is proportional to a power of it. A Sobol sequence samples the inputs of all causes together, because it
    covers them more evenly than random numbers. Its seed is fixed, so that a run can be repeated.
    """
    from scipy.stats import qmc  # the import takes a tenth of all import time, and only fabrication needs it

    points = qmc.Sobol(len(causes), seed=1).random(SAMPLES)
    normal_deviates = ndtri(np.clip(points, 1e-9, 1.0 - 1e-9))  # clipped, because the quantiles of 0 and 1 are infinite
    factors = np.ones((2, SAMPLES))
    for cause, deviates in zip(causes, normal_deviates.T, strict=True):
        # relative change of each stiffness (2, 1) in the last press, which is at full travel
        stiffness_change = np.reshape(cause.springs, (2, -1))[:, -1:]
        # two standard deviations of the input, relative to its nominal value
        input_change = (1.0 + stiffness_change) ** (1.0 / cause.power) - 1.0
        factors = factors * (1.0 + input_change * deviates / COVERAGE) ** cause.power
    return factors


def _band(values: Sequence[float] | Floats) -> Interval:
    """Return the ends of the interval that contains the middle 95 % of values. An end that is not finite is None.

    A value of nan represents a modulus beyond the range of nominal springs, so it is treated as infinite. Both ends are
    values of the sample, so that no end is interpolated between a finite and an infinite value.
    """
    numbers = np.nan_to_num(values, nan=math.inf, posinf=math.inf)
    ends = np.quantile(numbers, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], method="inverted_cdf")
    low, high = (float(end) if math.isfinite(end) else None for end in ends)
    return low, high
