"""Rows that do not fit a straight line, and lines that are bent: what a table of weights or of a plate may hide."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from sensor.arrays import Floats

LEAST_SPAN = 1e-6  # [N] or [mm]: below, a table has one load or one travel
ROUNDED = 12.0**-0.5  # standard deviation of a rounded number, of its last digit (JCGM 100:2008, F.2.2.1)
_UNLIKELY = 1e-4  # probability by which some row of a table without a fault is farther off
_LEAST_WIDTH = 0.1  # of the rows that draw a line, over that of all
_LEAST_RESIDUAL = 0.01  # of the span of a line: what is nearer moves a slope by less than the bar tells


@dataclass(frozen=True, kw_only=True)
class OddRow:
    """A row by its index that is off the line of all others, and what that line expects there."""

    index: int
    expected: float


def odd_row(x: Floats, shown: Floats, last_digits: Floats, span: float) -> OddRow | None:
    """Return the row of a line of what is shown over x that the others contradict; None where all fit.

    The residual of each row about the line of the others is compared with their scatter by Student's t. See R. D. Cook,
    S. Weisberg, Residuals and Influence in Regression, 1982, 2.2.2. It counts where it is a hundredth of a `span`.
    """
    freedom = len(x) - 3  # of a line through the others
    if freedom < 1:
        return None
    # The suspect is the row without which the others scatter least.
    lines = [line for index in range(len(x)) if (line := _line_without(x, shown, index)) is not None]
    if not lines:
        return None
    line = min(lines, key=lambda each: each.squares)
    others = x[np.arange(len(x)) != line.row]
    apart = float((x[line.row] - others.mean()) / np.linalg.norm(others - others.mean()))
    deviation = np.hypot(np.sqrt(line.squares / freedom), ROUNDED * last_digits.max())
    expected = float(line.zero + line.slope * x[line.row])
    residual = abs(float(shown[line.row]) - expected)
    # any of the rows may be the suspect, so the probability is shared by all
    student = float(stdtrit(freedom, 1.0 - 0.5 * _UNLIKELY / len(x)))
    likely = student * deviation * np.sqrt(1.0 + 1.0 / len(others) + apart**2)
    if residual > max(likely, _LEAST_RESIDUAL * abs(span)):
        return OddRow(index=line.row, expected=expected)
    return None


class _LineWithout(NamedTuple):
    """The line of all rows but one, whose index is `row`: slope, value at x = 0, and the squares that it leaves."""

    row: int
    slope: float
    zero: float
    squares: float


def _line_without(x: Floats, shown: Floats, index: int) -> _LineWithout | None:
    """Return the line of all rows but one; None where the others lie so close together that they draw none."""
    others = np.arange(len(x)) != index
    if np.ptp(x[others]) < _LEAST_WIDTH * np.ptp(x):
        return None
    slope, zero = np.polyfit(x[others], shown[others], 1)
    return _LineWithout(index, slope, zero, float(np.sum((shown[others] - zero - slope * x[others]) ** 2)))


@dataclass(frozen=True, kw_only=True)
class Bend:
    """The change of a slope from the first point of a line to the last, over the slope [1], and its deviation."""

    change: float
    deviation: float

    @property
    def excess(self) -> float:
        """Return by how much the change is larger than what the scatter explains [1]."""
        return max(0.0, abs(self.change) - 3.0 * self.deviation)


def bend_of(x: Floats, shown: Floats, last_digits: Floats) -> Bend:
    """Return the bend of what is shown over x, by a parabola; none of three points or of three different x."""
    freedom = len(x) - 3
    if freedom < 1 or len(set(x.tolist())) <= 3:  # noqa: PLR2004 - a parabola has three coefficients
        return Bend(change=0.0, deviation=0.0)
    part = (x - x.mean()) / np.ptp(x)
    columns = np.column_stack([np.ones(len(x)), part, part**2])
    inverse = np.linalg.inv(columns.T @ columns)
    found = inverse @ columns.T @ shown
    scatter = float(np.sum((shown - columns @ found) ** 2)) / freedom
    deviation = np.sqrt((scatter + (ROUNDED * float(last_digits.max())) ** 2) * inverse[2, 2])
    student = float(stdtrit(freedom, 0.975)) / 2.0
    return Bend(change=float(2.0 * found[2] / found[1]), deviation=float(2.0 * student * deviation / abs(found[1])))
