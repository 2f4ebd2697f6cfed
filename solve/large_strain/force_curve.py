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

DEPTH_SHARES = (0.005, 0.02, 0.04, 0.08, 0.12, 0.17, 0.25, 1 / 3, 5 / 12, 0.5, 7 / 12, 2 / 3, 0.75, 5 / 6, 11 / 12, 1.0)
DOME_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
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
        self._check(depth)
        curve = PchipInterpolator(self.depths, self.factors)
        return np.asarray(curve(np.maximum(depth, self.depths[0])), dtype=np.float64)

    def force(self, depth: Floats) -> tuple[Floats, Floats]:
        """Return g(d) d [tip sides] and its slope [1] at depths d [tip sides] of any shape; 0 above the skin.

        Beyond the deepest that was solved the factor goes on as at it, for iterations on the way to an equilibrium.
        """
        within = np.clip(depth, self.depths[0], self.depths[-1])
        curve = PchipInterpolator(self.depths, self.factors)
        inside, touching = within == depth, np.maximum(depth, 0.0)
        slope = curve(within) + np.where(inside, touching * curve.derivative()(within), 0.0)
        return np.asarray(curve(within) * touching), np.where(depth > 0.0, slope, 0.0)

    def error(self, depth: Floats) -> Floats:
        """Return the error of the factor [1] at depths [tip sides] of any shape; raises as `factor`."""
        self._check(depth)
        return np.interp(depth, self.depths, self.errors)

    def _check(self, depth: Floats) -> None:
        deepest = float(np.max(depth, initial=0.0))
        if deepest > self.reached * (1.0 + 1e-9):
            bound = f"at most {self.reached:.3g} tip sides, the deepest equilibrium that was found"
            raise validation_error(
                "depth", deepest, "tip sides", bound, "press less deep, or take wider or rounder tips"
            )


def force_curve(tip: TipProfile, law: FleshLaw, deepest: float, *, slides: bool = False) -> ForceCurve:
    """Return the curve of a tip down to a depth [tip sides], or as deep as both meshes found the same equilibrium.

    Raises InputError where the depth is not positive or beyond a dome's fine elements, and for a sharp edge that slides
    or a dome that grips; SolveError where no depth was found.
    """
    _check_depth(tip, deepest)
    _check_grip(tip, slides=slides)
    start = time.perf_counter()
    depths = [share * deepest for share in (DOME_SHARES if isinstance(tip, Dome) else DEPTH_SHARES)]
    solved = _solved_tip(tip)
    presses = [TipPress(tip=solved, law=law, slides=slides, refinement=each) for each in REFINEMENTS]
    coarse, fine = (pressed(press, depths) for press in presses)
    count = _agreed(presses[0], coarse, fine)
    if count == 0:
        msg = f"large strain: no equilibrium at {depths[0]:.3g} tip sides; take press.strain = 'linear'"
        raise SolveError(msg)
    curve = _curve(presses[-1], coarse, fine, count)
    if isinstance(tip, FlatTip) and solved != tip:
        curve = _rounded(curve, tip)
    status = _status(coarse, fine, depths, count)
    info = replace(curve.info, seconds=time.perf_counter() - start, status=status)
    return replace(curve, asked=deepest, info=info)


def _solved_tip(tip: TipProfile) -> TipProfile:
    """Return the tip that is solved: a sharp one for a fillet too small to be worth its elements."""
    if isinstance(tip, FlatTip) and tip.edge <= LEAST_SOLVED_EDGE * tip.radius:
        return replace(tip, edge=0.0)
    return tip


def _rounded(curve: ForceCurve, tip: FlatTip) -> ForceCurve:
    """Return the curve of a sharp tip less what a small fillet takes off; half of that is its error."""
    lost = fillet_loss(tip.radius, tip.edge, np.array(curve.depths))
    factors, errors = np.array(curve.factors) * (1.0 - lost), np.array(curve.errors) + 0.5 * lost
    return replace(curve, factors=tuple(factors.tolist()), errors=tuple(errors.tolist()))


def _agreed(press: TipPress, coarse: PressedForces, fine: PressedForces) -> int:
    """Return at how many depths both meshes found an equilibrium and the same one."""
    count = min(len(coarse.depths), len(fine.depths))
    body = _body_compliance(press.tip, press.law, coarse, fine)
    (_, before), (_, factors) = (_factors(press, each, count, body) for each in (coarse, fine))
    parted = np.flatnonzero(np.abs(factors - before) > MOST_APART)
    return int(parted[0]) if len(parted) else count


def _curve(press: TipPress, coarse: PressedForces, fine: PressedForces, count: int) -> ForceCurve:
    """Return the curve of the first `count` depths; `press` is that on the finer mesh."""
    body = _body_compliance(press.tip, press.law, coarse, fine)
    (_, before), (depths, factors) = (_factors(press, each, count, body) for each in (coarse, fine))
    # The step between the meshes changes sign on the way down: its largest so far counts, and at least the rim's share.
    between = np.maximum.accumulate(np.abs(factors - before))
    errors = np.maximum(between, rim_error(press, depths)) + unseen_error(press, fine.sharp / fine.sliding, depths)
    method = f"axisymmetric, finite strain, {press.law.name}"
    return ForceCurve(
        depths=tuple(depths.tolist()),
        factors=tuple(factors.tolist()),
        errors=tuple(errors.tolist()),
        grip=fine.sharp / fine.sliding,
        asked=float(fine.depths[count - 1]),
        info=SolveInfo(method=method, dofs=fine.dofs, seconds=0.0, status=""),
    )


def _check_depth(tip: TipProfile, deepest: float) -> None:
    if not deepest > 0.0:
        raise validation_error("deepest", deepest, "tip sides", "greater than 0", "ask for the depth of the press")
    if isinstance(tip, Dome) and deepest > tip.deepest:
        bound = f"at most {tip.deepest:.3g} tip sides, where contact leaves the fine elements"
        raise validation_error(
            "deepest", deepest, "tip sides", bound, "press less deep, or give the dome a larger radius of contact"
        )


def _check_grip(tip: TipProfile, *, slides: bool) -> None:
    """Refuse what a node by node contact does not resolve: a sharp edge that slides, a dome that grips."""
    if isinstance(tip, Dome) and not slides:
        raise validation_error(
            "slides", slides, "", "True for a dome", "where a dome grips depends on how it came there"
        )
    if slides and not isinstance(tip, Dome) and tip.edge < LEAST_SLIDING_EDGE * tip.radius:
        bound = f"at least {LEAST_SLIDING_EDGE * tip.radius:.3g} tip sides where the tip slides"
        raise validation_error(
            "edge", tip.edge, "tip sides", bound, "flesh folds round a sharp edge that slides: round it"
        )


def _factors(press: TipPress, found: PressedForces, count: int, body: float) -> tuple[Floats, Floats]:
    """Return depths [tip sides] and the force over the linear one [1], both (count,).

    `body` [1 / tip side] is what the finite body adds to the compliance of a half-space times E; under a dome it is
    taken off the depth, as the depth of Hertz's law is that in a half-space.
    """
    depths, forces = found.depths[:count], found.forces[:count]
    tip, law = press.tip, press.law
    if not isinstance(tip, Dome):
        return depths, forces / (found.sharp * depths)
    entered = depths - body * forces
    modulus = 1.0 / (1.0 - law.poisson**2)
    return entered, forces / (force_factor(modulus, tip.sphere) * entered**1.5)


def _body_compliance(tip: TipProfile, law: FleshLaw, coarse: PressedForces, fine: PressedForces) -> float:
    """Return what the finite body adds to the compliance of a round punch on a half-space, times E [1 / tip side].

    The stiffness of a sharp punch converges with the size of its elements, here to a half.
    """
    limit = 2.0 * fine.sliding - coarse.sliding
    return 1.0 / limit - (1.0 - law.poisson**2) / (2.0 * tip.radius)


def _status(coarse: PressedForces, fine: PressedForces, depths: list[float], count: int) -> str:
    meshes = f"meshes of {coarse.dofs} and {fine.dofs} unknowns, {fine.iterations} iterations"
    if count == len(depths):
        return f"{meshes}; every step converged"
    ends = "no equilibrium was found" if count == min(len(coarse.depths), len(fine.depths)) else "the meshes part"
    return f"{meshes}; {ends} beyond {depths[count - 1]:.3g} tip sides"
