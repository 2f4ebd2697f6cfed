"""Errors of the modulus caused by form errors of the printed domes, which are the same in every press of a unit."""

import math
from collections.abc import Sequence

import numpy as np

from cad.parts.dome_form import CAPS, form_deviations
from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import Curvatures, rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design


def form_error_changes(design: Design, model: RiseModel, press: Floats, curvatures: Curvatures | None = None) -> Floats:
    """Return the signed relative change [1] of E due to one standard deviation of each form error of the domes.

    The first form error is the error of the dome radius. Each further form error is a spherical cap on the apex, with
    one of the radii in `CAPS`. The variance of the outline is divided equally among the caps. All domes have the same
    form errors, because they are printed in the same way.

    `press` holds the forces (samples, tips) [N]. `curvatures` are the principal curvatures of the fruit [1/mm], by
    default the curvatures of the design. The result has the shape (form errors,). The array is empty for tips without
    domes.
    """
    rolling = rolling_domes(design, model.law.contrast.weights, curvatures)
    if rolling is None:
        return np.empty(0)
    outline, radius_error = form_deviations(design.tips, design.process)  # standard deviations: in mm, and relative
    # All caps have the same variance, and the sum of their variances is the variance of the outline.
    cap_deviation = outline / math.sqrt(len(CAPS))
    deviations = np.array([radius_error, *(len(CAPS) * [cap_deviation])])
    return deviations * model.form_slopes(press, rolling, CAPS)


def interpolate_to_middle(moduli: Sequence[float], rows: Floats) -> Floats:
    """Interpolate `rows` (moduli, ...) to the middle of the range of moduli [MPa], linearly in the logarithm of E.

    The error analysis assumes that the reference ball has this modulus.
    """
    logs = np.log(moduli)
    middle = 0.5 * (logs.min() + logs.max())
    columns = rows.reshape(len(logs), -1).T
    return np.array([np.interp(middle, logs, column) for column in columns]).reshape(rows.shape[1:])
