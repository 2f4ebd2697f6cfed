"""The linear law: forces of level flat faces, each of which touches as a whole or not at all.

The travel of each tip is the deflection of its spring plus the indentation of the fruit,

    x = C F + S F / E.

Here C is the compliance of the springs, and S is the compliance of the fruit times E. The law is exact, and S is the
same for all moduli and travels.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from sensor.arrays import Flags, Floats
from sensor.quantity import validation_error
from sensor.record import Record
from sensor.tips.layouts import SpringGroups
from solve.error_estimate import SolveInfo

PAIR = SpringGroups(low=(0,), high=(-1,))  # two tips: the first is on the soft spring, the last on the stiff one


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SensorResponse(Record):
    """The forces F of the tips [N], shape (moduli, travels, tips), at the moduli E [MPa] and the travels x [mm].

    The travel is measured at the middle of the tips, from the first touch of a level sensor.

    All other arrays except `mean_pressure` have shape (moduli, travels). High springs are the stiff ones, and low
    springs the soft ones. P is the mean force on the tips with high springs divided by the mean force on the tips with
    low springs [1]. `slope_ratio` is the same ratio for the derivatives of the forces with respect to the travel [1]. P
    and `slope_ratio` are nan if any tip is out of contact. `F_error` [1] is the relative error of the nonzero forces,
    nan if there are none. `P_error` [1] is the relative error of P. `P_step` [1] is the relative increase of P from a
    coarser grid of cells. `cells` is the number of contact cells. `cells` and `P_step` are 0 if no cells are needed.
    `mean_pressure` [MPa] is the mean pressure under each dome, with the same shape as F. For other tips, it is None.
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
    mean_pressure: Floats | None = None


class TipForces(NamedTuple):
    """The forces F of the tips [N], and their derivatives with respect to the travel, `rates` [N/mm].

    Both have shape (moduli, travels, tips).
    """

    F: Floats
    rates: Floats


def spring_compliance(*stiffnesses: float) -> Floats:
    """Return the compliance (n, n) [mm/N] of n uncoupled springs, given their stiffnesses [N/mm]."""
    return np.diag([1.0 / K for K in stiffnesses])


def travels(travel_mm: float, count: int) -> Floats:
    """Return `count` travels (count,) [mm] in equal steps up to `travel_mm`.

    The first travel is one step, not 0.
    """
    if count < 1:
        raise validation_error("count", count, "", "at least 1", "give at least one travel")
    return travel_mm * np.arange(1, count + 1) / count


def high_over_low(values: Floats, F: Floats, groups: SpringGroups = PAIR) -> Floats:
    """Return the mean value over the tips on high springs divided by the mean over the tips on low springs [1].

    `values` and the forces F have shape (..., tips), so the ratio has shape (...). It is nan if any tip is out of
    contact.
    """
    is_touching = (F > 0.0).all(axis=-1)
    high = values[..., list(groups.high)].mean(axis=-1)
    low = values[..., list(groups.low)].mean(axis=-1)
    return np.asarray(np.divide(high, low, out=np.full(is_touching.shape, np.nan), where=is_touching))


def response_of_forces(
    E: Floats, x: Floats, forces: TipForces, groups: SpringGroups, info: SolveInfo
) -> SensorResponse:
    """Return the response with the given forces, at moduli E (moduli,) [MPa] and travels x (travels,) [mm].

    `groups` holds the indices of the tips on low and on high springs. `info.dofs` is the number of contact cells. The
    errors of the response are 0, or nan without contact; the caller adds the actual errors.
    """
    F, rates = forces
    P = high_over_low(F, F, groups)
    return SensorResponse(
        E=E,
        x=x,
        F=F,
        P=P,
        slope_ratio=high_over_low(rates, F, groups),
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
    height_offsets: Sequence[float] | float = 0.0,
    groups: SpringGroups = PAIR,
) -> SensorResponse:
    """Return the response of level flat tips, each of which touches with its whole face or not at all.

    S [1/mm] is the compliance of the fruit times E, and C [mm/N] is the compliance of the springs, both (tips, tips). E
    (moduli,) [MPa] holds the moduli, and x (travels,) [mm] the travels. `height_offsets` [mm] are added to the travel
    of each tip. `groups` holds the indices of the tips on low and on high springs. The error of S is the only error of
    the forces; the caller adds it.
    """
    start = time.perf_counter()
    moduli = np.asarray(E, dtype=np.float64)
    x = np.asarray(x, dtype=np.float64)
    # A tip that is retracted from the fruit has a negative height offset, so it travels less; (travels, tips) [mm].
    travel = x[:, None] + np.broadcast_to(np.asarray(height_offsets, dtype=np.float64), (len(S),))
    F = np.zeros((len(moduli), len(x), len(S)))
    rates = np.zeros_like(F)
    for i, modulus in enumerate(moduli):
        F[i], rates[i] = _touching_forces(np.asarray(C) + np.asarray(S) / modulus, travel)
    status = "flat level faces: exact from the compliance for every modulus and travel"
    info = SolveInfo(method="linear", dofs=0, seconds=time.perf_counter() - start, status=status)
    return response_of_forces(moduli, x, TipForces(F, rates), groups, info)


def _touching_forces(compliance: Floats, travel: Floats) -> tuple[Floats, Floats]:
    """Return the forces [N] and their derivatives with respect to the travel [N/mm], both (travels, tips).

    `compliance` (tips, tips) [mm/N] is the compliance of springs and fruit in series. `travel` (travels, tips) [mm] is
    the travel of each tip. The forces of the tips in contact solve compliance F = travel.
    """
    is_touching = _find_contacts(compliance, travel)
    F = np.zeros(is_touching.shape)
    rates = np.zeros(is_touching.shape)
    # All travels at which the same tips touch have the same stiffness matrix, and are solved together. Each row of
    # `np.unique` marks one combination of touching tips.
    for touching_tips in np.unique(is_touching, axis=0):
        rows = (is_touching == touching_tips).all(axis=1)
        entries = np.ix_(rows, touching_tips)
        stiffness = np.linalg.inv(compliance[np.ix_(touching_tips, touching_tips)])
        # A tip at the limit of contact may have a negative force by round-off, which is set to 0.
        F[entries] = np.maximum(travel[entries] @ stiffness.T, 0.0)
        rates[entries] = stiffness.sum(axis=1)  # all tips travel at the same rate
    return F, rates


def _find_contacts(compliance: Floats, travel: Floats) -> Flags:
    """Return whether each tip is in contact at each travel, shape (travels, tips).

    `compliance` (tips, tips) [mm/N] is the compliance of springs and fruit in series. `travel` (travels, tips) [mm] is
    the travel of each tip. Contact is unilateral: F >= 0 and compliance F >= travel, and for each tip one of the two
    holds with equality. If not all tips touch, nonnegative least squares on the Cholesky factor solves for F. A tip
    touches if its force is positive.
    """
    # First assume that all tips touch. The assumption is correct at the travels at which all forces are compressive.
    is_touching = travel @ np.linalg.inv(compliance).T > 0.0
    is_partial = ~is_touching.all(axis=1)  # travels at which only some tips touch
    lower = cholesky(compliance, lower=True)
    if is_partial.any():
        from scipy.optimize import nnls  # rarely needed, and slow to load

        for row in np.flatnonzero(is_partial):
            forces, _ = nnls(lower.T, solve_triangular(lower, travel[row], lower=True))
            is_touching[row] = forces > 0.0
    return is_touching
