"""How far a fitted number may be off: by the residuals of its fit, and by the range that was fitted."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cad.quantity import Estimate

Floats = NDArray[np.float64]

_CHANCE = 2.0  # standard errors up to which neighbouring residuals are alike by chance
_MOST_ALIKE = 0.95  # correlation of neighbours: a larger one is taken for this
_WIDE = 3.0  # times the chosen range's error: a range that tells so little tells nothing about the choice
_TABULATED = 1e-4  # of the modulus: more than the straight lines between the tabulated forces take from it


def standard_errors(jacobian: Floats, residual: Floats) -> Floats:
    """Return the standard errors of fitted numbers, shape (numbers,), whose derivatives are the columns of a table.

    They are White's for residuals of unequal size (Econometrica 48 (1980) 817, doi:10.2307/1912934), wider where
    neighbouring residuals are alike.
    """
    points, numbers = jacobian.shape
    by_each_point = np.linalg.pinv(jacobian) * residual
    variance = (by_each_point**2).sum(axis=1)
    variance *= points / max(1, points - numbers)
    total = float(residual @ residual)
    correlation = float(residual[1:] @ residual[:-1]) / total if total > 0.0 else 0.0
    if correlation > _CHANCE / math.sqrt(points):
        correlation = min(correlation, _MOST_ALIKE)
        variance *= (1.0 + correlation) / (1.0 - correlation)
    return np.asarray(np.sqrt(variance))


def with_choice(best: Estimate, others: Sequence[Estimate]) -> Estimate:
    """Return the modulus of the chosen range with what those of other ranges add to its error [MPa].

    What noise explains of their difference is left out: the variance of the difference to a fit of more points is the
    difference of the variances (J. A. Hausman, Econometrica 46 (1978) 1251, doi:10.2307/1913827).
    """
    excess = []
    for other in others:
        if other.error < _WIDE * best.error:
            by_noise = max(0.0, other.error**2 - best.error**2)
            excess.append(max(0.0, (other.value - best.value) ** 2 - by_noise))
    by_choice = float(np.mean(excess)) if excess else 0.0
    error = math.sqrt(best.error**2 + by_choice + (_TABULATED * best.value) ** 2)
    return Estimate(best.value, error, best.unit)
