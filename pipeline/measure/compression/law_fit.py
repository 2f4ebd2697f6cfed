"""A force law fitted to a force-travel curve, zero line and settling of the skin included, with error bars.

The travel to a force F is x = x0 + D(F) - s exp(-F / F_s): the law's depth D from the touch x0 on, less what the skin
has not settled yet. The load cell shows f0 + f1 x besides.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cad.quantity import Estimate
from pipeline.measure.compression.force_law import ForceLaw

Floats = NDArray[np.float64]

_FINE = np.linspace(0.0, 1.0, 600) ** 2  # forces over the largest one at which the law is tabulated
TABULATED = 1e-4
"""Of the factor: more than the straight lines between the tabulated forces take from it."""
_TABLE_END = 1.6  # of the force at the end of the loading
_LEAST_SETTLING = 0.003  # of that force
_MOST_SETTLING = 0.12  # of that force; more would be no settling but the fruit itself
_LARGEST_TRAVEL = 0.12  # of the loading's, that settling may take
_GUESS = 0.03  # of that force, where the settling is looked for first
_GUESS_TRAVEL = 0.01  # of the loading's travel
_STEP = 0.01  # how far a first step goes
_WIDE = 50.0  # times farther for the settling's force
_UPPER = 0.3  # of the force at the end: above, a straight line through F^(1/n) gives a first guess
_CHANCE = 2.0  # standard errors up to which neighbours are alike by chance
_SETTLED = 1e-6  # [mm]: less settling is none


@dataclass(frozen=True, kw_only=True)
class LawFit:
    """What a fit found, with standard errors.

    `factor` is k of the law [N/mm^n], `touch` x0 and `settling` s [mm], `settling_force` F_s and `offset` f0 [N],
    `drift` f1 [N/mm], 0 where it was not fitted. `residual` (points,) [N] is measured less fitted.
    """

    law: ForceLaw
    factor: Estimate
    touch: Estimate
    settling: float
    settling_force: float
    offset: float
    drift: Estimate
    residual: Floats

    @property
    def onset(self) -> float:
        """Return the travel from which the force rises [mm]."""
        return self.touch.value - self.settling

    def force(self, travel: Floats, largest: float) -> Floats:
        """Return the force that the load cell shows [N] at travels [mm], up to a largest one."""
        parameters = (
            np.log(self.factor.value),
            self.touch.value,
            self.settling,
            np.log(self.settling_force),
            self.offset,
            self.drift.value,
        )
        return _force(self.law, np.array(parameters), travel, largest)


def fit_law(law: ForceLaw, travel: Floats, force: Floats, zero: float, *, with_drift: bool) -> LawFit | None:
    """Return the least-squares fit to travel [mm] and force [N], shape (points,); None where it has no minimum.

    `zero` [N] is where the load cell begins. The errors are White's for residuals of unequal size (Econometrica 48
    (1980) 817, doi:10.2307/1912934), wider where neighbouring residuals are alike.
    """
    largest = last_force(force) - zero
    upper = force - zero > _UPPER * largest
    if largest <= 0.0 or upper.sum() < 3:  # noqa: PLR2004 - a line and one point more
        return None
    slope, level = np.polyfit(travel[upper], (force[upper] - zero) ** (1.0 / law.exponent), 1)
    if slope <= 0.0:
        return None
    reach = float(travel[-1] - travel[0])
    # ln k, x0, s, ln F_s, f0, f1
    start = np.array(
        [law.exponent * np.log(slope), -level / slope, _GUESS_TRAVEL * reach, np.log(_GUESS * largest), zero, 0.0]
    )
    scale = _STEP * np.array([1.0, reach, reach, _WIDE, largest, largest / reach])
    lower = np.array([-np.inf, -np.inf, 0.0, np.log(_LEAST_SETTLING * largest), -np.inf, -np.inf])
    higher = np.array([np.inf, np.inf, _LARGEST_TRAVEL * reach, np.log(_MOST_SETTLING * largest), np.inf, np.inf])
    count = 6 if with_drift else 5

    def misfit(parameters: Floats) -> Floats:
        return _force(law, parameters, travel, largest) - force

    solution = least_squares(
        misfit,
        start[:count],
        bounds=(lower[:count], higher[:count]),
        x_scale=scale[:count],
    )
    return _fit_of(law, solution.x, np.asarray(solution.jac), -solution.fun) if solution.success else None


def last_force(force: Floats) -> float:
    """Return the mean force at the end of a loading (points,) [N]."""
    return float(force[-max(3, len(force) // 50) :].mean())


def _force(law: ForceLaw, parameters: Floats, travel: Floats, largest: float) -> Floats:
    """Return the force [N] at travels [mm] for (ln k, x0, s, ln F_s, f0, f1); f1 may be left out."""
    log_factor, touch, settling, log_settling_force, offset = parameters[:5]
    drift = parameters[5:].sum()
    force = _TABLE_END * largest * _FINE
    unsettled = settling * np.exp(-force / np.exp(log_settling_force))
    position = touch + law.depth(force, float(np.exp(log_factor))) - unsettled
    return np.asarray(np.interp(travel, position, force) + offset + drift * travel)


def _fit_of(law: ForceLaw, parameters: Floats, jacobian: Floats, residual: Floats) -> LawFit:
    error = np.zeros(6)
    fitted = [index for index in range(len(parameters)) if parameters[2] > _SETTLED or index not in (2, 3)]
    error[fitted] = _standard_errors(jacobian[:, fitted], residual)
    factor = float(np.exp(parameters[0]))
    return LawFit(
        law=law,
        factor=Estimate(factor, factor * float(error[0]), f"N/mm^{law.exponent:g}"),
        touch=Estimate(float(parameters[1]), float(error[1]), "mm"),
        settling=float(parameters[2]),
        settling_force=float(np.exp(parameters[3])),
        offset=float(parameters[4]),
        drift=Estimate(float(parameters[5:].sum()), float(error[5]), "N/mm"),
        residual=residual,
    )


def _standard_errors(jacobian: Floats, residual: Floats) -> Floats:
    """Return the standard errors of the numbers whose derivatives are the columns of a table, shape (numbers,)."""
    size = np.abs(jacobian).max(axis=0)
    size[size == 0.0] = 1.0
    table = jacobian / size
    inverse = np.linalg.pinv(table.T @ table)
    weighted = (table * residual[:, None] ** 2).T @ table
    freedom = len(residual) / max(1, len(residual) - len(size))
    total = float(residual @ residual)
    alike = float(residual[1:] @ residual[:-1]) / total if total > 0.0 else 0.0
    alike = min(alike, 0.95) if alike > _CHANCE / np.sqrt(len(residual)) else 0.0
    variance = np.diag(inverse @ weighted @ inverse) * freedom * (1.0 + alike) / (1.0 - alike)
    return np.asarray(np.sqrt(variance) / size)
