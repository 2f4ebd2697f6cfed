"""Choice of the range of a compression curve that follows a force law."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from instrument.compress.force_law import ForceLaw
from instrument.compress.law_fit import LawFit, fit_law, last_force
from instrument.compress.phases import Loading
from sensor.arrays import Floats
from sensor.quantity import Estimate

ENDS = (1.0, 0.8, 0.6)
"""Ends of a range, as shares of the force at the end of the loading."""
_GROUPS = 12  # groups of points whose mean residuals show whether the law is followed
_FITS_WELL = 2.2  # mean square of these means over their error; 99 % of good fits lie below
_LEAST_POINTS = 12
_LEAST_IDLE = 10  # points before the touch that are needed to detect a drift
_RARE = 10.0  # prior odds against a detectable drift
_TINY = float(np.finfo(float).tiny)
_WIDE = 3.0  # multiple of the chosen range's error beyond which another range says nothing about the choice
_TABULATED = 1e-4  # relative error of the modulus by linear interpolation in the tabulated forces


@dataclass(frozen=True, kw_only=True)
class RangeFit:
    """A law fitted over a range of travel that ends at `last` [mm].

    `fit` is the more probable of the fits with and without a drift of the zero line. `modulus` [MPa] and `touch` [mm]
    are means of both fits, weighted by probability, with standard errors. `follows` states whether the residuals are
    noise, and `idle` is the number of points before the touch.
    """

    fit: LawFit
    last: float
    modulus: Estimate
    touch: Estimate
    follows: bool
    idle: int


def choose_range(curve: Loading, law: ForceLaw) -> RangeFit | None:
    """Return the fit over the longest range that follows the law, with the choice in its error; None if none fits."""
    candidates = []
    for end in ENDS:
        fit = _fit_up_to(curve, end, law)
        if fit is not None:
            candidates.append(fit)
    if not candidates:
        return None
    following = [fit for fit in candidates if fit.follows]
    best = following[0] if following else min(candidates, key=lambda fit: float(fit.fit.residual.std()))
    others = [fit.modulus for fit in following or candidates if fit is not best]
    return replace(best, modulus=with_choice(best.modulus, others))


def with_choice(best: Estimate, others: Sequence[Estimate]) -> Estimate:
    """Return the modulus of the chosen range, with an error that includes its difference to other ranges [MPa].

    Noise explains a part of the difference, which is subtracted. The variance of the difference to a fit of more points
    is the difference of the variances (J. A. Hausman, Econometrica 46 (1978) 1251, doi:10.2307/1913827).
    """
    excess = []
    for other in others:
        if other.error < _WIDE * best.error:
            by_noise = max(0.0, other.error**2 - best.error**2)
            excess.append(max(0.0, (other.value - best.value) ** 2 - by_noise))
    by_choice = float(np.mean(excess)) if excess else 0.0
    error = math.sqrt(best.error**2 + by_choice + (_TABULATED * best.value) ** 2)
    return Estimate(best.value, error, best.unit)


def _fit_up_to(curve: Loading, end: float, law: ForceLaw) -> RangeFit | None:
    """Return the fit up to a fraction of the last force, but not beyond the depth to which the law holds."""
    force = curve.force - curve.zero
    width = max(1, len(force) // 60)
    smooth = np.convolve(force, np.ones(width) / width, mode="same")
    over = np.flatnonzero(smooth > end * last_force(force))
    count = int(over[0]) if over.size and end < 1.0 else len(force)
    fit = _fit(curve, count, law)
    if fit is None:
        return None
    within = int(np.searchsorted(curve.travel[:count], fit.touch.value + law.deepest))
    return fit if within == count else _fit(curve, within, law)


def _fit(curve: Loading, count: int, law: ForceLaw) -> RangeFit | None:
    """Return the fit to the first points: the mean with and without drift, weighted by probability.

    The probability follows Schwarz's criterion (Ann. Statist. 6 (1978) 461, doi:10.1214/aos/1176344136).
    """
    travel = curve.travel[:count]
    force = curve.force[:count]
    if count < _LEAST_POINTS:
        return None
    steady = fit_law(law, travel, force, curve.zero, with_drift=False)
    if steady is None:
        return None
    idle = int(np.searchsorted(travel, steady.onset))
    drifting = fit_law(law, travel, force, curve.zero, with_drift=True) if idle >= _LEAST_IDLE else None
    other = steady if drifting is None else drifting
    probability = 0.0 if drifting is None else _drift_probability(drifting, travel[:idle], force[:idle], count)
    fit = other if probability > 0.5 else steady  # noqa: PLR2004 - the more probable of two
    return RangeFit(
        fit=fit,
        last=float(travel[-1]),
        modulus=_mean(probability, other.modulus, steady.modulus),
        touch=_mean(probability, other.touch, steady.touch),
        follows=_is_noise(fit.residual) or bool((np.abs(fit.residual) <= law.error * np.abs(force)).all()),
        idle=idle,
    )


def _drift_probability(drifting: LawFit, travel: Floats, force: Floats, count: int) -> float:
    """Return the probability of a drift [1], which both the fit and the points before the touch must show.

    Travel [mm] and force [N] are of the points before the touch, (idle,); `count` is the number of all points.
    """
    (slope, _), covariance = np.polyfit(travel, force, 1, cov=True)
    in_zero_line = abs(slope) / max(math.sqrt(covariance[0, 0]), _TINY)
    by_fit = abs(drifting.parameters.drift) / max(drifting.errors.drift, _TINY)
    seen = min(in_zero_line, by_fit)  # standard errors
    odds_against = _RARE * math.sqrt(count) * math.exp(-0.5 * min(seen**2, 1e3))
    return 1.0 / (1.0 + odds_against)


def _mean(probability: float, first: Estimate, second: Estimate) -> Estimate:
    """Return the mean of two estimates with standard errors, weighted with the probability of the first."""
    mean = probability * first.value + (1.0 - probability) * second.value
    variance = probability * (first.error**2 + (first.value - mean) ** 2)
    variance += (1.0 - probability) * (second.error**2 + (second.value - mean) ** 2)
    return Estimate(mean, math.sqrt(variance), first.unit)


def _is_noise(residual: Floats) -> bool:
    """Return whether the means of groups of residuals are as small as noise makes them."""
    groups = np.array_split(residual, min(_GROUPS, max(3, len(residual) // 4)))
    curvature = residual[2:] - 2.0 * residual[1:-1] + residual[:-2]
    # variance of the noise; a second difference has 1 + 4 + 1 times that of one point
    variance = float(np.mean(curvature**2)) / 6.0
    squares = math.fsum(len(group) * group.mean() ** 2 for group in groups)
    freedom = max(1, len(groups) - 4)
    return variance == 0.0 or squares / variance / freedom < _FITS_WELL
