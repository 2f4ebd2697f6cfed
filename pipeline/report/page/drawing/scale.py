"""Scales of plots: where a value stands between two ends, and the values at which a scale has ticks."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_STEPS = (1.0, 2.0, 5.0, 10.0)
_ROUND_OFF = 1e-9  # of a step: what a tick at the very end of a scale may lie beyond it
_FEW_DECADES = 2
_PLAIN = (0.01, 99999.0)  # the sizes of linear scales whose numbers are short as they are
_PLAIN_POWER = (1e-4, 1e5)  # the numbers of logarithmic scales that are written without a power of ten
_RAISED = str.maketrans("-0123456789", "\N{SUPERSCRIPT MINUS}⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, kw_only=True)
class Scale:
    """A linear or logarithmic scale from `start` to `end`, with at most so many steps between its numbers.

    Its numbers are multiples of a power of ten where they would be long without, which `named` puts into the unit.
    Raises ValueError unless start is less than end, both are finite, and both greater than 0 on a logarithmic scale.
    """

    start: float
    end: float
    logarithmic: bool = False
    steps: int = 8

    def __post_init__(self) -> None:
        ordered = -math.inf < self.start < self.end < math.inf
        if not ordered or (self.logarithmic and not self.start > 0.0):
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
        if not self._in_equal_steps:
            return tuple((value, _written(value)) for value in self._of_decades(self._digits, self._stride))
        digits = max(0, self._power - math.floor(math.log10(self._step) + _ROUND_OFF))
        first = math.ceil(self.start / self._step - _ROUND_OFF)
        last = math.floor(self.end / self._step + _ROUND_OFF)
        values = (place * self._step for place in range(first, last + 1))
        texts = ((value, f"{value / 10.0**self._power:.{digits}f}") for value in values)
        return tuple((value, text.replace("-", "\N{MINUS SIGN}")) for value, text in texts)

    def named(self, label: str) -> str:
        """Return the name of a scale with the power of ten of its numbers in the brackets of its unit."""
        if self._power == 0:
            return label
        return label.replace("[", f"[{_power_of_ten(self._power)} ", 1).replace(" 1]", "]")

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

    @property
    def _power(self) -> int:
        """Return the power of ten that numbers in equal steps are multiples of: 0, or another multiple of 3."""
        largest = max(abs(self.start), abs(self.end))
        if not self._in_equal_steps or _PLAIN[0] <= largest <= _PLAIN[1]:
            return 0
        return 3 * math.floor(math.log10(largest) / 3.0)

    @property
    def _in_equal_steps(self) -> bool:
        """Say whether numbers are in equal steps: also on a logarithmic scale too short for two of 1, 2, 5, 10."""
        return not self.logarithmic or len(self._of_decades(self._digits)) <= 1

    @property
    def _digits(self) -> tuple[int, ...]:
        """Return the first digits of the numbers that are written: also 2 and 5 where there are few powers of ten."""
        return (1,) if len(self._of_decades((1,))) > _FEW_DECADES else (1, 2, 5)

    @property
    def _stride(self) -> int:
        """Return how many powers of ten lie between numbers: more than one where there are more than steps."""
        return math.ceil(max(1, len(self._of_decades((1,)))) / self.steps)

    def _of_decades(self, digits: "range | tuple[int, ...]", stride: int = 1) -> tuple[float, ...]:
        """Return the values with one of these first digits and no other, between the ends, in each so many decades."""
        powers = range(math.floor(math.log10(self.start)), math.ceil(math.log10(self.end)) + 1)
        values = (digit * 10.0**power for power in powers if power % stride == 0 for digit in digits)
        return tuple(value for value in values if self.start <= value <= self.end)


def _written(value: float) -> str:
    """Return one digit times a power of ten, in full where that is short."""
    if _PLAIN_POWER[0] <= value < _PLAIN_POWER[1]:
        return f"{value:g}"
    digit, _, power = f"{value:.0e}".partition("e")
    times = "" if digit == "1" else f"{digit}\N{MULTIPLICATION SIGN}"
    return times + _power_of_ten(int(power))


def _power_of_ten(power: int) -> str:
    return f"10{str(power).translate(_RAISED)}"
