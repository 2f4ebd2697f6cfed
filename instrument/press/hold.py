"""What a hold after a press shows of flesh that relaxes: moduli as if it were elastic, at moments of the hold."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from instrument.press.touches import PressSamples
from sensor.design.parameters import Design
from sensor.theory.contrast_law import ContrastLaw, read_modulus

LATE = 0.95  # of the hold: at its end the sensor may already be on its way out


class Held(NamedTuple):
    """What the hold of a press shows: the apparent modulus [MPa] at the moment of the design, and the relaxation [1].

    The relaxation is the apparent modulus late in the hold over that at the stop. It is None if the press ended before.
    """

    apparent: float
    relaxation: float | None


def held_moduli(
    design: Design, press: PressSamples, contrast: ContrastLaw, offset: float, stiffened: Callable[[float], float]
) -> Held | None:
    """Return what the hold of a press shows by a contrast with an offset [mm].

    Moments of the hold count from the deepest sample. `stiffened` returns the stiffness of the springs so long after
    the stop [s], over that of the weighing [1]. None is returned for a press that ended before the moment of the
    design. Raises ReadingError if the forces of a moment show no modulus.
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
