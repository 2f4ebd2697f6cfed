"""Apparent moduli of flesh that relaxes, at different times in the hold after a press."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from instrument.press.touches import PressSamples
from sensor.design.parameters import Design
from sensor.theory.contrast_law import ContrastLaw, read_modulus

LATE_FRACTION = 0.95
"""Fraction of the hold at which the relaxation is read; at the end of the hold the sensor may already be retracting."""


class HeldReading(NamedTuple):
    """The apparent modulus [MPa] at the reading time of the design, and the relaxation ratio [1].

    The relaxation ratio is the apparent modulus late in the hold divided by the apparent modulus at its start. There is
    no ratio, and `relaxation` is None, if the press ended before this late moment.
    """

    apparent: float
    relaxation: float | None


def held_moduli(
    design: Design, press: PressSamples, contrast: ContrastLaw, offset: float, stiffness_ratio: Callable[[float], float]
) -> HeldReading | None:
    """Return the apparent modulus and the relaxation ratio in the hold of a press.

    Each apparent modulus follows from the forces at one moment, by the law `contrast` with the `offset` [mm] of the
    press. Moments are times [s] since the stop, which is the deepest sample. `stiffness_ratio` maps a moment to the
    stiffness of the springs divided by their stiffness under calibration weights [1]. Returns None if the press ended
    before the reading time of the design. Raises ReadingError if the forces at a moment do not determine a modulus.
    """
    reading_moment = design.read_s - design.stop_s
    late_moment = LATE_FRACTION * (design.release_s - design.stop_s)
    moments = (0.0, reading_moment, late_moment)
    stop = press.t[press.deepest]
    recorded_moments = [moment for moment in moments if press.t[-1] >= stop + moment]
    if reading_moment not in recorded_moments:
        return None
    apparent_moduli = []
    for moment in recorded_moments:
        forces = [float(np.interp(stop + moment, press.t, tip_forces)) for tip_forces in press.forces.T]
        apparent_moduli.append(stiffness_ratio(moment) * read_modulus(contrast, forces, offset))
    at_stop, at_reading, *at_late_moment = apparent_moduli  # the last list is empty if the press ended before
    relaxation = at_late_moment[0] / at_stop if at_late_moment else None
    return HeldReading(apparent=at_reading, relaxation=relaxation)
