"""Equilibrium of flesh under a rigid tip at one depth: Newton's method on the potential energy, with a line search.

Contact is a penalty on the signed distance of the nodes of the top. The energy counts as infinite where flesh is turned
inside out. Where the exact matrix is not positive definite the one without negative curvatures gives the direction.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from solve.arrays import Flags, Floats
from solve.large_strain.body import Deformed, RoundBody, whole_matrices
from solve.large_strain.elements import COLUMNS, ROWS
from solve.large_strain.grid import Grid
from solve.large_strain.tip_profile import Distance, TipProfile
from solve.linear import SolveError

PENALTY = 1e4  # pressure over penetration [E / tip side]
RESIDUAL_LIMIT = 1e-8  # of the force on the tip: at a looser one a branch beside the equilibrium passes for it
MOST_ITERATIONS = 25
_HALVINGS = 10
_FALLS_ON = 0.9  # of the slope times the step: a convex quadratic has 0.5 at its least
_LONGEST = 64.0
_SUFFICIENT = 1e-4  # share of the slope that a step must win, L. Armijo, Pacific J. Math. 16, 1966


class NoEquilibriumError(SolveError):
    """A depth at which no equilibrium was found."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """Displacements u (nodes, 2) [tip sides] under a tip at a depth, and the force on it [E times tip side^2]."""

    depth: float
    u: Floats
    force: float
    iterations: int


@dataclass(frozen=True, kw_only=True, eq=False)
class _System:
    residual: Floats
    band: Floats
    force: float


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """A body under a tip, in equilibrium or not: its potential energy [E times tip side^3], which may be infinite.

    `touch` is the distance of the nodes of the top from the tip, `inside` (nodes of the top,) how deep they are in it.
    """

    body: Deformed
    touch: Distance
    inside: Floats
    energy: float


class PressedBody:
    """A round body under a rigid tip: its potential energy and its equilibrium at a depth [tip sides]."""

    def __init__(self, grid: Grid, body: RoundBody, tip: TipProfile) -> None:
        """Set up the places of the top and the band of the matrix."""
        self.grid, self.body, self.tip = grid, body, tip
        self._areas = _node_areas(grid.r)
        self._round_off = float(np.finfo(np.float64).eps) * body.volume
        rows, columns = body.dofs[ROWS], body.dofs[COLUMNS]
        self._shape = 2 * body.count, int((rows - columns).max()) + 1
        self._places = columns * self._shape[1] + rows - columns

    def touch(self, u: Floats, depth: float) -> Distance:
        """Return the signed distance of every node of the top from the tip [tip sides]."""
        moved = u[self.grid.top]
        return self.tip.distance(self.grid.r_nodes + moved[:, 0], moved[:, 1] + depth)

    def state(self, u: Floats, depth: float) -> State:
        """Return what displacements (nodes, 2) make of body and contact at a depth, all in [tip sides]."""
        body, touch = self.body.deformed(u), self.touch(u, depth)
        inside = np.minimum(touch.value, 0.0)
        energy = body.energy + 0.5 * PENALTY * float((self._areas * inside**2).sum())
        return State(body=body, touch=touch, inside=inside, energy=energy)

    def equilibrium(self, start: State, depth: float, held: Flags) -> Equilibrium:
        """Return the equilibrium at a depth [tip sides] from a start, whose held dofs (2 nodes,) stay.

        Raises NoEquilibriumError where the residual stays above 1e-8 of the force.
        """
        state = start
        for iteration in range(MOST_ITERATIONS):
            system = self._system(state, held)
            # The stresses round off at eps E, whatever the force: one unit of length makes a force of it.
            if np.linalg.norm(system.residual) <= max(RESIDUAL_LIMIT * abs(system.force), self._round_off):
                return Equilibrium(depth=depth, u=state.body.u, force=system.force, iterations=iteration)
            state = self._searched(state, depth, self._direction(system, state, depth, held), system.residual)
        raise NoEquilibriumError(_failed(depth, f"not within {MOST_ITERATIONS} iterations"))

    def linear_step(self, held: Flags, displaced: Floats) -> tuple[Floats, float]:
        """Return u (nodes, 2) of small strain for displaced held dofs [tip sides], and the force [E side^2]."""
        _, entries = self.body.tangent(self.body.deformed(np.zeros((self.body.count, 2))))
        matrices = whole_matrices(entries)
        load = self._pushed(matrices, displaced.ravel())
        u = displaced.ravel() + _solved(self._banded(entries, held), np.where(held, 0.0, -load))
        return u.reshape(-1, 2), -float(self._pushed(matrices, u)[2 * self.grid.top + 1].sum())

    def slope(self, at: Equilibrium, held: Flags, lowered: Floats) -> Floats:
        """Return by how much nodes move for each unit of depth, shape (nodes, 2) [1]; `lowered` is that of held dofs.

        Where the energy is not convex, negative curvatures are left out: the slope then serves as a start only.
        """
        state = self.state(at.u, at.depth)
        for projected in (False, True):
            _, entries = self.body.tangent(state.body, projected=projected)
            _, curvature = self._penalty(state, projected=projected)
            load = self._pushed(whole_matrices(entries), lowered.ravel()).reshape(-1, 2)
            # Nodes in contact move against the tip, which goes down by 1.
            load[self.grid.top] += np.einsum("nij,nj->ni", curvature, lowered[self.grid.top] + [0.0, 1.0])
            try:
                moved = _solved(self._band(entries, curvature, held), np.where(held, 0.0, -load.ravel()))
            except LinAlgError:
                continue
            return lowered + moved.reshape(-1, 2)
        raise NoEquilibriumError(_failed(at.depth, "the matrix is singular"))

    def _pushed(self, matrices: Floats, u: Floats) -> Floats:
        """Return the forces (2 nodes,) of small displacements (2 nodes,)."""
        return self.body.assembled(np.einsum("eab,be->ae", matrices, u[self.body.dofs]))

    def _direction(self, system: _System, state: State, depth: float, held: Flags) -> Floats:
        """Return the step of Newton where the energy is convex, else one on which it falls."""
        try:
            return _solved(system.band, -system.residual)
        except LinAlgError:
            convex = self._system(state, held, projected=True)
        try:
            return _solved(convex.band, -system.residual)
        except LinAlgError as error:
            raise NoEquilibriumError(_failed(depth, "the matrix is singular")) from error

    def _searched(self, state: State, depth: float, step: Floats, residual: Floats) -> State:
        """Return the state after the longest of the halved steps that lowers the energy."""
        u, slope = state.body.u, float(residual @ step)
        step = step.reshape(u.shape)
        for halvings in range(_HALVINGS):
            share = 0.5**halvings
            reached = self.state(u + share * step, depth)
            if reached.energy <= state.energy + _SUFFICIENT * share * slope + self._round_off:
                break
        else:
            raise NoEquilibriumError(_failed(depth, "no step lowers the energy"))
        # Where the energy is not convex it may fall far beyond a full step.
        while share >= 1.0 and slope < 0.0 and share < _LONGEST:
            if state.energy - reached.energy <= _FALLS_ON * abs(share * slope):
                break
            further = self.state(u + 2.0 * share * step, depth)
            if further.energy >= reached.energy:
                break
            share, reached = 2.0 * share, further
        return reached

    def _system(self, state: State, held: Flags, *, projected: bool = False) -> _System:
        """Return residual, lower band of the tangent and force on the tip, with and without the held dofs."""
        forces, entries = self.body.tangent(state.body, projected=projected)
        push, curvature = self._penalty(state, projected=projected)
        top = self.grid.top
        residual = forces.reshape(-1, 2).copy()
        residual[top] += push
        band = self._band(entries, curvature, held)
        force = -float(forces[2 * top + 1].sum())
        return _System(residual=np.where(held, 0.0, residual.ravel()), band=band, force=force)

    def _band(self, entries: Floats, curvature: Floats, held: Flags) -> Floats:
        """Return the lower band of elements and of second derivatives (nodes, 2, 2) of the penalty at the top."""
        band = self._banded(entries, held)
        free = ~held.reshape(-1, 2)[self.grid.top]
        kept = curvature * (free[:, :, None] & free[:, None, :])
        across, up = 2 * self.grid.top, 2 * self.grid.top + 1
        band[0, across] += kept[:, 0, 0]
        band[0, up] += kept[:, 1, 1]
        band[1, across] += kept[:, 0, 1]
        return band

    def _penalty(self, state: State, *, projected: bool) -> tuple[Floats, Floats]:
        """Return slope (nodes, 2) and second derivative (nodes, 2, 2) of the penalty's energy at the top."""
        touch, inside = state.touch, state.inside
        stiffness = PENALTY * self._areas * (inside < 0.0)
        curvature = touch.normal[:, :, None] * touch.normal[:, None, :]
        if not projected:
            curvature = curvature + inside[:, None, None] * touch.curvature
        return (stiffness * inside)[:, None] * touch.normal, stiffness[:, None, None] * curvature

    def _banded(self, entries: Floats, held: Flags) -> Floats:
        """Return the lower band (band, dofs) of the sum of the element matrices, held dofs as in the unit matrix."""
        free = ~held[self.body.dofs]
        kept = entries * (free[ROWS] & free[COLUMNS])
        total = np.bincount(self._places.ravel(), kept.ravel(), minlength=self._shape[0] * self._shape[1])
        # By columns, as LAPACK wants it: the factor then needs no copy.
        band = total.astype(np.float64, copy=False).reshape(self._shape).T
        band[0, held] = 1.0
        return band


def _failed(depth: float, why: str) -> str:
    return f"large strain: no equilibrium at a depth of {depth:.3g} tip sides: {why}; press less deep"


def _solved(band: Floats, right: Floats) -> Floats:
    """Return the solution of a positive definite system in a lower band; raises LinAlgError."""
    factor = cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False)
    return np.asarray(cho_solve_banded((factor, True), right, check_finite=False))


def _node_areas(lines: Floats) -> Floats:
    """Return the area of the top that belongs to each node, by Simpson's rule on 2 pi r [tip sides^2]."""
    start, step = lines[:-1], np.diff(lines)
    areas = np.zeros(2 * len(lines) - 1)
    for place, weight in enumerate((1.0, 4.0, 1.0)):
        shares = np.pi / 3.0 * weight * step * (start + 0.5 * place * step)
        np.add.at(areas, 2 * np.arange(len(step)) + place, shares)
    return areas
