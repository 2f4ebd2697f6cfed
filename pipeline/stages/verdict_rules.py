"""Is it good enough: one rule for each kind of target, against its value with its error bar and its tolerance."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cad.design.parameters import Targets
from cad.quantity import Estimate
from cad.theory.two_spring_law import (
    Springs,
    force_ratio,
    nonlinearity,
    series_ratio,
    stiffness_at_largest_nonlinearity,
)
from cad.verdict import Verdict
from pipeline.options import TOLERANCES
from pipeline.stages.springs import FittedSpring
from solve.contact.linear_response import SensorResponse
from solve.error_estimate import propagated

P_MAX_TOLERANCE = 0.01  # of the target
NL_TOLERANCE = 0.001
STIFFNESS_TOLERANCE = 0.001  # of the target, for springs of one piece
FITTED_TOLERANCE = 0.005  # with gauges or pins glued on, where no mesh knows them to 0.1 %
SPREAD_TOLERANCE = 0.01
_PARTS = 2.0  # an error of P or of NL adds those of both springs and of the contact

Law = Callable[[Springs, float, float], float]


@dataclass(frozen=True, kw_only=True)
class Characteristic:
    """P over the fruit's stiffness: the springs and the largest fruit stiffness they meet [N/mm], each with its error.

    `stiffness_ratio` [1] is the fruit's stiffness under the high tip over that under the low one.
    """

    springs: Springs
    K_m_max: float
    spring_errors: tuple[float, ...] = (0.0, 0.0)
    K_m_error: float = 0.0
    stiffness_ratio: float = 1.0

    def at(self, K_m: float) -> "Characteristic":
        """Return that of the same springs up to another fruit stiffness [N/mm], known to the same share."""
        return replace(self, K_m_max=K_m, K_m_error=self.K_m_error * K_m / self.K_m_max)

    def P_max(self) -> Estimate:
        """Return the largest force ratio [1]."""
        return self._estimate(force_ratio)

    def NL(self, targets: Targets) -> Estimate:
        """Return the nonlinearity [1] by the definition of the targets."""
        return self._estimate(lambda springs, K_m, ratio: nonlinearity(springs, K_m, targets.NL_definition, ratio))

    def K_m_of_NL(self, targets: Targets) -> float:
        """Return the fruit stiffness at which the definition of the targets takes the nonlinearity [N/mm]."""
        if targets.NL_definition == "mid-range":
            return 0.5 * self.K_m_max
        return stiffness_at_largest_nonlinearity(self.springs.K_h / self.stiffness_ratio, self.K_m_max)

    def force_ratio_with(self, K_m: float, springs: Sequence[float], fruit: Sequence[float]) -> float:
        """Return P at a fruit stiffness [N/mm] with the springs and the fruit under each tip changed by factors [1]."""
        K_l, K_h = springs[0] * self.springs.K_l, springs[1] * self.springs.K_h
        return series_ratio(K_l, K_h, K_m * fruit[0], self.stiffness_ratio * K_m * fruit[1])

    def _estimate(self, law: Law) -> Estimate:
        values = (*self.springs.stiffnesses, self.K_m_max, self.stiffness_ratio)
        # In the middle of the fruit both tips meet the same stiffness, and no error of a solve parts them.
        share = 0.0 if self.stiffness_ratio == 1.0 else self.K_m_error / self.K_m_max
        errors = (*self.spring_errors, self.K_m_error, share * self.stiffness_ratio)

        def value(K_l: float, K_h: float, K_m: float, ratio: float) -> float:
            return law(Springs(K_l=K_l, K_h=K_h), K_m, ratio)

        return Estimate(value(*values), propagated(value, values, errors))


def target_verdict(
    name: str, estimate: Estimate, limit: float, tolerance: float, reference: str, *, relative: bool = False
) -> Verdict:
    """Return the verdict that passes when a value lies within the tolerance of its limit [unit of the estimate].

    The tolerance is a share of the limit where `relative` [1]. Undecided where the error bar is wider than the
    tolerance and the value not farther off than both together.
    """
    allowed = tolerance * limit if relative else tolerance
    distance = abs(estimate.value - limit)
    passed: bool | None = distance <= allowed
    if estimate.error > allowed:
        passed = False if distance > allowed + estimate.error else None
    return Verdict(
        name=name,
        value=estimate.value,
        unit=estimate.unit,
        limit=limit,
        tolerance=tolerance,
        passed=passed,
        reference=reference,
        error=estimate.error,
        relative=relative,
    )


def margin_verdict(name: str, estimate: Estimate, limit: float, reference: str, *, at_most: bool = False) -> Verdict:
    """Return the verdict that passes when a value reaches its limit, or stays under it [unit of the estimate].

    Undecided where the error bar reaches across the limit.
    """
    margin = limit - estimate.value if at_most else estimate.value - limit
    return Verdict(
        name=name,
        value=estimate.value,
        unit=estimate.unit,
        limit=limit,
        tolerance=0.0,
        passed=margin >= 0.0 if abs(margin) > estimate.error else None,
        reference=reference,
        error=estimate.error,
    )


def deciding_tolerance(asked: float, allowed: float, error: float) -> float | None:
    """Return the `--tol` [1], of one digit, that brings a relative error down to what is allowed; None where none does.

    An error beyond what all parts have at the tolerance asked for was met by no mesh: a smaller tolerance does not
    help.
    """
    if not 0.0 < allowed < error <= _PARTS * asked:
        return None
    wanted = allowed / _PARTS
    digit = 10.0 ** math.floor(math.log10(wanted))
    rounded = round(math.floor(wanted / digit * (1.0 + 1e-9)) * digit, 12)
    return rounded if rounded < asked and TOLERANCES.hold(rounded) else None


def with_tolerance_advice(verdict: Verdict, asked: float) -> Verdict:
    """Return a verdict whose error bar leaves it undecided with the `--tol` [1] that would decide it."""
    limit, tolerance, error = verdict.limit, verdict.tolerance, verdict.error
    if verdict.passed is not None or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return verdict
    scale = abs(limit) or 1.0
    allowed = tolerance if verdict.relative else tolerance / scale
    if error / scale <= allowed:
        return verdict
    tighter = deciding_tolerance(asked, allowed, error / scale)
    advice = "no --tol would decide" if tighter is None else f"--tol {tighter:g} would decide"
    return replace(verdict, reference=f"{verdict.reference}; undecided by its error bar, {advice}")


def printable_verdict(spring: FittedSpring) -> Verdict:
    """Return the verdict on whether the process can make one spring: its value is the leaf length [mm]."""
    printable, strain = spring.printable, spring.root_strain
    reason, passed, limit = printable.reason, printable.passed, printable.strain_limit
    if strain is not None and strain.value + strain.error > limit:
        share = f"{strain.value:.3g} ± {strain.percent:.2g} %"
        reason = f"{reason}; FE root strain {share} must be at most {limit:g}"
        passed = False if strain.value > limit or passed is False else None
    return Verdict(
        name=printable.name,
        value=printable.length_mm,
        unit="mm",
        limit=f"{printable.shortest_mm:g} to {printable.longest_mm:g}",
        tolerance=None,
        passed=passed,
        reference=reason,
    )


def target_verdicts(own: Characteristic, targets: Targets, *, manufactured: bool = True) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL [1]; undecided for springs that were not made."""
    of_what = "of a level sensor on flat fruit" if manufactured else "of the target stiffnesses, which were not made"
    P_words = f"force ratio at E_max {of_what}; tolerance relative to the target"
    NL_words = f"departure of P from its straight line, {targets.NL_definition}, {of_what}; tolerance absolute"
    P_max = target_verdict("P_max", own.P_max(), targets.P_max, P_MAX_TOLERANCE, P_words, relative=True)
    NL = target_verdict("NL", own.NL(targets), targets.NL, NL_TOLERANCE, NL_words)
    return (P_max, NL) if manufactured else (replace(P_max, passed=None), replace(NL, passed=None))


def stiffness_verdict(name: str, spring: FittedSpring, *, monolithic: bool = True) -> Verdict:
    """Return the verdict on one spring [N/m]; undecided when it was not made.

    One that is not of one piece, with gauges or pins glued on, may miss by more where it is not known to the tolerance.
    """
    limit, K = 1e3 * spring.target, spring.K
    sharp = monolithic or K is None or K.error <= STIFFNESS_TOLERANCE * spring.target
    tolerance = STIFFNESS_TOLERANCE if sharp else FITTED_TOLERANCE
    if K is None:
        verdict = target_verdict(name, Estimate(limit, 0.0, "N/m"), limit, tolerance, "", relative=True)
        return replace(verdict, value=None, error=None, passed=None, reference="not made, so not solved")
    words = "FE of the exported housing; tolerance relative"
    return target_verdict(name, K.times(1e3, "N/m"), limit, tolerance, words, relative=True)


def displacement_verdict(table: SensorResponse) -> Verdict:
    """Return the verdict on the spread of P over the travel [1], the worst of all moduli.

    The spread may be off by twice the error of P where cells are solved; where P is one number it is exact.
    """
    name = "P_displacement_independent"
    spreads = [_spread(P) for P in table.P]
    measured = [spread for spread in spreads if spread is not None]
    if len(measured) < len(spreads) or not measured:
        lifted = "a tip is off the fruit for the whole travel, or for all but one step of it"
        verdict = target_verdict(name, Estimate(0.0, 0.0), 0.0, SPREAD_TOLERANCE, lifted)
        return replace(verdict, value=None, error=None, passed=False)
    errors = table.P_error[np.isfinite(table.P_error)]
    error = 2.0 * float(errors.max()) if table.cells and errors.size else 0.0
    words = "(max P - min P) / mean P over the travel, the worst of all E"
    return target_verdict(name, Estimate(max(measured), error), 0.0, SPREAD_TOLERANCE, words)


def _spread(P: np.ndarray) -> float | None:
    touching = P[np.isfinite(P)]
    return float(np.ptp(touching) / touching.mean()) if len(touching) > 1 else None


def monotonic_verdict(scan: SensorResponse) -> Verdict:
    """Return the verdict on P rising with E at the end of the travel [1]; moduli in rising order, at least two."""
    P = scan.P[:, -1]
    least = float((np.diff(P) / P[:-1]).min()) if np.isfinite(P).all() else None
    reference = "smallest relative step of P between neighbouring E at full travel"
    return Verdict(
        name="P_monotonic",
        value=least,
        unit="1",
        limit="greater than 0",
        tolerance=None,
        passed=least is not None and least > 0.0,
        reference="a tip is off the fruit at full travel" if least is None else reference,
    )


def bruise_verdict(pressure: Estimate, limit: float) -> Verdict:
    """Return the verdict on the mean pressure under a tip [MPa] against the fruit's limit."""
    words = "largest force over the face of a tip, at the largest E and full travel; must be at most the limit"
    return margin_verdict("bruise", pressure, limit, words, at_most=True)
