"""Scales of plots: where a value stands between two ends, and the values at which a scale has ticks."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_STEPS = (1.0, 2.0, 5.0, 10.0)
_ROUND_OFF = 1e-9  # of a step: what a tick at the very end of a scale may lie beyond it
_FEW_DECADES = 2


@dataclass(frozen=True, kw_only=True)
class Scale:
    """A linear or logarithmic scale from `start` to `end`, with at most so many steps between its numbers.

    Raises ValueError unless start is less than end, and greater than 0 where the scale is logarithmic.
    """

    start: float
    end: float
    logarithmic: bool = False
    steps: int = 8

    def __post_init__(self) -> None:
        if not self.start < self.end or (self.logarithmic and not self.start > 0.0):
            kind = "logarithmic" if self.logarithmic else "linear"
            msg = f"a {kind} scale cannot go from {self.start:g} to {self.end:g}"
            raise ValueError(msg)

    def shares(self, values: ArrayLike) -> Floats:
        """Return where values stand, from 0 at the start to 1 at the end [1], of the same shape; nan for nan."""
        given = np.asarray(values, dtype=np.float64)
        if self.logarithmic:
            return np.asarray(np.log(given / self.start) / math.log(self.end / self.start))
        return np.asarray((given - self.start) / (self.end - self.start))

    @property
    def ticks(self) -> tuple[tuple[float, str], ...]:
        """Return the values that have a number [unit of the scale], and how each is written."""
        if self.logarithmic:
            return tuple((value, f"{value:g}") for value in self._of_decades(self._written_digits()))
        digits = max(0, -math.floor(math.log10(self._step) + _ROUND_OFF))
        first = math.ceil(self.start / self._step - _ROUND_OFF)
        last = math.floor(self.end / self._step + _ROUND_OFF)
        values = (place * self._step for place in range(first, last + 1))
        return tuple((value, f"{value:.{digits}f}".replace("-", "\N{MINUS SIGN}")) for value in values)

    @property
    def small_ticks(self) -> tuple[float, ...]:
        """Return the values that have a tick without a number [unit of the scale]: those between powers of ten."""
        return self._of_decades(range(2, 10)) if self.logarithmic else ()

    @property
    def _step(self) -> float:
        """Return the step between ticks: 1, 2 or 5 times a power of ten."""
        least = (self.end - self.start) / self.steps
        power: float = 10.0 ** math.floor(math.log10(least))
        return next(step * power for step in _STEPS if step * power >= least * (1.0 - _ROUND_OFF))

    def _written_digits(self) -> tuple[int, ...]:
        """Return the first digits of the numbers that are written: also 2 and 5 where there are few powers of ten."""
        return (1,) if len(self._of_decades((1,))) > _FEW_DECADES else (1, 2, 5)

    def _of_decades(self, digits: "range | tuple[int, ...]") -> tuple[float, ...]:
        """Return the values with one of these first digits and no other, between the ends."""
        powers = range(math.floor(math.log10(self.start)), math.ceil(math.log10(self.end)) + 1)
        values = (digit * 10.0**power for power in powers for digit in digits)
        return tuple(value for value in values if self.start <= value <= self.end)
