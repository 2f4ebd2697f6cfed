"""A level pair of flat tips deep in soft flesh: its forces on a fruit, and the modulus that its forces tell.

A tip that carries F is indented by d, where g(d) d = F s / E with s its own compliance times E and g the factor of
large strain; it pushes the skin under the other tip down by s12 F / E. Both travel alike but for a height offset:

    (C F)_low + d_low + s12 F_high / E = (C F)_high + d_high + s12 F_low / E + offset .

Over the samples of a press the modulus is the one at which the offset scatters least beside what noise explains: W. E.
Deming, Statistical Adjustment of Data, 1943.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cad.theory.contrast_law import Matrix, ReadingError
from cad.theory.pair_line import FEWEST, OF_ANOTHER_SENSOR, PairLine

Floats = NDArray[np.float64]

BEYOND = 1.25
"""Of the deepest depth, up to which the factor counts as at it: a spring may be that far off its design."""
_WIDEST = math.log(1e4)  # of the modulus above the least one that the curve reaches
_SCANNED = 25  # moduli of which the best brackets the modulus of a line
_PERTURBATION = 1e-4  # of a factor: a whole bar at one depth alone would leave a kink
_AT_THE_END = 1e-6  # of a logarithm
_SETTLED = 1e-12
TOO_DEEP = "the tips stand deeper than large strain was solved for: must be a press of this design; press less far"


class Samples(NamedTuple):
    """Blocks of samples: how many each holds, (blocks,), and its mean forces of both tips [N], (blocks, 2)."""

    counts: Floats
    forces: Floats


def one_sample(forces: Sequence[float]) -> Samples:
    """Return a single sample of the forces of both tips [N]."""
    return Samples(np.ones(1), np.array([forces], dtype=np.float64))


class Indentation(NamedTuple):
    """How deep tips stand [mm], and by how much deeper for a larger force [mm/N]."""

    depth: Floats
    slope: Floats


class OffsetSlopes(NamedTuple):
    """Slopes of the height offset over both forces [mm/N], (blocks, 2), and over the logarithm of E [mm], (blocks,)."""

    forces: Floats
    modulus: Floats

    def variance(self, noises: ArrayLike) -> Floats:
        """Return the variance of the offset [mm^2] by noises [N] of both forces."""
        return np.asarray(((self.forces * np.array(noises)) ** 2).sum(axis=-1))


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

    def with_factors(self, ratios: ArrayLike) -> "DeepPair":
        """Return this pair with other factors: these times a ratio [1] for each depth."""
        return replace(self, factors=tuple((np.array(self.factors) * np.array(ratios)).tolist()))

    def perturbed(self) -> Iterator[tuple["DeepPair", float]]:
        """Yield this pair with a slightly larger factor at one depth, and how often that goes into its error bar [1].

        A curve may bend within its bars: what all of them move a number by, each as often as it goes into its bar and
        added without signs, bounds what any curve within the bars does.
        """
        for index, error in enumerate(self.errors):
            ratios = np.ones(len(self.factors))
            ratios[index] += _PERTURBATION
            yield self.with_factors(ratios), error / _PERTURBATION

    def at_upper_errors(self) -> "DeepPair":
        """Return this pair with the factors of all depths as far off as their error bars."""
        return self.with_factors(1.0 + np.array(self.errors))

    @cached_property
    def _linear_depths(self) -> Floats:
        """Return g(d) d at the depths [tip sides]: the depth that a tip of the same force has in linear flesh."""
        return np.multiply(self.depths, self.factors)

    @cached_property
    def _compliance(self) -> Floats:
        """Return the compliance of the fruit under each tip itself, times E [1/mm]."""
        return np.array([self.S[0][0], self.S[1][1]])

    def indentation(self, forces: ArrayLike, E: float) -> Indentation:
        """Return how deep tips of forces [N], (..., 2), stand in flesh of modulus E [MPa].

        Between depths the factor is a straight line over the force, beyond the last one it stays.
        """
        linear = np.asarray(forces) * self._compliance / E / self.side
        loads = self._linear_depths
        factors = np.array(self.factors)
        factor = np.interp(linear, loads, factors)
        above = np.searchsorted(loads, linear)
        gradients = np.concatenate([[0.0], np.diff(factors) / np.diff(loads), [0.0]])
        slope = (1.0 - linear * gradients[above] / factor) / factor
        return Indentation(self.side * linear / factor, slope * self._compliance / E)

    def is_beyond(self, forces: ArrayLike, E: float) -> bool:
        """Say whether a tip of the forces [N] stands deeper in flesh of modulus E [MPa] than was solved."""
        return bool((self.indentation(forces, E).depth > self.side * self.depths[-1]).any())

    @cached_property
    def _relative_compliance(self) -> Floats:
        """Return how much farther the spring of the low tip yields than that of the high one, per force [mm/N]."""
        return np.asarray(np.array(self.C[0]) - np.array(self.C[1]))

    def offset(self, forces: ArrayLike, E: float) -> Floats:
        """Return how far the high tip stands before the low one [mm] where forces [N] are those at modulus E [MPa]."""
        return np.asarray(np.asarray(forces) @ self._relative_compliance + self.skin_difference(forces, E))

    def skin_difference(self, forces: ArrayLike, E: float) -> Floats:
        """Return how much farther the skin sinks under the low tip than under the high one [mm], of forces [N]."""
        depth = self.indentation(forces, E).depth
        crossed = np.asarray(forces) @ np.array([-self.S[1][0], self.S[0][1]]) / E
        return np.asarray(depth[..., 0] - depth[..., 1] + crossed)

    def offset_slopes(self, forces: ArrayLike, E: float) -> OffsetSlopes:
        """Return the slopes of the offset at forces [N] and a modulus E [MPa]."""
        by_skin = self.indentation(forces, E).slope * np.array([1.0, -1.0])
        by_skin += np.array([-self.S[1][0], self.S[0][1]]) / E
        return OffsetSlopes(self._relative_compliance + by_skin, -(by_skin * np.asarray(forces)).sum(axis=-1))

    def ratio_modulus(self, forces: Sequence[float]) -> float:
        """Return the modulus [MPa] that forces of a level press [N] tell; raises ReadingError where they tell none."""
        from scipy.optimize import brentq

        def offset(logarithm: float) -> float:
            return float(self.offset(forces, math.exp(logarithm)))

        low, high = forces
        if not high > low > 0.0:
            raise ReadingError(OF_ANOTHER_SENSOR)
        least = self._least_logarithm(np.array(forces))
        if not offset(least) < 0.0 < offset(least + _WIDEST):
            raise ReadingError(OF_ANOTHER_SENSOR)
        return math.exp(brentq(offset, least, least + _WIDEST, xtol=_SETTLED))

    def line(self, samples: Samples, noises: ArrayLike = (0.0, 0.0)) -> PairLine:
        """Return what the samples of a press tell; `noises` [N] are the standard deviations of both forces.

        Raises ReadingError for fewer than three samples, and where they tell no modulus.
        """
        if len(samples.counts) < FEWEST:
            count = len(samples.counts)
            msg = f"samples with both tips on the fruit = {count}: must be at least {FEWEST}; press farther"
            raise ReadingError(msg)
        E = math.exp(self._straightest(samples, noises if np.any(noises) else (1.0, 1.0)))
        slopes = self.offset_slopes(samples.forces, E)
        deviations = slopes.modulus - np.average(slopes.modulus, weights=samples.counts)
        spread = samples.counts @ deviations**2
        by_noise = samples.counts @ (deviations**2 * slopes.variance(noises))
        offset = float(np.average(self.offset(samples.forces, E), weights=samples.counts))
        return PairLine(modulus=E, lead=offset, error=float(np.sqrt(by_noise) / spread))

    def shift(self, samples: Samples, E: float, law: "DeepPair", gains: ArrayLike = 1.0) -> float:
        """Return the fraction by which the modulus [1] read of samples moves, for another law and for gains [1]."""
        slopes = self.offset_slopes(samples.forces, E).modulus
        if len(slopes) > 1:
            slopes = slopes - np.average(slopes, weights=samples.counts)
        change = law.offset(samples.forces * np.asarray(gains), E) - self.offset(samples.forces, E)
        return float(-(samples.counts @ (slopes * change)) / (samples.counts @ slopes**2))

    def forces(self, E: float, travel: float) -> list[float]:
        """Return the forces of a level pair [N] on flesh of modulus E [MPa] at a travel [mm].

        Raises ReadingError where springs and flesh find no balance.
        """
        from scipy.optimize import root

        compliance = np.array(self.C)
        compliance[[0, 1], [1, 0]] += np.array([self.S[0][1], self.S[1][0]]) / E

        def balance(forces: Floats) -> tuple[Floats, Floats]:
            skin = self.indentation(forces, E)
            return compliance @ forces + skin.depth - travel, compliance + np.diag(skin.slope)

        start = travel / (np.diag(compliance) + self._compliance / E)
        solution = root(balance, start, jac=True, tol=_SETTLED)
        if not np.abs(solution.fun).max() <= 1e-9 * abs(travel):
            msg = f"a level press at {E:g} MPa: must have every tip on the fruit; its springs are far from the design"
            raise ReadingError(msg)
        return [float(force) for force in solution.x]

    def _least_logarithm(self, forces: Floats) -> float:
        """Return the log of the modulus [MPa] at which the deepest tip of forces [N] stands as deep as is allowed."""
        deepest = BEYOND * self.side * self._linear_depths[-1]
        return math.log(float((self._compliance * forces).max()) / deepest)

    def _straightest(self, samples: Samples, noises: ArrayLike) -> float:
        """Return the log of the modulus [MPa] at which the offset scatters least; raises ReadingError at an end."""
        from scipy.optimize import minimize_scalar

        def scatter(logarithm: float) -> float:
            """Return the squares of the offset less its mean, over its variance by noise."""
            E = math.exp(logarithm)
            weights = samples.counts / self.offset_slopes(samples.forces, E).variance(noises)
            offset = self.offset(samples.forces, E)
            return float(weights @ (offset - np.average(offset, weights=weights)) ** 2)

        least = self._least_logarithm(samples.forces)
        logarithms = np.linspace(least, least + _WIDEST, _SCANNED)
        lowest = int(np.argmin([scatter(logarithm) for logarithm in logarithms.tolist()]))
        if lowest == _SCANNED - 1:
            raise ReadingError(OF_ANOTHER_SENSOR)
        bracket = (logarithms[max(0, lowest - 1)], logarithms[lowest + 1])
        straightest = float(minimize_scalar(scatter, bounds=bracket, method="bounded", options={"xatol": 1e-9}).x)
        if straightest - least < _AT_THE_END:
            raise ReadingError(TOO_DEEP)
        return straightest
