"""Fit of a force law to a force-travel curve, with first contact, settling of the skin, and zero line as unknowns.

The travel at a force F is

    x = x0 + D(F) - s exp(-F / F_s),

where D is the depth of the force law, measured from first contact at x0. The last term describes the skin, which
settles under small forces. s is the travel that is lost in settling, and F_s is the force at which this term has
decayed to 1 / e. The load cell adds its zero line f0 + f1 x to the force.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from instrument.compress.force_law import ForceLaw
from sensor.arrays import Floats
from sensor.quantity import Estimate

_TABLE_FORCES = np.linspace(0.0, 1.0, 600) ** 2  # forces at which the law is tabulated, relative to the largest force
_TABLE_END = 1.6  # largest force in this table, relative to the force at the end of the loading
# Bounds of F_s, relative to the force at the end. Settling does not cause a nonlinearity up to larger forces.
_LEAST_SETTLING = 0.003
_MOST_SETTLING = 0.12
_LARGEST_TRAVEL = 0.12  # largest s, relative to the travel of the loading
_GUESS = 0.03  # initial guess of F_s, relative to the force at the end
_GUESS_TRAVEL = 0.01  # initial guess of s, relative to the travel of the loading
_STEP = 0.01  # relative size of the first step of the fit
_LOG_FORCE_SCALE = 50.0  # scale of ln F_s, relative to the scale of ln E
_UPPER_PART = 0.3  # points above this fraction of the force at the end determine the initial guess
_LEAST_UPPER_POINTS = 3  # minimum number of these points: one more than a line requires
_NO_SETTLING = 1e-6  # a smaller s is treated as zero [mm]
_SIGNIFICANT = 2.0  # a larger correlation of neighbouring residuals [standard errors] is not due to chance
_LARGEST_CORRELATION = 0.95  # upper limit of the correlation of neighbouring residuals in the standard errors


class CurveParameters(NamedTuple):
    """The parameters of a curve in the order of the fit: ln E, x0 [mm], s [mm], ln F_s, f0 [N] and f1 [N/mm]."""

    log_modulus: float
    touch: float
    settling: float
    log_settling_force: float
    offset: float
    drift: float = 0.0


_SETTLING_INDICES = (2, 3)  # indices of `settling` and `log_settling_force` in CurveParameters


@dataclass(frozen=True, kw_only=True)
class LawFit:
    """The result of a fit: the parameters and their standard errors.

    A parameter that was not fitted has the standard error 0. `residual` (points,) [N] is the fitted force minus the
    measured force.
    """

    law: ForceLaw
    parameters: CurveParameters
    errors: CurveParameters
    residual: Floats

    @property
    def modulus(self) -> Estimate:
        """Return the modulus E [MPa] and its standard error."""
        E = float(np.exp(self.parameters.log_modulus))
        return Estimate(E, E * self.errors.log_modulus, "MPa")

    @property
    def touch(self) -> Estimate:
        """Return the travel at first contact, x0 [mm], and its standard error."""
        return Estimate(self.parameters.touch, self.errors.touch, "mm")

    @property
    def onset(self) -> float:
        """Return the travel at which the force begins to rise [mm]."""
        return self.parameters.touch - self.parameters.settling

    def zero_line(self, travel: Floats) -> Floats:
        """Return the zero of the load cell [N] at travels [mm]."""
        return self.parameters.offset + self.parameters.drift * travel

    def force(self, travel: Floats, largest: float) -> Floats:
        """Return the force of the load cell [N] at travels [mm], for forces up to `largest` [N]."""
        return _load_cell_force(self.law, self.parameters, travel, largest)


def fit_law(law: ForceLaw, travel: Floats, force: Floats, zero: float, *, with_drift: bool) -> LawFit | None:
    """Fit a force law to `travel` [mm] and `force` [N], both (points,), by least squares.

    The unknowns are the modulus, first contact, the settling of the skin and the zero line. `zero` [N] is the initial
    guess of the zero of the load cell. With `with_drift`, the drift f1 of the zero line is another unknown; otherwise
    f1 is 0. Returns None if the force does not rise, or if the fit does not converge.
    """
    start = _initial_guess(law, travel, force, zero)
    if start is None:
        return None
    largest = mean_last_force(force) - zero
    span = float(travel[-1] - travel[0])
    lower, upper = _parameter_bounds(largest, span)
    # The solver divides each parameter by its typical change, because their units and magnitudes differ.
    scale = CurveParameters(1.0, span, span, _LOG_FORCE_SCALE, largest, largest / span)
    count = len(start) if with_drift else len(start) - 1  # the drift is the last parameter

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
    parameters = CurveParameters(*solution.x.tolist())
    errors = _parameter_errors(parameters, np.asarray(solution.jac), solution.fun)
    return LawFit(law=law, parameters=parameters, errors=errors, residual=solution.fun)


def _parameter_bounds(largest: float, span: float) -> tuple[CurveParameters, CurveParameters]:
    """Return the lower and the upper bounds of the fitted parameters, of which only the settling of the skin has any.

    `largest` [N] is the force at the end of the loading above the zero of the load cell, and `span` [mm] is the travel
    of the loading.
    """
    lower = CurveParameters(-np.inf, -np.inf, 0.0, np.log(_LEAST_SETTLING * largest), -np.inf, -np.inf)
    upper = CurveParameters(np.inf, np.inf, _LARGEST_TRAVEL * span, np.log(_MOST_SETTLING * largest), np.inf, np.inf)
    return lower, upper


def _parameter_errors(parameters: CurveParameters, jacobian: Floats, residual: Floats) -> CurveParameters:
    """Return the standard error of each parameter; it is 0 for a parameter that the curve does not determine.

    `jacobian` (points, fitted parameters) and `residual` (points,) are results of the solver.
    """
    # Indices of the fitted parameters. The last parameter, the drift, may not be among them.
    determined = list(range(jacobian.shape[1]))
    if parameters.settling <= _NO_SETTLING:  # without settling, F_s has no effect, and neither s nor F_s has an error
        determined = [index for index in determined if index not in _SETTLING_INDICES]
    errors = np.zeros(len(CurveParameters._fields))
    errors[determined] = standard_errors(jacobian[:, determined], residual)
    return CurveParameters(*errors.tolist())


def _initial_guess(law: ForceLaw, travel: Floats, force: Floats, zero: float) -> CurveParameters | None:
    """Return the initial guess of the fit, or None if the upper part of the curve does not rise.

    `travel` [mm] and `force` [N], both (points,), are the curve, and `zero` [N] is the approximate zero of the load
    cell. The law is close to F = E k (x - x0)^n. So F^(1/n) is a linear function of the travel x with slope (E k)^(1/n)
    and zero at x0. A straight line through the upper part of the curve gives E and x0. The guesses for the settling are
    typical values.
    """
    largest = mean_last_force(force) - zero
    is_upper = force - zero > _UPPER_PART * largest
    if largest <= 0.0 or is_upper.sum() < _LEAST_UPPER_POINTS:
        return None
    roots = (force[is_upper] - zero) ** (1.0 / law.exponent)  # F^(1/n)
    slope, intercept = np.polyfit(travel[is_upper], roots, 1)
    if slope <= 0.0:
        return None
    return CurveParameters(
        log_modulus=law.exponent * np.log(slope) - np.log(law.stiffness),
        touch=-intercept / slope,
        settling=_GUESS_TRAVEL * float(travel[-1] - travel[0]),
        log_settling_force=np.log(_GUESS * largest),
        offset=zero,
    )


def standard_errors(jacobian: Floats, residual: Floats) -> Floats:
    """Return the standard errors (parameters,) of fitted parameters, in the units of the parameters.

    `residual` (points,) are the residuals of the fit, and `jacobian` (points, parameters) holds their derivatives with
    respect to the parameters. The errors are White's heteroscedasticity-consistent errors (Econometrica 48 (1980) 817,
    doi:10.2307/1912934). The errors are increased if neighbouring residuals are correlated.
    """
    points, parameters = jacobian.shape
    changes = np.linalg.pinv(jacobian) * residual  # change of each parameter caused by the residual of each point
    variance = (changes**2).sum(axis=1)
    # Each fitted parameter makes the residuals smaller than the noise, as if there were one point less.
    variance *= points / max(1, points - parameters)
    total = float(residual @ residual)
    correlation = float(residual[1:] @ residual[:-1]) / total if total > 0.0 else 0.0
    # A correlation reduces the number of independent residuals. The factor (1 + r) / (1 - r) holds for a first-order
    # autoregressive process with the correlation r.
    if correlation > _SIGNIFICANT / math.sqrt(points):
        limited_correlation = min(correlation, _LARGEST_CORRELATION)  # so that the factor remains finite
        variance *= (1.0 + limited_correlation) / (1.0 - limited_correlation)
    return np.asarray(np.sqrt(variance))


def mean_last_force(force: Floats) -> float:
    """Return the mean force [N] over the last points of a loading curve: a fiftieth of them, but at least three."""
    count = max(3, len(force) // 50)
    return float(force[-count:].mean())


def _load_cell_force(law: ForceLaw, parameters: CurveParameters, travel: Floats, largest: float) -> Floats:
    """Return the force of the load cell [N] at travels [mm], for forces up to about `largest` [N].

    The travel is an explicit function of the force F, x = x0 + D(F) - s exp(-F / F_s). So the travel is tabulated at
    many forces, and the table is inverted by interpolation.
    """
    force = _TABLE_END * largest * _TABLE_FORCES
    unsettled = parameters.settling * np.exp(-force / np.exp(parameters.log_settling_force))
    position = parameters.touch + law.depth(force, float(np.exp(parameters.log_modulus))) - unsettled
    return np.asarray(np.interp(travel, position, force) + parameters.offset + parameters.drift * travel)
