"""Errors of a modulus by the form of printed domes, which are the same in all presses of a unit."""

import math
from collections.abc import Sequence

import numpy as np

from cad.parts.dome_form import CAPS, form_deviations
from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import Curvatures, rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design


def moved_by_form(design: Design, model: RiseModel, press: Floats, curvatures: Curvatures | None = None) -> Floats:
    """Return the relative change of E by one standard deviation of each form error of the domes, with its sign [1].

    The press has forces (samples, tips) [N]. The first error is of the radius; the others are of caps, which share the
    deviation of the outline equally. All domes have the same error, because they are printed alike. Tips without domes
    have none.
    """
    rolling = rolling_domes(design, model.law.contrast.weights, curvatures)
    if rolling is None:
        return np.empty(0)
    outline, of_radius = form_deviations(design.tips, design.process)
    deviations = np.array([of_radius, *(len(CAPS) * [outline / math.sqrt(len(CAPS))])])
    return deviations * model.form(press, rolling, CAPS)


def of_middle(moduli: Sequence[float], rows: Floats) -> Floats:
    """Return rows (moduli, ...) interpolated to the middle of the moduli [MPa], linearly over their logarithm.

    A design assumes a reference ball of this firmness.
    """
    logs = np.log(moduli)
    at = 0.5 * (logs.min() + logs.max())
    columns = rows.reshape(len(logs), -1).T
    return np.array([np.interp(at, logs, column) for column in columns]).reshape(rows.shape[1:])
