"""Forces of level tips as functions of time, on flesh that relaxes.

The forces are exact for flat faces and for growing contacts. Let n(t) be the forces that elastic flesh would exert at
the indentation of the tips at time t. On viscoelastic flesh, the forces are

    F(t) = n(t) - sum_i g_i m_i(t),    tau_i dm_i/dt = n - m_i,

with the history variables m_i. See E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438, doi:10.1115/1.3644020. The
indentation of each tip is the travel minus the deflection of its spring,

    x_i - gap_i - (C F)_i = h (n_i / E)^(2/3) + (S n)_i / E,

where the right side is the law of `sensor/theory/contrast_law.py`. Within a time step, n is assumed to be linear in
time, and the m_i are integrated exactly. The remaining error is proportional to the square of the step. Richardson
extrapolation from two step sizes removes it.
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Flags, Floats
from sensor.theory.contrast_law import ContrastLaw
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation
from solve.solve_error import SolveError

MOST_STEPS = 60  # maximum number of Newton steps
# Initial guess for a force, as a fraction of 1 / (1 / F_dome + 1 / F_spring). F_dome is the force if only the contact
# deflected, and F_spring the force if only the springs did. The fraction is so small that the guess is below the
# solution.
INITIAL_GUESS = 0.25
RESIDUAL_LIMIT = 1e-12  # residual at convergence divided by the largest travel
LARGEST_DECREASE = 1e-3  # relative decrease of a force up to which the contact is treated as growing


@dataclass(frozen=True, kw_only=True, eq=False)
class TimedForces:
    """Forces F [N] and the error bound `error` [N] due to the time steps, both (presses, times, tips)."""

    F: Floats
    error: Floats


def timed_forces(law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, travel: Floats) -> TimedForces:
    """Return the forces of presses on flesh whose instantaneous moduli are E (presses,) [MPa].

    `law` holds the gaps and compliances of the sensor, and `relaxation` is the Prony series of the flesh. `times` [s]
    and `travel` [mm] have shape (presses, times), and the first time is the first touch. The travel is linear between
    the times. The forces are solved with these time steps and with half of them, and extrapolated to steps of 0. The
    error is the size of this extrapolation. Raises SolveError if no equilibrium between springs and flesh is found, or
    if the contact of a dome shrinks.
    """
    coarse_forces = _forces_of_growing_contacts(law, relaxation, E, times, travel)
    fine_times = _with_midpoints(times)
    fine_forces = _forces_of_growing_contacts(law, relaxation, E, fine_times, _with_midpoints(travel))
    fine_forces = fine_forces[:, ::2]  # without the midpoints
    # Richardson extrapolation: half the step leaves a quarter of the error, which is a third of the difference.
    correction = (fine_forces - coarse_forces) / 3.0
    return TimedForces(F=fine_forces + correction, error=np.abs(correction))


def elastic_forces(law: ContrastLaw, E: Floats, travel: Floats, travel_reduction: Floats | float = 0.0) -> Floats:
    """Return the forces F (presses, tips) [N] on elastic flesh, at moduli E [MPa] and travels [mm], both (presses,).

    `law` holds the gaps [mm], the compliances C and S, and Hertz's constant h. For every tip in contact,

        x_i - gap_i = h (F_i / E)^(2/3) + ((C + S / E) F)_i.

    A tip out of contact has no force. `travel_reduction` (presses, tips) [mm] is subtracted from the travel of each
    tip. Raises SolveError if Newton's method does not converge.
    """
    # Arrays are (presses, tips) or, for compliances, (presses, tips, tips).
    modulus = E[:, None]
    _, C, S = law.arrays
    compliance = C + S / modulus[..., None]
    hertz = law.hertz * modulus ** (-2.0 / 3.0)
    overlap = travel[:, None] - np.array(law.gaps) - travel_reduction  # overlap of the undeformed tips with the fruit
    is_touching = overlap > 0.0
    tolerance = RESIDUAL_LIMIT * np.abs(travel).max()

    # The deflection is a concave function of the force, so Newton's method converges monotonically from below.
    F = _guess_forces(overlap, hertz, compliance)
    identity = np.eye(len(law.gaps))
    for _ in range(MOST_STEPS):
        cube_root = np.cbrt(F)
        deflection = hertz * cube_root**2 + np.einsum("pij,pj->pi", compliance, F)
        residual = np.where(is_touching, overlap - deflection, 0.0)
        if np.abs(residual).max() <= tolerance:
            return F
        tangent = compliance + _hertz_slope(hertz, cube_root, is_touching)[..., None] * identity
        tangent = np.where(is_touching[..., None], tangent, identity)  # a tip out of contact keeps a force of 0
        F = F + np.linalg.solve(tangent, residual[..., None])[..., 0]
        is_touching = is_touching & (F > 0.0)  # a contact cannot pull, so a tip with a negative force is released
        F = np.where(is_touching, F, 0.0)
    largest_residual = np.abs(residual).max()
    msg = f"tips over time: residual {largest_residual:.1e} mm must be at most {tolerance:.0e} mm. Press less deeply."
    raise SolveError(msg)


def _hertz_slope(hertz: Floats, cube_root: Floats, is_touching: Flags) -> Floats:
    """Return the derivative of the flattening `hertz` F^(2/3) with respect to the force F [mm/N], (presses, tips).

    `cube_root` (presses, tips) [N^(1/3)] is F^(1/3). The derivative is 0 for tips out of contact, and for flat tips,
    which have `hertz` (presses, 1) [mm/N^(2/3)] equal to 0.
    """
    divisor = np.where(is_touching, 1.5 * cube_root, 1.0)  # avoids division by zero
    return np.where(is_touching & (hertz > 0.0), hertz / divisor, 0.0)


def _guess_forces(overlap: Floats, hertz: Floats, compliance: Floats) -> Floats:
    """Return initial forces (presses, tips) [N] below the solution, and 0 for tips without overlap.

    Each tip is treated separately. The guess is `INITIAL_GUESS` / (1 / F1 + 1 / F2). The force F1 would close the
    overlap by flattening only, and F2 by the compliance of springs and fruit only. `overlap` (presses, tips) [mm] is
    the overlap of the undeformed tips with the fruit. A force F flattens the contact by `hertz` F^(2/3), with `hertz`
    (presses, 1) [mm/N^(2/3)]. `compliance` (presses, tips, tips) [mm/N] is the compliance of springs and fruit.
    """
    is_touching = overlap > 0.0
    positive_overlap = np.where(is_touching, overlap, 1.0)  # avoids division by zero
    own_compliance = np.einsum("pii->pi", compliance)
    inverse_force = (hertz / positive_overlap) ** 1.5 + own_compliance / positive_overlap
    return np.where(is_touching, INITIAL_GUESS / inverse_force, 0.0)


def forces_over_time(
    law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, tip_travel: Floats
) -> tuple[Floats, Floats]:
    """Return the forces F [N] on flesh that relaxes, and the elastic forces n [N], both (presses, times, tips).

    `law` holds the gaps [mm] and compliances of the sensor, and `relaxation` is the Prony series of the flesh. E
    (presses,) [MPa] holds the instantaneous moduli. `times` (presses, times) [s] begin at the first touch. `tip_travel`
    (presses, times, tips) [mm] is the travel of each tip since its own first touch. The result is valid only if
    contacts grow, which the caller must check. Raises SolveError if no equilibrium is found.
    """
    F = np.zeros_like(tip_travel)  # at the first touch, all forces are 0
    elastic = np.zeros_like(tip_travel)
    memory = Memory(relaxation)
    for k in range(1, times.shape[1]):
        # At the end of a step, F = modulus_factor * n - relaxed_force, where `relaxed_force` is known from the previous
        # steps. The first term is the force of elastic flesh whose modulus is E times the same factor.
        modulus_factor, relaxed_force = memory.step(times[:, k] - times[:, k - 1])
        first_term = _unrelaxed_forces(law, E * modulus_factor[:, 0], tip_travel[:, k], relaxed_force)
        elastic[:, k] = first_term / modulus_factor
        memory.keep(elastic[:, k])
        F[:, k] = first_term - np.where(first_term > 0.0, relaxed_force, 0.0)
    return F, elastic


def _unrelaxed_forces(law: ContrastLaw, modulus: Floats, tip_travel: Floats, relaxed_force: Floats) -> Floats:
    """Return the forces on flesh at the end of a time step, before `relaxed_force` is subtracted [N], (presses, tips).

    The result is the force on elastic flesh with the `modulus` (presses,) [MPa], under a travel that is increased by C
    times `relaxed_force`. The true forces are smaller by `relaxed_force`, and therefore deflect the springs less.
    `tip_travel` (presses, tips) [mm] is the travel of each tip since its own first touch. `relaxed_force` [N] is
    (presses, tips) or (presses, 1).
    """
    largest_travel = tip_travel.max(axis=-1)
    # `elastic_forces` expects one travel per press, from which it subtracts the gaps and `travel_reduction`.
    travel_reduction = largest_travel[:, None] - np.array(law.gaps) - tip_travel
    _, C, _ = law.arrays
    spring_recovery = np.broadcast_to(relaxed_force, travel_reduction.shape) @ C.T
    return elastic_forces(law, modulus, largest_travel, travel_reduction - spring_recovery)


def _forces_of_growing_contacts(
    law: ContrastLaw, relaxation: Relaxation, E: Floats, times: Floats, travel: Floats
) -> Floats:
    """Return the forces (presses, times, tips) [N] at times [s] and travels [mm], both (presses, times).

    The arguments are described in `timed_forces`. Raises SolveError if no equilibrium is found. Also raises SolveError
    if the contact of a dome shrinks, because the law is valid only for growing contacts. The contact of a flat tip is
    its whole face, which cannot shrink.
    """
    F, elastic = forces_over_time(law, relaxation, E, times, travel[..., None] - np.array(law.gaps))
    # The contact of a dome grows and shrinks with its elastic force.
    if law.hertz > 0.0 and (elastic[:, 1:] < (1.0 - LARGEST_DECREASE) * elastic[:, :-1]).any():
        msg = "domes over time: a contact shrinks, but only growing contacts can be solved. Hold for less time."
        raise SolveError(msg)
    return F


def _with_midpoints(values: Floats) -> Floats:
    """Return the values (presses, n) with the midpoint between each two neighbours inserted, (presses, 2 n - 1)."""
    refined = np.empty((len(values), 2 * values.shape[1] - 1))
    refined[:, ::2] = values
    refined[:, 1::2] = 0.5 * (values[:, 1:] + values[:, :-1])
    return refined
