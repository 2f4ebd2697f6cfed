"""Samples that contradict their press, found and left out as the samples come.

**The residual.** The contrast is y = w.(C F) + h z^2 w.F^(2/3) + z^3 w.(S F), at the modulus E = 1 / z^3 of the fruit.
It is the same in every sample of one press, whatever the pose and however fast the press is (`contrast_rise.py`). At
another modulus some samples in a row lie on a line of y over the whole force u. A spike in one channel moves both in a
direction that is no modulus. The slope of the line is bounded, by three things that all hold.

- The other samples of the row have a slope, known by their noise.
- The mean of the press before the row is a point of the line, but for a tenth of what the moduli allow.
- The fruit is in the range of the design, or up to a half beyond. A row that surely shows another slope is believed.

**The test.** Each sample of the row is left out in turn. The one whose absence leaves the least squares is suspected.
It is a spike where it lies off every line that the others allow, by `LARGEST_RESIDUAL` of its standard deviations. They
follow from the errors of the forces without a touch, or from the residuals of the press itself, if these are larger.
Normal noise leaves a sample out once in 1.7 million.

Where channels were brought to one time, a bad conversion is part of two samples, so two in a row are judged as one. A
decision waits for two samples more, and the memory does not grow.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.signals import Sample
from sensor.arrays import Floats
from sensor.design.reading import LEAST_OVER_NOISE

LARGEST_RESIDUAL = 5.0  # standard deviations
OTHERS = 4  # samples of a row that draw the line
BESIDE = 2  # samples of a row on either side of one that is decided
SLACK = 0.1  # of the slopes between the bounds: how far the chord of a press is off the slope at its end
_BEYOND = 1.5  # of both ends of the range of moduli
_FORCES = (0.02, 0.1, 0.4, 1.0)  # of full scale, at which slopes are taken


@dataclass(frozen=True, kw_only=True)
class PressLine:
    """The contrast of forces at the middle of the range of moduli, and the slopes that it may have over their sum.

    `linear` [mm/N] and `domes` [mm/N^(2/3)] are what forces, and their power of two thirds, add to the contrast.
    `errors` [N] are the standard deviations of the forces, each (tips,). `least` and `most` [mm/N] bound the slope.
    """

    linear: tuple[float, ...]
    domes: tuple[float, ...]
    errors: tuple[float, ...]
    least: float
    most: float

    def point(self, forces: Sequence[float]) -> "LinePoint":
        """Return the point of forces above 0 [N], (tips,)."""
        whole = contrast = of_contrast = of_both = 0.0
        for force, linear, dome, error in zip(forces, self.linear, self.domes, self.errors, strict=True):
            root = math.pow(force, 1.0 / 3.0)
            slope = linear + dome / 1.5 / root
            whole += force
            contrast += linear * force + dome * root * root
            of_contrast += (slope * error) ** 2
            of_both += slope * error**2
        return LinePoint(whole, contrast, of_contrast, of_both)

    @cached_property
    def of_whole(self) -> float:
        """Return the variance of the whole force [N^2]."""
        return math.fsum(error**2 for error in self.errors)


class LinePoint(NamedTuple):
    """The whole force u [N] and the contrast y [mm] of a sample; the variance of y [mm^2], its covariance with u."""

    u: float
    y: float
    yy: float
    yu: float


def press_line(sensor: MeasuringUnit) -> PressLine:
    """Return the line of the presses of a unit, with the slopes of level presses over the range of its design."""
    weights, C, S = sensor.law.arrays
    least, largest = sensor.range_MPa
    z = (least * largest) ** (-1.0 / 6.0)
    linear = weights @ (C + z**3 * S)
    domes = sensor.law.hertz * z * z * weights
    slopes = []
    for E in (least / _BEYOND, largest * _BEYOND):
        slopes += _level_slopes(sensor, E, linear, domes)
    return PressLine(
        linear=tuple(linear.tolist()),
        domes=tuple(domes.tolist()),
        errors=tuple((sensor.least_forces / LEAST_OVER_NOISE).tolist()),
        least=min(slopes),
        most=max(slopes),
    )


def _level_slopes(sensor: MeasuringUnit, E: float, linear: Floats, domes: Floats) -> list[float]:
    """Return slopes of the contrast over the whole force [mm/N] in a level press on fruit of E [MPa].

    Each dF of a travel dx is [C + S / E + 2/3 h E^(-2/3) F^(-1/3)] dF = dx. Flesh that relaxes may have any slope
    between those of the tips.
    """
    law = sensor.law
    _, C, S = law.arrays
    slopes = []
    for forces in np.outer(_FORCES, sensor.report.read_out.full_scale_N):
        inverse_roots = forces ** (-1.0 / 3.0) / 1.5
        of_tips = linear + domes * inverse_roots
        if sensor.design.fruit.relaxation is not None:
            slopes += [float(of_tips.min()), float(of_tips.max())]
            continue
        sinks = law.hertz * E ** (-2.0 / 3.0) * inverse_roots
        rise = np.linalg.solve(C + S / E + np.diag(sinks), np.ones(len(forces)))
        slopes.append(float(of_tips @ rise / rise.sum()))
    return slopes


class _Row(NamedTuple):
    """Some samples of a row through which the line y over u is drawn, u the whole force, y the contrast."""

    samples: int
    u: float  # mean [N]
    y: float  # mean [mm]
    uu: float  # sum of squares about the mean [N^2]
    uy: float  # sum of products about the means [N mm]
    yy: float  # mean variance of the errors of y [mm^2]
    yu: float  # mean covariance of the errors of y and u [N mm]
    squares: float  # sum of squares of what the line leaves of y [mm^2]

    def slope(self, line: PressLine) -> float:
        """Return the slope of least squares within the bounds of a line [mm/N]."""
        return min(max(self.uy / self.uu, line.least), line.most) if self.uu > 0.0 else 0.0


def _row_without(points: Sequence[LinePoint], first: int, several: int, line: PressLine) -> _Row:
    """Return a row without `several` points from the first on; the row has more points than that."""
    others = [*points[:first], *points[first + several :]]
    count = len(others)
    u, y, yy, yu = (sum(values) / count for values in zip(*others, strict=True))
    apart = [(point.u - u, point.y - y) for point in others]
    uu = sum([du * du for du, _ in apart])
    uy = sum([du * dy for du, dy in apart])
    row = _Row(count, u, y, uu, uy, yy, yu, 0.0)
    slope = row.slope(line)
    return row._replace(squares=sum([(dy - slope * du) ** 2 for du, dy in apart]))


class BeforeRow(NamedTuple):
    """What is known of a press before a row of it: how many samples, and their means of u [N] and y [mm]."""

    samples: int = 0
    u: float = 0.0
    y: float = 0.0

    def with_point(self, point: LinePoint) -> "BeforeRow":
        """Return the same with one sample more."""
        count = self.samples + 1
        return BeforeRow(count, self.u + (point.u - self.u) / count, self.y + (point.y - self.y) / count)


class Suspect(NamedTuple):
    """The sample of a row that contradicts the others most.

    It is at place `first`, `residual` of its standard deviations away from every line that the others allow. Those
    leave `squares` over the variance of a sample [1].
    """

    first: int
    residual: float
    squares: float


def suspect_of(points: Sequence[LinePoint], several: int, line: PressLine, before: BeforeRow, scale: float) -> Suspect:
    """Return the suspect of a row of a press, `several` samples in a row, whose variance is `scale` times the usual."""
    rows = [_row_without(points, first, several, line) for first in range(OTHERS + 1)]
    first = min(range(OTHERS + 1), key=lambda each: rows[each].squares)
    row = rows[first]
    slopes = _slopes(row, line, before, scale)
    residual = max(_residual(point, row, slopes, line) for point in points[first : first + several])
    return Suspect(first, residual, row.squares / _variance(row, row.slope(line), line))


def _variance(sample: _Row | LinePoint, slope: float, line: PressLine) -> float:
    """Return the variance of the residual of a sample about a line of a slope [mm^2]."""
    return sample.yy - slope * (2.0 * sample.yu - slope * line.of_whole)


def _slopes(row: _Row, line: PressLine, before: BeforeRow, scale: float) -> tuple[float, float]:
    """Return the least and the largest slope that a row, the press before it and the moduli allow [mm/N]."""
    # Of three bounds each holds unless it contradicts those before: the moduli, the row itself, the press before.
    noise = LARGEST_RESIDUAL * math.sqrt(scale * max(_variance(row, slope, line) for slope in (line.least, line.most)))
    least, most = line.least, line.most
    if row.uu > 0.0:
        slope, error = row.uy / row.uu, noise / math.sqrt(row.uu)
        least, most = max(least, slope - error), min(most, slope + error)
        if least > most:  # the row surely shows a slope beyond the moduli
            least, most = slope - error, slope + error
    if before.samples and row.u != before.u:
        chord = (row.y - before.y) / (row.u - before.u)
        error = noise * math.sqrt(1.0 / row.samples + 1.0 / before.samples) / abs(row.u - before.u)
        error += SLACK * (line.most - line.least)
        if max(least, chord - error) <= min(most, chord + error):
            return max(least, chord - error), min(most, chord + error)
    return least, most


def _residual(point: LinePoint, row: _Row, slopes: tuple[float, float], line: PressLine) -> float:
    """Return how many standard deviations a point is away from every line of a row; 0 if it is on one."""
    residuals = []
    for slope in slopes:
        variance = _variance(point, slope, line) + _variance(row, slope, line) / row.samples
        residuals.append((point.y - row.y - slope * (point.u - row.u)) / math.sqrt(variance))
    return 0.0 if residuals[0] * residuals[1] < 0.0 else min(map(abs, residuals))


class SpikeFilter:
    """The samples of one touch, which are passed on in their order, except those that contradict their press.

    `several` is the number of samples in a row that a bad conversion is part of. A decision waits for two samples more.
    The lines of those that are left out are added to `lines_left_out`.
    """

    def __init__(self, line: PressLine, several: int) -> None:
        """Begin with the touch."""
        self.lines_left_out: list[int] = []
        self._row: list[tuple[Sample, LinePoint]] = []
        self._line = line
        self._several = several
        self._decided = 0  # of the row, from its beginning on: samples that have been passed on
        self._before = BeforeRow()
        self._judged = 0  # rows of this touch
        self._squares = 0.0  # sum over these rows of what they leave without their suspects

    @property
    def last(self) -> list[Sample]:
        """Return the last samples, as many as a bad conversion is part of."""
        return [sample for sample, _ in self._row[-self._several :]]

    def add(self, sample: Sample) -> list[Sample]:
        """Take a sample with all tips on the fruit; return those that are decided by it."""
        self._row.append((sample, self._line.point(sample.forces)))
        length = OTHERS + self._several
        if len(self._row) < length:
            return []
        if len(self._row) > length:
            del self._row[0]
            self._decided -= 1
        self._judge(BESIDE + 1)
        return self._passed_on(len(self._row) - BESIDE - self._several + 1)

    def end(self) -> list[Sample]:
        """Return the samples that still wait: the touch is over."""
        if len(self._row) == OTHERS + self._several:
            self._judge(len(self._row))
        return self._passed_on(len(self._row))

    def _judge(self, places: int) -> None:
        """Leave the suspect of the row out if it is a spike, begins at one of the first places, and waits."""
        # variance that this touch has shown over that without a touch
        scale = max(1.0, self._squares / self._judged) if self._judged else 1.0
        suspect = suspect_of([point for _, point in self._row], self._several, self._line, self._before, scale)
        self._squares += suspect.squares
        self._judged += 1
        if suspect.residual > LARGEST_RESIDUAL * math.sqrt(scale) and suspect.first < places:
            spike = slice(max(suspect.first, self._decided), suspect.first + self._several)
            self.lines_left_out += [sample.line for sample, _ in self._row[spike]]
            del self._row[spike]

    def _passed_on(self, count: int) -> list[Sample]:
        decided = self._row[self._decided : count]
        for _, point in decided:
            self._before = self._before.with_point(point)
        self._decided = max(self._decided, count)
        return [sample for sample, _ in decided]
