"""Samples that contradict their press, found and left out as the samples come.

**The residual.** The contrast is y = w.(C F) + h z^2 w.F^(2/3) + z^3 w.(S F), at the modulus E = 1 / z^3 of the fruit.
It is the same in every sample of one press, whatever the pose and however fast the press is (`contrast_rise.py`). At
another modulus some samples in a row lie on a line of y over the whole force u. A spike in one channel moves both in a
direction that is no modulus. The slope of the line is bounded, by three things that all hold.

- The other samples of the row have a slope, known by their noise.
- The mean of the press before the row is a point of the line, but for a tenth of what the moduli allow.
- The fruit is in the range of the design, or up to a half beyond. A row that surely shows another slope is believed.

**The test.** Each sample of the row is left out in turn. The one whose absence leaves the least squares is suspected.
It is a spike if it lies off every line that the others allow, by five of its standard deviations. They
follow from the errors of the forces without a touch, or from the residuals of the press itself, if these are larger.
Normal noise leaves a sample out once in 1.7 million.

Where channels were brought to one time, a bad conversion is part of two samples, so two in a row are judged as one. A
decision waits for two samples more, and the memory does not grow.
"""

import math

import numpy as np

from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.design.reading import LEAST_OVER_NOISE

FIRM = 2.0  # times the least force of each tip: a touch that noise does not end
_LARGEST_RESIDUAL = 5.0  # standard deviations
_OTHERS = 4  # samples of a row that draw the line
_BESIDE = 2  # samples of a row on either side of one that is decided
_SLACK = 0.1  # of the slopes between the bounds: how far the chord of a press is off the slope at its end
_BEYOND = 1.5  # of both ends of the range of moduli
_FORCES = (0.02, 0.1, 0.4, 1.0)  # of full scale, at which slopes are taken


def spike_constants(sensor: MeasuringUnit) -> dict[str, object]:
    """Return what finds samples that contradict their press: those constants of `press_core.Unit`.

    The contrast is that of the middle of the range of moduli, its slopes those of level presses over the range.
    """
    weights, C, S = sensor.rise_law.contrast.arrays
    least, largest = sensor.range_MPa
    z = (least * largest) ** (-1.0 / 6.0)
    linear = weights @ (C + z**3 * S)
    domes = sensor.rise_law.contrast.hertz * z * z * weights
    errors = sensor.least_forces / LEAST_OVER_NOISE
    slopes = []
    for E in (least / _BEYOND, largest * _BEYOND):
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
    """Return slopes of the contrast over the whole force [mm/N] in a level press on fruit of E [MPa].

    Each dF of a travel dx is [C + S / E + 2/3 h E^(-2/3) F^(-1/3)] dF = dx. Flesh that relaxes may have any slope
    between those of the tips.
    """
    law = sensor.rise_law.contrast
    _, C, S = law.arrays
    slopes = []
    for forces in np.outer(_FORCES, sensor.report.read_out.full_scale_N):
        inverse_roots = forces ** (-1.0 / 3.0) / 1.5
        of_tips = linear + domes * inverse_roots
        if sensor.report.design.fruit.relaxation is not None:
            slopes += [float(of_tips.min()), float(of_tips.max())]
            continue
        sinks = law.hertz * E ** (-2.0 / 3.0) * inverse_roots
        rise = np.linalg.solve(C + S / E + np.diag(sinks), np.ones(len(forces)))
        slopes.append(float(of_tips @ rise / rise.sum()))
    return slopes
