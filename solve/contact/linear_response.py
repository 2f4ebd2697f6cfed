"""What the sensor reads where flat level faces touch whole or not at all: exact from one compliance.

Travel x of a tip is the give of its spring plus the indentation of the fruit: x = C F + S F / E, with C the
compliance of the springs and S that of the fruit times E. Linear, so every E and x comes from the same S.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from cad.quantity import validation_error
from solve.arrays import Floats
from solve.error_estimate import SolveInfo


@dataclass(frozen=True)
class TipKinds:
    """The indices of the tips on soft springs and of those on stiff springs; the pair has one of each."""

    soft: tuple[int, ...] = (0,)
    stiff: tuple[int, ...] = (-1,)


PAIR = TipKinds()


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorResponse:
    """Tip forces F [N], shape (moduli, travels, tips), over the moduli E [MPa] and the travels x [mm] of the housing.

    The force ratio P and the ratio of the force slopes over the travel [1], both of stiff tips over soft ones, have
    shape (moduli, travels) and are nan where a tip is off the fruit. So do the relative errors [1]: `F_error` of the
    forces of the tips that touch (nan where none does), `P_error` of P. `cells` counts the contact cells, 0 where the
    law is linear. `P_step` [1], (moduli, travels), is by how much P lies above that on a coarser grid of cells, as a
    share of P; 0 where the law is linear.
    """

    E: Floats
    x: Floats
    F: Floats
    P: Floats
    slope_ratio: Floats
    F_error: Floats
    P_error: Floats
    P_step: Floats
    cells: int
    info: SolveInfo


def spring_compliance(*stiffnesses: float) -> Floats:
    """Return the compliance of springs that do not disturb each other, shape (n, n) [mm/N from N/mm]."""
    return np.diag([1.0 / K for K in stiffnesses])


def travels(travel_mm: float, count: int) -> Floats:
    """Return `count` equal steps of travel that end at travel_mm [mm], shape (count,); 0 is left out."""
    if count < 1:
        raise validation_error("count", count, "", "at least 1", "ask for at least one travel")
    return travel_mm * np.arange(1, count + 1) / count


def stiff_over_soft(values: Floats, F: Floats, kinds: TipKinds = PAIR) -> Floats:
    """Return the mean of values over the stiff tips over that over the soft tips [1], shape (...).

    `values` and the forces F have shape (..., tips); nan where any tip is off the fruit.
    """
    touching = (F > 0.0).all(axis=-1)
    stiff, soft = (values[..., list(tips)].mean(axis=-1) for tips in (kinds.stiff, kinds.soft))
    ratio: Floats = np.divide(stiff, soft, out=np.full(touching.shape, np.nan), where=touching)
    return ratio


def response_of_forces(
    E: Floats, x: Floats, F: Floats, rates: Floats, kinds: TipKinds, info: SolveInfo
) -> SensorResponse:
    """Return the response of forces F [N] and their slopes over the travel [N/mm], both (moduli, travels, tips).

    The errors are 0 where there is a number, to be added to. `info.dofs` is the number of contact cells.
    """
    P = stiff_over_soft(F, F, kinds)
    return SensorResponse(
        E=E,
        x=x,
        F=F,
        P=P,
        slope_ratio=stiff_over_soft(rates, F, kinds),
        F_error=np.where((F > 0.0).any(axis=2), 0.0, np.nan),
        P_error=np.where(np.isfinite(P), 0.0, np.nan),
        P_step=np.zeros_like(P),
        cells=info.dofs,
        info=info,
    )


def linear_response(
    S: Floats,
    C: Floats,
    E: Sequence[float] | Floats,
    x: Sequence[float] | Floats,
    ahead: Sequence[float] | float = 0.0,
    kinds: TipKinds = PAIR,
) -> SensorResponse:
    """Return the response of flat tips that touch with their whole face or not at all, known but for the error of S.

    S [1/mm] and C [mm/N] have shape (tips, tips); `ahead` is what a tilt adds to the travel of each tip [mm].
    """
    start = time.perf_counter()
    moduli, x = np.asarray(E, dtype=np.float64), np.asarray(x, dtype=np.float64)
    reach = x[:, None] + np.broadcast_to(np.asarray(ahead, dtype=np.float64), (len(S),))
    solved = [_touching_forces(np.asarray(C) + np.asarray(S) / modulus, reach) for modulus in moduli]
    shape = (len(moduli), len(x), len(S))
    F, rates = (np.array([one[place] for one in solved], dtype=np.float64).reshape(shape) for place in (0, 1))
    status = "flat level faces: exact from the compliance for every modulus and travel"
    info = SolveInfo(method="linear", dofs=0, seconds=time.perf_counter() - start, status=status)
    return response_of_forces(moduli, x, F, rates, kinds, info)


def _touching_forces(compliance: Floats, reach: Floats) -> tuple[Floats, Floats]:
    """Return the forces [N] and their slopes over the travel [N/mm], both (travels, tips).

    Force and gap are never negative, and one of them is 0: compliance F >= reach, F >= 0. Where all tips touch the
    force is a linear solve; elsewhere non-negative least squares on the Cholesky factor finds the tips that do.
    """
    F = reach @ np.linalg.inv(compliance).T
    touching = F > 0.0
    partly = ~touching.all(axis=1)
    lower = cholesky(compliance, lower=True)
    for row in np.flatnonzero(partly):
        touching[row] = nnls(lower.T, solve_triangular(lower, reach[row], lower=True))[0] > 0.0
    rates = np.zeros_like(F)
    for tips in np.unique(touching, axis=0):
        rows = (touching == tips).all(axis=1)
        stiffness = np.linalg.inv(compliance[np.ix_(tips, tips)])
        F[rows] = 0.0
        F[np.ix_(rows, tips)] = np.maximum(reach[np.ix_(rows, tips)] @ stiffness.T, 0.0)
        rates[np.ix_(rows, tips)] = stiffness.sum(axis=1)
    return F, rates
