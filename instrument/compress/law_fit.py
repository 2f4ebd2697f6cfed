"""A force law fitted to a force-travel curve, together with the touch, the settling of the skin and the zero line.

The travel at a force F is x = x0 + D(F) - s exp(-F / F_s): the depth D of the law from the touch x0 on, minus the part
by which the skin has not yet settled. The load cell adds its zero line f0 + f1 x to the force.
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
# bounds of F_s relative to the force at the end; a larger one is not due to settling but to the fruit itself
_LEAST_SETTLING = 0.003
_MOST_SETTLING = 0.12
_LARGEST_TRAVEL = 0.12  # largest s, relative to the travel of the loading
_GUESS = 0.03  # initial guess of F_s, relative to the force at the end
_GUESS_TRAVEL = 0.01  # initial guess of s, relative to the travel of the loading
_STEP = 0.01  # relative size of the first step of the fit
_WIDE = 50.0  # scale of ln F_s, relative to ln E
_UPPER = 0.3  # fraction of the force at the end, above which the points give the initial guess
_SETTLED = 1e-6  # a smaller settling counts as none [mm]
_CHANCE = 2.0  # largest correlation of neighbouring residuals that may be chance [standard errors]
_MOST_ALIKE = 0.95  # largest correlation of neighbours that widens the errors


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
    """The result of a fit: its parameters, and their standard errors, which are 0 for parameters that were not fitted.

    `residual` (points,) [N] is the fitted force minus the measured one.
    """

    law: ForceLaw
    parameters: CurveParameters
    errors: CurveParameters
    residual: Floats

    @property
    def modulus(self) -> Estimate:
        """Return the modulus E [MPa] with its standard error."""
        E = float(np.exp(self.parameters.log_modulus))
        return Estimate(E, E * self.errors.log_modulus, "MPa")

    @property
    def touch(self) -> Estimate:
        """Return the travel at the touch, x0 [mm], with its standard error."""
        return Estimate(self.parameters.touch, self.errors.touch, "mm")

    @property
    def onset(self) -> float:
        """Return the travel from which the force rises [mm]."""
        return self.parameters.touch - self.parameters.settling

    def zero_line(self, travel: Floats) -> Floats:
        """Return the zero of the load cell [N] at travels [mm]."""
        return self.parameters.offset + self.parameters.drift * travel

    def force(self, travel: Floats, largest: float) -> Floats:
        """Return the force of the load cell [N] at travels [mm], for forces up to `largest` [N]."""
        return _load_cell_force(self.law, self.parameters, travel, largest)


def fit_law(law: ForceLaw, travel: Floats, force: Floats, zero: float, *, with_drift: bool) -> LawFit | None:
    """Fit a force law to travel [mm] and force [N], both (points,), by least squares.

    `zero` [N] is the approximate zero of the load cell. With `with_drift`, its drift is fitted too. Returns None if the
    curve does not rise, or if the fit does not converge.
    """
    start = _initial_guess(law, travel, force, zero)
    if start is None:
        return None
    largest = last_force(force) - zero
    span = float(travel[-1] - travel[0])
    lower = CurveParameters(-np.inf, -np.inf, 0.0, np.log(_LEAST_SETTLING * largest), -np.inf, -np.inf)
    upper = CurveParameters(np.inf, np.inf, _LARGEST_TRAVEL * span, np.log(_MOST_SETTLING * largest), np.inf, np.inf)
    scale = CurveParameters(1.0, span, span, _WIDE, largest, largest / span)
    count = 6 if with_drift else 5  # the drift is the last parameter

    def residuals(parameters: Floats) -> Floats:
        return _load_cell_force(law, CurveParameters(*parameters), travel, largest) - force

    solution = least_squares(
        residuals,
        start[:count],
        bounds=(lower[:count], upper[:count]),
        x_scale=_STEP * np.array(scale[:count]),
    )
    if not solution.success:
        return None
    determined = list(range(count))
    parameters = CurveParameters(*solution.x.tolist())
    if parameters.settling <= _SETTLED:  # at this bound the data do not determine the force of the settling
        determined = [index for index in determined if index not in _SETTLING_INDICES]
    errors = np.zeros(6)
    errors[determined] = standard_errors(np.asarray(solution.jac)[:, determined], solution.fun)
    return LawFit(law=law, parameters=parameters, errors=CurveParameters(*errors.tolist()), residual=solution.fun)


def _initial_guess(law: ForceLaw, travel: Floats, force: Floats, zero: float) -> CurveParameters | None:
    """Return the initial guess of the fit, or None if the upper part of the curve does not rise.

    By the law F = E k (x - x0)^n. So F^(1/n) is a linear function of the travel x with slope (E k)^(1/n), which is 0 at
    the touch x0. A line fitted to the upper part gives E and x0. The settling starts from typical values.
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
    """Return the standard errors of fitted parameters, (parameters,).

    `jacobian` (points, parameters) is the derivative of the residuals `residual` (points,). The errors are White's for
    residuals of unequal variance (Econometrica 48 (1980) 817, doi:10.2307/1912934), widened if neighbouring residuals
    are correlated.
    """
    points, parameters = jacobian.shape
    changes = np.linalg.pinv(jacobian) * residual  # change of each parameter due to the residual of each point
    variance = (changes**2).sum(axis=1)
    variance *= points / max(1, points - parameters)
    total = float(residual @ residual)
    correlation = float(residual[1:] @ residual[:-1]) / total if total > 0.0 else 0.0
    # Residuals of a first-order autoregressive process have fewer independent values by this factor.
    if correlation > _CHANCE / math.sqrt(points):
        correlation = min(correlation, _MOST_ALIKE)
        variance *= (1.0 + correlation) / (1.0 - correlation)
    return np.asarray(np.sqrt(variance))


def last_force(force: Floats) -> float:
    """Return the mean force [N] over the last few points, at least three, of a loading curve (points,) [N]."""
    return float(force[-max(3, len(force) // 50) :].mean())


def _load_cell_force(law: ForceLaw, parameters: CurveParameters, travel: Floats, largest: float) -> Floats:
    """Return the force of the load cell [N] at travels [mm], for forces up to about `largest` [N].

    The travel is an explicit function of the force. So it is tabulated against the force, and the table is inverted.
    """
    force = _TABLE_END * largest * _FINE
    unsettled = parameters.settling * np.exp(-force / np.exp(parameters.log_settling_force))
    position = parameters.touch + law.depth(force, float(np.exp(parameters.log_modulus))) - unsettled
    return np.asarray(np.interp(travel, position, force) + parameters.offset + parameters.drift * travel)
