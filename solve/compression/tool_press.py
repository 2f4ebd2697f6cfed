"""Stepwise compression of a half body by a rigid tool: the force at each travel of the tool.

Contact is enforced by a penalty on the penetration of surface nodes into the tool. Equilibrium is a minimum of the
total energy, which Newton's method with a line search finds. The tool is frictionless, or it grips the nodes that it
has touched.
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

_PENALTY = 1e5  # pressure per penetration [E / half height]; the penetration is then 2e-4 of the smallest travel
_RESIDUAL_LIMIT = 1e-8  # largest allowed residual divided by the force on the tool
_MAX_ITERATIONS = 60  # maximum number of Newton steps
_HALVINGS = 14  # number of step lengths that the line search tries, each half of the previous one
# Smallest energy decrease divided by its linear prediction; see L. Armijo, Pacific J. Math. 16, 1966.
_SUFFICIENT_DECREASE = 1e-4
_RADIUS_TOLERANCE = 1e-9  # relative tolerance of a radius, so that nodes on the edge of a plunger touch it
_EXTRAPOLATION_COUNTS = (1, 2, 3)  # numbers of previous equilibria from which initial guesses are extrapolated


@dataclass(frozen=True, kw_only=True, eq=False)
class _ToolState:
    """A deformed body under a tool, and its contact. Arrays have the shape (surface nodes,).

    `height` [mm] is the height of each surface node above the face of the tool. A positive height is the penetration.
    `slope` [1] is the slope of the face at the node, and `slope_rate` [1/mm] its derivative with respect to the radius.
    `touches` marks the nodes in contact. `energy` [N mm] is the strain energy plus the energy of the penalty.
    """

    body: Deformed
    height: Floats
    slope: Floats
    slope_rate: Floats
    touches: Flags
    energy: float


@dataclass(frozen=True, eq=False)
class _ToolPress:
    """A half body under a tool that has moved by `travel` [mm] since it first touched the body."""

    body: HalfBody
    tool: Tool
    travel: float

    @property
    def penalty(self) -> float:
        """Return the pressure of the tool per penetration [MPa/mm], for E = 1 MPa."""
        half_height = float(self.body.x[self.body.surface[0], 1])
        return _PENALTY / half_height

    @property
    def round_off(self) -> float:
        """Return the round-off of the energy [N mm]. Divided by 1 mm, it also bounds the round-off of a force [N]."""
        return float(np.finfo(np.float64).eps) * self.body.volume

    def evaluate(self, u: Floats) -> _ToolState:
        """Return the deformed body, its contact and its energy for displacements u (nodes, 2) [mm].

        A surface node touches the tool if it is not below the face of the tool, and if its undeformed position is
        within the edge of the tool.
        """
        body = self.body
        r = body.x[body.surface, 0]
        z = body.x[body.surface, 1]
        rise, slope, slope_rate = self.tool.face(r + u[body.surface, 0])
        # The first surface node is on the axis, where the tool touches the body first.
        lowest_point = z[0] - self.travel  # z of the lowest point of the tool
        height = z + u[body.surface, 1] - lowest_point - rise
        touches = (height >= 0.0) & (r <= self.tool.edge * (1.0 + _RADIUS_TOLERANCE))
        deformed = body.deformed(u)
        energy = deformed.energy + 0.5 * self.penalty * float((body.area * height**2)[touches].sum())
        return _ToolState(
            body=deformed, height=height, slope=slope, slope_rate=slope_rate, touches=touches, energy=energy
        )

    def find_equilibrium(self, start: _ToolState, held: Flags) -> tuple[_ToolState, float]:
        """Return the state of minimum energy and the force on the tool [N], by Newton's method from `start`.

        The dofs marked in `held` (2 nodes,) keep their displacements in `start`. Raises SolveError if the method does
        not converge.
        """
        state = start
        held_dofs = np.flatnonzero(held)
        for _ in range(_MAX_ITERATIONS):
            # First, the Newton step of the energy itself is tried. If it does not lower the energy sufficiently, the
            # step of a convex approximation of the energy is tried.
            for convex in (False, True):
                residual, matrix, force = self._linearise(state, held, convex=convex)
                if np.linalg.norm(residual) <= max(_RESIDUAL_LIMIT * force, self.round_off):
                    return state, force
                step = factorise(matrix, held_dofs).solve(-residual)
                next_state = self._line_search(state, step, float(residual @ step))
                if next_state is not None:
                    state = next_state
                    break
            else:  # neither step lowers the energy sufficiently
                break
        msg = f"compression: no equilibrium was found at a travel of {self.travel:.3g} mm. Reduce the travel."
        raise SolveError(msg)

    def _linearise(self, state: _ToolState, held: Flags, *, convex: bool) -> tuple[Floats, csc_matrix, float]:
        """Return the residual (2 nodes,) [N], its derivative (2 nodes, 2 nodes) [N/mm], and the force on the tool [N].

        The residual and its derivative are the first and second derivatives of the total energy with respect to the
        displacements. The penalty energy of a node in contact is 1/2 k height^2, where k is the penalty stiffness
        [N/mm]. The height increases by 1 per unit upward displacement, and decreases by the slope of the face per unit
        outward displacement. With `convex`, negative curvatures of the energy are set to 0. The residual is set to 0 at
        the dofs marked in `held`.
        """
        body = self.body
        stiffness = self.penalty * body.area
        contact_force = stiffness * np.where(state.touches, state.height, 0.0)
        outward = 2 * body.surface  # dofs of the surface nodes along r
        upward = outward + 1  # dofs of the surface nodes along z
        forces, matrix = body.tangent(state.body, convex=convex)
        forces[upward] += contact_force
        forces[outward] -= contact_force * state.slope

        upward_stiffness = stiffness * state.touches
        # The curvature of the face makes the energy less convex, so its term is left out with `convex`.
        curvature_term = 0.0 if convex else contact_force * state.slope_rate
        outward_stiffness = upward_stiffness * state.slope**2 - curvature_term
        coupling = -upward_stiffness * state.slope
        values = np.concatenate([upward_stiffness, outward_stiffness, coupling, coupling])
        rows = np.concatenate([upward, outward, upward, outward])
        columns = np.concatenate([upward, outward, outward, upward])
        matrix = matrix + coo_array((values, (rows, columns)), shape=matrix.shape)
        return np.where(held, 0.0, forces), csc_matrix(matrix), float(contact_force.sum())

    def _line_search(self, state: _ToolState, step: Floats, slope: float) -> _ToolState | None:
        """Return the state after a fraction of `step` (2 nodes,) [mm] that lowers the energy sufficiently.

        The fractions 1, 1/2, 1/4 and so on are tried, and the first that satisfies Armijo's condition is used. The
        result is None if no fraction does. `slope` [N mm] is the derivative of the energy with respect to the fraction.
        """
        for halvings in range(_HALVINGS):
            fraction = 0.5**halvings
            candidate = self.evaluate(state.body.u + fraction * step.reshape(-1, 2))
            if candidate.energy <= state.energy + _SUFFICIENT_DECREASE * fraction * slope + self.round_off:
                return candidate
        return None


def press_forces(body: HalfBody, travels: Sequence[float], *, tool: Tool | None = None, grips: bool = False) -> Floats:
    """Return the force on the tool [N], shape (travels,), at increasing travels since the first touch [mm].

    Young's modulus is 1 MPa. The default tool is a plate. With `grips`, surface nodes that the tool has touched can no
    longer move along r, nor can nodes on a table. Raises SolveError if no equilibrium is found.
    """
    tool = tool or Tool()
    held = body.held.copy()  # gripped dofs are added below, where dof 2 i moves node i along r
    if grips:  # the tool also grips the nodes that it touches before the press, for example on a flat top
        initial_state = _ToolPress(body, tool, 0.0).evaluate(np.zeros((body.count, 2)))
        held[2 * body.surface[initial_state.touches]] = True
        held[2 * body.on_table] = True
    solutions = [np.zeros((body.count, 2))]
    solved_travels = [0.0]
    forces = []
    for travel in travels:
        press = _ToolPress(body, tool, travel)
        start = _find_initial_state(press, solutions, solved_travels, held)
        state, force = press.find_equilibrium(start, held)
        forces.append(force)
        solutions.append(state.body.u)
        solved_travels.append(travel)
        if grips:
            held[2 * body.surface[state.touches]] = True
    return np.array(forces)


def _find_initial_state(
    press: _ToolPress, solutions: Sequence[Floats], solved_travels: Sequence[float], held: Flags
) -> _ToolState:
    """Return the state from which Newton's method starts, extrapolated from previous equilibria.

    Three extrapolations are tried: through one, two and three equilibria. The state with the smallest energy is
    returned. `solutions` are the displacements (nodes, 2) [mm] at the `solved_travels` [mm]. The dofs marked in `held`
    (2 nodes,) keep their last displacements.
    """
    candidates = []
    for count in _EXTRAPOLATION_COUNTS:
        guess = _extrapolate(solutions[-count:], solved_travels[-count:], press.travel)
        guess = np.where(held.reshape(-1, 2), solutions[-1], guess)
        candidates.append(press.evaluate(guess))
    return min(candidates, key=lambda candidate: candidate.energy)


def _extrapolate(solutions: Sequence[Floats], solved_travels: Sequence[float], travel: float) -> Floats:
    """Return the displacements (nodes, 2) [mm] at a travel [mm], by the Lagrange polynomial through `solutions`.

    `solved_travels` [mm] are the travels of these solutions.
    """
    weights = np.ones(len(solutions))
    for i, solved_travel in enumerate(solved_travels):
        other_travels = [other for j, other in enumerate(solved_travels) if j != i]
        weights[i] = math.prod((travel - other) / (solved_travel - other) for other in other_travels)
    return np.asarray(np.einsum("s,snd->nd", weights, np.array(solutions)))
