"""Constants from which a finished sensor computes a modulus, given its forces. The fields are keys of report.json."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sensor.design.signal_path import SignalPath
from sensor.quantity import report_field
from sensor.record import Record
from sensor.theory.contrast_law import ContrastLaw, pair_law

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class LevelReading:
    """The uncorrected reading [MPa] of a level sensor at the centre of a fruit with the true modulus E [MPa]."""

    E_MPa: float = report_field("MPa", "modulus of the fruit in a simulated level press at its centre")
    read_MPa: float = report_field("MPa", "modulus that is read from the rise of that press")


def correct_reading(E_read: float, level: Sequence[LevelReading]) -> float:
    """Correct a modulus that was read [MPa] for the shape and the skin of the fruit, by simulated level readings.

    The correction factor is the true modulus divided by the modulus read. Its logarithm is interpolated linearly in the
    logarithm of the modulus read, and is constant beyond the first and the last of the `level` readings. Without level
    readings, the modulus is unchanged.
    """
    if not level:
        return E_read
    log_readings = [math.log(row.read_MPa) for row in level]
    log_factors = [math.log(row.E_MPa / row.read_MPa) for row in level]
    return E_read * math.exp(np.interp(math.log(E_read), log_readings, log_factors))


@dataclass(frozen=True, kw_only=True)
class ReadChannels:
    """The errors of the channels due to the read-out, and the counts at which they saturate; one channel for each tip.

    The zeros drift by at most `zero_drift_N`, and the gains by at most `gain_drift_percent`.
    """

    zero_drift_N: tuple[float, ...]
    gain_drift_percent: tuple[float, ...]
    saturation_counts: int = 2**23 - 1  # full scale of a 24-bit converter


@dataclass(frozen=True, kw_only=True, repr=False)
class ReadingConstants(Record):
    """The constants of the contrast law from which a modulus is computed, given the forces.

    `springs_mm_per_N`, `fruit_per_mm` and `lean_mm_per_N` have the shape (tips, tips). `full_scale_N`, `weights` and
    `gaps_mm` have the shape (tips,). The law of a pair is simpler: it has `own_less_other_per_mm`, but no `weights`,
    `gaps_mm`, `fruit_per_mm` and `hertz`. Other layouts have these, but no `own_less_other_per_mm`.
    """

    method: str = report_field("", "the method that computes a modulus from the forces")
    springs_mm_per_N: Matrix = report_field(
        "mm/N",
        "compliance matrix of the springs, a row for each tip; the elements off the diagonal are the "
        "crosstalk through the frame",
    )
    full_scale_N: tuple[float, ...] = report_field(
        "N", "largest force of each channel; if the design has `[reading]`, over all its poses"
    )
    model_error_percent: float = report_field("%", "error of E that the error of the solved contact causes")
    level: tuple[LevelReading, ...] = report_field(
        "",
        "simulated level presses by which all readings of a pair are corrected; empty if the law of a pair is exact",
    )
    own_less_other_per_mm: float | None = report_field(
        "1/mm", "s11 - s12 of a pair, times E; null for other layouts", default=None
    )
    weights: tuple[float, ...] | None = report_field(
        "1", "weight of each tip in the contrast; null for a pair", default=None
    )
    gaps_mm: tuple[float, ...] | None = report_field(
        "mm", "distance of each tip from the fruit at the first touch of a level press; null for a pair", default=None
    )
    fruit_per_mm: Matrix | None = report_field(
        "1/mm",
        "compliance matrix of the fruit times E, under domes without Hertz's local indentation; null for a pair",
        default=None,
    )
    hertz: float | None = report_field(
        "mm (MPa/N)^(2/3)",
        "Hertz's factor: the local indentation under a dome is this factor times (F / E)^(2/3); 0 for flat "
        "tips, null for a pair",
        default=None,
    )
    lean_mm_per_N: Matrix | None = report_field(
        "mm/N",
        "only for domes: compliance that is added to the springs' compliance in the contrast, because inclined forces "
        "of a level press deflect the tips sideways; left out for other tips",
        default=None,
        left_out=True,
    )
    signal: SignalPath | None = report_field(
        "",
        "conversion of forces to counts; left out without `[readout]` in the design. Lists are in the order of `tips`",
        default=None,
        left_out=True,
    )
    rise_level: tuple[LevelReading, ...] = report_field(
        "",
        "simulated level presses by which all readings of a line or a square are corrected; left out for a pair",
        default=(),
        left_out=True,
    )
    fastest_press_s: float | None = report_field(
        "s",
        "shortest duration of a press by hand, from the first touch to the deepest point, that gives an accurate E. A "
        "faster press has too few samples, or the conversion times of its channels cause an error of E "
        "above 2 % on level fruit. Left out without `[readout]`",
        default=None,
        left_out=True,
    )

    @property
    def is_pair(self) -> bool:
        """Return whether the constants are for a pair of tips."""
        return self.weights is None

    @property
    def channels(self) -> ReadChannels:
        """Return the errors of the channels, which do not drift without a read-out."""
        signal = self.signal
        if signal is None:
            no_drift = (0.0,) * len(self.full_scale_N)  # one for each tip
            return ReadChannels(zero_drift_N=no_drift, gain_drift_percent=no_drift)
        return ReadChannels(
            zero_drift_N=signal.zero_drift_N,
            gain_drift_percent=signal.gain_drift_percent,
            saturation_counts=signal.saturation_counts,
        )

    @property
    def level_readings(self) -> tuple[LevelReading, ...]:
        """Return the level readings by which all readings are corrected, whatever the layout."""
        return self.level if self.is_pair else self.rise_level

    @property
    def contrast(self) -> ContrastLaw:
        """Return the contrast law of the tips with the springs as designed."""
        return self.contrast_on(self.springs_mm_per_N)

    def contrast_on(self, springs: Sequence[Sequence[float]]) -> ContrastLaw:
        """Return the contrast law on springs with a different compliance matrix, `springs` (tips, tips) [mm/N]."""
        if self.weights is None or self.gaps_mm is None or self.fruit_per_mm is None:  # all are None for a pair
            return pair_law(springs, self.own_less_other_per_mm or 0.0)
        C = springs if self.lean_mm_per_N is None else np.add(springs, self.lean_mm_per_N).tolist()
        return ContrastLaw(weights=self.weights, gaps=self.gaps_mm, C=C, S=self.fruit_per_mm, hertz=self.hertz or 0.0)
