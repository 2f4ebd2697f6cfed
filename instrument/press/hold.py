"""Apparent moduli of flesh that relaxes, at moments of the hold after a press."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from instrument.press.touches import PressSamples
from sensor.design.parameters import Design
from sensor.theory.contrast_law import ContrastLaw, read_modulus

LATE = 0.95  # as a fraction of the hold; at its end the sensor may already be retracting


class Held(NamedTuple):
    """The apparent modulus [MPa] at the reading moment of the design, and the relaxation [1].

    The relaxation is the apparent modulus late in the hold over the apparent modulus at the stop. It is None if the
    press ended earlier.
    """

    apparent: float
    relaxation: float | None


def held_moduli(
    design: Design, press: PressSamples, contrast: ContrastLaw, offset: float, stiffened: Callable[[float], float]
) -> Held | None:
    """Return the apparent modulus and relaxation in the hold of a press, by a contrast with an offset [mm].

    Moments of the hold are counted from the deepest sample. `stiffened` returns the stiffness of the springs at a time
    after the stop [s] over their stiffness at the weighing [1]. Returns None if the press ended before the reading
    moment of the design. Raises ReadingError if the forces of a moment give no modulus.
    """
    moments = (0.0, design.read_s - design.stop_s, LATE * (design.release_s - design.stop_s))
    stop = press.t[press.deepest]
    due = [moment for moment in moments if press.t[-1] >= stop + moment]
    if moments[1] not in due:
        return None
    apparent = []
    for moment in due:
        forces = [float(np.interp(stop + moment, press.t, of_tip)) for of_tip in press.forces.T]
        apparent.append(stiffened(moment) * read_modulus(contrast, forces, offset))
    at_stop, at_read, *late = apparent
    return Held(at_read, late[0] / at_stop if late else None)
