"""Which range of a compression curve follows Hertz's law, and how much the modulus depends on that choice."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.measure.compression.hertz_fit import TABULATED, HertzFit, fit_hertz, last_force
from pipeline.measure.compression.loading import Loading

Floats = NDArray[np.float64]

ENDS = (1.0, 0.8, 0.6)  # of the force at the end of the loading: where a range may end
LARGEST_DEPTH = 0.1  # of the radius, on each side that is pressed in: Hertz's strain is small up to there
_GROUPS = 12  # of points, whose mean residuals show whether the law is followed
_FITS_WELL = 2.2  # mean square of those means over their error: 99 % of good fits lie below
_LEAST_POINTS = 12
_LEAST_IDLE = 10  # points before the touch that a drift is seen in
_RARE = 10.0  # tests without a drift that is seen for each with one, before a test is looked at
_TINY = float(np.finfo(float).tiny)
_WIDE = 3.0  # times the chosen range's error: a range that tells so little tells nothing about the choice


@dataclass(frozen=True, kw_only=True)
class RangeFit:
    """The law over a range of travel that ends at `last` [mm].

    `fit` is the more probable of the fits with and without a drift of the zero line, `factor` [N/mm^(3/2)] the mean of
    both by their probability, `factor_error` its standard error; so with `touch` [mm]. `follows` says whether the
    residuals are noise, `idle` how many points lie before the touch.
    """

    fit: HertzFit
    last: float
    factor: float
    factor_error: float
    touch: float
    touch_error: float
    follows: bool
    idle: int


def choose_range(curve: Loading, radius: float, plates: int) -> RangeFit | None:
    """Return the fit over the longest range that follows the law, with the choice in its error; None where none fits.

    `radius` [mm] bounds the travel to which the law holds; `plates` press the fruit in, each by its share.
    """
    made = [one for one in (_fitted(curve, end, radius, plates) for end in ENDS) if one is not None]
    if not made:
        return None
    good = [one for one in made if one.follows]
    best = good[0] if good else min(made, key=lambda one: float(one.fit.residual.std()))
    others = [one for one in (good or made) if one is not best]
    spread = _beyond_chance(best, others)
    return RangeFit(
        fit=best.fit,
        last=best.last,
        factor=best.factor,
        factor_error=float(np.sqrt(best.factor_error**2 + spread**2 + (TABULATED * best.factor) ** 2)),
        touch=best.touch,
        touch_error=best.touch_error,
        follows=best.follows,
        idle=best.idle,
    )


def _fitted(curve: Loading, end: float, radius: float, plates: int) -> RangeFit | None:
    x, F = curve.travel, curve.force - curve.zero
    width = max(1, len(x) // 60)
    smooth = np.convolve(F, np.ones(width) / width, mode="same")
    over = np.flatnonzero(smooth > end * last_force(F))
    count = int(over[0]) if over.size and end < 1.0 else len(x)
    first = _fit(x[:count], curve.force[:count], curve.zero)
    if first is None:
        return None
    deepest = first.touch + plates * LARGEST_DEPTH * radius
    within = int(np.searchsorted(x[:count], deepest))
    if within < count:
        first = _fit(x[:within], curve.force[:within], curve.zero)
    return first


def _fit(travel: Floats, force: Floats, zero: float) -> RangeFit | None:
    """Return the mean of the fits with and without drift, each with its probability by Schwarz's criterion.

    Ann. Statist. 6 (1978) 461, doi:10.1214/aos/1176344136.
    """
    if len(travel) < _LEAST_POINTS:
        return None
    steady = fit_hertz(travel, force, zero, with_drift=False)
    if steady is None:
        return None
    idle = int(np.searchsorted(travel, steady.onset))
    drifting = fit_hertz(travel, force, zero, with_drift=True) if idle >= _LEAST_IDLE else None
    drifting = drifting or steady
    told = _slope_told(travel[:idle], force[:idle]) if idle >= _LEAST_IDLE else 0.0
    share = _share_of_drift(drifting, told, len(travel))
    chosen = drifting if share > 0.5 else steady  # noqa: PLR2004 - the more probable of two
    factor, factor_error = _mean(share, (drifting.factor, drifting.factor_error), (steady.factor, steady.factor_error))
    touch, touch_error = _mean(share, (drifting.touch, drifting.touch_error), (steady.touch, steady.touch_error))
    return RangeFit(
        fit=chosen,
        last=float(travel[-1]),
        factor=factor,
        factor_error=factor_error,
        touch=touch,
        touch_error=touch_error,
        follows=_misfit(chosen.residual) < _FITS_WELL,
        idle=idle,
    )


def _share_of_drift(drifting: HertzFit, told: float, count: int) -> float:
    """Return the probability of a drift [1] that fit and zero line tell, in standard errors, over some points."""
    least = min(told, abs(drifting.drift) / max(drifting.drift_error, _TINY))
    return 1.0 / (1.0 + _RARE * math.sqrt(count) * math.exp(-0.5 * min(least**2, 1e3)))


def _slope_told(travel: Floats, force: Floats) -> float:
    """Return the slope of a zero line over its standard error [1]."""
    place = travel - travel.mean()
    spread = float(place @ place)
    slope = float(place @ force) / max(spread, _TINY)
    residual = force - force.mean() - slope * place
    error = math.sqrt(float(residual @ residual) / (len(travel) - 2) / max(spread, _TINY))
    return abs(slope) / max(error, _TINY)


def _mean(share: float, first: tuple[float, float], second: tuple[float, float]) -> tuple[float, float]:
    """Return the mean of two estimates (value, standard error) and its error; the first has this share."""
    mean = share * first[0] + (1.0 - share) * second[0]
    variance = share * (first[1] ** 2 + (first[0] - mean) ** 2)
    variance += (1.0 - share) * (second[1] ** 2 + (second[0] - mean) ** 2)
    return float(mean), float(np.sqrt(variance))


def _misfit(residual: Floats) -> float:
    """Return the mean square of the means of groups of residuals, over what their noise makes them [1]."""
    groups = np.array_split(residual, min(_GROUPS, max(3, len(residual) // 4)))
    bend = residual[2:] - 2.0 * residual[1:-1] + residual[:-2]
    variance = float(np.mean(bend**2)) / 6.0
    free = max(1, len(groups) - 4)
    if variance == 0.0:
        return 0.0
    return float(sum(len(group) * group.mean() ** 2 for group in groups)) / variance / free


def _beyond_chance(best: RangeFit, others: list[RangeFit]) -> float:
    """Return how far the factors of other ranges lie from the best one, beyond what noise explains [N/mm^(3/2)].

    The variance of the difference to a fit of more points is the difference of the variances: J. A. Hausman,
    Econometrica 46 (1978) 1251, doi:10.2307/1913827.
    """
    excess = [
        max(0.0, (one.factor - best.factor) ** 2 - max(0.0, one.factor_error**2 - best.factor_error**2))
        for one in others
        if one.factor_error < _WIDE * best.factor_error
    ]
    return float(np.sqrt(np.mean(excess))) if excess else 0.0
