"""The modulus from a press of two tips: a line over the press, whose slope no constant misalignment moves.

Each tip travels by x = (C F)_i + (S F)_i / E + lead_i, so that over the samples of one press

    (C F)_low - (C F)_high = (s11 - s12) / E (F_high - F_low) + lead ,

a straight line whose slope gives E and whose intercept gives how far one tip stands before the other. Measured forces
are noisy on both sides of it: W. E. Deming, Statistical Adjustment of Data, 1943, fits a line to such samples.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

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
        soft, stiff = other.soft - self.soft, other.stiff - self.stiff
        part, weight = other.count / count, self.count * other.count / count
        return PressSums(
            count,
            self.soft + part * soft,
            self.stiff + part * stiff,
            self.soft_soft + other.soft_soft + weight * soft * soft,
            self.soft_stiff + other.soft_stiff + weight * soft * stiff,
            self.stiff_stiff + other.stiff_stiff + weight * stiff * stiff,
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
    give = C[0][0] - C[1][0], C[0][1] - C[1][1]
    noise = _of_line(give, (noises[0] ** 2, 0.0, noises[1] ** 2))
    slope, spread = _slope(_of_line(give, (sums.soft_soft, sums.soft_stiff, sums.stiff_stiff)), noise)
    scatter = math.sqrt(max(noise[2] - 2.0 * slope * noise[1] + slope**2 * noise[0], 0.0))
    return PairLine(
        modulus=own_less_other / slope,
        lead=give[0] * sums.soft + give[1] * sums.stiff - slope * (sums.stiff - sums.soft),
        error=scatter / math.sqrt(spread) / slope,
    )


def ratio_modulus(C: Matrix, own_less_other: float, forces: Sequence[float]) -> float:
    """Return the modulus [MPa] that the forces of the low and the high tip [N] tell where both travel alike.

    This is (4) of the paper with springs that are coupled; C [mm/N] and s11 - s12 [1/mm] as in `line_over_press`. A
    lead of one tip moves it. Raises ReadingError where the forces tell nothing.
    """
    soft, stiff = forces
    give = (C[0][0] - C[1][0]) * soft + (C[0][1] - C[1][1]) * stiff
    if not (give > 0.0 and stiff > soft):
        raise ReadingError(OF_ANOTHER_SENSOR)
    return own_less_other * (stiff - soft) / give


Moments = tuple[float, float, float]


def _of_line(give: Sequence[float], products: Moments) -> Moments:
    """Return the products of x = F_high - F_low with x and with y = give . F, and of y with y."""
    soft, mixed, stiff = products
    return (
        soft - 2.0 * mixed + stiff,
        give[0] * (mixed - soft) + give[1] * (stiff - mixed),
        give[0] ** 2 * soft + 2.0 * give[0] * give[1] * mixed + give[1] ** 2 * stiff,
    )


def _slope(found: Moments, noise: Moments) -> tuple[float, float]:
    """Return the slope of y over x [mm/N] and the products of x with x, both without noise; raises ReadingError."""
    taken = _noise_share(found, noise)
    spread, rise = found[0] - taken * noise[0], found[1] - taken * noise[1]
    if not (spread > 0.0 and rise > 0.0):
        raise ReadingError(OF_ANOTHER_SENSOR)
    return rise / spread, spread


def _noise_share(found: Moments, noise: Moments) -> float:
    """Return the smallest t at which the matrix found - t noise lets through a line: its determinant is zero."""
    a = noise[0] * noise[2] - noise[1] ** 2
    b = found[0] * noise[2] + found[2] * noise[0] - 2.0 * found[1] * noise[1]
    c = max(found[0] * found[2] - found[1] ** 2, 0.0)
    root = b + math.sqrt(max(b * b - 4.0 * a * c, 0.0))
    return 2.0 * c / root if root > 0.0 else 0.0
