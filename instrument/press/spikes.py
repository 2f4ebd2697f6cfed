"""Constants of the test for outliers: samples that contradict their press, which are left out as they arrive.

**The residual.** The contrast is y = w.(C F) + h z^2 w.F^(2/3) + z^3 w.(S F), at the modulus E = 1 / z^3 of the fruit.
It is the same in every sample of one press, for any pose and speed (`contrast_rise.py`). At another modulus,
consecutive samples lie on a line of y against the total force u. An outlier in one channel moves both in a direction
that belongs to no modulus. Three conditions limit the slope of the line.

- The other samples of a window of consecutive samples have a slope, known to within their noise.
- The mean of the press before the window is a point of the line, within a tenth of the slopes that the moduli allow.
- The fruit is in the range of the design, or up to a half beyond. A window that clearly has another slope is believed.

**The test.** Each sample of the window is left out in turn. The one whose absence gives the smallest sum of squares is
the suspect. It is an outlier if it is five standard deviations away from every line that the other samples allow. The
deviations come from the force errors without a touch, or from the residuals of the press if these are larger. Normal
noise drops a sample once in 1.7 million.

If channels were interpolated to one time, a bad conversion affects two samples, so two consecutive samples are tested
together. A decision is pending until two more samples have arrived, and the memory does not grow.
"""

import math

import numpy as np

from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.design.reading import LEAST_OVER_NOISE

FIRM = 2.0  # multiple of the smallest force of each tip above which noise does not end a touch
_LARGEST_RESIDUAL = 5.0  # standard deviations
_OTHERS = 4  # samples of a window that define the line
_BESIDE = 2  # samples of a window on either side of the one that is decided on
_SLACK = 0.1  # largest difference between the chord of a press and its final slope, as a fraction of the allowed slopes
_BEYOND = 1.5  # margin beyond both ends of the range of moduli [1]
_FORCES = (0.02, 0.1, 0.4, 1.0)  # forces at which slopes are computed, as fractions of full scale


def spike_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the constants of `press_core.Unit` by which it drops samples that contradict their press.

    The contrast is taken at the geometric mean of the range of moduli. The limits of its slope against the total force
    come from level presses on the softest and the firmest fruit.
    """
    weights, C, S = sensor.rise_law.contrast.arrays
    softest, firmest = sensor.range_MPa
    z = (softest * firmest) ** (-1.0 / 6.0)
    linear = weights @ (C + z**3 * S)
    domes = sensor.rise_law.contrast.hertz * z * z * weights
    errors = sensor.least_forces / LEAST_OVER_NOISE
    slopes = []
    for E in (softest / _BEYOND, firmest * _BEYOND):
        slopes += _level_slopes(sensor, E, linear, domes)
    return {
        "least_forces": sensor.least_forces.tolist(),
        "linear": linear.tolist(),
        "line_domes": domes.tolist(),
        "errors": errors.tolist(),
        "least_slope": min(slopes),
        "most_slope": max(slopes),
        "of_whole": math.fsum(errors**2),
        "others": _OTHERS,
        "beside": _BESIDE,
        "slack": _SLACK * (max(slopes) - min(slopes)),
        "firm": FIRM,
        "largest_residual": _LARGEST_RESIDUAL,
    }


def _level_slopes(sensor: MeasuringUnit, E: float, linear: Floats, domes: Floats) -> list[float]:
    """Return slopes of the contrast against the total force [mm/N] in a level press on fruit of E [MPa].

    `linear` [mm/N] and `domes` [mm/N^(2/3)] are the weights of the contrast for F and F^(2/3), (tips,). The forces rise
    with the travel x by dF/dx, which solves [C + S / E + 2/3 h E^(-2/3) F^(-1/3)] dF/dx = 1. For flesh that relaxes,
    any slope between the slopes of the single tips is allowed.
    """
    law = sensor.rise_law.contrast
    _, C, S = law.arrays
    slopes = []
    for forces in np.outer(_FORCES, sensor.report.read_out.full_scale_N):
        power_slopes = forces ** (-1.0 / 3.0) / 1.5  # d F^(2/3) / dF
        tip_slopes = linear + domes * power_slopes
        if sensor.report.design.fruit.relaxation is not None:
            slopes += [float(tip_slopes.min()), float(tip_slopes.max())]
            continue
        dome_compliances = law.hertz * E ** (-2.0 / 3.0) * power_slopes
        force_rates = np.linalg.solve(C + S / E + np.diag(dome_compliances), np.ones(len(forces)))
        slopes.append(float(tip_slopes @ force_rates / force_rates.sum()))
    return slopes
