"""Scatter of prints before calibration, as bands that contain most prints.

The bands are computed from a sample of prints. In each print, every cause that scatters from print to print has a
single value, which all springs share.
"""

import math
from collections.abc import Sequence
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

SAMPLES = 1024  # number of prints in the sample; a Sobol sequence needs a power of two
LEVEL = 0.95  # fraction of the prints that a band contains


def scatter_bands(pair: PressedSensor, level: LevelPress) -> ScatterBands | None:
    """Return the bands that contain 95 % of the prints of a pair before calibration, or None without a housing.

    The spring stiffnesses vary over a sample of prints. For each print, the `level` presses of the pair give the force
    ratio P_max on the firmest fruit and the nonlinearity NL. They also give the error of a reading of the firmest fruit
    that assumes the nominal stiffnesses.
    """
    if pair.springs.housing is None:
        return None
    # Only these causes scatter from print to print and change the springs.
    print_causes = [cause for cause in level.causes if cause.scatters and cause.calibrated and cause.springs.any()]
    factors = _sampled_factors(print_causes)
    # All prints are evaluated at once: the last axis of this cause has an entry for each print instead of each travel.
    prints = Cause(name="prints", reason="", springs=factors[:, None, :] - 1.0)
    at_full_travel = replace(level, travel=level.travel[-1:])
    P = at_full_travel.ratio(prints, 1.0)  # (moduli, samples)
    E = level.E[:, 0]
    K_l, K_h = (1e3 * K * factor for K, factor in zip(level.K, factors, strict=True))  # [N/m]
    # `modulus_scale` returns None if P does not increase with the modulus. No modulus can then be read.
    modulus_at = force_ratio_curve(pair).modulus_scale(at_full_travel.ratio()[:, 0], E) or (lambda _: math.nan)
    calibrated_error = 0.0  # relative error of a modulus read with calibrated springs; the errors of both springs add
    for cause in known_springs():
        low = modulus_at(float(at_full_travel.largest_ratio(cause, -1.0)))
        high = modulus_at(float(at_full_travel.largest_ratio(cause, 1.0)))
        calibrated_error += 0.5 * abs(high - low) / float(E[-1])
    return ScatterBands(
        K_l_N_per_m=_band(K_l),
        K_h_N_per_m=_band(K_h),
        P_max=_band(P[-1]),
        NL=_band([curve_nonlinearity(curve, E.tolist(), level.NL_definition) for curve in P.T.tolist()]),
        modulus_error=_band([modulus_at(P_max) / E[-1] - 1.0 for P_max in P[-1].tolist()]),
        calibrated_modulus_error=calibrated_error if math.isfinite(calibrated_error) else None,
    )


def _sampled_factors(causes: Sequence[Cause]) -> Floats:
    """Return the relative stiffness [1] of each spring in a sample of prints, shape (2, `SAMPLES`).

    It is the stiffness divided by its nominal value. The input of each cause has a normal distribution, and the
    stiffness is proportional to a power of it. A Sobol sequence samples the inputs of all causes together.
    """
    from scipy.stats import qmc  # its import takes a tenth of all import time, and only fabrication needs it

    points = qmc.Sobol(len(causes), seed=1).random(SAMPLES)
    normal_deviates = ndtri(np.clip(points, 1e-9, 1.0 - 1e-9))  # clipped, because the quantiles of 0 and 1 are infinite
    factors = np.ones((2, SAMPLES))
    for cause, deviates in zip(causes, normal_deviates.T, strict=True):
        # stiffness change in the last press, which is at full travel
        stiffness_change = np.reshape(cause.springs, (2, -1))[:, -1:]
        two_sigma = (1.0 + stiffness_change) ** (1.0 / cause.power) - 1.0  # relative change of the input
        factors = factors * (1.0 + two_sigma * deviates / COVERAGE) ** cause.power
    return factors


def _band(values: Sequence[float] | Floats) -> Interval:
    """Return the ends of the interval that contains the middle 95 % of values. An end that is not finite is None.

    A value of nan represents a modulus beyond the range of nominal springs, so it is treated as infinite.
    """
    numbers = np.nan_to_num(values, nan=math.inf, posinf=math.inf)
    ends = np.quantile(numbers, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], method="inverted_cdf")
    low, high = (float(end) if math.isfinite(end) else None for end in ends)
    return low, high
