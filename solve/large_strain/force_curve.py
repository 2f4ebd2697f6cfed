"""How the force on one tip departs from the linear one as it goes deeper: from two meshes, with errors."""

import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from cad.quantity import validation_error
from cad.theory.hertz import force_factor
from solve.arrays import Floats
from solve.error_estimate import SolveInfo
from solve.large_strain.curve_error import fillet_loss, rim_error, unseen_error
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.press import PressedForces, TipPress, pressed
from solve.large_strain.tip_profile import Dome, FlatTip, TipProfile
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
DOME_FRACTIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
REFINEMENTS = (1, 2)
LEAST_SLIDING_EDGE = 0.05  # of the tip's radius
LEAST_SOLVED_EDGE = 0.006  # of the tip's radius: half of what a smaller fillet takes off the force is 0.3 % at most
# Of a factor: meshes that part by more found two equilibria; elsewhere they part by 1.2 % at most. Hencky's law at
# nu < 0.2 snaps round a sharp edge, earlier and to less energy on each finer mesh: none of its branches is the limit.
MOST_APART = 0.02


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """The force over the linear one, `factors` [1] with their `errors` [1], at depths [tip sides] that were solved.

    The linear force of a flat tip is that of the sharp one with the same grip, of a dome that of Hertz. `grip` [1] is
    how much stiffer a tip that grips is than one that slides, at small strain. `asked` [tip sides] is the depth that
    was asked for: the curve ends before it where no equilibrium was found.
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

    def force(self, depth: Floats) -> tuple[Floats, Floats]:
        """Return g(d) d [tip sides] and its slope [1] at depths d [tip sides] of any shape; 0 above the skin.

        Beyond the deepest that was solved the factor goes on as at it, for iterations on the way to an equilibrium.
        """
        within = np.clip(depth, self.depths[0], self.depths[-1])
        curve = PchipInterpolator(self.depths, self.factors)
        inside = within == depth
        touching = np.maximum(depth, 0.0)
        slope = curve(within) + np.where(inside, touching * curve.derivative()(within), 0.0)
        return np.asarray(curve(within) * touching), np.where(depth > 0.0, slope, 0.0)

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


def force_curve(tip: TipProfile, law: FleshLaw, deepest: float, *, slides: bool = False) -> ForceCurve:
    """Return the curve of a tip down to a depth [tip sides], or as deep as both meshes found the same equilibrium.

    Raises InputError where the depth is not positive or beyond a dome's fine elements, and for a sharp edge that slides
    or a dome that grips; SolveError where no depth was found.
    """
    _check(tip, deepest, slides=slides)
    start = time.perf_counter()
    fractions = DOME_FRACTIONS if isinstance(tip, Dome) else DEPTH_FRACTIONS
    depths = [fraction * deepest for fraction in fractions]

    # A fillet too small to be worth its elements is solved as a sharp edge.
    solved_tip = tip
    if isinstance(tip, FlatTip) and tip.edge <= LEAST_SOLVED_EDGE * tip.radius:
        solved_tip = replace(tip, edge=0.0)
    press = TipPress(tip=solved_tip, law=law, slides=slides, refinement=REFINEMENTS[1])
    coarse = pressed(replace(press, refinement=REFINEMENTS[0]), depths)
    fine = pressed(press, depths)

    # What the finite body adds to the compliance of a round punch on a half-space, times E [1 / tip side]. The
    # stiffness of a sharp punch converges with the size of its elements, here to a half.
    limit = 2.0 * fine.sliding - coarse.sliding
    body_compliance = 1.0 / limit - (1.0 - law.poisson**2) / (2.0 * tip.radius)
    _, coarse_factors = _factors(press, coarse, body_compliance)
    entered, factors = _factors(press, fine, body_compliance)

    # The curve ends where a mesh found no equilibrium, or both found different ones.
    solved = min(len(coarse_factors), len(factors))
    difference = np.abs(factors[:solved] - coarse_factors[:solved])
    apart = np.flatnonzero(difference > MOST_APART)
    count = int(apart[0]) if len(apart) else solved
    if count == 0:
        msg = f"large strain: no equilibrium at {depths[0]:.3g} tip sides; take press.strain = 'linear'"
        raise SolveError(msg)
    status = f"meshes of {coarse.dofs} and {fine.dofs} unknowns, {fine.iterations} iterations"
    if count == len(depths):
        status += "; every step converged"
    else:
        ends = "no equilibrium was found" if count == solved else "the meshes part"
        status += f"; {ends} beyond {depths[count - 1]:.3g} tip sides"

    entered = entered[:count]
    factors = factors[:count]
    grip = fine.sharp / fine.sliding
    # The step between the meshes changes sign on the way down: its largest so far counts, and at least the rim's part.
    errors = np.maximum(np.maximum.accumulate(difference[:count]), rim_error(press, entered))
    errors = errors + unseen_error(press, grip, entered)
    if isinstance(tip, FlatTip) and solved_tip != tip:
        lost = fillet_loss(tip.radius, tip.edge, entered)  # half of it counts as its error
        factors = factors * (1.0 - lost)
        errors = errors + 0.5 * lost
    return ForceCurve(
        depths=tuple(entered.tolist()),
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


def _check(tip: TipProfile, deepest: float, *, slides: bool) -> None:
    """Refuse a depth out of reach, and what contact node by node does not resolve."""
    if not deepest > 0.0:
        raise validation_error("deepest", deepest, "tip sides", "greater than 0", "ask for the depth of the press")
    if isinstance(tip, Dome):
        if deepest > tip.deepest:
            bound = f"at most {tip.deepest:.3g} tip sides, where contact leaves the fine elements"
            hint = "press less deep, or give the dome a larger radius of contact"
            raise validation_error("deepest", deepest, "tip sides", bound, hint)
        if not slides:
            hint = "where a dome grips depends on how it came there"
            raise validation_error("slides", slides, "", "True for a dome", hint)
    elif slides and tip.edge < LEAST_SLIDING_EDGE * tip.radius:
        bound = f"at least {LEAST_SLIDING_EDGE * tip.radius:.3g} tip sides where the tip slides"
        hint = "flesh folds round a sharp edge that slides: round it"
        raise validation_error("edge", tip.edge, "tip sides", bound, hint)


def _factors(press: TipPress, solved: PressedForces, body_compliance: float) -> tuple[Floats, Floats]:
    """Return depths [tip sides] and the force over the linear one [1], both (depths,).

    Under a dome what the body adds is taken off the depth, as the depth of Hertz's law is that in a half-space.
    """
    if not isinstance(press.tip, Dome):
        return solved.depths, solved.forces / (solved.sharp * solved.depths)
    entered = solved.depths - body_compliance * solved.forces
    modulus = 1.0 / (1.0 - press.law.poisson**2)
    return entered, solved.forces / (force_factor(modulus, press.tip.sphere) * entered**1.5)
