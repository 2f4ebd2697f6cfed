"""A half body under a rigid plate, pressed step by step: the force at each travel of the plate.

Contact is a penalty on how far nodes of the surface lie above the plate; equilibrium is the least energy of both,
found by Newton's method with a line search. The plate is slippery, or grips what it has touched.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, diags_array

from solve.arrays import Flags, Floats
from solve.compression.body import Deformed, HalfBody
from solve.linear import SolveError, factorised

_PENALTY = 1e5  # pressure over penetration [E / half height]: 2e-4 of the least travel
_RESIDUAL_LIMIT = 1e-8  # of the force on the plate
_MOST_ITERATIONS = 60
_HALVINGS = 14
_SUFFICIENT = 1e-4  # fraction of the slope that a step must win, L. Armijo, Pacific J. Math. 16, 1966
_STARTS = (1, 2, 3)  # last equilibria through which a start is extrapolated


@dataclass(frozen=True, kw_only=True, eq=False)
class _State:
    """A body under a plate: the `height` of nodes of the surface over it [mm] (surface,), and the energy of both."""

    body: Deformed
    height: Floats
    energy: float

    @property
    def touches(self) -> Flags:
        """Return which nodes of the surface meet the plate (surface,)."""
        return self.height >= 0.0


def pressed(body: HalfBody, travels: Sequence[float], *, grips: bool = False) -> Floats:
    """Return the force [N at E = 1 MPa] at rising travels of the plate after the first touch [mm], shape (travels,).

    Raises SolveError where no equilibrium is found.
    """
    held = body.held.copy()
    if grips:
        at_rest = _state(body, np.zeros((body.count, 2)), 0.0)
        held[2 * body.surface[at_rest.touches]] = True
    solutions = [np.zeros((body.count, 2))]
    reached = [0.0]
    forces = []
    for travel in travels:
        states = []
        for count in _STARTS:
            start = _extrapolated(solutions[-count:], reached[-count:], travel)
            start = np.where(held.reshape(-1, 2), solutions[-1], start)  # what is gripped stays where it is
            states.append(_state(body, start, travel))
        state = min(states, key=lambda candidate: candidate.energy)
        state, force = _equilibrium(body, state, travel, held)
        forces.append(force)
        solutions.append(state.body.u)
        reached.append(travel)
        if grips:
            held[2 * body.surface[state.touches]] = True
    return np.array(forces)


def _equilibrium(body: HalfBody, state: _State, travel: float, held: Flags) -> tuple[_State, float]:
    """Return the state of least energy from a start whose held dofs stay, and the force on the plate [N]."""
    stiffness = _penalty(body) * body.area
    fixed = np.flatnonzero(held)
    upright = 2 * body.surface + 1
    round_off = float(np.finfo(np.float64).eps) * body.volume
    for _ in range(_MOST_ITERATIONS):
        push = stiffness * np.maximum(state.height, 0.0)
        contact = np.zeros(2 * body.count)
        contact[upright] = stiffness * state.touches
        force = float(push.sum())
        for convex in (False, True):
            forces, matrix = body.tangent(state.body, convex=convex)
            forces[upright] += push
            residual = np.where(held, 0.0, forces)
            # Stresses round off at eps E: one unit of length makes a force of it.
            if np.linalg.norm(residual) <= max(_RESIDUAL_LIMIT * force, round_off):
                return state, force
            step = factorised(csc_matrix(matrix + diags_array(contact)), fixed).solve(-residual)
            further = _line_search(body, state, travel, step, float(residual @ step))
            if further is not None:
                break
        if further is None:
            break
        state = further
    msg = f"compression: no equilibrium at a travel of {travel:.3g} mm; press less deep"
    raise SolveError(msg)


def _state(body: HalfBody, u: Floats, travel: float) -> _State:
    """Return body, contact and energy at displacements (nodes, 2) and a travel [mm]."""
    z = body.x[body.surface, 1]
    height = z + u[body.surface, 1] - (z[0] - travel)
    deformed = body.deformed(u)
    energy = deformed.energy + 0.5 * _penalty(body) * float((body.area * np.maximum(height, 0.0) ** 2).sum())
    return _State(body=deformed, height=height, energy=energy)


def _line_search(body: HalfBody, state: _State, travel: float, step: Floats, slope: float) -> _State | None:
    """Return the state after the longest of the halved steps that lowers the energy; None where none does."""
    round_off = float(np.finfo(np.float64).eps) * body.volume
    for halvings in range(_HALVINGS):
        length = 0.5**halvings
        reached = _state(body, state.body.u + length * step.reshape(-1, 2), travel)
        if reached.energy <= state.energy + _SUFFICIENT * length * slope + round_off:
            return reached
    return None


def _penalty(body: HalfBody) -> float:
    return _PENALTY / float(body.x[body.surface[0], 1])


def _extrapolated(solutions: Sequence[Floats], reached: Sequence[float], travel: float) -> Floats:
    """Return the polynomial in the travel through the last solutions (nodes, 2), at a travel [mm]."""
    weights = np.ones(len(solutions))
    for i, node in enumerate(reached):
        others = [other for j, other in enumerate(reached) if j != i]
        weights[i] = math.prod((travel - other) / (node - other) for other in others)
    return np.asarray(np.einsum("s,snd->nd", weights, np.array(solutions)))
