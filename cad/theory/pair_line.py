"""The modulus from a press of two tips: a line over the press, whose slope no constant misalignment moves.

Each tip travels by x = (C F)_i + (S F)_i / E + lead_i, so that over the samples of one press

    (C F)_low - (C F)_high = (s11 - s12) / E (F_high - F_low) + lead ,

a straight line whose slope gives E and whose intercept gives how far one tip stands before the other.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cad.theory.contrast_law import Matrix, ReadingError

FEWEST = 3


@dataclass(frozen=True, kw_only=True)
class PairLine:
    """The modulus of the fruit [MPa] that a press tells, and how far the high tip stands before the low one [mm]."""

    modulus: float
    lead: float


def line_over_press(C: Matrix, own_less_other: float, presses: Sequence[Sequence[float]]) -> PairLine:
    """Return what the forces of the low and the high tip [N] over one press tell.

    C [mm/N] has a row and a column for each spring; `own_less_other` is s11 - s12, times E [1/mm]. Samples in which a
    tip is off the fruit are left out. Raises ReadingError where fewer than three are left, or where they tell nothing.
    """
    touching = [forces for forces in presses if min(forces) > 0.0]
    if len(touching) < FEWEST:
        msg = f"samples with both tips on the fruit = {len(touching)}: must be at least {FEWEST}; press farther"
        raise ReadingError(msg)
    across = [stiff - soft for soft, stiff in touching]
    give = [(C[0][0] - C[1][0]) * soft + (C[0][1] - C[1][1]) * stiff for soft, stiff in touching]
    slope, level = _line(across, give)
    if not slope > 0.0:
        msg = "the forces belong to no modulus: must be those of this sensor, pressed on a fruit; calibrate it anew"
        raise ReadingError(msg)
    return PairLine(modulus=own_less_other / slope, lead=level)


def _line(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Return slope and intercept of the straight line of least squares of y over x."""
    middle, level = (math.fsum(values) / len(values) for values in (x, y))
    spread = math.fsum((value - middle) ** 2 for value in x)
    rise = math.fsum((one - middle) * (other - level) for one, other in zip(x, y, strict=True))
    slope = rise / spread if spread > 0.0 else 0.0
    return slope, level - slope * middle
