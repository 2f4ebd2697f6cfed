"""The modulus from a press of two tips: a line over the press, whose slope no constant misalignment moves.

Each tip travels by x = (C F)_i + (S F)_i / E + lead_i, so that over the samples of one press

    (C F)_low - (C F)_high = (s11 - s12) / E (F_high - F_low) + lead ,

a straight line whose slope gives E and whose intercept gives how far one tip stands before the other. Measured forces
are noisy on both sides of it: W. E. Deming, Statistical Adjustment of Data, 1943, fits a line to such samples.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cad.theory.contrast_law import Matrix, ReadingError

FEWEST = 3
OF_ANOTHER_SENSOR = (
    "the forces belong to no modulus: must be those of this sensor, pressed on a fruit; calibrate it anew"
)


@dataclass(frozen=True, kw_only=True)
class PairLine:
    """The modulus of the fruit [MPa] that a press tells, and how far the high tip stands before the low one [mm].

    `error` is the standard deviation of the modulus by the noise of the forces, as a share of it [1].
    """

    modulus: float
    lead: float
    error: float = 0.0


@dataclass(frozen=True)
class PressSums:
    """Samples of a press as running sums: their count, mean forces [N], and products of what they differ from these.

    The products [N^2] are low with low, low with high, and high with high tip, summed over the samples.
    """

    count: int = 0
    soft: float = 0.0
    stiff: float = 0.0
    soft_soft: float = 0.0
    soft_stiff: float = 0.0
    stiff_stiff: float = 0.0

    def joined(self, other: "PressSums") -> "PressSums":
        """Return the sums over the samples of both."""
        count = self.count + other.count
        if count == 0:
            return self
        low_step = other.soft - self.soft
        high_step = other.stiff - self.stiff
        fraction = other.count / count
        weight = self.count * other.count / count
        return PressSums(
            count=count,
            soft=self.soft + fraction * low_step,
            stiff=self.stiff + fraction * high_step,
            soft_soft=self.soft_soft + other.soft_soft + weight * low_step * low_step,
            soft_stiff=self.soft_stiff + other.soft_stiff + weight * low_step * high_step,
            stiff_stiff=self.stiff_stiff + other.stiff_stiff + weight * high_step * high_step,
        )


def line_over_press(C: Matrix, own_less_other: float, presses: Sequence[Sequence[float]]) -> PairLine:
    """Return what forces of the low and the high tip [N] without noise over one press tell.

    C [mm/N] has a row and a column for each spring; `own_less_other` is s11 - s12, times E [1/mm]. Samples in which a
    tip is off the fruit are left out. Raises ReadingError where fewer than three are left, or where they tell nothing.
    """
    sums = PressSums()
    for forces in presses:
        if min(forces) > 0.0:
            sums = sums.joined(PressSums(1, *forces))
    return line_of_sums(C, own_less_other, sums)


def line_of_sums(C: Matrix, own_less_other: float, sums: PressSums, noises: Sequence[float] = (0.0, 0.0)) -> PairLine:
    """Return what the sums over a press tell; `noises` [N] are the standard deviations of both forces.

    C [mm/N] and `own_less_other` [1/mm] as in `line_over_press`, which says what raises.
    """
    if sums.count < FEWEST:
        msg = f"samples with both tips on the fruit = {sums.count}: must be at least {FEWEST}; press farther"
        raise ReadingError(msg)
    # x = F_high - F_low [N], and y [mm], by how much more the low spring is bent than the high one
    x_and_y = np.array([[-1.0, 1.0], np.subtract(C[0], C[1])])
    forces = [[sums.soft_soft, sums.soft_stiff], [sums.soft_stiff, sums.stiff_stiff]]
    samples = x_and_y @ forces @ x_and_y.T
    noise = x_and_y @ np.diag(np.square(noises)) @ x_and_y.T

    # Deming's line: so much of the noise is taken off the products that what remains lies on a line
    (spread, rise), _ = samples - _noise_fraction(samples, noise) * noise
    if not (spread > 0.0 and rise > 0.0):
        raise ReadingError(OF_ANOTHER_SENSOR)
    slope = float(rise / spread)

    x, y = x_and_y @ [sums.soft, sums.stiff]
    off_line = np.array([-slope, 1.0])
    scatter = math.sqrt(max(off_line @ noise @ off_line, 0.0))
    return PairLine(
        modulus=own_less_other / slope,
        lead=float(y - slope * x),
        error=scatter / math.sqrt(spread) / slope,
    )


def _noise_fraction(samples: npt.NDArray[np.float64], noise: npt.NDArray[np.float64]) -> float:
    """Return the smallest t at which the products samples - t noise are those of a line: their determinant is zero."""
    a = noise[0, 0] * noise[1, 1] - noise[0, 1] ** 2
    b = samples[0, 0] * noise[1, 1] + samples[1, 1] * noise[0, 0] - 2.0 * samples[0, 1] * noise[0, 1]
    c = max(samples[0, 0] * samples[1, 1] - samples[0, 1] ** 2, 0.0)
    root = b + math.sqrt(max(b * b - 4.0 * a * c, 0.0))
    return float(2.0 * c / root) if root > 0.0 else 0.0


def ratio_modulus(C: Matrix, own_less_other: float, forces: Sequence[float], lead: float = 0.0) -> float:
    """Return the modulus [MPa] that the forces of the low and the high tip [N] tell where the high one has a lead [mm].

    This is (4) of the paper with springs that are coupled; C [mm/N] and s11 - s12 [1/mm] as in `line_over_press`.
    Raises ReadingError where the forces tell nothing.
    """
    low, high = forces
    difference = (C[0][0] - C[1][0]) * low + (C[0][1] - C[1][1]) * high - lead
    if not (difference > 0.0 and high > low):
        raise ReadingError(OF_ANOTHER_SENSOR)
    return own_less_other * (high - low) / difference
