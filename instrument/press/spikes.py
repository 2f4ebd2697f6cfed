"""Constants of the test for outliers: samples that contradict their press, and are left out.

**The residual.** The contrast is y = w.(C F) + h z^2 w.F^(2/3) + z^3 w.(S F), at the modulus E = 1 / z^3 of the fruit.
It is the same in every sample of one press, for any pose and speed (`contrast_rise.py`). If it is computed with another
modulus, consecutive samples lie on a straight line of y against the total force u. An outlier in one channel moves y
and u in a direction that no modulus explains. Three conditions limit the slope of the line.

- The slope of the other samples in a window of consecutive samples is known to within their noise.
- The mean of the press before the window lies on the line, to within a tenth of the range of possible slopes.
- The modulus is within the range of the design, extended by half at both ends. If the other samples clearly contradict
  this range, their slope is used.

**The test.** Each sample of the window is left out in turn. The sample without which the sum of squared residuals is
smallest is the suspect. It is an outlier if it is five standard deviations away from every line that the other samples
allow. The standard deviation follows from the force errors of a free sensor, or from the residuals of the press if
these are larger. With normally distributed noise, one sample in 1.7 million is dropped by mistake.

If channels were interpolated to one time, a bad conversion affects two samples, so two consecutive samples are tested
together. A sample is accepted or dropped when two more samples have arrived, and the required memory does not grow.
"""

import math

import numpy as np

from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.design.reading import LEAST_OVER_NOISE

FIRM = 2.0  # multiple of the smallest force of a tip in contact; at larger forces, noise does not end a touch
_LARGEST_RESIDUAL = 5.0  # [standard deviations]
_FITTED_SAMPLES = 4  # number of samples in a window to which the line is fitted
_SLOPE_TOLERANCE = 0.1  # largest difference between the slopes of a chord and of the press, over the slopes' range
_NEIGHBOURS = 2  # number of samples on either side of the sample under test
_RANGE_MARGIN = 1.5  # factor by which the range of moduli is extended at both ends [1]
_FORCE_FRACTIONS = (0.02, 0.1, 0.4, 1.0)  # forces at which slopes are computed, as fractions of full scale [1]


def spike_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return the constants of `press_core.Unit` with which outliers are found.

    The contrast is computed at the geometric mean of the range of moduli. The limits of its slope against the total
    force come from level presses on fruit that is softer and firmer than this range by the factor `_RANGE_MARGIN`.
    `press_core.Unit` explains each constant.
    """
    weights, C, S = sensor.rise_law.contrast.arrays
    softest, firmest = sensor.range_MPa
    z = (softest * firmest) ** (-1.0 / 6.0)  # E^(-1/3) at the geometric mean
    linear = weights @ (C + z**3 * S)  # weights of F in the contrast [mm/N]
    domes = sensor.rise_law.contrast.hertz * z * z * weights  # weights of F^(2/3) in the contrast [mm/N^(2/3)]
    errors = sensor.least_forces / LEAST_OVER_NOISE  # standard deviations of the forces of a free sensor [N]
    slopes = []
    for E in (softest / _RANGE_MARGIN, firmest * _RANGE_MARGIN):
        slopes += _level_slopes(sensor, E, linear, domes)
    return {
        "least_forces": sensor.least_forces.tolist(),
        "linear": linear.tolist(),
        "line_domes": domes.tolist(),
        "errors": errors.tolist(),
        "least_slope": min(slopes),
        "most_slope": max(slopes),
        "total_force_variance": math.fsum(errors**2),
        "fitted_samples": _FITTED_SAMPLES,
        "neighbours": _NEIGHBOURS,
        "slope_tolerance": _SLOPE_TOLERANCE * (max(slopes) - min(slopes)),
        "firm": FIRM,
        "largest_residual": _LARGEST_RESIDUAL,
    }


def _level_slopes(sensor: MeasuringUnit, E: float, linear: Floats, domes: Floats) -> list[float]:
    """Return slopes of the contrast against the total force [mm/N], for a level press on fruit of modulus E [MPa].

    There is one slope for each of several depths of the press. `linear` (tips,) [mm/N] and `domes` (tips,)
    [mm/N^(2/3)] are the weights of F and F^(2/3) in the contrast. The derivative dF/dx of the forces with respect to
    the travel x solves [C + S / E + 2/3 h E^(-2/3) F^(-1/3)] dF/dx = 1. For flesh that relaxes, any slope between the
    slopes of the individual tips is possible, so there are two slopes for each depth: the smallest and the largest.
    """
    law = sensor.rise_law.contrast
    _, C, S = law.arrays  # compliance of the springs [mm/N], and of the flesh times E [1/mm]
    slopes = []
    for forces in np.outer(_FORCE_FRACTIONS, sensor.report.read_out.full_scale_N):
        power_slopes = forces ** (-1.0 / 3.0) / 1.5  # d F^(2/3) / dF
        tip_slopes = linear + domes * power_slopes
        if sensor.report.design.fruit.relaxation is not None:
            slopes += [float(tip_slopes.min()), float(tip_slopes.max())]
            continue
        dome_compliances = law.hertz * E ** (-2.0 / 3.0) * power_slopes
        force_rates = np.linalg.solve(C + S / E + np.diag(dome_compliances), np.ones(len(forces)))
        slopes.append(float(tip_slopes @ force_rates / force_rates.sum()))
    return slopes
