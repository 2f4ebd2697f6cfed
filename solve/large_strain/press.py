"""A rigid tip pressed into flesh step by step: the force at each depth, as deep as equilibrium was found."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solve.arrays import Flags, Floats
from solve.large_strain.body import RoundBody
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.grid import press_grid
from solve.large_strain.newton import Equilibrium, NoEquilibriumError, PressedBody
from solve.large_strain.tip_profile import FlatTip, TipProfile

LARGEST_STEP = 0.05  # of the depth [tip sides]
LEAST_STEP = 1e-2  # of the deepest depth: below, the press ends
_PREDICTED_FROM = 3  # equilibria through which a start is extrapolated
_FEW_ITERATIONS = 5


@dataclass(frozen=True, kw_only=True)
class TipPress:
    """One press to be solved: tip and flesh, whether the tip slides on the skin or grips it, and the refinement."""

    tip: TipProfile
    law: FleshLaw
    slides: bool = False
    refinement: int = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class PressedForces:
    """Forces [E times tip side^2] at the depths asked for that were reached [tip sides], and what they cost.

    `sharp` is the stiffness [E times tip side] of the sharp tip of this radius at small strain with the same grip,
    `sliding` that of the one that slides.
    """

    depths: Floats
    forces: Floats
    sharp: float
    sliding: float
    dofs: int
    iterations: int


def pressed(press: TipPress, depths: Sequence[float]) -> PressedForces:
    """Return the forces at rising depths [tip sides]; those beyond the last equilibrium that was found are left out."""
    march = _March(press)
    forces: list[float] = []
    for depth in depths:
        try:
            forces.append(march.to(depth, least=LEAST_STEP * depths[-1]))
        except NoEquilibriumError:
            break
    return PressedForces(
        depths=np.asarray(depths[: len(forces)], dtype=np.float64),
        forces=np.array(forces, dtype=np.float64),
        sharp=march.sharp_stiffness(slides=press.slides),
        sliding=march.sharp_stiffness(slides=True),
        dofs=2 * march.body.body.count,
        iterations=march.iterations,
    )


class _March:
    """The press on its way down: what was found so far, and which dofs are held."""

    def __init__(self, press: TipPress) -> None:
        grid = press_grid(press.tip, press.refinement)
        self.press, self.body = press, PressedBody(grid, RoundBody(grid, press.law), press.tip)
        self._step = LARGEST_STEP
        self.iterations = 0
        flat = isinstance(press.tip, FlatTip)
        seated = flat and (press.tip.seat == press.tip.radius or not press.slides)
        self._held = self._holding(press.tip.seat if seated else -1.0, slides=press.slides)
        start, _ = self.body.linear_step(self._held, self._lowered(self._held))
        self._slope = start
        self._found = [Equilibrium(depth=0.0, u=np.zeros_like(start), force=0.0, iterations=0)]

    def to(self, depth: float, *, least: float) -> float:
        """Return the force at a depth, reached in steps of at least `least` [tip sides]; raises NoEquilibriumError."""
        while self._found[-1].depth < depth:
            here = self._found[-1].depth
            count = int(np.ceil((depth - here) / self._step - 1e-9))
            there = depth if count <= 1 else here + (depth - here) / count
            try:
                self._add(self._equilibrium(there))
            except NoEquilibriumError:
                self._step = 0.5 * (there - here)
                if self._step < least:
                    raise
        return self._found[-1].force

    def sharp_stiffness(self, *, slides: bool) -> float:
        """Return the force over the depth of a sharp tip at small strain [E times tip side]."""
        held = self._holding(self.press.tip.radius, slides=slides)
        return self.body.linear_step(held, self._lowered(held))[1]

    def _equilibrium(self, depth: float) -> Equilibrium:
        best = min((self.body.state(u, depth) for u in self._starts(depth)), key=lambda state: state.energy)
        if not np.isfinite(best.energy):
            last = self._found[-1]
            slope = self.body.slope(last, self._held, self._lowered(self._held))
            best = self.body.state(last.u + (depth - last.depth) * slope, depth)
        if not np.isfinite(best.energy):
            msg = f"large strain: no start at a depth of {depth:.3g} tip sides"
            raise NoEquilibriumError(msg)
        return self.body.equilibrium(best, depth, self._held)

    def _starts(self, depth: float) -> list[Floats]:
        """Return displacements extrapolated to a depth through the last three, two and one of the equilibria."""
        last = self._found[-1]
        held = self._held.reshape(-1, 2)
        down = depth - last.depth
        starts = [last.u + down * self._slope] if len(self._found) == 1 else []
        for count in range(2, min(_PREDICTED_FROM, len(self._found)) + 1):
            starts.append(_extrapolated(self._found[-count:], depth))
        lowered = last.u + down * self._lowered(self._held)
        return [np.where(held, lowered, start) for start in starts]

    def _add(self, found: Equilibrium) -> None:
        self._found = [*self._found[1 - _PREDICTED_FROM :], found]
        self.iterations += found.iterations
        if found.iterations <= _FEW_ITERATIONS:
            self._step = min(LARGEST_STEP, 1.5 * self._step)
        if not self.press.slides:
            touch = self.body.touch(found.u, found.depth)
            gripped = self.body.grid.top[(touch.value < 0.0) & touch.face]
            held = self._held.reshape(-1, 2).copy()
            held[gripped] = True
            self._held = held.ravel()

    def _holding(self, seat: float, *, slides: bool) -> Flags:
        """Return which dofs are held: the base, the axis across, and the top up to a radius [tip sides]."""
        grid = self.body.grid
        held = np.zeros((len(grid.r_nodes), len(grid.z_nodes), 2), dtype=bool)
        held[:, -1], held[0, :, 0] = True, True
        under = grid.r_nodes <= seat * (1.0 + 1e-9)
        held[under, 0, 1] = True
        if not slides:
            held[under, 0, 0] = True
        return held.ravel()

    def _lowered(self, held: Flags) -> Floats:
        """Return displacements (nodes, 2) of 1 downwards of the held dofs of the top."""
        u = np.zeros((self.body.body.count, 2))
        top = self.body.grid.top
        u[top, 1] = -1.0 * held.reshape(-1, 2)[top, 1]
        return u


def _extrapolated(found: Sequence[Equilibrium], depth: float) -> Floats:
    """Return the displacements that a polynomial of the depth through equilibria has at a depth."""
    depths = [one.depth for one in found]
    u = np.zeros_like(found[0].u)
    for one in found:
        others = [other for other in depths if other != one.depth]
        u = u + one.u * float(np.prod([(depth - other) / (one.depth - other) for other in others]))
    return u
