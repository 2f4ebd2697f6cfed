"""Straight lines fitted to measured values as a function of a load: slope, zero, standard error, curvature and outlier.

**Lack of fit.** A channel or a deflection that is not linear in the force F follows c = p0 + p1 F + p2 F^2. The
straight line fitted to the calibration weights has the slope s = cov(F, c) / var(F) = p1 + 2 p2 m. Here m = cov(F, F^2)
/ (2 var F) is the force at which the parabola has this slope. A press is read by co-moments with its instrument u, so
its slope is p1 + 2 p2 m' with m' = cov(u, F^2) / (2 cov(u, F)). A reading at one moment uses the slope of the chord
from zero, for which m' = F / 2. So the relative error of a press is

    e = k (m' - m),    k = 2 p2 / s.

Two numbers determine it for any press: its value -k m at m' = 0, and its slope k. The error has a known sign, and it
changes ln E by e times the slope of ln E with respect to a gain or a compliance. Because it is not corrected, its
magnitude is added to the half width (JCGM 100:2008, F.2.4.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate
from sensor.theory.student import student_quantile

FEWEST = 3
"""Minimum number of points of a line; with fewer, their scatter cannot be estimated."""
LEAST_SPAN = 1e-6
"""Minimum range of x [N or mm]; if the range is smaller, all rows of a table have the same load or travel."""
ROUNDED = 12.0**-0.5
"""Standard deviation of a rounding error, as a fraction of its resolution (JCGM 100:2008, F.2.2.1)."""
_LEVELS = 3  # number of different values of x that a parabola needs
_FALSE_ALARM = 1e-4  # probability that a table without an outlier appears to have one
_MIN_WIDTH = 0.1  # minimum range of x after a point is removed, as a fraction of the range of all points
_SIGNIFICANT = 3.0  # number of standard deviations; 3 in 1000 straight lines then appear to be curved
_MIN_RESIDUAL = 0.01  # fraction of the span of the values; a smaller residual changes the slope by less than its error


class LackOfFit(NamedTuple):
    """The relative error [1] of the slope of a straight line fitted to a curve: at x = 0, and per unit of x."""

    at_zero: float
    per_x: float


@dataclass(frozen=True, kw_only=True)
class Bend:
    """The curvature of a line of measured points, from a parabola through them.

    `change` [1] is the change of the slope from the first point to the last, relative to the slope. `change_deviation`
    [1] is its standard deviation. `middle` is the x at which the parabola has the slope of the straight line, and
    `span` is the range of x. `scatter` is the standard deviation of the values about the parabola, increased by
    Student's t if there are few points.
    """

    change: float = 0.0
    change_deviation: float = 0.0
    middle: float = 0.0
    span: float = 1.0
    scatter: float = 0.0

    @property
    def unexplained_change(self) -> float:
        """Return the part of the change [1] that scatter does not explain."""
        return max(0.0, abs(self.change) - _SIGNIFICANT * self.change_deviation)

    @property
    def significant_change(self) -> float:
        """Return the change [1], or 0 if scatter explains it."""
        return self.change if self.unexplained_change > 0.0 else 0.0

    @property
    def lack_of_fit(self) -> LackOfFit:
        """Return the lack of fit of the straight line. The lack of fit is zero if scatter explains the curvature."""
        per_x = self.significant_change / self.span
        return LackOfFit(at_zero=0.0 - per_x * self.middle, per_x=per_x)  # 0 and not -0 for a straight line


@dataclass(frozen=True, kw_only=True)
class Outlier:
    """The row of a table that deviates most from the line through the other rows.

    `index` is its position and `expected` the value that the other rows predict for it. `residual` is its distance from
    their line, and `likely` is the largest distance that scatter explains.
    """

    index: int
    expected: float
    residual: float
    likely: float


@dataclass(frozen=True, kw_only=True)
class Line:
    """A straight line fitted by least squares.

    `slope` has one standard deviation as its error, and `zero` is the value at x = 0. `span` is the range of the
    values. `suspect` is the row that deviates most from the line through the other rows.
    """

    slope: Estimate
    zero: float
    bend: Bend
    span: float
    suspect: Outlier | None

    def outlier(self, span: float | None = None) -> Outlier | None:
        """Return the row that does not fit the line through the other rows, or None if all rows fit.

        The residual of an outlier is at least 1 % of `span`, which is by default the span of this line.
        """
        min_residual = _MIN_RESIDUAL * (self.span if span is None else span)
        if self.suspect is None or self.suspect.residual <= max(self.suspect.likely, min_residual):
            return None
        return self.suspect


def fit_line(x: Floats, values: Floats, resolutions: Floats, levels: Floats | None = None) -> Line:
    """Fit a straight line to `values` (n,) against `x` (n,) by least squares, and test it for curvature and an outlier.

    There must be at least `FEWEST` points, with at least two different x. `resolutions` (n,) are the resolutions to
    which the values are rounded. The standard error of the slope includes the scatter of the points and this rounding.
    If the points lie on a curve, the scatter is measured about a parabola. The standard error then covers the slope at
    both ends of the line.

    A parabola is fitted only if there are at least three different `levels` (n,) [unit of x]. These are the nominal
    values of x, by default x itself. The standard error uses the finest resolution, because a coarser rounding appears
    in the scatter. The tests for curvature and for an outlier use the coarsest, so that rounding causes no false alarm.
    A constant error of all values changes the zero, but not the slope.
    """
    points = _PointsOfLine.centred(x, values, resolutions)
    nominal_x = x if levels is None else levels
    distinct_x = set(nominal_x.tolist())
    bend = points.bend(level_count=len(distinct_x))
    return Line(
        slope=Estimate(points.slope, _slope_error(points, bend, resolutions)),
        zero=float(values.mean() - points.slope * x.mean()),
        bend=bend,
        span=float(np.ptp(values)),
        suspect=points.suspect(),
    )


def _slope_error(points: "_PointsOfLine", bend: Bend, resolutions: Floats) -> float:
    """Return the standard deviation of the slope of a line, caused by scatter, rounding and curvature.

    If the line has a significant bend, the scatter is measured about a parabola instead of the line.
    """
    degrees_of_freedom = len(points.x) - 2
    # With few points, Student's t replaces the coverage factor of the normal distribution.
    coverage_ratio = student_quantile(degrees_of_freedom) / COVERAGE
    scatter_about_line = coverage_ratio * float(np.linalg.norm(points.residuals)) / degrees_of_freedom**0.5
    scatter = bend.scatter if bend.unexplained_change else scatter_about_line
    rounding = ROUNDED * float(resolutions.min())
    error = float(np.hypot(scatter, rounding)) / (points.width * points.span)
    if bend.unexplained_change:
        # At either end of the line, the slope is uncertain by half of the standard deviation of its change.
        error = float(np.hypot(error, 0.5 * bend.change_deviation * points.slope))
    return error


def slope_error_of_resolution(digit: float, largest: float, fractions: Sequence[float]) -> float:
    """Return the relative standard deviation of a slope [1] that is caused by the resolution `digit` of the readings.

    The readings lie on a line through zero and have no other error. The readings are the `fractions` [1] of the
    `largest` reading, which has the unit of `digit`.
    """
    values = largest * np.array(fractions)
    return fit_line(values, values, np.full(len(values), digit)).slope.relative


class _PointsOfLine(NamedTuple):
    """Points of a line, and the QR decomposition of the columns 1, p and p^2 of a parabola, with p = (x - mean) / span.

    Q and R are better conditioned than the normal equations. Their first two columns describe the straight line.
    `components` are the products of the columns of Q with the values minus their mean. `residuals` are the deviations
    from the straight line. `resolution` is the coarsest of the resolutions.
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
        """Centre the points about their mean and compute their QR decomposition."""
        span = float(np.ptp(x))
        p = (x - x.mean()) / span
        Q, R = np.linalg.qr(np.column_stack([np.ones(len(x)), p, p**2]))
        deviations = values - values.mean()
        components = Q.T @ deviations
        residuals = deviations - Q[:, :2] @ components[:2]
        return cls(x, values, float(resolutions.max()), span, Q, R, components, residuals)

    @property
    def width(self) -> float:
        """Return the root sum of squares of x about its mean, divided by the span [1]."""
        return abs(float(self.R[1, 1]))

    @property
    def slope(self) -> float:
        """Return the slope of the straight line."""
        return 0.0 + float(self.components[1] / self.R[1, 1]) / self.span  # 0 and not -0 for a horizontal line

    def bend(self, level_count: int) -> Bend:
        """Return the curvature of the parabola through the points.

        The curvature is 0 for a horizontal line, for three points, or if `level_count`, the number of different x, is
        less than three.
        """
        degrees_of_freedom = len(self.x) - 3
        rise = self.slope * self.span
        if degrees_of_freedom < 1 or level_count < _LEVELS or rise == 0.0:
            return Bend()
        # The third column of Q is the part of p^2 that no straight line describes.
        variance = float(np.sum((self.residuals - self.components[2] * self.Q[:, 2]) ** 2)) / degrees_of_freedom
        rounding = ROUNDED * self.resolution
        # standard deviation of the coefficient of p^2
        deviation = float(np.sqrt(variance + rounding**2) / abs(self.R[2, 2]))
        coverage_ratio = student_quantile(degrees_of_freedom) / COVERAGE
        return Bend(
            # Over the span, p grows by 1, so the slope 2 c p changes by 2 c, with c the coefficient of p^2.
            change=2.0 * float(self.components[2] / self.R[2, 2]) / rise,
            change_deviation=2.0 * coverage_ratio * deviation / abs(rise),
            # In p, the parabola has the slope of the line at cov(p, p^2) / (2 var p).
            middle=float(self.x.mean() + 0.5 * self.R[1, 2] / self.R[1, 1] * self.span),
            span=self.span,
            scatter=coverage_ratio * variance**0.5,
        )

    def removable_rows(self) -> list[bool]:
        """Return, for each row, whether the other rows span at least a tenth of the range of x."""
        remaining_spans = [float(np.ptp(np.delete(self.x, row))) for row in range(len(self.x))]
        return [remaining_span >= _MIN_WIDTH * self.span for remaining_span in remaining_spans]

    def suspect(self) -> Outlier | None:
        """Return the row whose removal reduces the scatter most, or None if no row can be removed.

        At least three rows must remain, and they must span at least a tenth of the range of x. The lines through the
        other rows are not fitted one by one, because they follow from the fit to all rows and its leverages: R. D.
        Cook, S. Weisberg, Residuals and Influence in Regression, 1982, 2.2.2.
        """
        degrees_of_freedom = len(self.x) - 3  # degrees of freedom of a line through the other rows
        is_removable = self.removable_rows()
        if degrees_of_freedom < 1 or not any(is_removable):
            return None
        # For a row that cannot be removed, 1 minus its leverage may be 0, and is replaced by 1.
        one_less_leverage = np.where(is_removable, 1.0 - np.sum(self.Q[:, :2] ** 2, axis=1), 1.0)
        deleted_residuals = self.residuals / one_less_leverage  # distance of each row from the line through the others
        decreases = self.residuals * deleted_residuals  # decrease of the sum of squares if a row is removed
        # A decrease is never negative, so a row with -1 is not chosen.
        index = int(np.argmax(np.where(is_removable, decreases, -1.0)))
        variance = max(0.0, float(self.residuals @ self.residuals - decreases[index])) / degrees_of_freedom
        # Any row may be the suspect, so the probability is divided by their number (Bonferroni).
        quantile = student_quantile(degrees_of_freedom, 1.0 - 0.5 * _FALSE_ALARM / len(self.x))
        multiple = quantile / float(one_less_leverage[index]) ** 0.5
        return Outlier(
            index=index,
            expected=float(self.values[index] - deleted_residuals[index]),
            residual=abs(float(deleted_residuals[index])),
            likely=multiple * float(np.sqrt(variance + (ROUNDED * self.resolution) ** 2)),
        )
