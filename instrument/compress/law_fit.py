"""A force law fitted to a force-travel curve, together with the touch, the settling of the skin and the zero line.

The travel at a force F is x = x0 + D(F) - s exp(-F / F_s): the depth D of the law from the touch x0 on, less the part
that the skin has not yet settled. The load cell adds f0 + f1 x to the force.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from instrument.compress.force_law import ForceLaw
from sensor.arrays import Floats
from sensor.quantity import Estimate

_FINE = np.linspace(0.0, 1.0, 600) ** 2  # forces at which the law is tabulated, relative to the largest one
_TABLE_END = 1.6  # end of this table, relative to the force at the end of the loading
# bounds of F_s relative to the force at the end; a larger one is no settling but the fruit itself
_LEAST_SETTLING = 0.003
_MOST_SETTLING = 0.12
_LARGEST_TRAVEL = 0.12  # largest s, relative to the travel of the loading
_GUESS = 0.03  # first guess of F_s, relative to the force at the end
_GUESS_TRAVEL = 0.01  # first guess of s, relative to the travel of the loading
_STEP = 0.01  # relative size of the first step of the fit
_WIDE = 50.0  # scale of ln F_s, relative to ln E
_UPPER = 0.3  # share of the force at the end; above it, a straight line through F^(1/n) gives the first guess
_SETTLED = 1e-6  # settling below this is none [mm]
_CHANCE = 2.0  # correlation of neighbouring residuals that is chance [standard errors]
_MOST_ALIKE = 0.95  # largest correlation of neighbours that is used


class CurveParameters(NamedTuple):
    """The parameters of a curve: ln E of the law, x0 and s [mm], ln F_s, f0 [N] and f1 [N/mm]."""

    log_modulus: float
    touch: float
    settling: float
    log_settling_force: float
    offset: float
    drift: float = 0.0


_SETTLING_INDICES = (2, 3)  # indices of `settling` and `log_settling_force`


@dataclass(frozen=True, kw_only=True)
class LawFit:
    """The result of a fit, with standard errors; 0 for parameters that were not fitted.

    `residual` (points,) [N] is fitted less measured force.
    """

    law: ForceLaw
    parameters: CurveParameters
    errors: CurveParameters
    residual: Floats

    @property
    def modulus(self) -> Estimate:
        """Return E [MPa]."""
        E = float(np.exp(self.parameters.log_modulus))
        return Estimate(E, E * self.errors.log_modulus, "MPa")

    @property
    def touch(self) -> Estimate:
        """Return x0 [mm]."""
        return Estimate(self.parameters.touch, self.errors.touch, "mm")

    @property
    def onset(self) -> float:
        """Return the travel from which the force rises [mm]."""
        return self.parameters.touch - self.parameters.settling

    def zero_line(self, travel: Floats) -> Floats:
        """Return the zero of the load cell [N] at travels [mm]."""
        return self.parameters.offset + self.parameters.drift * travel

    def force(self, travel: Floats, largest: float) -> Floats:
        """Return the force of the load cell [N] at travels [mm], for forces up to `largest`."""
        return _force(self.law, self.parameters, travel, largest)


def fit_law(law: ForceLaw, travel: Floats, force: Floats, zero: float, *, with_drift: bool) -> LawFit | None:
    """Return the least-squares fit to travel [mm] and force [N], shape (points,).

    `zero` [N] is the approximate zero of the load cell. None if the curve does not rise, or the fit does not converge.
    """
    start = _first_guess(law, travel, force, zero)
    if start is None:
        return None
    largest = last_force(force) - zero
    reach = float(travel[-1] - travel[0])
    lower = CurveParameters(-np.inf, -np.inf, 0.0, np.log(_LEAST_SETTLING * largest), -np.inf, -np.inf)
    upmost = CurveParameters(np.inf, np.inf, _LARGEST_TRAVEL * reach, np.log(_MOST_SETTLING * largest), np.inf, np.inf)
    scale = CurveParameters(1.0, reach, reach, _WIDE, largest, largest / reach)
    count = 6 if with_drift else 5

    def misfit(parameters: Floats) -> Floats:
        return _force(law, CurveParameters(*parameters), travel, largest) - force

    solution = least_squares(
        misfit,
        start[:count],
        bounds=(lower[:count], upmost[:count]),
        x_scale=_STEP * np.array(scale[:count]),
    )
    if not solution.success:
        return None
    fitted = list(range(count))
    parameters = CurveParameters(*solution.x.tolist())
    if parameters.settling <= _SETTLED:
        fitted = [index for index in fitted if index not in _SETTLING_INDICES]
    errors = np.zeros(6)
    errors[fitted] = standard_errors(np.asarray(solution.jac)[:, fitted], solution.fun)
    return LawFit(law=law, parameters=parameters, errors=CurveParameters(*errors.tolist()), residual=solution.fun)


def _first_guess(law: ForceLaw, travel: Floats, force: Floats, zero: float) -> CurveParameters | None:
    """Return the start of the fit; None if the upper part of the curve does not rise.

    By the law, F = E k (x - touch)^n, so F^(1/n) is a straight line over x with slope (E k)^(1/n), 0 at the touch.
    """
    largest = last_force(force) - zero
    upper = force - zero > _UPPER * largest
    if largest <= 0.0 or upper.sum() < 3:  # noqa: PLR2004 - a line and one point more
        return None
    slope, level = np.polyfit(travel[upper], (force[upper] - zero) ** (1.0 / law.exponent), 1)
    if slope <= 0.0:
        return None
    return CurveParameters(
        log_modulus=law.exponent * np.log(slope) - np.log(law.stiffness),
        touch=-level / slope,
        settling=_GUESS_TRAVEL * float(travel[-1] - travel[0]),
        log_settling_force=np.log(_GUESS * largest),
        offset=zero,
    )


def standard_errors(jacobian: Floats, residual: Floats) -> Floats:
    """Return the standard errors of fitted parameters from the Jacobian (points, parameters).

    They are White's for residuals of unequal size (Econometrica 48 (1980) 817, doi:10.2307/1912934), widened if
    neighbouring residuals are correlated.
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


def last_force(force: Floats) -> float:
    """Return the mean force at the end of a loading (points,) [N]."""
    return float(force[-max(3, len(force) // 50) :].mean())


def _force(law: ForceLaw, parameters: CurveParameters, travel: Floats, largest: float) -> Floats:
    """Return the force of the load cell [N] at travels [mm]; the law is tabulated over force and inverted."""
    force = _TABLE_END * largest * _FINE
    unsettled = parameters.settling * np.exp(-force / np.exp(parameters.log_settling_force))
    position = parameters.touch + law.depth(force, float(np.exp(parameters.log_modulus))) - unsettled
    return np.asarray(np.interp(travel, position, force) + parameters.offset + parameters.drift * travel)
