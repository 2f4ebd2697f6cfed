"""A level pair of flat tips deep in soft flesh: its forces on a fruit, and the modulus that its forces tell.

A tip that carries F is indented by d, where g(d) d = F s / E with s its own compliance times E and g the factor of
large strain; it pushes the skin under the other tip down by s12 F / E. Both travel alike but for a height offset:

    (C F)_low + d_low + s12 F_high / E = (C F)_high + d_high + s12 F_low / E + offset .

Over the samples of a press the modulus is the one at which the offset scatters least beside what noise explains: W. E.
Deming, Statistical Adjustment of Data, 1943.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cad.theory.contrast_law import ReadingError
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


def one_sample(forces: Floats) -> Samples:
    """Return a single sample of the forces of both tips [N]."""
    return Samples(np.ones(1), forces[None])


@dataclass(frozen=True, kw_only=True, eq=False)
class DeepPair:
    """A pair of springs C [mm/N] over a fruit S, times E [1/mm], (2, 2), each with the low tip first.

    `side` of the tips [mm]; `factors` [1] is the force over the linear one at rising `depths` [tip sides], `errors` [1]
    their relative error bars, all (depths,).
    """

    C: Floats
    S: Floats
    side: float
    depths: Floats
    factors: Floats
    errors: Floats

    def with_factors(self, ratios: Floats) -> "DeepPair":
        """Return this pair with other factors: these times a ratio [1] for each depth."""
        return replace(self, factors=self.factors * ratios)

    def curve_contributions(self, change: Callable[["DeepPair"], float]) -> float:
        """Return the most that any curve within the error bars changes a number: the contributions of all depths added.

        A curve may bend within its bars: it may move a number farther than one that is off alike at all depths.
        `change` returns what a pair of another curve changes the number by.
        """
        total = 0.0
        for index, error in enumerate(self.errors.tolist()):
            ratios = np.ones(len(self.factors))
            ratios[index] += _PERTURBATION
            total += error / _PERTURBATION * abs(change(self.with_factors(ratios)))
        return total

    @cached_property
    def _linear_depths(self) -> Floats:
        """Return g(d) d at the depths [tip sides]: the depth that a tip of the same force has in linear flesh."""
        return self.depths * self.factors

    def _linear_depth(self, forces: ArrayLike, E: float) -> Floats:
        """Return how deep tips of forces [N], (..., 2), stand in linear flesh of modulus E [MPa] [tip sides]."""
        return np.asarray(forces) * np.diag(self.S) / E / self.side

    def depth(self, forces: ArrayLike, E: float) -> Floats:
        """Return how deep tips of forces [N], (..., 2), stand in flesh of modulus E [MPa] [mm].

        Between depths the factor is a straight line over the force, beyond the last one it stays.
        """
        linear = self._linear_depth(forces, E)
        return np.asarray(self.side * linear / np.interp(linear, self._linear_depths, self.factors))

    def _depth_per_force(self, forces: ArrayLike, E: float) -> Floats:
        """Return by how much deeper tips stand for a larger force [mm/N]."""
        linear = self._linear_depth(forces, E)
        factor = np.interp(linear, self._linear_depths, self.factors)
        gradients = np.concatenate([[0.0], np.diff(self.factors) / np.diff(self._linear_depths), [0.0]])
        gradient = gradients[np.searchsorted(self._linear_depths, linear)]
        return np.asarray((1.0 - linear * gradient / factor) / factor * np.diag(self.S) / E)

    def is_beyond(self, forces: ArrayLike, E: float) -> bool:
        """Say whether a tip of the forces [N] stands deeper in flesh of modulus E [MPa] than was solved."""
        return bool((self.depth(forces, E) > self.side * self.depths[-1]).any())

    def offset(self, forces: ArrayLike, E: float) -> Floats:
        """Return how far the high tip stands before the low one [mm] where forces [N] are those at modulus E [MPa]."""
        depth = self.depth(forces, E)
        by_force = self.C[0] - self.C[1] + self._by_other_tip / E
        return np.asarray(np.asarray(forces) @ by_force + depth[..., 0] - depth[..., 1])

    @property
    def _by_other_tip(self) -> Floats:
        """Return how much farther the skin sinks under the low tip than the high one by the other's force [1/mm]."""
        return np.array([-self.S[1, 0], self.S[0, 1]])

    def _skin_per_force(self, forces: ArrayLike, E: float) -> Floats:
        """Return how much farther the skin sinks under the low tip than the high one per force [mm/N], (..., 2)."""
        return np.asarray(self._depth_per_force(forces, E) * np.array([1.0, -1.0]) + self._by_other_tip / E)

    def offset_per_log_E(self, forces: ArrayLike, E: float) -> Floats:
        """Return the slope of the offset over the logarithm of E [mm]: the skin is one of forces over E."""
        return np.asarray(-(self._skin_per_force(forces, E) * np.asarray(forces)).sum(axis=-1))

    def _offset_variance(self, forces: ArrayLike, E: float, noises: Floats) -> Floats:
        """Return the variance of the offset [mm^2] by noises [N] of both forces."""
        slopes = self.C[0] - self.C[1] + self._skin_per_force(forces, E)
        return np.asarray(((slopes * noises) ** 2).sum(axis=-1))

    def ratio_modulus(self, forces: Floats) -> float:
        """Return the modulus [MPa] that forces of a level press [N] tell; raises ReadingError where they tell none."""
        from scipy.optimize import brentq

        def offset(logarithm: float) -> float:
            return float(self.offset(forces, math.exp(logarithm)))

        low, high = forces
        least = self._least_logarithm(forces) if high > low > 0.0 else 0.0
        if not high > low > 0.0 or not offset(least) < 0.0 < offset(least + _WIDEST):
            raise ReadingError(OF_ANOTHER_SENSOR)
        return math.exp(brentq(offset, least, least + _WIDEST, xtol=_SETTLED))

    def line(self, samples: Samples, noises: Floats) -> PairLine:
        """Return what the samples of a press tell; `noises` [N] are the standard deviations of both forces.

        Raises ReadingError for fewer than three samples, and where they tell no modulus.
        """
        count = len(samples.counts)
        if count < FEWEST:
            msg = f"samples with both tips on the fruit = {count}: must be at least {FEWEST}; press farther"
            raise ReadingError(msg)
        E = math.exp(self._straightest(samples, noises if noises.any() else np.ones(2)))
        slopes = self.offset_per_log_E(samples.forces, E)
        deviations = slopes - np.average(slopes, weights=samples.counts)
        spread = samples.counts @ deviations**2
        by_noise = samples.counts @ (deviations**2 * self._offset_variance(samples.forces, E, noises))
        offset = float(np.average(self.offset(samples.forces, E), weights=samples.counts))
        return PairLine(modulus=E, lead=offset, error=float(np.sqrt(by_noise) / spread))

    def shift(self, samples: Samples, E: float, law: "DeepPair", gains: ArrayLike = 1.0) -> float:
        """Return the fraction by which the modulus [1] read of samples moves, for another law and for gains [1]."""
        slopes = self.offset_per_log_E(samples.forces, E)
        if len(slopes) > 1:
            slopes = slopes - np.average(slopes, weights=samples.counts)
        change = law.offset(samples.forces * np.asarray(gains), E) - self.offset(samples.forces, E)
        return float(-(samples.counts @ (slopes * change)) / (samples.counts @ slopes**2))

    def forces(self, E: float, travel: float) -> Floats:
        """Return the forces of a level pair [N] on flesh of modulus E [MPa] at a travel [mm].

        Raises ReadingError where springs and flesh find no balance.
        """
        from scipy.optimize import root

        coupling = self.S - np.diag(np.diag(self.S))
        compliance = self.C + coupling / E

        def balance(forces: Floats) -> Floats:
            """Return the residual [mm]."""
            return np.asarray(compliance @ forces + self.depth(forces, E) - travel)

        start = travel / np.diag(self.C + self.S / E)
        solution = root(balance, start, tol=_SETTLED)
        if not np.abs(solution.fun).max() <= 1e-9 * abs(travel):
            msg = f"a level press at {E:g} MPa: must have every tip on the fruit; its springs are far from the design"
            raise ReadingError(msg)
        return np.asarray(solution.x)

    def _least_logarithm(self, forces: Floats) -> float:
        """Return the log of the modulus [MPa] at which the deepest tip of forces [N] stands as deep as is allowed."""
        deepest = float(self._linear_depth(forces, 1.0).max())
        return math.log(deepest / (BEYOND * self._linear_depths[-1]))

    def _straightest(self, samples: Samples, noises: Floats) -> float:
        """Return the log of the modulus [MPa] at which the offset scatters least; raises ReadingError at an end."""
        from scipy.optimize import minimize_scalar

        def scatter(logarithm: float) -> float:
            """Return the squares of the offset less its mean, over its variance by noise."""
            E = math.exp(logarithm)
            weights = samples.counts / self._offset_variance(samples.forces, E, noises)
            offset = self.offset(samples.forces, E)
            return float(weights @ (offset - np.average(offset, weights=weights)) ** 2)

        least = self._least_logarithm(samples.forces)
        logarithms = np.linspace(least, least + _WIDEST, _SCANNED).tolist()
        lowest = int(np.argmin([scatter(logarithm) for logarithm in logarithms]))
        if lowest == _SCANNED - 1:
            raise ReadingError(OF_ANOTHER_SENSOR)
        bracket = (logarithms[max(0, lowest - 1)], logarithms[lowest + 1])
        straightest = float(minimize_scalar(scatter, bounds=bracket, method="bounded", options={"xatol": 1e-9}).x)
        if straightest - least < _AT_THE_END:
            raise ReadingError(TOO_DEEP)
        return straightest
