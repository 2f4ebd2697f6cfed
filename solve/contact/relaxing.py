"""Forces of level tips over time on springs and flesh that relaxes: exact for flat faces and growing contacts.

Let n(t) be the forces with which elastic flesh would resist the indentation of the tips at time t. The forces of flesh
that relaxes are F(t) = n(t) - sum g_i m_i(t), tau_i dm_i/dt = n - m_i. See E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27
(1960) 438, doi:10.1115/1.3644020. The indentation of each tip is the travel less the deflection of its spring,

    x_i - gap_i - (C F)_i = h (n_i / E)^(2/3) + (S n)_i / E,

the law of `sensor/theory/contrast_law.py`. Within a step, n is taken as linear in time, and the memory m is integrated
exactly. The remaining error is proportional to the square of the step and is extrapolated from two steps (Richardson).
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.theory.contrast_law import ContrastLaw
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation
from solve.solve_error import SolveError

MOST_STEPS = 60  # most steps of Newton's method
BELOW = 0.25  # starting force, below the root, over 1 / (1 / F_dome + 1 / F_spring) with each taken separately
RESIDUAL_LIMIT = 1e-12  # residual at convergence over the largest travel
SHRINKS = 1e-3  # relative decrease of a force up to which a contact is treated as growing


@dataclass(frozen=True, kw_only=True, eq=False)
class TimedForces:
    """Forces F [N], shape (presses, times, tips), and the bound `error` [N] of their error due to the steps in time."""

    F: Floats
    error: Floats


def timed_forces(law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, travel: Floats) -> TimedForces:
    """Return the forces of presses on flesh of moduli E (presses,) [MPa] at the first instant.

    `times` [s] and `travel` [mm], (presses, times), begin before the first step; the travel is linear between them.
    Raises SolveError if no equilibrium of springs and flesh is found, or if a dome's contact shrinks.
    """
    coarse = _growing(law, relaxation, E, times, travel)
    fine = _growing(law, relaxation, E, _halved(times), _halved(travel))[:, ::2]
    step = (fine - coarse) / 3.0
    return TimedForces(F=fine + step, error=np.abs(step))


def elastic_forces(law: ContrastLaw, E: Floats, travel: Floats, held_back: Floats | float = 0.0) -> Floats:
    """Return the forces F [N] of elastic flesh, (presses, tips), at moduli [MPa] and travels [mm], both (presses,).

    They solve x_i - gap_i = h (F_i / E)^(2/3) + ((C + S / E) F)_i for tips with F_i > 0; other tips have no force.
    `held_back` (presses, tips) [mm] is subtracted from the travel of each tip. Raises SolveError if Newton's method
    does not converge.
    """
    modulus = E[:, None]
    compliance = np.array(law.C) + np.array(law.S) / modulus[..., None]
    hertz = law.hertz * modulus ** (-2.0 / 3.0)
    entered = travel[:, None] - np.array(law.gaps) - held_back  # overlap of the undeformed tips with the fruit
    is_on = entered > 0.0
    allowed = RESIDUAL_LIMIT * np.abs(travel).max()

    # The depth is concave over the force, so Newton's method converges monotonically from below the root.
    depth = np.where(is_on, entered, 1.0)
    own = np.einsum("pii->pi", compliance)
    F = np.where(is_on, BELOW / ((hertz / depth) ** 1.5 + own / depth), 0.0)
    identity = np.eye(len(law.gaps))
    for _ in range(MOST_STEPS):
        root = np.cbrt(F)
        sunk = hertz * root**2 + np.einsum("pij,pj->pi", compliance, F)
        residual = np.where(is_on, entered - sunk, 0.0)
        if np.abs(residual).max() <= allowed:
            return F
        hertz_slope = np.where(is_on & (hertz > 0.0), hertz / np.where(is_on, 1.5 * root, 1.0), 0.0)
        tangent = compliance + hertz_slope[..., None] * identity
        tangent = np.where(is_on[..., None], tangent, identity)  # a tip out of contact takes no step
        F = F + np.linalg.solve(tangent, residual[..., None])[..., 0]
        is_on = is_on & (F > 0.0)
        F = np.where(is_on, F, 0.0)
    msg = f"tips over time: residual {np.abs(residual).max():.1e} mm must be at most {allowed:.0e} mm; press less deep"
    raise SolveError(msg)


def forces_on_way(
    law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, lowered: Floats
) -> tuple[Floats, Floats]:
    """Return forces [N] on flesh of moduli E (presses,) [MPa] and the elastic forces there, (presses, times, tips).

    `times` (presses, times) [s] begin before the first step. `lowered` (presses, times, tips) [mm] is the travel of
    each tip since its own touch. Contacts must grow, which the caller checks. Raises SolveError.
    """
    C = np.array(law.C)
    F, elastic = np.zeros_like(lowered), np.zeros_like(lowered)
    memory = Memory(relaxation)
    # At the end of a step, F = `fresh` n - `lost`, with n the elastic force then, and `lost` known from the past. So n
    # follows from an elastic press on flesh of modulus E `fresh`, with springs relieved by the force `lost`.
    for k in range(1, times.shape[1]):
        fresh, lost = memory.step(times[:, k] - times[:, k - 1])
        farthest = lowered[:, k].max(axis=-1)
        held_back = farthest[:, None] - np.array(law.gaps) - lowered[:, k]
        relieved = np.broadcast_to(lost, held_back.shape) @ C.T
        answer = elastic_forces(law, E * fresh[:, 0], farthest, held_back - relieved)
        elastic[:, k] = answer / fresh
        memory.keep(elastic[:, k])
        F[:, k] = answer - np.where(answer > 0.0, lost, 0.0)
    return F, elastic


def _growing(law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, travel: Floats) -> Floats:
    """Return the forces [N], (presses, times, tips), at times and travels (presses, times); contacts must grow."""
    F, elastic = forces_on_way(law, relaxation, E, times, travel[..., None] - np.array(law.gaps))
    if law.hertz > 0.0 and (elastic[:, 1:] < (1.0 - SHRINKS) * elastic[:, :-1]).any():
        msg = "domes over time: a contact shrinks, and only growing ones are solved; hold for less time"
        raise SolveError(msg)
    return F


def _halved(nodes: Floats) -> Floats:
    """Return nodes (presses, n) with an additional node in the middle of each step, (presses, 2 n - 1)."""
    halved = np.empty((len(nodes), 2 * nodes.shape[1] - 1))
    halved[:, ::2] = nodes
    halved[:, 1::2] = 0.5 * (nodes[:, 1:] + nodes[:, :-1])
    return halved
