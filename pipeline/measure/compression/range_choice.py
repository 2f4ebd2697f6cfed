"""Which range of a compression curve follows a force law, and how much the modulus depends on that choice."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cad.quantity import Estimate
from pipeline.measure.compression.force_law import ForceLaw
from pipeline.measure.compression.law_fit import TABULATED, LawFit, fit_law, last_force
from pipeline.measure.compression.loading import Loading

Floats = NDArray[np.float64]

ENDS = (1.0, 0.8, 0.6)
"""Of the force at the end of the loading: where a range may end."""
_GROUPS = 12  # of points, whose mean residuals show whether the law is followed
_FITS_WELL = 2.2  # mean square of those means over their error: 99 % of good fits lie below
_LEAST_POINTS = 12
_LEAST_IDLE = 10  # points before the touch that a drift is seen in
_RARE = 10.0  # tests without a drift that is seen for each with one, before a test is looked at
_TINY = float(np.finfo(float).tiny)
_WIDE = 3.0  # times the chosen range's error: a range that tells so little tells nothing about the choice


@dataclass(frozen=True, kw_only=True)
class RangeFit:
    """A law fitted over a range of travel that ends at `last` [mm].

    `fit` is the more probable of the fits with and without a drift of the zero line; `factor` [N/mm^n] and `touch` [mm]
    are means of both by their probability, with standard errors. `follows` says whether the residuals are noise, `idle`
    how many points lie before the touch.
    """

    fit: LawFit
    last: float
    factor: Estimate
    touch: Estimate
    follows: bool
    idle: int


def choose_range(curve: Loading, law: ForceLaw) -> RangeFit | None:
    """Return the fit over the longest range that follows the law, the choice in its error; None where none fits."""
    candidates = [fit for fit in (_fit_to(curve, end, law) for end in ENDS) if fit is not None]
    if not candidates:
        return None
    following = [fit for fit in candidates if fit.follows]
    best = following[0] if following else min(candidates, key=lambda fit: float(fit.fit.residual.std()))
    spread = _beyond_chance(best.factor, [fit.factor for fit in following or candidates if fit is not best])
    error = float(np.sqrt(best.factor.error**2 + spread**2 + (TABULATED * best.factor.value) ** 2))
    return replace(best, factor=replace(best.factor, error=error))


def _fit_to(curve: Loading, end: float, law: ForceLaw) -> RangeFit | None:
    """Return the fit up to a fraction of the last force, and not beyond the depth to which the law holds."""
    travel = curve.travel
    force = curve.force - curve.zero
    width = max(1, len(travel) // 60)
    smooth = np.convolve(force, np.ones(width) / width, mode="same")
    over = np.flatnonzero(smooth > end * last_force(force))
    count = int(over[0]) if over.size and end < 1.0 else len(travel)
    fit = _fit(law, travel[:count], curve.force[:count], curve.zero)
    if fit is None:
        return None
    within = int(np.searchsorted(travel[:count], fit.touch.value + law.deepest))
    return fit if within == count else _fit(law, travel[:within], curve.force[:within], curve.zero)


def _fit(law: ForceLaw, travel: Floats, force: Floats, zero: float) -> RangeFit | None:
    """Return the mean of the fits with and without drift, each with its probability by Schwarz's criterion.

    Ann. Statist. 6 (1978) 461, doi:10.1214/aos/1176344136.
    """
    if len(travel) < _LEAST_POINTS:
        return None
    steady = fit_law(law, travel, force, zero, with_drift=False)
    if steady is None:
        return None
    idle = int(np.searchsorted(travel, steady.onset))
    drifting = steady
    probability = 0.0
    if idle >= _LEAST_IDLE:
        drifting = fit_law(law, travel, force, zero, with_drift=True) or steady
        # A drift has to be seen by the fit and in the zero line alone, in standard errors.
        by_fit = abs(drifting.drift.value) / max(drifting.drift.error, _TINY)
        seen = min(_slope_in_errors(travel[:idle], force[:idle]), by_fit)
        odds_against = _RARE * math.sqrt(len(travel)) * math.exp(-0.5 * min(seen**2, 1e3))
        probability = 1.0 / (1.0 + odds_against)
    fit = drifting if probability > 0.5 else steady  # noqa: PLR2004 - the more probable of two
    return RangeFit(
        fit=fit,
        last=float(travel[-1]),
        factor=_mean(probability, drifting.factor, steady.factor),
        touch=_mean(probability, drifting.touch, steady.touch),
        follows=_misfit(fit.residual) < _FITS_WELL,
        idle=idle,
    )


def _slope_in_errors(travel: Floats, force: Floats) -> float:
    """Return the slope of a zero line over its standard error [1]."""
    arm = travel - travel.mean()
    spread = max(float(arm @ arm), _TINY)
    slope = float(arm @ force) / spread
    residual = force - force.mean() - slope * arm
    error = math.sqrt(float(residual @ residual) / (len(travel) - 2) / spread)
    return abs(slope) / max(error, _TINY)


def _mean(probability: float, first: Estimate, second: Estimate) -> Estimate:
    """Return the mean of two estimates with standard errors, the first of which has a probability."""
    mean = probability * first.value + (1.0 - probability) * second.value
    variance = probability * (first.error**2 + (first.value - mean) ** 2)
    variance += (1.0 - probability) * (second.error**2 + (second.value - mean) ** 2)
    return Estimate(mean, math.sqrt(variance), first.unit)


def _misfit(residual: Floats) -> float:
    """Return the mean square of the means of groups of residuals, over what their noise makes them [1]."""
    groups = np.array_split(residual, min(_GROUPS, max(3, len(residual) // 4)))
    curvature = residual[2:] - 2.0 * residual[1:-1] + residual[:-2]
    variance = float(np.mean(curvature**2)) / 6.0
    freedom = max(1, len(groups) - 4)
    if variance == 0.0:
        return 0.0
    return float(sum(len(group) * group.mean() ** 2 for group in groups)) / variance / freedom


def _beyond_chance(best: Estimate, others: Sequence[Estimate]) -> float:
    """Return how far the factors of other ranges lie from the best one, beyond what noise explains [N/mm^n].

    The variance of the difference to a fit of more points is the difference of the variances: J. A. Hausman,
    Econometrica 46 (1978) 1251, doi:10.2307/1913827.
    """
    excess = []
    for factor in others:
        if factor.error < _WIDE * best.error:
            by_chance = max(0.0, factor.error**2 - best.error**2)
            excess.append(max(0.0, (factor.value - best.value) ** 2 - by_chance))
    return float(np.sqrt(np.mean(excess))) if excess else 0.0
