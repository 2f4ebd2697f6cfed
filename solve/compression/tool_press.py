"""A half body under a rigid tool, pressed step by step: the force at each travel of the tool.

Contact is a penalty on the height of surface nodes above the tool's face. Equilibrium is the minimum of the total
energy, found by Newton's method with a line search. The tool is frictionless, or grips the nodes that it has touched.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_matrix

from sensor.arrays import Flags, Floats
from solve.compression.half_body import Deformed, HalfBody
from solve.compression.tool import Tool
from solve.linear import SolveError, factorise

_PENALTY = 1e5  # pressure over penetration [E / half height]; the penetration is 2e-4 of the least travel
_RESIDUAL_LIMIT = 1e-8  # largest residual over the force on the tool
_MOST_ITERATIONS = 60
_HALVINGS = 14
_SUFFICIENT = 1e-4  # least decrease of energy over the linear prediction, L. Armijo, Pacific J. Math. 16, 1966
_SAME = 1e-9  # relative tolerance of a radius, for nodes on the edge of a plunger
_STARTS = (1, 2, 3)  # numbers of previous equilibria from which a start is extrapolated


@dataclass(frozen=True, kw_only=True, eq=False)
class _ToolState:
    """A body under a tool: `touches` marks the surface nodes in contact, and `energy` is the total energy.

    The other arrays are (surface,): the `height` of nodes above the tool's face [mm], the `slope` [1] of this face, and
    its `growth` outwards [1/mm].
    """

    body: Deformed
    height: Floats
    slope: Floats
    growth: Floats
    touches: Flags
    energy: float


@dataclass(frozen=True, eq=False)
class _ToolPress:
    """A half body under a tool at a travel [mm]."""

    body: HalfBody
    tool: Tool
    travel: float

    @property
    def penalty(self) -> float:
        """Return the pressure of the tool over its penetration [MPa/mm at E = 1 MPa]."""
        half_height = float(self.body.x[self.body.surface[0], 1])
        return _PENALTY / half_height

    @property
    def round_off(self) -> float:
        """Return the round-off of the energy [N mm], which per unit of length also bounds the round-off of a force."""
        return float(np.finfo(np.float64).eps) * self.body.volume

    def state(self, u: Floats) -> _ToolState:
        """Return body, contact and energy at displacements (nodes, 2) [mm]."""
        body = self.body
        r = body.x[body.surface, 0]
        z = body.x[body.surface, 1]
        rise, slope, growth = self.tool.face(r + u[body.surface, 0])
        height = z + u[body.surface, 1] - (z[0] - self.travel) - rise
        touches = (height >= 0.0) & (r <= self.tool.edge * (1.0 + _SAME))
        deformed = body.deformed(u)
        energy = deformed.energy + 0.5 * self.penalty * float((body.area * height**2)[touches].sum())
        return _ToolState(body=deformed, height=height, slope=slope, growth=growth, touches=touches, energy=energy)

    def equilibrium(self, start: _ToolState, held: Flags) -> tuple[_ToolState, float]:
        """Return the state of least energy from a start whose held dofs are fixed, and the force on the tool [N].

        Raises SolveError if Newton's method does not converge.
        """
        state = start
        fixed = np.flatnonzero(held)
        for _ in range(_MOST_ITERATIONS):
            for convex in (False, True):
                residual, matrix, force = self._linearised(state, held, convex=convex)
                # The round-off of the energy, over 1 mm, bounds the round-off of a force.
                if np.linalg.norm(residual) <= max(_RESIDUAL_LIMIT * force, self.round_off):
                    return state, force
                step = factorise(matrix, fixed).solve(-residual)
                lower = self._line_search(state, step, float(residual @ step))
                if lower is not None:
                    break
            if lower is None:
                break
            state = lower
        msg = f"compression: no equilibrium at a travel of {self.travel:.3g} mm; press less deep"
        raise SolveError(msg)

    def _linearised(self, state: _ToolState, held: Flags, *, convex: bool) -> tuple[Floats, csc_matrix, float]:
        """Return residual (2 nodes,) [N], its slope (2 nodes, 2 nodes) [N/mm], and the force on the tool [N].

        The penalty's energy is 1/2 k height^2 of each touching node. The height increases by 1 per displacement
        upwards, and decreases by the slope of the face per displacement outwards. With `convex`, negative curvatures of
        the energy are set to 0.
        """
        body = self.body
        stiffness = self.penalty * body.area
        push = stiffness * np.where(state.touches, state.height, 0.0)
        outward = 2 * body.surface
        upright = outward + 1
        forces, matrix = body.tangent(state.body, convex=convex)
        forces[upright] += push
        forces[outward] -= push * state.slope

        contact = stiffness * state.touches
        across = contact * state.slope**2 - (0.0 if convex else push * state.growth)
        coupled = -contact * state.slope
        values = np.concatenate([contact, across, coupled, coupled])
        rows = np.concatenate([upright, outward, upright, outward])
        columns = np.concatenate([upright, outward, outward, upright])
        matrix = matrix + coo_array((values, (rows, columns)), shape=matrix.shape)
        return np.where(held, 0.0, forces), csc_matrix(matrix), float(push.sum())

    def _line_search(self, state: _ToolState, step: Floats, slope: float) -> _ToolState | None:
        """Return the state after the longest of the halved steps (2 nodes,) that lowers the energy, if any does.

        `slope` is the slope of the energy along the step. The result is None if no step lowers the energy.
        """
        for halvings in range(_HALVINGS):
            length = 0.5**halvings
            reached = self.state(state.body.u + length * step.reshape(-1, 2))
            if reached.energy <= state.energy + _SUFFICIENT * length * slope + self.round_off:
                return reached
        return None


def press_forces(body: HalfBody, travels: Sequence[float], *, tool: Tool | None = None, grips: bool = False) -> Floats:
    """Return the force [N at E = 1 MPa] at rising travels of a tool after the first touch [mm], shape (travels,).

    Without a tool a plate presses. With `grips`, the tool holds the nodes that it has touched, and a table always holds
    its nodes. Raises SolveError if no equilibrium is found.
    """
    tool = tool or Tool()
    held = body.held.copy()
    if grips:
        at_rest = _ToolPress(body, tool, 0.0).state(np.zeros((body.count, 2)))
        held[2 * body.surface[at_rest.touches]] = True
        held[2 * body.on_table] = True
    solutions = [np.zeros((body.count, 2))]
    reached = [0.0]
    forces = []
    for travel in travels:
        press = _ToolPress(body, tool, travel)
        # Start from the extrapolation through previous equilibria that has the least energy.
        states = []
        for count in _STARTS:
            start = _extrapolated(solutions[-count:], reached[-count:], travel)
            start = np.where(held.reshape(-1, 2), solutions[-1], start)  # gripped nodes do not move
            states.append(press.state(start))
        state, force = press.equilibrium(min(states, key=lambda candidate: candidate.energy), held)
        forces.append(force)
        solutions.append(state.body.u)
        reached.append(travel)
        if grips:
            held[2 * body.surface[state.touches]] = True
    return np.array(forces)


def _extrapolated(solutions: Sequence[Floats], reached: Sequence[float], travel: float) -> Floats:
    """Return the value at a travel [mm] of the polynomial through the last solutions (nodes, 2) (Lagrange)."""
    weights = np.ones(len(solutions))
    for i, node in enumerate(reached):
        others = [other for j, other in enumerate(reached) if j != i]
        weights[i] = math.prod((travel - other) / (node - other) for other in others)
    return np.asarray(np.einsum("s,snd->nd", weights, np.array(solutions)))
