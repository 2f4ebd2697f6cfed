"""Equilibrium of flesh under a rigid tip at one depth: Newton's method on the potential energy, with a line search.

Contact is a penalty on the signed distance of the nodes of the top. The energy counts as infinite where flesh is turned
inside out. Where the exact matrix is not positive definite the one without negative curvatures gives the direction.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from solve.arrays import Flags, Floats
from solve.large_strain.body import RoundBody
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


class PressedBody:
    """A round body under a rigid tip: its potential energy and its equilibrium at a depth [tip sides]."""

    def __init__(self, grid: Grid, body: RoundBody, tip: TipProfile) -> None:
        """Set up the places of the top and the band of the matrix."""
        self.grid, self.body, self.tip = grid, body, tip
        self._areas = _node_areas(grid.r)
        self._round_off = float(np.finfo(np.float64).eps) * body.volume
        size = body.dofs.shape[1]
        rows, columns = np.repeat(body.dofs, size, axis=1), np.tile(body.dofs, (1, size))
        self._lower = (rows >= columns).ravel()
        self._shape = int((rows - columns).max()) + 1, 2 * body.count
        self._places = ((rows - columns) * self._shape[1] + columns).ravel()[self._lower]

    def touch(self, u: Floats, depth: float) -> Distance:
        """Return the signed distance of every node of the top from the tip [tip sides]."""
        moved = u[self.grid.top]
        return self.tip.distance(self.grid.r_nodes + moved[:, 0], moved[:, 1] + depth)

    def energy(self, u: Floats, depth: float) -> float:
        """Return the strain energy and that of the penalty [E times tip side^3]."""
        inside = np.minimum(self.touch(u, depth).value, 0.0)
        return self.body.energy(u) + 0.5 * PENALTY * float((self._areas * inside**2).sum())

    def equilibrium(self, u: Floats, depth: float, held: Flags) -> Equilibrium:
        """Return the equilibrium at a depth from a start u, whose held dofs (2 nodes,) stay.

        Raises NoEquilibriumError where the residual stays above 1e-8 of the force.
        """
        for iteration in range(MOST_ITERATIONS):
            system = self._system(u, depth, held)
            # The stresses round off at eps E, whatever the force: one unit of length makes a force of it.
            if np.linalg.norm(system.residual) <= max(RESIDUAL_LIMIT * abs(system.force), self._round_off):
                return Equilibrium(depth=depth, u=u, force=system.force, iterations=iteration)
            u = self._searched(u, depth, self._direction(system, u, depth, held), system.residual)
        raise NoEquilibriumError(_failed(depth, f"not within {MOST_ITERATIONS} iterations"))

    def linear_step(self, held: Flags, displaced: Floats) -> tuple[Floats, float]:
        """Return u (nodes, 2) of small strain for given displacements of the held dofs, and the force on the top."""
        none = np.zeros((self.body.count, 2))
        _, blocks = self.body.tangent(none)
        local = displaced.ravel()[self.body.dofs]
        load = self.body.assembled((blocks @ local[..., None])[..., 0])
        u = displaced.ravel() + _solved(self._without(held, self._banded(blocks)), np.where(held, 0.0, -load))
        reaction = self.body.assembled((blocks @ u[self.body.dofs][..., None])[..., 0])
        return u.reshape(-1, 2), -float(reaction[2 * self.grid.top + 1].sum())

    def _direction(self, system: _System, u: Floats, depth: float, held: Flags) -> Floats:
        """Return the step of Newton where the energy is convex, else one on which it falls."""
        try:
            return _solved(system.band, -system.residual)
        except LinAlgError:
            convex = self._system(u, depth, held, projected=True)
        try:
            return _solved(convex.band, -system.residual)
        except LinAlgError as error:
            raise NoEquilibriumError(_failed(depth, "the matrix is singular")) from error

    def _searched(self, u: Floats, depth: float, step: Floats, residual: Floats) -> Floats:
        """Return u after the longest of the halved steps that lowers the energy."""
        start, slope, step = self.energy(u, depth), float(residual @ step), step.reshape(u.shape)
        for halvings in range(_HALVINGS):
            share = 0.5**halvings
            reached = self.energy(u + share * step, depth)
            if reached <= start + _SUFFICIENT * share * slope + self._round_off:
                break
        else:
            raise NoEquilibriumError(_failed(depth, "no step lowers the energy"))
        # Where the energy is not convex it may fall far beyond a full step.
        while share >= 1.0 and slope < 0.0 and share < _LONGEST and start - reached > _FALLS_ON * abs(share * slope):
            further = self.energy(u + 2.0 * share * step, depth)
            if further >= reached:
                break
            share, reached = 2.0 * share, further
        return u + share * step

    def _system(self, u: Floats, depth: float, held: Flags, *, projected: bool = False) -> _System:
        """Return residual, lower band of the tangent and force on the tip, with and without the held dofs."""
        forces, blocks = self.body.tangent(u, projected=projected)
        residual, band = forces.copy(), self._banded(blocks)
        push, curvature = self._penalty(self.touch(u, depth), projected=projected)
        across, up = 2 * self.grid.top, 2 * self.grid.top + 1
        residual[across] += push[:, 0]
        residual[up] += push[:, 1]
        band[0, across] += curvature[:, 0, 0]
        band[0, up] += curvature[:, 1, 1]
        band[1, across] += curvature[:, 0, 1]
        force = -float(forces[up].sum())
        return _System(residual=np.where(held, 0.0, residual), band=self._without(held, band), force=force)

    def _penalty(self, touch: Distance, *, projected: bool) -> tuple[Floats, Floats]:
        """Return slope (nodes, 2) and second derivative (nodes, 2, 2) of the penalty's energy at the top."""
        inside = np.minimum(touch.value, 0.0)
        stiffness = PENALTY * self._areas * (inside < 0.0)
        curvature = touch.normal[:, :, None] * touch.normal[:, None, :]
        if not projected:
            curvature = curvature + inside[:, None, None] * touch.curvature
        return (stiffness * inside)[:, None] * touch.normal, stiffness[:, None, None] * curvature

    def _banded(self, blocks: Floats) -> Floats:
        """Return the lower band (band, dofs) of the sum of the element matrices."""
        entries = blocks.ravel()[self._lower]
        total = np.bincount(self._places, entries, minlength=self._shape[0] * self._shape[1])
        return total.astype(np.float64).reshape(self._shape)

    def _without(self, held: Flags, band: Floats) -> Floats:
        """Return the band with rows and columns of held dofs as those of the unit matrix."""
        free = np.concatenate([~held, np.zeros(self._shape[0], dtype=bool)])
        rows = np.lib.stride_tricks.sliding_window_view(free, self._shape[1])[: self._shape[0]]
        kept: Floats = band * (rows & ~held)
        kept[0, held] = 1.0
        return kept


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
