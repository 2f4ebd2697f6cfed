"""Straight lines through measured values against a load: slope, zero, standard error, curvature and outlier.

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
"""Minimum number of points of a line whose scatter can be estimated."""
LEAST_SPAN = 1e-6
"""Minimum range of x [N or mm]; a table with a smaller range has one load or one travel."""
ROUNDED = 12.0**-0.5
"""Standard deviation of a rounded number, as a fraction of its resolution (JCGM 100:2008, F.2.2.1)."""
_LEVELS = 3  # number of different x that a parabola needs
_FALSE_ALARM = 1e-4  # probability that a table without an outlier appears to have one
_MIN_WIDTH = 0.1  # minimum range of x of the other points, as a fraction of the range of all points
_SIGNIFICANT = 3.0  # standard deviations; three of a thousand straight lines then appear to be curved
_MIN_RESIDUAL = 0.01  # fraction of the span of a line; a smaller residual moves a slope by less than its error


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
        return max(0.0, abs(self.change) - _SIGNIFICANT * self.deviation)

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
class Outlier:
    """The row of a table that deviates most from the line through the others: its index and their prediction for it.

    `residual` is its distance from this line, `likely` the largest distance that scatter explains.
    """

    index: int
    expected: float
    residual: float
    likely: float


@dataclass(frozen=True, kw_only=True)
class Line:
    """A straight line by least squares: its slope with one standard deviation, its value at x = 0, and its bend.

    `span` is the range of the values, `suspect` the row that deviates most from the line through the others.
    """

    slope: Estimate
    zero: float
    bend: Bend
    span: float
    suspect: Outlier | None

    def outlier(self, span: float | None = None) -> Outlier | None:
        """Return the outlier among the rows, which does not fit the line through the others; None if there is none.

        An outlier has a residual of at least a hundredth of `span`, by default the span of this line.
        """
        min_residual = _MIN_RESIDUAL * (self.span if span is None else span)
        if self.suspect is None or self.suspect.residual <= max(self.suspect.likely, min_residual):
            return None
        return self.suspect


def fit_line(x: Floats, values: Floats, resolutions: Floats, levels: Floats | None = None) -> Line:
    """Fit a straight line to `values` (n,) against x (n,) by least squares, with an error that covers curvature.

    There are at least `FEWEST` points, with at least two different x. The standard error of the slope contains the
    scatter of the points and the rounding of each value to its resolution. If the points lie on a curve, the scatter is
    taken about a parabola, and the error covers the slope at both ends of the line.

    Curvature is only looked for if there are three different `levels` [unit of x]; these are the nominal values of x,
    by default x itself. The error bar uses the finest of the `resolutions` (n,), the tests for curvature and for an
    outlier use the coarsest. A constant error of all values changes the zero and not the slope.
    """
    points = _PointsOfLine.centred(x, values, resolutions)
    bend = points.bend(len(set((x if levels is None else levels).tolist())))
    degrees_of_freedom = len(x) - 2
    # With few points, the standard deviation is widened by Student's t over the factor of a normal distribution.
    scatter = student(degrees_of_freedom) / COVERAGE * float(np.linalg.norm(points.residuals)) / degrees_of_freedom**0.5
    rounding = ROUNDED * float(resolutions.min())
    error = float(np.hypot(bend.scatter if bend.excess else scatter, rounding)) / (points.width * points.span)
    if bend.excess:
        error = float(np.hypot(error, 0.5 * bend.deviation * points.slope))  # the slope at an end of the line
    return Line(
        slope=Estimate(points.slope, error),
        zero=float(values.mean() - points.slope * x.mean()),
        bend=bend,
        span=float(np.ptp(values)),
        suspect=points.suspect(),
    )


def slope_error_of_resolution(digit: float, largest: float, at: Sequence[float]) -> float:
    """Return the relative standard deviation of a slope [1] that results from the resolution `digit` of the readings.

    The readings lie on a line through zero and have no other error. They are `at` these fractions of the `largest`
    reading, which has the unit of `digit`.
    """
    values = largest * np.array(at)
    return fit_line(values, values, np.full(len(values), digit)).slope.relative


class _PointsOfLine(NamedTuple):
    """Points of a line, with the QR decomposition of the columns 1, p and p^2 of a parabola, p = (x - mean) / span.

    Q and R are better conditioned than normal equations, and contain the straight line in their first two columns.
    `components` are the products of the columns of Q with the values less their mean. `residuals` are those of the
    straight line. `resolution` is the coarsest of the values.
    """

    x: Floats
    values: Floats
    resolution: float
    span: float
    Q: Floats
    R: Floats
    components: Floats
    residuals: Floats

    @classmethod
    def centred(cls, x: Floats, values: Floats, resolutions: Floats) -> "_PointsOfLine":
        """Return the points with the QR decomposition about their mean."""
        span = float(np.ptp(x))
        p = (x - x.mean()) / span
        Q, R = np.linalg.qr(np.column_stack([np.ones(len(x)), p, p**2]))
        deviations = values - values.mean()
        components = Q.T @ deviations
        residuals = deviations - Q[:, :2] @ components[:2]
        return cls(x, values, float(resolutions.max()), span, Q, R, components, residuals)

    @property
    def width(self) -> float:
        """Return the root of the sum of squares of x about its mean, over the span [1]."""
        return abs(float(self.R[1, 1]))

    @property
    def slope(self) -> float:
        """Return the slope of the straight line."""
        return 0.0 + float(self.components[1] / self.R[1, 1]) / self.span  # 0 and not -0 for a horizontal line

    def bend(self, levels: int) -> Bend:
        """Return the curvature of the parabola through the points.

        It is 0 for a horizontal line, for three points, or if `levels`, the number of different x, is below three.
        """
        degrees_of_freedom = len(self.x) - 3
        rise = self.slope * self.span
        if degrees_of_freedom < 1 or levels < _LEVELS or rise == 0.0:
            return Bend()
        variance = float(np.sum((self.residuals - self.components[2] * self.Q[:, 2]) ** 2)) / degrees_of_freedom
        rounding = ROUNDED * self.resolution
        deviation = float(np.sqrt(variance + rounding**2) / abs(self.R[2, 2]))  # of the coefficient of p^2
        widening = student(degrees_of_freedom) / COVERAGE
        return Bend(
            change=2.0 * float(self.components[2] / self.R[2, 2]) / rise,
            deviation=2.0 * widening * deviation / abs(rise),
            middle=float(self.x.mean() + 0.5 * self.R[1, 2] / self.R[1, 1] * self.span),
            span=self.span,
            scatter=widening * variance**0.5,
        )

    def suspect(self) -> Outlier | None:
        """Return the row whose removal reduces the scatter most; None if no line can be fitted without it.

        The line without each row follows from the leverages of the one fit: R. D. Cook, S. Weisberg, Residuals and
        Influence in Regression, 1982, 2.2.2.
        """
        rows = range(len(self.x))
        degrees_of_freedom = len(self.x) - 3  # of a line through the other rows
        is_removable = [float(np.ptp(np.delete(self.x, row))) >= _MIN_WIDTH * self.span for row in rows]
        if degrees_of_freedom < 1 or not any(is_removable):
            return None
        one_less_leverage = np.where(is_removable, 1.0 - np.sum(self.Q[:, :2] ** 2, axis=1), 1.0)
        deleted_residuals = self.residuals / one_less_leverage  # of each row, from the line through the others
        decreases = self.residuals * deleted_residuals  # of the sum of squares, if the row is removed
        index = int(np.argmax(np.where(is_removable, decreases, -1.0)))
        variance = max(0.0, float(self.residuals @ self.residuals - decreases[index])) / degrees_of_freedom
        # Any row may be the suspect, so the probability is divided by their number (Bonferroni).
        quantile = student(degrees_of_freedom, 1.0 - 0.5 * _FALSE_ALARM / len(self.x))
        widening = quantile / float(one_less_leverage[index]) ** 0.5
        return Outlier(
            index=index,
            expected=float(self.values[index] - deleted_residuals[index]),
            residual=abs(float(deleted_residuals[index])),
            likely=widening * float(np.sqrt(variance + (ROUNDED * self.resolution) ** 2)),
        )
