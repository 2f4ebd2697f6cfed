"""What the form of printed domes does to a modulus: it is alike in all presses of a unit."""

import math
from collections.abc import Sequence

import numpy as np

from cad.parts.pin import tip_accuracy_mm
from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import Curvatures, rolling_domes
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.theory.dome_form import CAPS


def moved_by_form(design: Design, model: RiseModel, press: Floats, curvatures: Curvatures | None = None) -> Floats:
    """Return by which fraction of E each error of the form of domes moves a reading, one standard deviation [1].

    They are of a press (samples, tips) [N], with their signs. The first is that of the radius, the others are those of
    caps, each of an equal share. Outlines are off by half the accuracy of their process, one standard deviation. The
    radius is that of a round face whose rim is off by as much. All domes are taken to be off alike, as they are printed
    alike. Tips without domes have no such error.
    """
    rolling = rolling_domes(design, model.law.contrast.weights, curvatures)
    if rolling is None:
        return np.empty(0)
    outline = 0.5 * tip_accuracy_mm(design.tips, design.process)
    radius = rolling.dome_radius
    half = min(0.5 * design.tips.side_mm, radius)
    rim = radius - math.sqrt(radius**2 - half**2)
    deviations = np.array([outline / rim, *(len(CAPS) * [outline / math.sqrt(len(CAPS))])])
    return deviations * model.form(press, rolling, CAPS)


def of_middle(moduli: Sequence[float], rows: Floats) -> Floats:
    """Return what belongs to the middle of moduli [MPa] by rows of each (moduli, ...), straight over their logarithm.

    A design takes its reference ball to be as firm.
    """
    logs = np.log(moduli)
    at = 0.5 * (logs.min() + logs.max())
    columns = rows.reshape(len(logs), -1).T
    return np.array([np.interp(at, logs, column) for column in columns]).reshape(rows.shape[1:])
