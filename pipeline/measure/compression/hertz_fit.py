"""Hertz's law fitted to a force-travel curve, zero line and settling of the skin included, with error bars.

The travel to a force F is x = x0 + (F / k)^(2/3) - s exp(-F / F_s): Hertz's from the touch x0 on, less what the skin
has not settled yet. The load cell shows f0 + f1 x besides.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Floats = NDArray[np.float64]

_FINE = np.linspace(0.0, 1.0, 600) ** 2  # forces over the largest one at which the law is tabulated
TABULATED = 1e-4  # of the factor: more than the straight lines between those forces take from it
_BEYOND = 1.6  # of the force at the end of the loading: where the table ends
_LEAST_SETTLING, _MOST_SETTLING = 0.003, 0.12  # of that force; more would be no settling but the fruit itself
_LARGEST_TRAVEL = 0.12  # of the loading's, that settling may take
_GUESS, _GUESS_TRAVEL = 0.03, 0.01  # of that force and travel: where the settling is looked for first
_STEP, _WIDE = 0.01, 50.0  # how far a first step goes, and the settling's force farther than the others
_UPPER = 0.3  # of the force at the end: above, the straight line of F^(2/3) gives a first guess
_CHANCE = 2.0  # standard errors up to which neighbours are alike by chance
_SETTLED = 1e-6  # mm: less settling is none


@dataclass(frozen=True, kw_only=True)
class HertzFit:
    """What a fit found, and the standard errors of factor, touch and drift in the same units.

    `factor` is k [N/mm^(3/2)], `touch` x0 and `settling` s [mm], `settling_force` F_s and `offset` f0 [N], `drift` f1
    [N/mm], left 0 where it was not fitted. `residual` (points,) [N] is measured less fitted.
    """

    factor: float
    touch: float
    settling: float
    settling_force: float
    offset: float
    drift: float
    factor_error: float
    touch_error: float
    drift_error: float
    residual: Floats

    @property
    def onset(self) -> float:
        """Return the travel from which the force rises [mm]."""
        return self.touch - self.settling

    def shown(self, travel: Floats, largest: float) -> Floats:
        """Return the force that the load cell shows [N] at travels [mm], up to a largest one."""
        logarithms = (np.log(self.factor), np.log(self.settling_force))
        law = np.array([logarithms[0], self.touch, self.settling, logarithms[1], self.offset, self.drift])
        return _shown(law, travel, largest)


def fit_hertz(travel: Floats, force: Floats, zero: float, *, with_drift: bool) -> HertzFit | None:
    """Return the least-squares fit to travel [mm] and force [N], shape (points,); None where it has no minimum.

    `zero` [N] is where the load cell begins. The errors are White's for residuals of unequal size (Econometrica 48
    (1980) 817, doi:10.2307/1912934), wider where neighbouring residuals are alike.
    """
    largest = last_force(force) - zero
    line = _straight_line(travel, force - zero, largest)
    if line is None:
        return None
    reach = float(travel[-1] - travel[0])
    start = np.array([*line, _GUESS_TRAVEL * reach, np.log(_GUESS * largest), zero, 0.0])
    scale = np.array([1.0, reach, reach, _WIDE, largest, largest / reach]) * _STEP
    lower, upper = _bounds(reach, largest)
    fitted = slice(0, 6 if with_drift else 5)

    def missing(law: Floats) -> Floats:
        return _shown(law, travel, largest) - force

    bounds = (lower[fitted], upper[fitted])
    found = least_squares(missing, start[fitted], bounds=bounds, x_scale=scale[fitted])
    return _with_errors(found.x, np.asarray(found.jac), -found.fun) if found.success else None


def last_force(force: Floats) -> float:
    """Return the mean force at the end of a loading (points,) [N]."""
    return float(force[-max(3, len(force) // 50) :].mean())


def _bounds(reach: float, largest: float) -> tuple[Floats, Floats]:
    """Return what (ln k, x0, s, ln F_s, f0, f1) may be at least and at most, for a travel [mm] and a force [N]."""
    lower, upper = np.full(6, -np.inf), np.full(6, np.inf)
    lower[2:4] = 0.0, np.log(_LEAST_SETTLING * largest)
    upper[2:4] = _LARGEST_TRAVEL * reach, np.log(_MOST_SETTLING * largest)
    return lower, upper


def _straight_line(travel: Floats, force: Floats, largest: float) -> tuple[float, float] | None:
    """Return the logarithm of the factor and the touch [mm] from the line through F^(2/3) of the upper part."""
    upper = force > _UPPER * largest
    if largest <= 0.0 or upper.sum() < 3:  # noqa: PLR2004 - a line and one point more
        return None
    slope, level = np.polyfit(travel[upper], force[upper] ** (2.0 / 3.0), 1)
    return (1.5 * float(np.log(slope)), float(-level / slope)) if slope > 0.0 else None


def _shown(law: Floats, travel: Floats, largest: float) -> Floats:
    """Return the force [N] at travels [mm] of a law (ln k, x0, s, ln F_s, f0, f1)."""
    force = _BEYOND * largest * _FINE
    place = law[1] + (force / np.exp(law[0])) ** (2.0 / 3.0) - law[2] * np.exp(-force / np.exp(law[3]))
    drift = law[5:].sum()  # none where it is not fitted
    return np.asarray(np.interp(travel, place, force) + law[4] + drift * travel)


def _with_errors(law: Floats, jacobian: Floats, residual: Floats) -> HertzFit:
    fitted = [index for index in range(len(law)) if law[2] > _SETTLED or index not in (2, 3)]
    error = np.zeros(6)
    error[fitted] = _errors(jacobian[:, fitted], residual)
    values = np.append(law, 0.0)[:6]
    factor = float(np.exp(values[0]))
    return HertzFit(
        factor=factor,
        touch=float(values[1]),
        settling=float(values[2]),
        settling_force=float(np.exp(values[3])),
        offset=float(values[4]),
        drift=float(values[5]),
        factor_error=factor * float(error[0]),
        touch_error=float(error[1]),
        drift_error=float(error[5]),
        residual=residual,
    )


def _errors(jacobian: Floats, residual: Floats) -> Floats:
    """Return the standard errors of the numbers that a table of derivatives belongs to, shape (numbers,)."""
    size = np.abs(jacobian).max(axis=0)
    size[size == 0.0] = 1.0
    table = jacobian / size
    inverse = np.linalg.pinv(table.T @ table)
    meat = (table * residual[:, None] ** 2).T @ table
    free = len(residual) / max(1, len(residual) - len(size))
    return np.asarray(np.sqrt(np.diag(inverse @ meat @ inverse) * free * _likeness(residual)) / size)


def _likeness(residual: Floats) -> float:
    """Return by how much neighbours that are alike widen the error bars, squared [1]; at least 1."""
    total = float(residual @ residual)
    alike = float(residual[1:] @ residual[:-1]) / total if total > 0.0 else 0.0
    alike = min(alike, 0.95) if alike > _CHANCE / np.sqrt(len(residual)) else 0.0
    return (1.0 + alike) / (1.0 - alike)
