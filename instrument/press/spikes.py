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

**A lost touch.** A tip may be off the fruit in one sample between two with twice the least force of a touch. It was not
lifted then. So a press is firm, and noise does not end it, once its tips had twice that force.

Where channels were brought to one time, a bad conversion is part of two samples, so two in a row are judged as one. A
decision waits for two samples more, and the memory does not grow.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.design.reading import LEAST_OVER_NOISE

LARGEST_RESIDUAL = 5.0  # standard deviations
FIRM = 2.0  # times the least force of each tip: a touch that noise does not end
OTHERS = 4  # samples of a row that draw the line
BESIDE = 2  # samples of a row on either side of one that is decided
SLACK = 0.1  # of the slopes between the bounds: how far the chord of a press is off the slope at its end
_BEYOND = 1.5  # of both ends of the range of moduli
_FORCES = (0.02, 0.1, 0.4, 1.0)  # of full scale, at which slopes are taken

Payload = TypeVar("Payload")


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

    @property
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
    others = [point for index, point in enumerate(points) if not first <= index < first + several]
    count = len(others)
    u = sum(point.u for point in others) / count
    y = sum(point.y for point in others) / count
    uu = sum((point.u - u) ** 2 for point in others)
    uy = sum((point.u - u) * (point.y - y) for point in others)
    yy = sum(point.yy for point in others) / count
    yu = sum(point.yu for point in others) / count
    row = _Row(count, u, y, uu, uy, yy, yu, 0.0)
    slope = row.slope(line)
    return row._replace(squares=sum((point.y - y - slope * (point.u - u)) ** 2 for point in others))


@dataclass(eq=False)
class _Waiting(Generic[Payload]):
    """A sample of the row: what it carries, its forces, its point, and whether it still waits for a decision."""

    payload: Payload
    forces: Floats
    point: LinePoint
    waits: bool = True


class SpikeFilter(Generic[Payload]):
    """Passes on the samples of a signal in their order, except those that contradict their press.

    `several` is how many samples in a row a bad conversion is part of. What is left out is added to `left_out`.
    """

    def __init__(self, sensor: MeasuringUnit, several: int = 1) -> None:
        """Begin with the tips off."""
        self.left_out: list[Payload] = []
        self._line = press_line(sensor)
        self._least = sensor.least_forces  # a force above is a touch
        self._several = several
        self._off: list[tuple[Payload, Floats]] = []
        self._begin()

    def _begin(self) -> None:
        self._row: list[_Waiting[Payload]] = []
        self._judged = 0  # rows of this press
        self._squares = 0.0  # sum of what these rows leave without their suspects, over the variance of a sample
        self._count, self._u, self._y = 0, 0.0, 0.0  # samples of the press that are released, and their means

    def filtered(self, samples: Iterable[tuple[Payload, Floats]]) -> Iterator[tuple[Payload, Floats]]:
        """Yield the samples of a whole signal that are not left out: what each carries, and its forces [N], (tips,)."""
        for payload, forces in samples:
            yield from self._add(payload, forces)
        yield from self._end()

    def _add(self, payload: Payload, forces: Floats) -> list[tuple[Payload, Floats]]:
        """Take what a sample carries with its forces [N], (tips,); return the samples that are released by it."""
        if not (forces > self._least).all():
            if not self._row:
                return [(payload, forces)]
            self._off.append((payload, forces))
            return self._end() if self._is_lift(forces) else []
        released = []
        if self._off and self._were_lost(forces):
            self.left_out += [lost for lost, _ in self._off]
            self._off = []
        elif self._off:
            released = self._end()
        length = OTHERS + self._several
        self._row = self._row[1 - length :]
        self._row.append(_Waiting(payload, forces, self._line.point(forces.tolist())))
        if len(self._row) == length:
            self._judge(range(BESIDE + 1))
            released += self._released(len(self._row) - BESIDE - self._several + 1)
        return released

    def _is_lift(self, forces: Floats) -> bool:
        """Say whether samples with a tip off are more than a bad conversion makes, the last one of forces [N]."""
        is_loose = bool((forces <= FIRM * self._least).all())
        return len(self._off) > self._several or (len(self._off) > 1 and is_loose)

    def _were_lost(self, forces: Floats) -> bool:
        """Say whether samples with a tip off lie between firm touches, the second one of forces [N].

        Where a bad conversion is part of two samples, one of them may be a touch.
        """
        firm = FIRM * self._least
        before = any(bool((sample.forces > firm).all()) for sample in self._row[-self._several :])
        return before and (self._several > 1 or bool((forces > firm).all()))

    def _end(self) -> list[tuple[Payload, Floats]]:
        """Return the samples that are still to be released: the touch is over, or the signal is."""
        if len(self._row) == OTHERS + self._several:
            self._judge(range(len(self._row)))
        released = [*self._released(len(self._row)), *self._off]
        self._off = []
        self._begin()
        return released

    def _released(self, count: int) -> list[tuple[Payload, Floats]]:
        released = []
        for sample in self._row[:count]:
            if sample.waits:
                sample.waits = False
                self._count += 1
                self._u += (sample.point.u - self._u) / self._count
                self._y += (sample.point.y - self._y) / self._count
                released.append((sample.payload, sample.forces))
        return released

    def _judge(self, decided: range) -> None:
        """Leave the suspect of the row out where it is a spike, begins at a place that is decided, and waits."""
        points = [sample.point for sample in self._row]
        rows = [_row_without(points, first, self._several, self._line) for first in range(OTHERS + 1)]
        first = min(range(OTHERS + 1), key=lambda each: rows[each].squares)  # the suspect
        row = rows[first]
        # variance that this press has shown over that without a touch
        scale = max(1.0, self._squares / self._judged) if self._judged else 1.0
        slopes = self._slopes(row, scale)
        residual = max(self._residual(point, row, slopes) for point in points[first : first + self._several])
        slope = row.slope(self._line)
        self._squares += row.squares / self._variance(row, slope)
        self._judged += 1
        if residual > LARGEST_RESIDUAL * math.sqrt(scale) and first in decided:
            spike = [sample for sample in self._row[first : first + self._several] if sample.waits]
            self.left_out += [sample.payload for sample in spike]
            self._row = [sample for sample in self._row if not (sample.waits and sample in spike)]

    def _variance(self, sample: _Row | LinePoint, slope: float) -> float:
        """Return the variance of the residual of a sample about a line of a slope [mm^2]."""
        return sample.yy - slope * (2.0 * sample.yu - slope * self._line.of_whole)

    def _slopes(self, row: _Row, scale: float) -> tuple[float, float]:
        """Return the least and the largest slope that a row, the press before it and the moduli allow [mm/N]."""
        # Of three bounds each holds unless it contradicts those before: the moduli, the row itself, the press before.
        line = self._line
        noise = LARGEST_RESIDUAL * math.sqrt(
            scale * max(self._variance(row, line.least), self._variance(row, line.most))
        )
        least, most = line.least, line.most
        if row.uu > 0.0:
            slope, error = row.uy / row.uu, noise / math.sqrt(row.uu)
            least, most = max(least, slope - error), min(most, slope + error)
            if least > most:  # the row surely shows a slope beyond the moduli
                least, most = slope - error, slope + error
        if self._count and row.u != self._u:
            chord = (row.y - self._y) / (row.u - self._u)
            error = noise * math.sqrt(1.0 / row.samples + 1.0 / self._count) / abs(row.u - self._u)
            error += SLACK * (line.most - line.least)
            if max(least, chord - error) <= min(most, chord + error):
                return max(least, chord - error), min(most, chord + error)
        return least, most

    def _residual(self, point: LinePoint, row: _Row, slopes: tuple[float, float]) -> float:
        """Return by how many standard deviations a point is off every line of a row; 0 where it is on one."""
        residuals = []
        for slope in slopes:
            variance = self._variance(point, slope) + self._variance(row, slope) / row.samples
            residuals.append((point.y - row.y - slope * (point.u - row.u)) / math.sqrt(variance))
        return 0.0 if residuals[0] * residuals[1] < 0.0 else min(map(abs, residuals))
