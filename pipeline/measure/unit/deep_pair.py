"""A level pair of flat tips deep in soft flesh: its forces on a fruit, and the modulus that its forces tell.

A tip that carries F has entered by d, where g(d) d = F s / E with s its own compliance times E and g the factor of
large strain; it pushes the skin under the other tip down by s12 F / E. Both travel alike but for a lead of one of them:

    (C F)_low + d_low + s12 F_high / E = (C F)_high + d_high + s12 F_low / E + lead .

Over the samples of a press the modulus is the one at which the lead scatters least beside what noise explains: W. E.
Deming, Statistical Adjustment of Data, 1943.

Roots and least places are searched for here: SciPy's searches take longer to import than a reading takes in all.
"""

import bisect
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from cad.theory.contrast_law import Matrix, ReadingError
from cad.theory.pair_line import FEWEST, OF_ANOTHER_SENSOR, PairLine

Sample = tuple[int, float, float]
"""How many samples it stands for, and the mean forces of the low and the high tip [N]."""

BEYOND = 1.25  # of the deepest depth, up to which the factor counts as at it: a spring may be that far off its design
_WIDEST = math.log(1e4)  # of the modulus above the least one that the curve reaches
_SCAN, _SHRINKS, _HALVINGS = 24, 60, 60
_NUDGE = 1e-4  # of a factor: a whole bar at one depth alone would leave a kink
_AT_THE_END = 1e-6  # of a logarithm
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_STEPS, _SETTLED = 50, 1e-13
TOO_DEEP = "the tips stand deeper than large strain was solved for: must be a press of this design; press less far"


@dataclass(frozen=True, kw_only=True)
class DeepPair:
    """A pair of springs C [mm/N] over a fruit S, times E [1/mm], each with a row for the low and the high tip.

    `side` of the tips [mm]; `factors` [1] is the force over the linear one at rising `depths` [tip sides], `errors` [1]
    their relative error bars.
    """

    C: Matrix
    S: Matrix
    side: float
    depths: tuple[float, ...]
    factors: tuple[float, ...]
    errors: tuple[float, ...]

    def perturbed(self) -> Iterator[tuple["DeepPair", float]]:
        """Yield this pair with a slightly larger factor at one depth, and how often that goes into its error bar [1].

        A curve may bend within its bars: what all of them move a number by, each as often as it goes into its bar and
        added without signs, bounds what any curve within the bars does.
        """
        for place, error in enumerate(self.errors):
            factors = list(self.factors)
            factors[place] *= 1.0 + _NUDGE
            yield replace(self, factors=tuple(factors)), error / _NUDGE

    def off_alike(self) -> "DeepPair":
        """Return this pair with the factors of all depths as far off as their error bars."""
        return replace(self, factors=tuple(g * (1.0 + e) for g, e in zip(self.factors, self.errors, strict=True)))

    @cached_property
    def _linear(self) -> tuple[float, ...]:
        """Return g(d) d at the depths [tip sides]: the depth that a tip of the same force has in linear flesh."""
        return tuple(depth * factor for depth, factor in zip(self.depths, self.factors, strict=True))

    def depth(self, tip: int, force: float, E: float) -> tuple[float, float]:
        """Return how deep a tip of a force [N] stands in flesh of modulus E [MPa], in mm, and its slope [mm/N].

        Between depths the factor is a straight line over the force, beyond the last one it stays.
        """
        linear = force * self.S[tip][tip] / E / self.side
        places, factors = self._linear, self.factors
        at = bisect.bisect_left(places, linear)
        if at in (0, len(places)):
            factor, bend = factors[min(at, len(places) - 1)], 0.0
        else:
            bend = (factors[at] - factors[at - 1]) / (places[at] - places[at - 1])
            factor = factors[at - 1] + bend * (linear - places[at - 1])
        slope = (1.0 - linear * bend / factor) / factor
        return self.side * linear / factor, slope * self.S[tip][tip] / E

    def is_beyond(self, forces: Sequence[float], E: float) -> bool:
        """Say whether a tip of the forces [N] stands deeper in flesh of modulus E [MPa] than was solved."""
        return any(self.depth(tip, force, E)[0] > self.side * self.depths[-1] for tip, force in enumerate(forces))

    def lead(self, forces: Sequence[float], E: float) -> float:
        """Return how far the high tip stands before the low one [mm] where forces [N] are those at modulus E [MPa]."""
        return self._give(0) * forces[0] + self._give(1) * forces[1] + self.sunk(forces, E)

    def sunk(self, forces: Sequence[float], E: float) -> float:
        """Return how much farther the skin sinks under the low tip than under the high one [mm], of forces [N]."""
        (soft, _), (stiff, _) = (self.depth(tip, force, E) for tip, force in enumerate(forces))
        return soft - stiff + (self.S[0][1] * forces[1] - self.S[1][0] * forces[0]) / E

    def lead_slopes(self, forces: Sequence[float], E: float) -> tuple[float, float, float]:
        """Return the slopes of the lead over both forces [mm/N] and over the logarithm of the modulus [mm]."""
        soft, stiff = forces
        slopes = [self.depth(tip, force, E)[1] for tip, force in enumerate(forces)]
        by_soft, by_stiff = slopes[0] - self.S[1][0] / E, self.S[0][1] / E - slopes[1]
        return self._give(0) + by_soft, self._give(1) + by_stiff, -by_soft * soft - by_stiff * stiff

    def ratio_modulus(self, forces: Sequence[float]) -> float:
        """Return the modulus [MPa] that forces of a level press [N] tell; raises ReadingError where they tell none."""
        soft, stiff = forces
        if not stiff > soft > 0.0:
            raise ReadingError(OF_ANOTHER_SENSOR)
        least = self._least_modulus([forces])
        below, above = math.log(least), math.log(least) + _WIDEST
        if not self.lead(forces, least) < 0.0 < self.lead(forces, math.exp(above)):
            raise ReadingError(OF_ANOTHER_SENSOR)
        for _ in range(_HALVINGS):
            middle = 0.5 * (below + above)
            below, above = (middle, above) if self.lead(forces, math.exp(middle)) < 0.0 else (below, middle)
        return math.exp(0.5 * (below + above))

    def line(self, samples: Sequence[Sample], noises: Sequence[float] = (0.0, 0.0)) -> PairLine:
        """Return what the samples of a press tell; `noises` [N] are the standard deviations of both forces.

        Raises ReadingError for fewer than three samples, and where they tell no modulus.
        """
        if len(samples) < FEWEST:
            msg = f"samples with both tips on the fruit = {len(samples)}: must be at least {FEWEST}; press farther"
            raise ReadingError(msg)
        E = math.exp(self._straightest(samples, noises if any(noises) else (1.0, 1.0)))
        counts = [count for count, *_ in samples]
        lead = math.fsum(count * self.lead(forces, E) for count, *forces in samples) / sum(counts)
        return PairLine(modulus=E, lead=lead, error=self._noise(samples, noises, E))

    def _noise(self, samples: Sequence[Sample], noises: Sequence[float], E: float) -> float:
        """Return the standard deviation of the modulus of a line by noise [1]."""
        slopes = [self.lead_slopes(forces, E) for _, *forces in samples]
        counts = [count for count, *_ in samples]
        spread, mean = _spread([row[2] for row in slopes], counts)
        rows = zip(counts, slopes, strict=True)
        squares = math.fsum(count * (row[2] - mean) ** 2 * _variance(row, noises) for count, row in rows)
        return math.sqrt(squares) / spread

    def moved(self, samples: Sequence[Sample], E: float, other: "DeepPair", gains: Sequence[float]) -> float:
        """Return the share by which the modulus [1] read of samples moves, for another law and for gains [1]."""
        slopes = [self.lead_slopes(forces, E)[2] for _, *forces in samples]
        counts = [count for count, *_ in samples]
        spread, mean = _spread(slopes, counts) if len(samples) > 1 else (slopes[0] ** 2, 0.0)
        shifts = [
            other.lead([gain * force for gain, force in zip(gains, forces, strict=True)], E) - self.lead(forces, E)
            for _, *forces in samples
        ]
        rows = zip(counts, slopes, shifts, strict=True)
        return -math.fsum(count * (slope - mean) * shift for count, slope, shift in rows) / spread

    def forces(self, E: float, travel: float) -> list[float]:
        """Return the forces of a level pair [N] on flesh of modulus E [MPa] at a travel [mm], by Newton's method.

        Raises ReadingError where springs and flesh find no balance.
        """
        forces = [travel / (row[tip] + self.S[tip][tip] / E) for tip, row in enumerate(self.C)]
        for _ in range(_STEPS):
            left, (a, b), (c, d) = self._balance(forces, E, travel)
            if max(map(abs, left)) <= _SETTLED * abs(travel):
                return forces
            step = d * left[0] - b * left[1], a * left[1] - c * left[0]
            forces = [force - change / (a * d - b * c) for force, change in zip(forces, step, strict=True)]
        msg = f"a level press at {E:g} MPa: must have every tip on the fruit; its springs are too far from the design"
        raise ReadingError(msg)

    def _balance(
        self, forces: Sequence[float], E: float, travel: float
    ) -> tuple[list[float], Sequence[float], Sequence[float]]:
        """Return by how much springs and flesh give more than the travel [mm], and the rows of its slopes [mm/N]."""
        depths = [self.depth(tip, force, E) for tip, force in enumerate(forces)]
        crossed = [self.C[0][1] + self.S[0][1] / E, self.C[1][0] + self.S[1][0] / E]
        left = [
            self.C[tip][tip] * force + depth + cross * other - travel
            for tip, (force, other, cross, (depth, _)) in enumerate(
                zip(forces, reversed(forces), crossed, depths, strict=True)
            )
        ]
        own = [self.C[tip][tip] + slope for tip, (_, slope) in enumerate(depths)]
        return left, (own[0], crossed[0]), (crossed[1], own[1])

    def _give(self, tip: int) -> float:
        return self.C[0][tip] - self.C[1][tip]

    def _least_modulus(self, samples: Sequence[Sequence[float]]) -> float:
        """Return the modulus [MPa] at which the deepest tip of forces [N] stands as deep as the curve may be taken."""
        deepest = BEYOND * self.side * self._linear[-1]
        return max(self.S[tip][tip] * force / deepest for forces in samples for tip, force in enumerate(forces))

    def _straightest(self, samples: Sequence[Sample], noises: Sequence[float]) -> float:
        """Return the logarithm of the modulus [MPa] at which the lead scatters least; raises ReadingError at an end."""

        def scatter(log: float) -> float:
            return self._scatter(samples, noises, math.exp(log))

        least = math.log(self._least_modulus([forces for _, *forces in samples]))
        logs = [least + _WIDEST * place / _SCAN for place in range(_SCAN + 1)]
        lowest = min(range(len(logs)), key=lambda place: scatter(logs[place]))
        if lowest == _SCAN:
            raise ReadingError(OF_ANOTHER_SENSOR)
        found = _least_place(scatter, logs[max(0, lowest - 1)], logs[lowest + 1])
        if found - least < _AT_THE_END:
            raise ReadingError(TOO_DEEP)
        return found

    def _scatter(self, samples: Sequence[Sample], noises: Sequence[float], E: float) -> float:
        """Return the squares of the lead less its mean over its variance by noise [1], summed over the samples."""
        weights = [count / _variance(self.lead_slopes(forces, E), noises) for count, *forces in samples]
        return _spread([self.lead(forces, E) for _, *forces in samples], weights)[0]


def _variance(slopes: Sequence[float], noises: Sequence[float]) -> float:
    """Return the variance of a lead [mm^2] by noises [N] of both forces; slopes [mm/N]."""
    return math.fsum((slope * noise) ** 2 for slope, noise in zip(slopes, noises, strict=False))


def _spread(values: Sequence[float], counts: Sequence[float]) -> tuple[float, float]:
    """Return the sum of squares of values less their mean, and the mean, each value as often as it counts."""
    mean = math.fsum(count * value for count, value in zip(counts, values, strict=True)) / sum(counts)
    return math.fsum(count * (value - mean) ** 2 for count, value in zip(counts, values, strict=True)), mean


def _least_place(height: Callable[[float], float], below: float, above: float) -> float:
    """Return where a function with one valley between two places is least, by golden sections."""
    inner = [above - _GOLDEN * (above - below), below + _GOLDEN * (above - below)]
    heights = [height(place) for place in inner]
    for _ in range(_SHRINKS):
        if heights[0] < heights[1]:
            above, inner[1], heights[1] = inner[1], inner[0], heights[0]
            inner[0] = above - _GOLDEN * (above - below)
            heights[0] = height(inner[0])
        else:
            below, inner[0], heights[0] = inner[0], inner[1], heights[1]
            inner[1] = below + _GOLDEN * (above - below)
            heights[1] = height(inner[1])
    return 0.5 * (below + above)
