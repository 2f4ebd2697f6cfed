"""How the force on one tip departs from the linear one as it goes deeper: from two meshes, with errors."""

import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from reference.flat_punch.curve_error import fillet_loss, rim_error, unseen_error
from reference.flat_punch.press import TipPress, pressed
from reference.flat_punch.tip_profile import RoundTip
from sensor.arrays import Floats
from sensor.quantity import validation_error
from solve.compression.flesh_law import FleshLaw
from solve.error_estimate import SolveInfo
from solve.linear import SolveError

DEPTH_FRACTIONS = (
    0.005,
    0.02,
    0.04,
    0.08,
    0.12,
    0.17,
    0.25,
    1 / 3,
    5 / 12,
    0.5,
    7 / 12,
    2 / 3,
    0.75,
    5 / 6,
    11 / 12,
    1.0,
)
REFINEMENTS = (1, 2)
LEAST_SOLVED_EDGE = 0.006  # of the tip's radius: half of what a smaller fillet takes off the force is 0.3 % at most
# Of a factor: meshes that part by more found two equilibria; elsewhere they part by 1.2 % at most. Hencky's law at
# nu < 0.2 snaps round a sharp edge, earlier and to less energy on each finer mesh: none of its branches is the limit.
MOST_APART = 0.02


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """The force over the linear one, `factors` [1] with their `errors` [1], at depths [tip sides] that were solved.

    The linear force is that of the sharp tip, which grips too. `grip` [1] is how much stiffer it is than one that
    slides, at small strain. `asked` [tip sides] is the depth that was asked for: the curve ends before it where no
    equilibrium was found.
    """

    depths: tuple[float, ...]
    factors: tuple[float, ...]
    errors: tuple[float, ...]
    grip: float
    asked: float
    info: SolveInfo

    @property
    def reached(self) -> float:
        """Return the deepest depth that was solved [tip sides]."""
        return self.depths[-1]

    def factor(self, depth: Floats) -> Floats:
        """Return the force over the linear one [1] at depths [tip sides] of any shape.

        Before the first depth it is that at the first. Raises InputError beyond the deepest that was solved.
        """
        self._check_depth(depth)
        curve = PchipInterpolator(self.depths, self.factors)
        return np.asarray(curve(np.maximum(depth, self.depths[0])), dtype=np.float64)

    def error(self, depth: Floats) -> Floats:
        """Return the error of the factor [1] at depths [tip sides] of any shape; raises as `factor`."""
        self._check_depth(depth)
        return np.interp(depth, self.depths, self.errors)

    def _check_depth(self, depth: Floats) -> None:
        deepest = float(np.max(depth, initial=0.0))
        if deepest > self.reached * (1.0 + 1e-9):
            bound = f"at most {self.reached:.3g} tip sides, the deepest equilibrium that was found"
            hint = "press less deep, or take wider or rounder tips"
            raise validation_error("depth", deepest, "tip sides", bound, hint)


def force_curve(tip: RoundTip, law: FleshLaw, deepest: float) -> ForceCurve:
    """Return the curve of a tip down to a depth [tip sides], or as deep as both meshes found the same equilibrium.

    The tip grips the skin. Raises InputError where the depth is not positive, SolveError where no depth was found.
    """
    if not deepest > 0.0:
        raise validation_error("deepest", deepest, "tip sides", "greater than 0", "ask for the depth of the press")
    start = time.perf_counter()
    depths = [fraction * deepest for fraction in DEPTH_FRACTIONS]

    # A fillet too small to be worth its elements is solved as a sharp edge.
    solved_tip = tip
    if tip.edge <= LEAST_SOLVED_EDGE * tip.radius:
        solved_tip = replace(tip, edge=0.0)
    press = TipPress(tip=solved_tip, law=law, refinement=REFINEMENTS[1])
    coarse = pressed(replace(press, refinement=REFINEMENTS[0]), depths)
    fine = pressed(press, depths)

    coarse_factors = coarse.forces / (coarse.sharp * coarse.depths)
    factors = fine.forces / (fine.sharp * fine.depths)
    solved = min(len(coarse_factors), len(factors))
    difference = np.abs(factors[:solved] - coarse_factors[:solved])
    count = _common_depths(difference, depths[0])
    status = f"meshes of {coarse.dofs} and {fine.dofs} unknowns, {fine.iterations} iterations"
    if count == len(depths):
        status += "; every step converged"
    else:
        ends = "no equilibrium was found" if count == solved else "the meshes part"
        status += f"; {ends} beyond {depths[count - 1]:.3g} tip sides"

    solved_depths = fine.depths[:count]
    factors = factors[:count]
    grip = fine.sharp / fine.sliding
    # The step between the meshes changes sign on the way down: its largest so far counts, and at least the rim's part.
    errors = np.maximum(np.maximum.accumulate(difference[:count]), rim_error(press, solved_depths))
    errors = errors + unseen_error(press, grip, solved_depths)
    if solved_tip != tip:
        lost = fillet_loss(tip.radius, tip.edge, solved_depths)  # half of it counts as its error
        factors = factors * (1.0 - lost)
        errors = errors + 0.5 * lost
    return ForceCurve(
        depths=tuple(solved_depths.tolist()),
        factors=tuple(factors.tolist()),
        errors=tuple(errors.tolist()),
        grip=grip,
        asked=deepest,
        info=SolveInfo(
            method=f"axisymmetric, finite strain, {law.name}",
            dofs=fine.dofs,
            seconds=time.perf_counter() - start,
            status=status,
        ),
    )


def _common_depths(difference: Floats, first_depth: float) -> int:
    """Return at how many depths both meshes found the same equilibrium; raises SolveError where at none.

    `difference` is that of their factors [1] at the depths that both solved, the first of which is in [tip sides].
    """
    apart = np.flatnonzero(difference > MOST_APART)
    count = int(apart[0]) if len(apart) else len(difference)
    if count == 0:
        msg = f"large strain: no equilibrium at {first_depth:.3g} tip sides"
        raise SolveError(msg)
    return count
