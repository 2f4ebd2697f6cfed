"""A half body under a rigid tool, pressed step by step: the force at each travel of the tool.

Contact is a penalty on how far nodes of the surface lie above the tool's face; equilibrium is the least energy of both,
found by Newton's method with a line search. The tool is slippery, or grips what it has touched.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_matrix

from sensor.arrays import Flags, Floats
from solve.compression.body import Deformed, HalfBody
from solve.compression.tool import Tool
from solve.linear import SolveError, factorise

_PENALTY = 1e5  # pressure over penetration [E / half height]: 2e-4 of the least travel
_RESIDUAL_LIMIT = 1e-8  # of the force on the plate
_MOST_ITERATIONS = 60
_HALVINGS = 14
_SUFFICIENT = 1e-4  # fraction of the slope that a step must win, L. Armijo, Pacific J. Math. 16, 1966
_SAME = 1e-9  # of a radius: a node is on the edge of a plunger
_STARTS = (1, 2, 3)  # last equilibria through which a start is extrapolated


@dataclass(frozen=True, kw_only=True, eq=False)
class _ToolState:
    """A body under a tool: which nodes of the surface it `touches`, and the energy of both.

    Each array is (surface,): the `height` of nodes over the tool's face [mm], its `slope` [1], its `growth` [1/mm].
    """

    body: Deformed
    height: Floats
    slope: Floats
    growth: Floats
    touches: Flags
    energy: float


def press_forces(body: HalfBody, travels: Sequence[float], *, tool: Tool | None = None, grips: bool = False) -> Floats:
    """Return the force [N at E = 1 MPa] at rising travels of a tool after the first touch [mm], shape (travels,).

    Without a tool a plate presses. Raises SolveError where no equilibrium is found.
    """
    tool = tool or Tool()
    held = body.held.copy()
    if grips:
        at_rest = _state(body, tool, np.zeros((body.count, 2)), 0.0)
        held[2 * body.surface[at_rest.touches]] = True
        held[2 * body.on_table] = True
    solutions = [np.zeros((body.count, 2))]
    reached = [0.0]
    forces = []
    for travel in travels:
        states = []
        for count in _STARTS:
            start = _extrapolated(solutions[-count:], reached[-count:], travel)
            start = np.where(held.reshape(-1, 2), solutions[-1], start)  # what is gripped stays where it is
            states.append(_state(body, tool, start, travel))
        state = min(states, key=lambda candidate: candidate.energy)
        state, force = _equilibrium(body, tool, state, travel, held)
        forces.append(force)
        solutions.append(state.body.u)
        reached.append(travel)
        if grips:
            held[2 * body.surface[state.touches]] = True
    return np.array(forces)


def _equilibrium(body: HalfBody, tool: Tool, state: _ToolState, travel: float, held: Flags) -> tuple[_ToolState, float]:
    """Return the state of least energy from a start whose held dofs stay, and the force on the tool [N]."""
    stiffness = _penalty(body) * body.area
    fixed = np.flatnonzero(held)
    outward = 2 * body.surface
    upright = outward + 1
    round_off = float(np.finfo(np.float64).eps) * body.volume
    for _ in range(_MOST_ITERATIONS):
        push = stiffness * np.where(state.touches, state.height, 0.0)
        contact = stiffness * state.touches
        force = float(push.sum())
        for convex in (False, True):
            forces, matrix = body.tangent(state.body, convex=convex)
            forces[upright] += push
            forces[outward] -= push * state.slope
            residual = np.where(held, 0.0, forces)
            # Stresses round off at eps E: one unit of length makes a force of it.
            if np.linalg.norm(residual) <= max(_RESIDUAL_LIMIT * force, round_off):
                return state, force
            across = contact * state.slope**2 - (0.0 if convex else push * state.growth)
            coupled = -contact * state.slope
            values = np.concatenate([contact, across, coupled, coupled])
            rows = np.concatenate([upright, outward, upright, outward])
            columns = np.concatenate([upright, outward, outward, upright])
            matrix = matrix + coo_array((values, (rows, columns)), shape=matrix.shape)
            step = factorise(csc_matrix(matrix), fixed).solve(-residual)
            further = _line_search(body, tool, state, travel, step, float(residual @ step))
            if further is not None:
                break
        if further is None:
            break
        state = further
    msg = f"compression: no equilibrium at a travel of {travel:.3g} mm; press less deep"
    raise SolveError(msg)


def _state(body: HalfBody, tool: Tool, u: Floats, travel: float) -> _ToolState:
    """Return body, contact and energy at displacements (nodes, 2) and a travel [mm]."""
    r = body.x[body.surface, 0]
    z = body.x[body.surface, 1]
    rise, slope, growth = tool.face(r + u[body.surface, 0])
    height = z + u[body.surface, 1] - (z[0] - travel) - rise
    touches = (height >= 0.0) & (r <= tool.edge * (1.0 + _SAME))
    deformed = body.deformed(u)
    energy = deformed.energy + 0.5 * _penalty(body) * float((body.area * height**2)[touches].sum())
    return _ToolState(body=deformed, height=height, slope=slope, growth=growth, touches=touches, energy=energy)


def _line_search(
    body: HalfBody, tool: Tool, state: _ToolState, travel: float, step: Floats, slope: float
) -> _ToolState | None:
    """Return the state after the longest of the halved steps that lowers the energy; None where none does."""
    round_off = float(np.finfo(np.float64).eps) * body.volume
    for halvings in range(_HALVINGS):
        length = 0.5**halvings
        reached = _state(body, tool, state.body.u + length * step.reshape(-1, 2), travel)
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
