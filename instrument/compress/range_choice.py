"""Choice of the range of a compression curve over which it follows a force law."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from instrument.compress.force_law import ForceLaw
from instrument.compress.law_fit import LawFit, fit_law, mean_last_force
from instrument.compress.phases import Loading
from sensor.arrays import Floats
from sensor.quantity import Estimate

ENDS = (1.0, 0.8, 0.6)
"""Ends of the ranges that are tried, as fractions of the force at the end of the loading."""
_SMOOTH_PARTS = 60  # the force is smoothed over a sixtieth of its points before the end of a range is determined
_GROUPS = 12  # maximum number of groups of points whose mean residuals are tested
_LEAST_GROUPS = 3  # minimum number of these groups
_LEAST_GROUP_SIZE = 4  # number of points of a group in a curve too short for `_GROUPS`
_FITTED = 4  # fitted parameters that reduce the degrees of freedom: modulus, first contact, settling and zero
_LARGEST_CHI_SQUARE = 2.2  # largest reduced chi-square of these means; 99 % of good fits are below
_LEAST_POINTS = 12  # minimum number of points of a fit
_LEAST_IDLE = 10  # minimum number of points before first contact from which a drift can be detected
_ODDS_AGAINST_DRIFT = 10.0  # prior odds against a detectable drift
_TINY = float(np.finfo(float).tiny)
# Another range is compared only if its error is at most this many times the error of the chosen range.
_LARGEST_ERROR_RATIO = 3.0
_INTERPOLATION_ERROR = 1e-4  # relative error of the modulus due to linear interpolation in the table of forces


@dataclass(frozen=True, kw_only=True)
class RangeFit:
    """A force law fitted over a range of travel that ends at `range_end` [mm].

    `fit` is the more probable of two fits, with and without a drift of the zero line. `modulus` [MPa] and `touch` [mm],
    the travel at first contact, are the means of the two fits, weighted by their probabilities, with standard errors.
    `follows_law` is True if the curve follows the law within its noise or within the error of the law. `idle_points` is
    the number of points before first contact.
    """

    fit: LawFit
    range_end: float
    modulus: Estimate
    touch: Estimate
    follows_law: bool
    idle_points: int


def choose_range(curve: Loading, law: ForceLaw) -> RangeFit | None:
    """Fit a force law to the longest range of a curve that follows this law.

    The error of the modulus includes the choice of the range. If the curve follows the law over none of the ranges, the
    range with the smallest residuals is used. Returns None if no range can be fitted.
    """
    range_fits = [_fit_range(curve, end, law) for end in ENDS]
    candidates = [fit for fit in range_fits if fit is not None]  # the longest range first
    if not candidates:
        return None
    following = [fit for fit in candidates if fit.follows_law]
    best = following[0] if following else min(candidates, key=lambda fit: float(fit.fit.residual.std()))
    other_moduli = [fit.modulus for fit in following or candidates if fit is not best]
    return replace(best, modulus=add_choice_error(best.modulus, other_moduli))


def add_choice_error(best: Estimate, others: Sequence[Estimate]) -> Estimate:
    """Return the modulus of the chosen range [MPa], with an error that includes its difference from other ranges.

    `best` is the modulus of the chosen range, and `others` are the moduli of the other ranges. The part of the squared
    difference that noise explains is subtracted. This part is the difference of the variances of the two fits, because
    the wider range contains the points of the narrower one (J. A. Hausman, Econometrica 46 (1978) 1251,
    doi:10.2307/1913827).
    """
    excesses = []  # squared differences that noise does not explain [MPa^2]
    for other in others:
        if other.error < _LARGEST_ERROR_RATIO * best.error:
            noise_variance = max(0.0, other.error**2 - best.error**2)
            excesses.append(max(0.0, (other.value - best.value) ** 2 - noise_variance))
    choice_variance = float(np.mean(excesses)) if excesses else 0.0
    error = math.sqrt(best.error**2 + choice_variance + (_INTERPOLATION_ERROR * best.value) ** 2)
    return Estimate(best.value, error, best.unit)


def _fit_range(curve: Loading, end: float, law: ForceLaw) -> RangeFit | None:
    """Fit the law to the points up to the fraction `end` [1] of the force at the end of the loading.

    The range does not extend beyond the largest depth of the law. Returns None if the range has too few points, or if
    the fit fails.
    """
    force = curve.force - curve.zero
    width = max(1, len(force) // _SMOOTH_PARTS)
    smooth = np.convolve(force, np.ones(width) / width, mode="same")  # so that noise does not end the range too early
    beyond_end = np.flatnonzero(smooth > end * mean_last_force(force))
    is_whole = end >= 1.0 or not beyond_end.size
    count = len(force) if is_whole else int(beyond_end[0])
    fit = _fit_points(curve, count, law)
    if fit is None:
        return None
    # The depth is measured from first contact, which only the fit determines. So a range that is too deep is refitted.
    allowed_count = int(np.searchsorted(curve.travel[:count], fit.touch.value + law.deepest))
    return fit if allowed_count == count else _fit_points(curve, allowed_count, law)


def _fit_points(curve: Loading, count: int, law: ForceLaw) -> RangeFit | None:
    """Fit the law to the first `count` points, with and without a drift of the zero line.

    Modulus and first contact of the result are the means of the two fits, weighted by their probabilities. Returns None
    for too few points, and if the fit without a drift fails.
    """
    travel = curve.travel[:count]
    force = curve.force[:count]
    if count < _LEAST_POINTS:
        return None
    without_drift = fit_law(law, travel, force, curve.zero, with_drift=False)
    if without_drift is None:
        return None
    idle_points = int(np.searchsorted(travel, without_drift.onset))  # points before the force rises
    # With few points before first contact, a drift cannot be distinguished from the force of the body.
    drifting = fit_law(law, travel, force, curve.zero, with_drift=True) if idle_points >= _LEAST_IDLE else None
    if drifting is None:
        # The means of the result then contain the fit without a drift twice, the first time with the weight 0.
        with_drift, probability = without_drift, 0.0
    else:
        with_drift = drifting
        probability = _drift_probability(drifting, travel[:idle_points], force[:idle_points], count)
    fit = with_drift if probability > 0.5 else without_drift  # noqa: PLR2004 - the more probable of two
    is_within_error_of_law = bool((np.abs(fit.residual) <= law.error * np.abs(force)).all())
    return RangeFit(
        fit=fit,
        range_end=float(travel[-1]),
        modulus=_weighted_mean(probability, with_drift.modulus, without_drift.modulus),
        touch=_weighted_mean(probability, with_drift.touch, without_drift.touch),
        follows_law=_is_noise(fit.residual) or is_within_error_of_law,
        idle_points=idle_points,
    )


def _drift_probability(drifting: LawFit, travel: Floats, force: Floats, count: int) -> float:
    """Return the probability [1] that the zero line of the load cell drifts.

    The odds against a drift are

        _ODDS_AGAINST_DRIFT * sqrt(count) * exp(-z^2 / 2),

    the prior odds times the Bayes factor by Schwarz's criterion (Ann. Statist. 6 (1978) 461,
    doi:10.1214/aos/1176344136). Here z is the drift in standard errors. Both the fit and the points before first
    contact must show the drift, so z is the smaller of their two values.

    `drifting` is the fit with a drift. `travel` [mm] and `force` [N], both (idle points,), are the points before first
    contact, and `count` is the number of all points.
    """
    (slope, _), covariance = np.polyfit(travel, force, 1, cov=True)
    idle_significance = abs(slope) / max(math.sqrt(covariance[0, 0]), _TINY)
    fit_significance = abs(drifting.parameters.drift) / max(drifting.errors.drift, _TINY)
    significance = min(idle_significance, fit_significance)  # standard errors
    exponent = -0.5 * min(significance**2, 1e3)  # the limit prevents an underflow
    odds_against = _ODDS_AGAINST_DRIFT * math.sqrt(count) * math.exp(exponent)
    return 1.0 / (1.0 + odds_against)


def _weighted_mean(probability: float, first: Estimate, second: Estimate) -> Estimate:
    """Return the mean of two estimates, weighted by the probability [1] of the first one, with its standard error.

    The standard error is the standard deviation of a mixture distribution, so it includes the difference between the
    two values.
    """
    mean = probability * first.value + (1.0 - probability) * second.value
    variance = probability * (first.error**2 + (first.value - mean) ** 2)
    variance += (1.0 - probability) * (second.error**2 + (second.value - mean) ** 2)
    return Estimate(mean, math.sqrt(variance), first.unit)


def _is_noise(residual: Floats) -> bool:
    """Return whether the residuals (points,) [N] of a fit are only noise.

    A chi-square test is applied to the mean residuals of consecutive groups of points. If a curve does not follow the
    law, many neighbouring residuals have the same sign, so the group means exceed what noise explains.
    """
    group_count = min(_GROUPS, max(_LEAST_GROUPS, len(residual) // _LEAST_GROUP_SIZE))
    groups = np.array_split(residual, group_count)
    # Second differences are almost zero for smooth residuals. Their variance is 1 + 4 + 1 times the noise variance.
    differences = residual[2:] - 2.0 * residual[1:-1] + residual[:-2]
    noise_variance = float(np.mean(differences**2)) / 6.0
    # The mean of a group has the variance of the noise divided by the number of its points.
    squares = math.fsum(len(group) * group.mean() ** 2 for group in groups)
    degrees_of_freedom = max(1, group_count - _FITTED)
    return noise_variance == 0.0 or squares / noise_variance / degrees_of_freedom < _LARGEST_CHI_SQUARE
