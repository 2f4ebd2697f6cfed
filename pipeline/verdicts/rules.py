"""Is it good enough: one rule for each kind of target, against its value with its error bar and its tolerance."""

import math
from dataclasses import replace

import numpy as np

from cad.design.parameters import Targets
from cad.quantity import Estimate
from cad.verdict import Verdict
from pipeline.options import TOLERANCES
from pipeline.springs.fitted_spring import FittedSpring
from solve.contact.linear_response import SensorResponse

P_MAX_TOLERANCE = 0.01  # of the target
NL_TOLERANCE = 0.001
STIFFNESS_TOLERANCE = 0.001  # of the target, for springs of one piece
FITTED_TOLERANCE = 0.005  # with gauges or pins glued on, where no mesh knows them to 0.1 %
SPREAD_TOLERANCE = 0.01
_PARTS = 2.0  # an error of P or of NL adds those of both springs and of the contact

_ZERO = Estimate(0.0, 0.0)
UNDECIDED = "undecided by its error bar"


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


def tolerance_remedy(verdict: Verdict, asked: float) -> str | None:
    """Return the `--tol` [1] that would decide a verdict that its error bar leaves undecided, None for any other."""
    limit, tolerance, error = verdict.limit, verdict.tolerance, verdict.error
    if verdict.passed is not None or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return None
    scale = abs(limit) or 1.0
    allowed = tolerance if verdict.relative else tolerance / scale
    if error / scale <= allowed:
        return None
    tighter = deciding_tolerance(asked, allowed, error / scale)
    return f"{UNDECIDED}, no --tol would decide" if tighter is None else f"{UNDECIDED}, --tol {tighter:g} would decide"


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


def target_verdicts(
    P_max: Estimate | None, NL: Estimate | None, targets: Targets, of_what: str = "", *, manufactured: bool = True
) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL [1], `of_what` in words.

    A value that is missing, because a tip is off the fruit, fails; springs that were not made leave both undecided.
    """
    P_words = f"force ratio at E_max {of_what}; tolerance relative to the target"
    NL_words = f"departure of P from its straight line, {targets.NL_definition}, {of_what}; tolerance absolute"
    verdicts = (
        target_verdict("P_max", P_max or _ZERO, targets.P_max, P_MAX_TOLERANCE, P_words, relative=True),
        target_verdict("NL", NL or _ZERO, targets.NL, NL_TOLERANCE, NL_words),
    )
    found = tuple(
        _lifted(verdict) if estimate is None else verdict
        for verdict, estimate in zip(verdicts, (P_max, NL), strict=True)
    )
    return found if manufactured else tuple(replace(verdict, passed=None) for verdict in found)


def _lifted(verdict: Verdict) -> Verdict:
    """Return a verdict that fails without a value, because a tip is off the fruit."""
    reference = "a tip is off the fruit at full travel, so that there is no force ratio"
    return replace(verdict, value=None, error=None, passed=False, reference=reference)


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


def displacement_verdict(table: SensorResponse, drift: str = "") -> Verdict:
    """Return the verdict on the spread of P over the travel [1], the worst of all moduli; `drift` is said beside it.

    The spread may be off by twice the error of P where cells are solved, at large strain by what P may be off more at
    one travel than at another; where P is one number it is exact.
    """
    name = "P_displacement_independent"
    spreads = [_spread(P) for P in table.P]
    measured = [spread for spread in spreads if spread is not None]
    if len(measured) < len(spreads) or not measured:
        lifted = "a tip is off the fruit for the whole travel, or for all but one step of it"
        verdict = target_verdict(name, Estimate(0.0, 0.0), 0.0, SPREAD_TOLERANCE, lifted)
        return replace(verdict, value=None, error=None, passed=False)
    errors = table.P_error[np.isfinite(table.P_error)]
    error = 2.0 * float(errors.max()) if table.cells and errors.size else float(np.ptp(table.P_step, axis=1).max())
    words = "(max P - min P) / mean P over the travel, the worst of all E" + drift
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
