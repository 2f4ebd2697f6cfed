"""Is it good enough: each target against what was computed, with its error bar and its tolerance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cad.design.parameters import Targets
from cad.theory.two_spring_law import Springs, force_ratio, nonlinearity
from cad.verdict import Verdict
from pipeline.accuracy import would_decide
from pipeline.stages.springs import PrintedSpring
from solve.contact.linear_response import Response
from solve.error_estimate import propagated

P_MAX_TOLERANCE = 0.01  # of the target
NL_TOLERANCE = 0.001
STIFFNESS_TOLERANCE = 0.001  # of the target, for springs of one piece
FITTED_TOLERANCE = 0.005  # with gauges or pins glued on, where no mesh knows them to 0.1 %
SPREAD_TOLERANCE = 0.01

PAPER = Springs(K_l=0.753, K_h=17.3)
PAPER_TARGETS = Targets(P_max=5.0, NL=0.05)

Law = Callable[[Springs, float, float], float]


@dataclass(frozen=True, kw_only=True)
class Judged:
    """Springs to be judged and the largest fruit stiffness they meet [N/mm], each with its error [same unit]."""

    springs: Springs
    K_m_max: float
    spring_errors: tuple[float, float] = (0.0, 0.0)
    K_m_error: float = 0.0
    asymmetry: float = 1.0

    def at(self, K_m: float) -> "Judged":
        """Return the same springs at another fruit stiffness [N/mm], known to the same share."""
        return replace(self, K_m_max=K_m, K_m_error=self.K_m_error * K_m / self.K_m_max)

    def P_max(self) -> tuple[float, float]:
        """Return the largest force ratio and its error [1]."""
        return self._with_error(force_ratio)

    def NL(self, targets: Targets) -> tuple[float, float]:
        """Return the nonlinearity by the definition of the targets, and its error [1]."""
        return self._with_error(lambda springs, K_m, q: nonlinearity(springs, K_m, targets.NL_definition, q))

    def _with_error(self, law: Law) -> tuple[float, float]:
        values = (self.springs.K_l, self.springs.K_h, self.K_m_max, self.asymmetry)
        # In the middle of the fruit both tips meet the same stiffness, and no error of a solve parts them.
        share = 0.0 if self.asymmetry == 1.0 else self.K_m_error / self.K_m_max
        errors = (*self.spring_errors, self.K_m_error, share * self.asymmetry)

        def of_numbers(K_l: float, K_h: float, K_m: float, q: float) -> float:
            return law(Springs(K_l=K_l, K_h=K_h), K_m, q)

        return of_numbers(*values), propagated(of_numbers, values, errors)


def printable_verdict(spring: PrintedSpring) -> Verdict:
    """Return the verdict on whether the process can make one spring: its value is the leaf length [mm]."""
    found = spring.printable
    strain, limit = spring.root_strain, found.strain_limit
    reason, passed = found.reason, found.passed
    if strain is not None and strain * (1.0 + 0.01 * (spring.strain_error_percent or 0.0)) > limit:
        share = f"{strain:.3g} ± {spring.strain_error_percent or 0.0:.2g} %"
        reason = f"{reason}; FE root strain {share} must be at most {limit:g}"
        passed = False if strain > limit or passed is False else None
    return Verdict(
        name=found.name,
        value=found.length_mm,
        unit="mm",
        limit=f"{found.shortest_mm:g} to {found.longest_mm:g}",
        tolerance=None,
        passed=passed,
        reference=reason,
    )


def decided(value: float, target: float, tolerance: float, error: float) -> bool | None:
    """Say whether a value lies within the tolerance of its target; None when its error bar does not let one say."""
    distance = abs(value - target)
    if error <= tolerance:
        return distance <= tolerance
    return False if distance > tolerance + error else None


def on_right_side(margin: float, error: float) -> bool | None:
    """Say whether a margin to a limit is on the right side; None when its error bar reaches across."""
    return margin >= 0.0 if abs(margin) > error else None


def advised(verdict: Verdict, asked: float) -> Verdict:
    """Return a verdict that its error bar leaves undecided with the `--tol` that would decide it in its reference."""
    limit, tolerance, error = verdict.limit, verdict.tolerance, verdict.error
    if verdict.passed is not None or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return verdict
    scale = abs(limit) or 1.0
    allowed = tolerance if verdict.relative else tolerance / scale
    if error / scale <= allowed:
        return verdict
    tighter = would_decide(asked, allowed, error / scale)
    advice = "no --tol would decide" if tighter is None else f"--tol {tighter:g} would decide"
    return replace(verdict, reference=f"{verdict.reference}; undecided by its error bar, {advice}")


def target_verdicts(judged: Judged, targets: Targets, *, made: bool = True) -> tuple[Verdict, Verdict]:
    """Return the verdicts on the largest force ratio and on the nonlinearity; undecided for springs not made."""
    of_what = "of a level sensor on flat fruit" if made else "of the target stiffnesses, which were not made"
    P_max, P_error = judged.P_max()
    NL, NL_error = judged.NL(targets)
    return (
        Verdict(
            name="P_max",
            value=P_max,
            unit="1",
            limit=targets.P_max,
            tolerance=P_MAX_TOLERANCE,
            passed=decided(P_max, targets.P_max, P_MAX_TOLERANCE * targets.P_max, P_error) if made else None,
            reference=f"force ratio at E_max {of_what}; tolerance relative to the target",
            error=P_error,
            relative=True,
        ),
        Verdict(
            name="NL",
            value=NL,
            unit="1",
            limit=targets.NL,
            tolerance=NL_TOLERANCE,
            passed=decided(NL, targets.NL, NL_TOLERANCE, NL_error) if made else None,
            reference=f"departure of P from its straight line, {targets.NL_definition}, {of_what}; tolerance absolute",
            error=NL_error,
        ),
    )


def stiffness_verdict(name: str, spring: PrintedSpring, error: float, *, plain: bool = True) -> Verdict:
    """Return the verdict on one spring [N/mm in, N/m out]; undecided when it was not made.

    One that is not `plain`, with gauges or pins glued on, may miss by more where it is not known to the tolerance.
    """
    target, found = spring.target, spring.stiffness
    tolerance = STIFFNESS_TOLERANCE if plain or error <= STIFFNESS_TOLERANCE * target else FITTED_TOLERANCE
    return Verdict(
        name=name,
        value=None if found is None else 1e3 * found,
        unit="N/m",
        limit=1e3 * target,
        tolerance=tolerance,
        passed=None if found is None else decided(found, target, tolerance * target, error),
        reference="not made, so not solved" if found is None else "FE of the exported housing; tolerance relative",
        error=None if found is None else 1e3 * error,
        relative=True,
    )


def displacement_verdict(responses: Sequence[Response], error: float = 0.0) -> Verdict:
    """Return the verdict on the spread of P over the travel, the worst of all moduli, known within an error [1]."""
    spreads = [_spread(response.P) for response in responses]
    known = [spread for spread in spreads if spread is not None]
    worst = max(known) if len(known) == len(spreads) and known else None
    return Verdict(
        name="P_displacement_independent",
        value=worst,
        unit="1",
        limit=0.0,
        tolerance=SPREAD_TOLERANCE,
        passed=worst is not None and decided(worst, 0.0, SPREAD_TOLERANCE, error),
        reference="(max P - min P) / mean P over the travel, the worst of all E"
        if worst is not None
        else "a tip is off the fruit for the whole travel, or for all but one step of it",
        error=error if worst is not None else None,
    )


def _spread(P: np.ndarray) -> float | None:
    both = P[np.isfinite(P)]
    return float(np.ptp(both) / both.mean()) if len(both) > 1 else None


def monotonic_verdict(responses: Sequence[Response]) -> Verdict:
    """Return the verdict on P rising with E at the end of the travel; responses in order of E, at least two."""
    P = np.array([response.P[-1] for response in responses])
    steps = np.diff(P) / P[:-1]
    least = float(steps.min()) if np.isfinite(P).all() else None
    return Verdict(
        name="P_monotonic",
        value=least,
        unit="1",
        limit="greater than 0",
        tolerance=None,
        passed=least is not None and least > 0.0,
        reference="smallest relative step of P between neighbouring E at full travel"
        if least is not None
        else "a tip is off the fruit at full travel",
    )


def bruise_verdict(pressure: float, limit: float, error: float) -> Verdict:
    """Return the verdict on the mean pressure under a tip, known within an error, against the fruit's limit [MPa]."""
    return Verdict(
        name="bruise",
        value=pressure,
        unit="MPa",
        limit=limit,
        tolerance=0.0,
        passed=on_right_side(limit - pressure, error),
        reference="largest force over the face of a tip, at the largest E and full travel; must be at most the limit",
        error=error,
    )
