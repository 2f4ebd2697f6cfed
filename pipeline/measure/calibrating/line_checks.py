"""Rows that do not fit a straight line, and lines that are bent: what a table of weights or of a plate may hide."""

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from sensor.arrays import Floats

LEAST_SPAN = 1e-6  # [N] or [mm]: below, a table has one load or one travel
_UNLIKELY = 1e-4  # probability by which some row of a table without a fault is farther off
_LEAST_RESIDUAL = 0.01  # of the span of a line: what is nearer moves a slope by less than the bar tells
_ROUNDED = 12.0**-0.5  # standard deviation of a rounded number, of its last digit (JCGM 100:2008, F.2.2.1)


@dataclass(frozen=True, kw_only=True)
class OddRow:
    """A row by its index that is off the line of all others, and what that line expects there."""

    index: int
    expected: float


def odd_row(x: Floats, shown: Floats, last_digits: Floats, span: float) -> OddRow | None:
    """Return the row of a line of what is shown over x that the others contradict; None where all fit.

    The residual of each row about the line of the others is compared with their scatter by Student's t (R. D. Cook,
    S. Weisberg, Residuals and Influence in Regression, 1982, 2.2.2). It counts where it is a hundredth of a `span`.
    """
    freedom = len(x) - 3
    if freedom < 1:
        return None
    suspect = None
    least = np.inf
    for index in range(len(x)):
        others = np.arange(len(x)) != index
        if np.ptp(x[others]) < 0.1 * np.ptp(x):
            continue
        slope, zero = np.polyfit(x[others], shown[others], 1)
        squares = float(np.sum((shown[others] - zero - slope * x[others]) ** 2))
        if squares < least:
            suspect, least = (index, slope, zero, others), squares
    if suspect is None:
        return None
    index, slope, zero, others = suspect
    apart = float((x[index] - x[others].mean()) / np.linalg.norm(x[others] - x[others].mean()))
    deviation = np.hypot(np.sqrt(least / freedom), _ROUNDED * last_digits.max())
    expected = float(zero + slope * x[index])
    residual = abs(float(shown[index]) - expected)
    likely = (
        float(stdtrit(freedom, 1.0 - 0.5 * _UNLIKELY / len(x)))
        * deviation
        * np.sqrt(1.0 + 1.0 / others.sum() + apart**2)
    )
    if residual > max(likely, _LEAST_RESIDUAL * abs(span)):
        return OddRow(index=index, expected=expected)
    return None


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
    deviation = np.sqrt((scatter + (_ROUNDED * float(last_digits.max())) ** 2) * inverse[2, 2])
    student = float(stdtrit(freedom, 0.975)) / 2.0
    return Bend(change=float(2.0 * found[2] / found[1]), deviation=float(2.0 * student * deviation / abs(found[1])))
