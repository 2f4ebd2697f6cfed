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
"""Ends of the ranges that are tried, as fractions of the force at the end of the loading."""
_GROUPS = 12  # maximum number of groups of points whose mean residuals show whether the law is followed
_FITS_WELL = 2.2  # largest reduced chi square of these means; 99 % of good fits lie below
_LEAST_POINTS = 12  # minimum number of points of a fit
_LEAST_IDLE = 10  # minimum number of points before the touch from which a drift can be detected
_RARE = 10.0  # prior odds against a detectable drift
_TINY = float(np.finfo(float).tiny)
_WIDE = 3.0  # largest error of another range, over the chosen range's error, with which its modulus is compared
_TABULATED = 1e-4  # relative error of the modulus due to linear interpolation in the tabulated forces


@dataclass(frozen=True, kw_only=True)
class RangeFit:
    """A law fitted over a range of travel that ends at `last` [mm].

    `fit` is the more probable of the fits with and without a drift of the zero line. `modulus` [MPa] and `touch` [mm]
    are means of both fits, weighted by probability, with standard errors. `follows` is True if the curve follows the
    law within its noise or the error of the law. `idle` is the number of points before the touch.
    """

    fit: LawFit
    last: float
    modulus: Estimate
    touch: Estimate
    follows: bool
    idle: int


def choose_range(curve: Loading, law: ForceLaw) -> RangeFit | None:
    """Fit a law to the longest range of a curve that follows it, with an error that includes the choice of the range.

    If no range follows the law, the one with the smallest residuals is taken. Returns None if no range can be fitted.
    """
    candidates = []
    for end in ENDS:
        fit = _fit_range(curve, end, law)
        if fit is not None:
            candidates.append(fit)
    if not candidates:
        return None
    following = [fit for fit in candidates if fit.follows]
    best = following[0] if following else min(candidates, key=lambda fit: float(fit.fit.residual.std()))
    others = [fit.modulus for fit in following or candidates if fit is not best]
    return replace(best, modulus=add_choice_error(best.modulus, others))


def add_choice_error(best: Estimate, others: Sequence[Estimate]) -> Estimate:
    """Return the modulus of the chosen range [MPa], with an error that includes its difference from other ranges.

    Noise explains a part of the difference, which is subtracted. The variance of the difference from a fit of more
    points is the difference of the variances (J. A. Hausman, Econometrica 46 (1978) 1251, doi:10.2307/1913827).
    """
    excesses = []
    for other in others:
        if other.error < _WIDE * best.error:
            noise_variance = max(0.0, other.error**2 - best.error**2)
            excesses.append(max(0.0, (other.value - best.value) ** 2 - noise_variance))
    choice_variance = float(np.mean(excesses)) if excesses else 0.0
    error = math.sqrt(best.error**2 + choice_variance + (_TABULATED * best.value) ** 2)
    return Estimate(best.value, error, best.unit)


def _fit_range(curve: Loading, end: float, law: ForceLaw) -> RangeFit | None:
    """Return the fit up to the fraction `end` of the last force, but not beyond the depth to which the law holds.

    Returns None if the range has too few points or cannot be fitted.
    """
    force = curve.force - curve.zero
    width = max(1, len(force) // 60)
    smooth = np.convolve(force, np.ones(width) / width, mode="same")
    beyond_end = np.flatnonzero(smooth > end * last_force(force))
    count = int(beyond_end[0]) if beyond_end.size and end < 1.0 else len(force)
    fit = _fit_points(curve, count, law)
    if fit is None:
        return None
    # Only the fit shows the touch, from which the depth is counted. So a range that is too deep is fitted again.
    within = int(np.searchsorted(curve.travel[:count], fit.touch.value + law.deepest))
    return fit if within == count else _fit_points(curve, within, law)


def _fit_points(curve: Loading, count: int, law: ForceLaw) -> RangeFit | None:
    """Return the fit to the first `count` points: the mean of fits with and without a drift, weighted by probability.

    Returns None for too few points, and if the fit fails.
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
    with_drift = steady if drifting is None else drifting
    probability = 0.0 if drifting is None else _drift_probability(drifting, travel[:idle], force[:idle], count)
    fit = with_drift if probability > 0.5 else steady  # noqa: PLR2004 - the more probable of two
    return RangeFit(
        fit=fit,
        last=float(travel[-1]),
        modulus=_weighted_mean(probability, with_drift.modulus, steady.modulus),
        touch=_weighted_mean(probability, with_drift.touch, steady.touch),
        follows=_is_noise(fit.residual) or bool((np.abs(fit.residual) <= law.error * np.abs(force)).all()),
        idle=idle,
    )


def _drift_probability(drifting: LawFit, travel: Floats, force: Floats, count: int) -> float:
    """Return the probability of a drift of the zero line [1].

    Both the fit and the points before the touch must show the drift. Travel [mm] and force [N] belong to the points
    before the touch, (idle,). `count` is the number of all points. The odds are prior odds times those by Schwarz's
    criterion (Ann. Statist. 6 (1978) 461, doi:10.1214/aos/1176344136), sqrt(count) exp(-chi^2 / 2).
    """
    (slope, _), covariance = np.polyfit(travel, force, 1, cov=True)
    idle_significance = abs(slope) / max(math.sqrt(covariance[0, 0]), _TINY)
    fit_significance = abs(drifting.parameters.drift) / max(drifting.errors.drift, _TINY)
    significance = min(idle_significance, fit_significance)  # standard errors
    odds_against = _RARE * math.sqrt(count) * math.exp(-0.5 * min(significance**2, 1e3))  # 1e3 prevents an underflow
    return 1.0 / (1.0 + odds_against)


def _weighted_mean(probability: float, first: Estimate, second: Estimate) -> Estimate:
    """Return the mean of two estimates with standard errors, weighted with the probability of the first [1].

    The variance is the one of a mixture: it includes the difference of the two values.
    """
    mean = probability * first.value + (1.0 - probability) * second.value
    variance = probability * (first.error**2 + (first.value - mean) ** 2)
    variance += (1.0 - probability) * (second.error**2 + (second.value - mean) ** 2)
    return Estimate(mean, math.sqrt(variance), first.unit)


def _is_noise(residual: Floats) -> bool:
    """Return whether residuals (points,) [N] are noise, by a chi-square test of the means of consecutive groups.

    A law that is not followed leaves residuals of one sign over many points, which their means show.
    """
    groups = np.array_split(residual, min(_GROUPS, max(3, len(residual) // 4)))
    differences = residual[2:] - 2.0 * residual[1:-1] + residual[:-2]
    # The variance of the noise; a second difference has 1 + 4 + 1 times the variance of one point.
    variance = float(np.mean(differences**2)) / 6.0
    squares = math.fsum(len(group) * group.mean() ** 2 for group in groups)
    freedom = max(1, len(groups) - 4)  # degrees of freedom: without modulus, touch, settling and zero
    return variance == 0.0 or squares / variance / freedom < _FITS_WELL
