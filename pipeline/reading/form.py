"""What the form of printed domes does to a modulus: it is alike in all presses of a unit."""

import math
from collections.abc import Sequence

import numpy as np

from cad.parts.dome_form import CAPS, form_deviations
from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import Curvatures, rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design


def moved_by_form(design: Design, model: RiseModel, press: Floats, curvatures: Curvatures | None = None) -> Floats:
    """Return by which fraction of E each error of the form of domes moves a reading, one standard deviation [1].

    They are of a press (samples, tips) [N], with their signs. The first is that of the radius, the others are those of
    caps, each of an equal share. All domes are taken to be off alike, as they are printed alike. Tips without domes
    have no such error.
    """
    rolling = rolling_domes(design, model.law.contrast.weights, curvatures)
    if rolling is None:
        return np.empty(0)
    outline, of_radius = form_deviations(design.tips, design.process)
    deviations = np.array([of_radius, *(len(CAPS) * [outline / math.sqrt(len(CAPS))])])
    return deviations * model.form(press, rolling, CAPS)


def of_middle(moduli: Sequence[float], rows: Floats) -> Floats:
    """Return what belongs to the middle of moduli [MPa] by rows of each (moduli, ...), straight over their logarithm.

    A design takes its reference ball to be as firm.
    """
    logs = np.log(moduli)
    at = 0.5 * (logs.min() + logs.max())
    columns = rows.reshape(len(logs), -1).T
    return np.array([np.interp(at, logs, column) for column in columns]).reshape(rows.shape[1:])
