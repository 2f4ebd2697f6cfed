"""What turns the forces of a finished sensor into a modulus; the fields are the keys of report.json, in its units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cad.fabrication.bridges import SignalPath
from cad.theory.contrast_law import ContrastLaw, pair_law

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class LevelReading:
    """What a level sensor in the middle of its fruit reads [MPa] where the modulus is E [MPa]: shape and skin."""

    E_MPa: float
    read_MPa: float


def corrected(read: float, level: Sequence[LevelReading]) -> float:
    """Return the modulus [MPa] that a level sensor reads as `read` [MPa]: what shape and skin of the fruit add."""
    if not level:
        return read
    logs = [math.log(row.read_MPa) for row in level]
    shifts = [math.log(row.E_MPa / row.read_MPa) for row in level]
    return read * math.exp(np.interp(math.log(read), logs, shifts))


@dataclass(frozen=True, kw_only=True)
class ReadOut:
    """What turns forces into a modulus, in the terms of the contrast law; that of a pair needs fewer.

    `springs_mm_per_N` and `fruit_per_mm` (times E) have shape (tips, tips), `full_scale_N`, the largest force of each
    channel, `weights` [1] and `gaps_mm` (tips,). A pair has `own_less_other_per_mm` and None for the terms of a
    contrast; other layouts the other way round. `level`, of a pair, or `rise_level`, of other layouts, are readings of
    level presses over the range of E, by which all are corrected; none where the law is exact. `lean_mm_per_N` (tips,
    tips) is what the contrast of domes adds to the springs, for forces that lean; None for other tips. `signal` is what
    becomes of forces on the way to counts; None where the design names no read-out. `fastest_press_s` is the shortest
    duration of a press by hand, from the first touch to its deepest point; None without a read-out.
    """

    method: str
    springs_mm_per_N: Matrix
    full_scale_N: tuple[float, ...]
    model_error_percent: float
    level: tuple[LevelReading, ...]
    own_less_other_per_mm: float | None = None
    weights: tuple[float, ...] | None = None
    gaps_mm: tuple[float, ...] | None = None
    fruit_per_mm: Matrix | None = None
    hertz: float | None = None
    lean_mm_per_N: Matrix | None = None
    signal: SignalPath | None = None
    rise_level: tuple[LevelReading, ...] = ()
    fastest_press_s: float | None = None

    @property
    def is_pair(self) -> bool:
        """Say whether the constants are those of a pair."""
        return self.weights is None

    @property
    def contrast(self) -> ContrastLaw:
        """Return the contrast law of the tips with the springs as designed."""
        return self.contrast_on(self.springs_mm_per_N)

    def contrast_on(self, springs: Sequence[Sequence[float]]) -> ContrastLaw:
        """Return the contrast law of the tips on springs of a compliance [mm/N], (tips, tips)."""
        if self.weights is None or self.gaps_mm is None or self.fruit_per_mm is None:
            return pair_law(springs, self.own_less_other_per_mm or 0.0)
        return ContrastLaw(
            weights=self.weights,
            gaps=self.gaps_mm,
            C=springs if self.lean_mm_per_N is None else np.add(springs, self.lean_mm_per_N).tolist(),
            S=self.fruit_per_mm,
            hertz=self.hertz or 0.0,
        )
