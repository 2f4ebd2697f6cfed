"""A rigid tip pressed into flesh step by step: the force at each depth, as deep as equilibrium was found."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reference.flat_punch.body import RoundBody
from reference.flat_punch.grid import press_grid
from reference.flat_punch.newton import Equilibrium, NoEquilibriumError, PressedBody
from reference.flat_punch.tip_profile import RoundTip
from sensor.arrays import Flags, Floats
from solve.compression.flesh_law import FleshLaw

LARGEST_STEP = 0.05  # of the depth [tip sides]
LEAST_STEP = 1e-2  # of the deepest depth: below, the press ends
_PREDICTED_FROM = 3  # equilibria through which a start is extrapolated
_FEW_ITERATIONS = 5


@dataclass(frozen=True, kw_only=True)
class TipPress:
    """One press to be solved: a tip that grips the skin, its flesh, and the refinement of the mesh."""

    tip: RoundTip
    law: FleshLaw
    refinement: int = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class PressedForces:
    """Forces [E times tip side^2] at the depths asked for that were reached [tip sides], and what they cost.

    `sharp` is the stiffness [E times tip side] of the sharp tip of this radius at small strain. `sliding` is that of
    one that slides instead of gripping.
    """

    depths: Floats
    forces: Floats
    sharp: float
    sliding: float
    dofs: int
    iterations: int


def pressed(press: TipPress, depths: Sequence[float]) -> PressedForces:
    """Return the forces at rising depths [tip sides]; those beyond the last equilibrium that was found are left out."""
    march = _DepthMarch(press)
    forces: list[float] = []
    for depth in depths:
        try:
            forces.append(march.advance(depth, least_step=LEAST_STEP * depths[-1]))
        except NoEquilibriumError:
            break
    return PressedForces(
        depths=np.asarray(depths[: len(forces)], dtype=np.float64),
        forces=np.array(forces, dtype=np.float64),
        sharp=march.sharp_stiffness(slides=False),
        sliding=march.sharp_stiffness(slides=True),
        dofs=2 * march.body.body.count,
        iterations=march.iterations,
    )


class _DepthMarch:
    """The press on its way down: the last equilibria, the step in depth, and which dofs are held."""

    def __init__(self, press: TipPress) -> None:
        grid = press_grid(press.tip, press.refinement)
        self.press = press
        self.body = PressedBody(grid, RoundBody(grid, press.law), press.tip)
        self.iterations = 0
        self._step = LARGEST_STEP

        self._held = self._held_dofs(press.tip.seat, slides=False)
        self._first_slope, _ = self.body.linear_step(self._held, self._lowered(self._held))
        rest = np.zeros_like(self._first_slope)
        self._equilibria = [Equilibrium(depth=0.0, u=rest, force=0.0, iterations=0)]

    def advance(self, depth: float, *, least_step: float) -> float:
        """Return the force at a depth, reached in steps of at least `least_step`; raises NoEquilibriumError."""
        while self._equilibria[-1].depth < depth:
            here = self._equilibria[-1].depth
            count = int(np.ceil((depth - here) / self._step - 1e-9))
            target = depth if count <= 1 else here + (depth - here) / count
            try:
                self._append(self._equilibrium(target))
            except NoEquilibriumError:
                self._step = 0.5 * (target - here)
                if self._step < least_step:
                    raise
        return self._equilibria[-1].force

    def sharp_stiffness(self, *, slides: bool) -> float:
        """Return the force over the depth of a sharp tip at small strain [E times tip side]."""
        held = self._held_dofs(self.press.tip.radius, slides=slides)
        return self.body.linear_step(held, self._lowered(held))[1]

    def _equilibrium(self, depth: float) -> Equilibrium:
        """Return the equilibrium at a depth, from the start with the least energy."""
        last = self._equilibria[-1]
        down = depth - last.depth
        lowered = last.u + down * self._lowered(self._held)
        held = self._held.reshape(-1, 2)

        # Starts extrapolated through the last three and two equilibria; the first step follows small strain.
        starts = []
        if len(self._equilibria) == 1:
            starts.append(last.u + down * self._first_slope)
        for count in range(2, min(_PREDICTED_FROM, len(self._equilibria)) + 1):
            starts.append(_extrapolated(self._equilibria[-count:], depth))
        states = [self.body.state(np.where(held, lowered, start), depth) for start in starts]
        best = min(states, key=lambda state: state.energy)

        if not np.isfinite(best.energy):
            slope = self.body.slope(last, self._held, self._lowered(self._held))
            best = self.body.state(last.u + down * slope, depth)
        if not np.isfinite(best.energy):
            raise NoEquilibriumError(depth, "no start")
        return self.body.equilibrium(best, depth, self._held)

    def _append(self, equilibrium: Equilibrium) -> None:
        """Keep an equilibrium, lengthen the step if it was easy, and hold what the tip now touches."""
        self._equilibria = [*self._equilibria[1 - _PREDICTED_FROM :], equilibrium]
        self.iterations += equilibrium.iterations
        if equilibrium.iterations <= _FEW_ITERATIONS:
            self._step = min(LARGEST_STEP, 1.5 * self._step)
        distance = self.body.distance(equilibrium.u, equilibrium.depth)
        gripped = self.body.grid.top[(distance.value < 0.0) & distance.face]
        held = self._held.reshape(-1, 2).copy()
        held[gripped] = True
        self._held = held.ravel()

    def _held_dofs(self, seat: float, *, slides: bool) -> Flags:
        """Return which dofs are held: the base, the axis across, and the top up to a radius [tip sides]."""
        grid = self.body.grid
        held = np.zeros((len(grid.r_nodes), len(grid.z_nodes), 2), dtype=bool)
        held[:, -1] = True
        held[0, :, 0] = True
        under_tip = grid.r_nodes <= seat * (1.0 + 1e-9)
        held[under_tip, 0, 1] = True
        if not slides:
            held[under_tip, 0, 0] = True
        return held.ravel()

    def _lowered(self, held: Flags) -> Floats:
        """Return displacements (nodes, 2) of 1 downwards of the held dofs of the top."""
        u = np.zeros((self.body.body.count, 2))
        top = self.body.grid.top
        u[top, 1] = -1.0 * held.reshape(-1, 2)[top, 1]
        return u


def _extrapolated(equilibria: Sequence[Equilibrium], depth: float) -> Floats:
    """Return the displacements at a depth of the polynomial in the depth through equilibria (Lagrange)."""
    u = np.zeros_like(equilibria[0].u)
    for i, equilibrium in enumerate(equilibria):
        factors = []
        for j, node in enumerate(equilibria):
            if j != i:
                factors.append((depth - node.depth) / (equilibrium.depth - node.depth))
        u = u + equilibrium.u * float(np.prod(factors))
    return u
