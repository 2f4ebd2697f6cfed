"""Rows that do not fit a straight line, and lines that are bent: what a table of weights or of a plate may hide.

**Lack of fit.** A channel that bends shows c = p0 + p1 F + p2 F^2 of a force F, and a deflection does likewise. The
straight line through its weights has the slope s = cov(F, c) / var(F) = p1 + 2 p2 m, with the middle of the weights
m = cov(F, F^2) / (2 var F). A press reads by co-moments with its instrument u, so it sees the slope p1 + 2 p2 m', with
the middle of its samples m' = cov(u, F^2) / (2 cov(u, F)). One moment sees the chord from zero, where m' = F / 2. What
is shown in a press is thus wrong by the fraction

    e = k (m' - m),    k = 2 p2 / s,

which is a straight line over m': its value at m' = 0, -k m, and its slope k tell it for any press. It is an error of
known sign, which moves E by e times the slope of ln E over a gain or a compliance. It is not corrected, so its size
adds to the half width (JCGM 100:2008, F.2.4.5).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from sensor.arrays import Floats

LEAST_SPAN = 1e-6  # [N] or [mm]: below, a table has one load or one travel
ROUNDED = 12.0**-0.5  # standard deviation of a rounded number, of its last digit (JCGM 100:2008, F.2.2.1)
_UNLIKELY = 1e-4  # probability by which some row of a table without a fault is farther off
_LEAST_WIDTH = 0.1  # of the rows that draw a line, over that of all
_BEYOND_SCATTER = 3.0  # deviations: of straight lines a bend is told in three of a thousand
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
    """The change of a slope from the first point of a line to the last, over the slope [1], and its deviation.

    `middle` is that of the points, `span` the distance of the first from the last. `scatter` is the standard deviation
    of what is shown about the parabola, wider for few points by Student's t.
    """

    change: float = 0.0
    deviation: float = 0.0
    middle: float = 0.0
    span: float = 1.0
    scatter: float = 0.0

    @property
    def excess(self) -> float:
        """Return by how much the change is larger than what the scatter explains [1]."""
        return max(0.0, abs(self.change) - _BEYOND_SCATTER * self.deviation)

    @property
    def told_change(self) -> float:
        """Return the change [1]; 0 where the scatter explains it."""
        return self.change if self.excess > 0.0 else 0.0

    @property
    def lack_of_fit(self) -> "LackOfFit":
        """Return the lack of fit of the straight line; none where the scatter explains the bend."""
        per_x = self.told_change / self.span
        return LackOfFit(at_zero=0.0 - per_x * self.middle, per_x=per_x)


class LackOfFit(NamedTuple):
    """The error of the slope of a straight line, over the slope [1], where it is bent: at x = 0, and per unit of x."""

    at_zero: float
    per_x: float


def bend_of(x: Floats, shown: Floats, last_digits: Floats) -> Bend:
    """Return the bend of what is shown over x, by a parabola; none of three points, of two x, or of a level line."""
    freedom = len(x) - 3
    if freedom < 1 or len(set(x.tolist())) < 3:  # noqa: PLR2004 - a parabola has three coefficients
        return Bend()
    span = float(np.ptp(x))
    part = (x - x.mean()) / span
    columns = np.column_stack([np.ones(len(x)), part, part**2])
    inverse = np.linalg.inv(columns.T @ columns)
    found = inverse @ columns.T @ shown
    skew = float(np.sum(part**3) / np.sum(part**2))
    slope = float(found[1] + skew * found[2])  # of the straight line, which is that of the parabola at the middle
    if slope == 0.0:
        return Bend()
    scatter = float(np.sum((shown - columns @ found) ** 2)) / freedom
    deviation = np.sqrt((scatter + (ROUNDED * float(last_digits.max())) ** 2) * inverse[2, 2])
    student = float(stdtrit(freedom, 0.975)) / 2.0
    return Bend(
        change=float(2.0 * found[2] / slope),
        deviation=float(2.0 * student * deviation / abs(slope)),
        middle=float(x.mean()) + 0.5 * skew * span,
        span=span,
        scatter=student * float(np.sqrt(scatter)),
    )
