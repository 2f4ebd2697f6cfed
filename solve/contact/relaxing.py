"""Forces of level tips over time, on springs and on flesh that relaxes: flat faces exactly, domes while they grow.

Let n(t) be the forces of elastic flesh at the indentation that the tips have reached at t. Those of flesh that relaxes
are F(t) = n(t) - sum g_i m_i(t), tau_i dm_i/dt = n - m_i. See E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438,
doi:10.1115/1.3644020. How far each tip has gone in is what its spring leaves of the travel,

    x_i - gap_i - (C F)_i = h (n_i / E)^(2/3) + (S n)_i / E,

the law of `sensor/theory/contrast_law.py`. Within a step n is taken to run straight, and the memory m is integrated
exactly. What that leaves out is proportional to the square of the step and is extrapolated from two (Richardson).
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.theory.contrast_law import ContrastLaw
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation
from solve.linear import SolveError

MOST_STEPS = 60
BELOW = 0.25  # of the harmonic mean of the forces of dome and springs alone: less than the force of both
RESIDUAL_LIMIT = 1e-12  # of the largest travel
SHRINKS = 1e-3  # of a force: by less a contact may shrink, whose memory is then that of one that grows


@dataclass(frozen=True, kw_only=True, eq=False)
class TimedForces:
    """Forces F [N], shape (presses, times, tips), and how far each may be off by the steps in time, `error` [N]."""

    F: Floats
    error: Floats


def timed_forces(law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, travel: Floats) -> TimedForces:
    """Return the forces of presses on flesh of moduli E (presses,) [MPa] at the first instant.

    `times` [s] and `travel` [mm], (presses, times), begin before the first step; the travel runs straight between.
    Raises SolveError where springs and flesh find no equilibrium, or where a dome's contact shrinks.
    """
    coarse = _stepped(law, relaxation, E, times, travel)
    fine = _stepped(law, relaxation, E, _halved(times), _halved(travel))[:, ::2]
    step = (fine - coarse) / 3.0
    return TimedForces(F=fine + step, error=np.abs(step))


def elastic_forces(law: ContrastLaw, E: Floats, travel: Floats, held_back: Floats | float = 0.0) -> Floats:
    """Return the forces F [N] of elastic flesh, (presses, tips), at moduli [MPa] and travels [mm], both (presses,).

    They solve x_i - gap_i = h (F_i / E)^(2/3) + ((C + S / E) F)_i where that makes F_i > 0. `held_back` (presses, tips)
    [mm] is taken from the travel of each tip; one that is off has no force. Raises SolveError where Newton's method
    finds none.
    """
    modulus = E[:, None]
    compliance = np.array(law.C) + np.array(law.S) / modulus[..., None]
    hertz = law.hertz * modulus ** (-2.0 / 3.0)
    entered = travel[:, None] - np.array(law.gaps) - held_back  # of the undeformed tips
    is_on = entered > 0.0
    allowed = RESIDUAL_LIMIT * np.abs(travel).max()

    # The depth is concave over the force: from below the root Newton's method runs up to it.
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
        tangent = np.where(is_on[..., None], tangent, identity)  # a tip that is off takes no step
        F = F + np.linalg.solve(tangent, residual[..., None])[..., 0]
        is_on = is_on & (F > 0.0)
        F = np.where(is_on, F, 0.0)
    msg = f"tips over time: residual {np.abs(residual).max():.1e} mm must be at most {allowed:.0e} mm; press less deep"
    raise SolveError(msg)


def _stepped(law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, travel: Floats) -> Floats:
    """Return the forces [N] at times (presses, times), one step from each to the next, (presses, times, tips).

    At the end of a step the force is `fresh` times the elastic force n then, less `lost`, which the past has decided.
    So n follows from an elastic press on flesh of modulus E `fresh`, whose springs `lost` has relieved.
    """
    C = np.array(law.C)
    F = np.zeros((*times.shape, len(law.gaps)))
    elastic = F[:, 0]
    memory = Memory(relaxation)
    for k in range(1, times.shape[1]):
        fresh, lost = memory.step(times[:, k] - times[:, k - 1])
        answer = elastic_forces(law, E * fresh[:, 0], travel[:, k], np.broadcast_to(-lost, elastic.shape) @ C.T)
        if law.hertz > 0.0 and (answer < (1.0 - SHRINKS) * fresh * elastic).any():
            msg = "domes over time: a contact shrinks, and only growing ones are solved; hold for less time"
            raise SolveError(msg)
        elastic = answer / fresh
        memory.keep(elastic)
        F[:, k] = answer - np.where(answer > 0.0, lost, 0.0)
    return F


def _halved(nodes: Floats) -> Floats:
    """Return nodes (presses, n) with one more in the middle of each step, (presses, 2 n - 1)."""
    halved = np.empty((len(nodes), 2 * nodes.shape[1] - 1))
    halved[:, ::2] = nodes
    halved[:, 1::2] = 0.5 * (nodes[:, 1:] + nodes[:, :-1])
    return halved
