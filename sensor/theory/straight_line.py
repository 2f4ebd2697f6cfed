"""Straight lines through measured values over a load: slope, zero, error, the bend, and the row that does not fit.

**Lack of fit.** A channel that bends shows c = p0 + p1 F + p2 F^2 under a force F, and a deflection does likewise. The
straight line through its weights has the slope s = cov(F, c) / var(F) = p1 + 2 p2 m, with the middle of the weights m =
cov(F, F^2) / (2 var F). A press is read by co-moments with its instrument u, so its slope is p1 + 2 p2 m', with the
middle of its samples m' = cov(u, F^2) / (2 cov(u, F)). A reading at one moment has the slope of the chord from zero,
where m' = F / 2. So the relative error of a press is

    e = k (m' - m),    k = 2 p2 / s,

which is a straight line over m': its value at m' = 0, -k m, and its slope k determine it for any press. It is an error
of known sign, which moves E by e times the slope of ln E over a gain or a compliance. It is not corrected, so its size
is added to the half width (JCGM 100:2008, F.2.4.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate
from sensor.theory.student import student

FEWEST = 3
"""Fewest points of a line whose scatter can be estimated."""
LEAST_SPAN = 1e-6
"""Least range of x [N or mm]; a table with a smaller range has one load or one travel."""
ROUNDED = 12.0**-0.5
"""Standard deviation of a rounded number, over its last digit (JCGM 100:2008, F.2.2.1)."""
_LEVELS = 3  # different values of x that a parabola needs
_UNLIKELY = 1e-4  # probability that a table without a fault has a row that is suspected
_LEAST_WIDTH = 0.1  # least range of x of the other rows, over the range of all rows
_BEYOND_SCATTER = 3.0  # standard deviations; a bend is then found in three of a thousand straight lines
_LEAST_RESIDUAL = 0.01  # residual over the span of a line; a smaller one moves a slope by less than its error


class LackOfFit(NamedTuple):
    """The error of the slope of a straight line through a bent one, over the slope [1]: at x = 0, and per unit of x."""

    at_zero: float
    per_x: float


@dataclass(frozen=True, kw_only=True)
class Bend:
    """The change of a slope from the first point of a line to the last, relative to the slope [1], and its deviation.

    `middle` is the x at which the parabola has the slope of the straight line, `span` the range of x. `scatter` is the
    standard deviation of the values about the parabola, widened for few points by Student's t.
    """

    change: float = 0.0
    deviation: float = 0.0
    middle: float = 0.0
    span: float = 1.0
    scatter: float = 0.0

    @property
    def excess(self) -> float:
        """Return the part of the change [1] that scatter does not explain."""
        return max(0.0, abs(self.change) - _BEYOND_SCATTER * self.deviation)

    @property
    def significant_change(self) -> float:
        """Return the change [1]; 0 if scatter explains it."""
        return self.change if self.excess > 0.0 else 0.0

    @property
    def lack_of_fit(self) -> LackOfFit:
        """Return the lack of fit of the straight line, which is zero if scatter explains the bend."""
        per_x = self.significant_change / self.span
        return LackOfFit(at_zero=0.0 - per_x * self.middle, per_x=per_x)


@dataclass(frozen=True, kw_only=True)
class OddRow:
    """The row that the other rows contradict most, by its index, and the value that their line predicts for it.

    `residual` is its distance from this line, `likely` the largest distance that scatter explains.
    """

    index: int
    expected: float
    residual: float
    likely: float


@dataclass(frozen=True, kw_only=True)
class Line:
    """A straight line by least squares: its slope with one standard deviation, its value at x = 0, and its bend.

    `span` is the range of the values, `suspect` the row that the other rows contradict most.
    """

    slope: Estimate
    zero: float
    bend: Bend
    span: float
    suspect: OddRow | None

    def odd_row(self, span: float | None = None) -> OddRow | None:
        """Return the row that does not fit the line of the others, or None.

        Such a row has a residual of at least a hundredth of `span`, by default the span of this line.
        """
        least = _LEAST_RESIDUAL * (self.span if span is None else span)
        if self.suspect is None or self.suspect.residual <= max(self.suspect.likely, least):
            return None
        return self.suspect


def fitted(x: Floats, shown: Floats, last_digits: Floats, levels: Floats | None = None) -> Line:
    """Return the least-squares line of the values `shown` over x; an error of the zero does not change its slope.

    There are at least `FEWEST` points, with at least two different x. A bend needs three different `levels`, by default
    x. If the line is bent, the scatter is taken about a parabola. Each number also has the standard deviation of its
    rounding to a last digit. The error bar uses the finest last digit; the tests for an odd row and for a bend use the
    coarsest.
    """
    points = _PointsOfLine.centred(x, shown, last_digits)
    bend = points.bend(len(set((x if levels is None else levels).tolist())))
    freedom = len(x) - 2
    scatter = student(freedom) / COVERAGE * float(np.linalg.norm(points.left)) / freedom**0.5
    by_rounding = ROUNDED * float(last_digits.min())
    error = float(np.hypot(bend.scatter if bend.excess else scatter, by_rounding)) / (points.width * points.span)
    if bend.excess:
        error = float(np.hypot(error, 0.5 * bend.deviation * points.slope))  # the slope at an end of the line
    return Line(
        slope=Estimate(points.slope, error),
        zero=float(shown.mean() - points.slope * x.mean()),
        bend=bend,
        span=float(np.ptp(shown)),
        suspect=points.suspect(),
    )


def left_by_digits(digit: float, largest: float, at: Sequence[float]) -> float:
    """Return the relative standard deviation of a slope [1] that follows from the last `digit` of the readings.

    The readings lie on a line through zero, without another error, `at` these fractions of the `largest` [same unit].
    """
    shown = largest * np.array(at)
    return fitted(shown, shown, np.full(len(shown), digit)).slope.relative


class _PointsOfLine(NamedTuple):
    """Points of a line, with the QR decomposition of the columns 1, p and p^2 of a parabola, p = (x - mean) / span.

    `along` are the components of `shown` less its mean along the columns of Q. `left` are the residuals about the
    straight line.
    """

    x: Floats
    shown: Floats
    last_digit: float
    span: float
    Q: Floats
    R: Floats
    along: Floats
    left: Floats

    @classmethod
    def centred(cls, x: Floats, shown: Floats, last_digits: Floats) -> "_PointsOfLine":
        """Return the points with their decomposition."""
        span = float(np.ptp(x))
        part = (x - x.mean()) / span
        Q, R = np.linalg.qr(np.column_stack([np.ones(len(x)), part, part**2]))
        above = shown - shown.mean()
        along = Q.T @ above
        left = above - Q[:, :2] @ along[:2]
        return cls(x, shown, float(last_digits.max()), span, Q, R, along, left)

    @property
    def width(self) -> float:
        """Return the root of the sum of squares of x about its mean, over the span [1]."""
        return abs(float(self.R[1, 1]))

    @property
    def slope(self) -> float:
        """Return the slope of the straight line."""
        return 0.0 + float(self.along[1] / self.R[1, 1]) / self.span  # a level line has 0, not -0

    def bend(self, levels: int) -> Bend:
        """Return the bend of the parabola; it is 0 for a level line, three points, or fewer than three levels of x."""
        freedom = len(self.x) - 3
        over_span = self.slope * self.span
        if freedom < 1 or levels < _LEVELS or over_span == 0.0:
            return Bend()
        squares = float(np.sum((self.left - self.along[2] * self.Q[:, 2]) ** 2)) / freedom
        rounding = ROUNDED * self.last_digit
        deviation = float(np.sqrt(squares + rounding**2) / abs(self.R[2, 2]))
        wider = student(freedom) / COVERAGE
        return Bend(
            change=2.0 * float(self.along[2] / self.R[2, 2]) / over_span,
            deviation=2.0 * wider * deviation / abs(over_span),
            middle=float(self.x.mean() + 0.5 * self.R[1, 2] / self.R[1, 1] * self.span),
            span=self.span,
            scatter=wider * squares**0.5,
        )

    def suspect(self) -> OddRow | None:
        """Return the row whose removal reduces the scatter most; None if too few other rows determine a line.

        It uses leverages: R. D. Cook, S. Weisberg, Residuals and Influence in Regression, 1982, 2.2.2.
        """
        freedom = len(self.x) - 3  # degrees of freedom of a line through the others
        drawn = [float(np.ptp(np.delete(self.x, row))) >= _LEAST_WIDTH * self.span for row in range(len(self.x))]
        if freedom < 1 or not any(drawn):
            return None
        one_less_leverage = np.where(drawn, 1.0 - np.sum(self.Q[:, :2] ** 2, axis=1), 1.0)
        residuals = self.left / one_less_leverage  # about the line of the others
        removed = self.left * residuals  # decrease of the sum of squares by leaving out each row
        index = int(np.argmax(np.where(drawn, removed, -1.0)))
        squares = max(0.0, float(self.left @ self.left - removed[index])) / freedom
        # Any row may be the suspect, so the probability is divided by their number (Bonferroni).
        wider = student(freedom, 1.0 - 0.5 * _UNLIKELY / len(self.x)) / float(one_less_leverage[index]) ** 0.5
        return OddRow(
            index=index,
            expected=float(self.shown[index] - residuals[index]),
            residual=abs(float(residuals[index])),
            likely=wider * float(np.sqrt(squares + (ROUNDED * self.last_digit) ** 2)),
        )
