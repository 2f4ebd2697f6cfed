"""Errors of the modulus due to the form of printed domes; they are the same in all presses of a unit."""

import math
from collections.abc import Sequence

import numpy as np

from cad.parts.dome_form import CAPS, form_deviations
from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import Curvatures, rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design


def changes_by_form(design: Design, model: RiseModel, press: Floats, curvatures: Curvatures | None = None) -> Floats:
    """Return the relative change of E due to one standard deviation of each form error of the domes, with its sign [1].

    The first form error is that of the dome radius. Each other one is a spherical cap on the apex, with one of the
    radii in `CAPS`; the caps share the deviation of the outline equally. All domes have the same errors, because they
    are printed in the same way. `press` has the forces (samples, tips) [N], and `curvatures` are those of the fruit
    [1/mm], by default the design's. The result is empty for tips without domes.
    """
    rolling = rolling_domes(design, model.law.contrast.weights, curvatures)
    if rolling is None:
        return np.empty(0)
    outline, radius_error = form_deviations(design.tips, design.process)
    # The variance of the outline is the sum of the equal variances of the caps.
    deviations = np.array([radius_error, *(len(CAPS) * [outline / math.sqrt(len(CAPS))])])
    return deviations * model.form(press, rolling, CAPS)


def interpolate_to_middle(moduli: Sequence[float], rows: Floats) -> Floats:
    """Return rows (moduli, ...) interpolated to the middle of the range of moduli [MPa], linearly in their logarithm.

    The error analysis assumes that a reference ball has this modulus.
    """
    logs = np.log(moduli)
    middle = 0.5 * (logs.min() + logs.max())
    columns = rows.reshape(len(logs), -1).T
    return np.array([np.interp(middle, logs, column) for column in columns]).reshape(rows.shape[1:])
