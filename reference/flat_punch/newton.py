"""Equilibrium of flesh under a rigid tip at one depth: Newton's method on the potential energy, with a line search.

Contact is a penalty on the signed distance of the nodes of the top. The energy counts as infinite where flesh is turned
inside out. Where the exact matrix is not positive definite the one without negative curvatures gives the direction.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from reference.flat_punch.body import Deformed, RoundBody, whole_matrices
from reference.flat_punch.elements import COLUMNS, ROWS
from reference.flat_punch.grid import Grid
from reference.flat_punch.tip_profile import Distance, RoundTip
from sensor.arrays import Flags, Floats
from solve.linear import SolveError

PENALTY = 1e4  # pressure over penetration [E / tip side]
RESIDUAL_LIMIT = 1e-8  # of the force on the tip: at a looser one a branch beside the equilibrium passes for it
MOST_ITERATIONS = 25
_HALVINGS = 10
_FALLS_ON = 0.9  # of the slope times the step: a convex quadratic has 0.5 at its least
_LONGEST = 64.0
_SUFFICIENT = 1e-4  # fraction of the slope that a step must win, L. Armijo, Pacific J. Math. 16, 1966


class NoEquilibriumError(SolveError):
    """A depth at which no equilibrium was found."""

    def __init__(self, depth: float, reason: str) -> None:
        """Say why none was found at a depth [tip sides]."""
        super().__init__(f"large strain: no equilibrium at a depth of {depth:.3g} tip sides: {reason}; press less deep")


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """Displacements u (nodes, 2) [tip sides] under a tip at a depth, and the force on it [E times tip side^2]."""

    depth: float
    u: Floats
    force: float
    iterations: int


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """A body under a tip, in equilibrium or not: its potential energy [E times tip side^3], which may be infinite.

    `distance` is that of the nodes of the top from the tip, `penetration` (nodes of the top,) is at most 0 [tip sides].
    """

    body: Deformed
    distance: Distance
    penetration: Floats
    energy: float


class PressedBody:
    """A round body under a rigid tip: its potential energy and its equilibrium at a depth [tip sides]."""

    def __init__(self, grid: Grid, body: RoundBody, tip: RoundTip) -> None:
        """Set up the area of each node of the top and the places of all entries in the band of the matrix."""
        self.grid = grid
        self.body = body
        self.tip = tip
        # The round-off of the energy [E times tip side^3]; over a unit of length it bounds that of a force.
        self._round_off = float(np.finfo(np.float64).eps) * body.volume

        # Area of the top that belongs to each node, by Simpson's rule on 2 pi r [tip sides^2].
        start = grid.r[:-1]
        step = np.diff(grid.r)
        self._areas = np.zeros(len(grid.r_nodes))
        for local, simpson in enumerate((1.0, 4.0, 1.0)):
            contribution = np.pi / 3.0 * simpson * step * (start + 0.5 * local * step)
            np.add.at(self._areas, 2 * np.arange(len(step)) + local, contribution)

        # Where each entry of an element lies in the lower band of the matrix, stored column by column.
        rows = body.dofs[ROWS]
        columns = body.dofs[COLUMNS]
        self._band_width = int((rows - columns).max()) + 1
        self._band_index = (columns * self._band_width + rows - columns).ravel()

    def distance(self, u: Floats, depth: float) -> Distance:
        """Return the signed distance of every node of the top from the tip [tip sides]."""
        moved = u[self.grid.top]
        return self.tip.distance(self.grid.r_nodes + moved[:, 0], moved[:, 1] + depth)

    def state(self, u: Floats, depth: float) -> State:
        """Return body, contact and energy at displacements (nodes, 2) and a depth, all in [tip sides]."""
        body = self.body.deformed(u)
        distance = self.distance(u, depth)
        penetration = np.minimum(distance.value, 0.0)
        energy = body.energy + 0.5 * PENALTY * float((self._areas * penetration**2).sum())
        return State(body=body, distance=distance, penetration=penetration, energy=energy)

    def equilibrium(self, start: State, depth: float, held: Flags) -> Equilibrium:
        """Return the equilibrium at a depth [tip sides] from a start, whose held dofs (2 nodes,) stay.

        Raises NoEquilibriumError where the residual stays above 1e-8 of the force.
        """
        state = start
        for iteration in range(MOST_ITERATIONS):
            residual, band, force = self._linearised(state, held)
            # A residual under eps E V over a unit of length is round-off, however small the force.
            if np.linalg.norm(residual) <= max(RESIDUAL_LIMIT * abs(force), self._round_off):
                return Equilibrium(depth=depth, u=state.body.u, force=force, iterations=iteration)
            try:
                step = _solved(band, -residual)
            except LinAlgError:
                _, convex_band, _ = self._linearised(state, held, projected=True)
                try:
                    step = _solved(convex_band, -residual)
                except LinAlgError as error:
                    raise NoEquilibriumError(depth, "the matrix is singular") from error
            state = self._line_search(state, depth, step, residual)
        raise NoEquilibriumError(depth, f"not within {MOST_ITERATIONS} iterations")

    def linear_step(self, held: Flags, displaced: Floats) -> tuple[Floats, float]:
        """Return u (nodes, 2) of small strain for displaced held dofs [tip sides], and the force [E side^2]."""
        _, entries = self.body.tangent(self.body.deformed(np.zeros((self.body.count, 2))))
        matrices = whole_matrices(entries)
        load = self._forces(matrices, displaced.ravel())
        u = displaced.ravel() + _solved(self._assembled_band(entries, held), np.where(held, 0.0, -load))
        return u.reshape(-1, 2), -float(self._forces(matrices, u)[2 * self.grid.top + 1].sum())

    def slope(self, at: Equilibrium, held: Flags, lowered: Floats) -> Floats:
        """Return by how much nodes move for each unit of depth, shape (nodes, 2) [1]; `lowered` is that of held dofs.

        Where the energy is not convex, negative curvatures are left out: the slope then serves as a start only.
        """
        state = self.state(at.u, at.depth)
        top = self.grid.top
        for projected in (False, True):
            _, entries = self.body.tangent(state.body, projected=projected)
            _, curvature = self._penalty(state, projected=projected)
            load = self._forces(whole_matrices(entries), lowered.ravel()).reshape(-1, 2)
            # Nodes in contact move against the tip, which goes down by 1.
            load[top] += np.einsum("nij,nj->ni", curvature, lowered[top] + [0.0, 1.0])
            try:
                moved = _solved(self._band(entries, curvature, held), np.where(held, 0.0, -load.ravel()))
            except LinAlgError:
                continue
            return lowered + moved.reshape(-1, 2)
        raise NoEquilibriumError(at.depth, "the matrix is singular")

    def _forces(self, matrices: Floats, u: Floats) -> Floats:
        """Return the forces (2 nodes,) of small displacements (2 nodes,)."""
        return self.body.assembled(np.einsum("eab,be->ae", matrices, u[self.body.dofs]))

    def _line_search(self, state: State, depth: float, step: Floats, residual: Floats) -> State:
        """Return the state after the longest of the halved steps (2 nodes,) that lowers the energy.

        Where a full step does, longer ones are tried as long as the energy falls on. `residual` (2 nodes,) is the slope
        of the energy. Raises NoEquilibriumError where no step lowers it.
        """
        u = state.body.u
        slope = float(residual @ step)
        step = step.reshape(u.shape)
        for halvings in range(_HALVINGS):
            length = 0.5**halvings
            reached = self.state(u + length * step, depth)
            if reached.energy <= state.energy + _SUFFICIENT * length * slope + self._round_off:
                break
        else:
            raise NoEquilibriumError(depth, "no step lowers the energy")
        # Where the energy is not convex it may fall far beyond a full step.
        while length >= 1.0 and slope < 0.0 and length < _LONGEST:
            if state.energy - reached.energy <= _FALLS_ON * abs(length * slope):
                break
            further = self.state(u + 2.0 * length * step, depth)
            if further.energy >= reached.energy:
                break
            length = 2.0 * length
            reached = further
        return reached

    def _linearised(self, state: State, held: Flags, *, projected: bool = False) -> tuple[Floats, Floats, float]:
        """Return residual (2 nodes,), lower band of the tangent, and force on the tip [E times tip side^2]."""
        forces, entries = self.body.tangent(state.body, projected=projected)
        push, curvature = self._penalty(state, projected=projected)
        top = self.grid.top
        residual = forces.reshape(-1, 2).copy()
        residual[top] += push
        band = self._band(entries, curvature, held)
        return np.where(held, 0.0, residual.ravel()), band, -float(forces[2 * top + 1].sum())

    def _penalty(self, state: State, *, projected: bool) -> tuple[Floats, Floats]:
        """Return slope (nodes, 2) and second derivative (nodes, 2, 2) of the penalty's energy at the top."""
        normal = state.distance.normal
        stiffness = PENALTY * self._areas * (state.penetration < 0.0)
        curvature = normal[:, :, None] * normal[:, None, :]
        if not projected:
            curvature = curvature + state.penetration[:, None, None] * state.distance.curvature
        return (stiffness * state.penetration)[:, None] * normal, stiffness[:, None, None] * curvature

    def _band(self, entries: Floats, curvature: Floats, held: Flags) -> Floats:
        """Return the lower band of elements and of second derivatives (nodes, 2, 2) of the penalty at the top."""
        band = self._assembled_band(entries, held)
        free = ~held.reshape(-1, 2)[self.grid.top]
        kept = curvature * (free[:, :, None] & free[:, None, :])
        radial = 2 * self.grid.top
        band[0, radial] += kept[:, 0, 0]
        band[0, radial + 1] += kept[:, 1, 1]
        band[1, radial] += kept[:, 0, 1]
        return band

    def _assembled_band(self, entries: Floats, held: Flags) -> Floats:
        """Return the lower band (band, dofs) of the sum of the element matrices, held dofs as in the unit matrix."""
        free = ~held[self.body.dofs]
        kept = entries * (free[ROWS] & free[COLUMNS])
        size = 2 * self.body.count
        total = np.bincount(self._band_index, kept.ravel(), minlength=size * self._band_width)
        # By columns, as LAPACK wants it: the factor then needs no copy.
        band = total.astype(np.float64, copy=False).reshape(size, self._band_width).T
        band[0, held] = 1.0
        return band


def _solved(band: Floats, right: Floats) -> Floats:
    """Return the solution of a positive definite system in a lower band; raises LinAlgError."""
    factor = cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False)
    return cho_solve_banded((factor, True), right, check_finite=False)
