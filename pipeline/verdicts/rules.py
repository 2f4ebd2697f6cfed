"""Is it good enough: one rule for each kind of target, against its value with its error bar and its tolerance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.options import TOLERANCES
from pipeline.reading.analysis import Readings, SkinPressure
from pipeline.reading.over_time import ReadingOverTime
from pipeline.response.scene_press import ScenePress
from pipeline.springs.fitted_springs import FittedSpring
from pipeline.storage.plain import first_largest
from sensor.design.parameters import Design, Targets
from sensor.design.reading import LARGEST_TOUCH_FRACTION, Reading
from sensor.quantity import Estimate
from sensor.theory.hertz import contact_reach, relative_radius
from sensor.tips.layouts import Position
from sensor.verdict import Verdict, all_passed, failed_verdict, one_sided
from sensor.words import rounded, with_bar
from solve.contact.linear_response import SensorResponse

P_MAX_TOLERANCE = 0.01  # of the target
NL_TOLERANCE = 0.001
STIFFNESS_TOLERANCE = 0.001  # of the target, for springs of one piece
FITTED_TOLERANCE = 0.005  # with pins glued on, where no mesh knows them to 0.1 %
SPREAD_TOLERANCE = 0.01
_PARTS = 2.0  # an error of P or of NL adds those of both springs and of the contact
_STIFFNESSES = ("K_l", "K_h")  # whose errors are those of their spring only
UNDECIDED = "undecided by its error bar"
LIFTED = "a tip is off the fruit at full travel, so that there is no force ratio"


@dataclass(frozen=True, kw_only=True)
class TargetValue:
    """A number that a value must meet [unit], within a tolerance [unit], which is a fraction [1] where `relative`."""

    limit: float
    tolerance: float
    relative: bool = False
    unit: str = "1"

    @property
    def allowed_miss(self) -> float:
        """Return the largest distance of a value from the target [unit]."""
        return self.tolerance * self.limit if self.relative else self.tolerance


def target_verdict(name: str, estimate: Estimate | None, target: TargetValue, reference: str) -> Verdict:
    """Return the verdict that passes when a value lies within the tolerance of its target; without a value it fails.

    It is undecided where the error bar is wider than the tolerance, unless the value is farther off than both together.
    """
    passed: bool | None = False
    if estimate is not None:
        allowed = target.allowed_miss
        distance = abs(estimate.value - target.limit)
        passed = distance <= allowed
        if estimate.error > allowed:
            passed = False if distance > allowed + estimate.error else None
    return Verdict(
        name=name,
        value=None if estimate is None else estimate.value,
        unit=target.unit,
        limit=target.limit,
        tolerance=target.tolerance,
        passed=passed,
        reference=reference,
        error=None if estimate is None else estimate.error,
        relative=target.relative,
    )


def margin_verdict(name: str, estimate: Estimate, limit: float, reference: str, *, at_most: bool = False) -> Verdict:
    """Return the verdict that passes when a value reaches its limit, or does not exceed it [unit of the estimate].

    Undecided where the error bar reaches across the limit; a value without an error that lies on its limit passes.
    """
    margin = limit - estimate.value if at_most else estimate.value - limit
    verdict = Verdict(
        name=name,
        value=estimate.value,
        unit=estimate.unit,
        limit=limit,
        tolerance=0.0,
        passed=margin >= 0.0 if abs(margin) >= estimate.error else None,
        reference=reference,
        error=estimate.error,
    )
    return one_sided(verdict, "at most" if at_most else "at least")


def tolerance_hint(verdict: Verdict, asked: float) -> str | None:
    """Return a hint for a verdict that its error bar leaves undecided: the `--tol` that would decide it, if any does.

    `asked` is the relative tolerance [1] of the run. There is no hint for any other verdict.
    """
    limit = verdict.limit
    tolerance = verdict.tolerance
    error = verdict.error
    if verdict.passed is not None or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return None
    scale = abs(limit) or 1.0
    relative_error = error / scale
    allowed = tolerance if verdict.relative else tolerance / scale
    if relative_error <= allowed:
        return None
    # A larger error than all parts may have at the tolerance asked for was met by no mesh: a smaller one is no help.
    parts = 1.0 if verdict.name in _STIFFNESSES else _PARTS
    if allowed > 0.0 and relative_error <= parts * asked:
        tighter = rounded(allowed / parts, 1, towards=0.0)
        if tighter < asked and TOLERANCES.hold(tighter):
            return f"{UNDECIDED}, `--tol {tighter:g}` would decide"
    return f"{UNDECIDED}, no `--tol` would decide"


# Force ratio


def target_verdicts(
    P_max: Estimate | None, NL: Estimate | None, targets: Targets, of_what: str, *, manufactured: bool = True
) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL [1], `of_what` in words.

    A value that is missing, because a tip is off the fruit, fails; springs that were not made leave both undecided.
    """
    P_words = f"force ratio at E_max {of_what}; tolerance relative to the target"
    NL_words = f"departure of P from its straight line, {targets.NL_definition}, {of_what}; tolerance absolute"
    P_target = TargetValue(limit=targets.P_max, tolerance=P_MAX_TOLERANCE, relative=True)
    NL_target = TargetValue(limit=targets.NL, tolerance=NL_TOLERANCE)
    of_P = target_verdict("P_max", P_max, P_target, LIFTED if P_max is None else P_words)
    of_NL = target_verdict("NL", NL, NL_target, LIFTED if NL is None else NL_words)
    if not manufactured:
        return replace(of_P, passed=None), replace(of_NL, passed=None)
    return of_P, of_NL


def displacement_verdict(table: SensorResponse) -> Verdict:
    """Return the verdict on the spread of P over the travel [1], the worst of all moduli.

    The spread may be off by twice the error of P where cells are solved; where P is one number it is exact.
    """
    name = "P_displacement_independent"
    no_spread = TargetValue(limit=0.0, tolerance=SPREAD_TOLERANCE)
    largest = 0.0
    for P in table.P:
        touching = P[np.isfinite(P)]
        if touching.size <= 1:
            lifted = "a tip is off the fruit for the whole travel, or for all but one step of it"
            return target_verdict(name, None, no_spread, lifted)
        largest = max(largest, float(np.ptp(touching) / touching.mean()))
    errors = table.P_error[np.isfinite(table.P_error)]
    error = 2.0 * float(errors.max()) if table.cells and errors.size else 0.0
    words = "(max P - min P) / mean P over the travel, the worst of all E"
    return target_verdict(name, Estimate(largest, error), no_spread, words)


def monotonic_verdict(scan: SensorResponse) -> Verdict:
    """Return the verdict on P rising with E at the end of the travel [1]; moduli in rising order, at least two."""
    P = scan.P[:, -1]
    steps = np.diff(P) / P[:-1]
    least = float(steps.min())
    verdict = Verdict(
        name="P_monotonic",
        value=least,
        unit="1",
        limit="greater than 0",
        tolerance=None,
        passed=least > 0.0,
        reference="smallest relative step of P between neighbouring E at full travel",
    )
    if not np.isfinite(P).all():
        return replace(verdict, value=None, passed=False, reference="a tip is off the fruit at full travel")
    return verdict


# Springs


def stiffness_verdict(name: str, spring: FittedSpring, *, monolithic: bool) -> Verdict:
    """Return the verdict on one spring [N/m]; undecided when it was not made.

    One that is not of one piece, with pins glued on, may miss by more where it is not known to the tolerance.
    """
    K = spring.K
    is_known = monolithic or K is None or K.error <= STIFFNESS_TOLERANCE * spring.target
    tolerance = STIFFNESS_TOLERANCE if is_known else FITTED_TOLERANCE
    target = TargetValue(limit=1e3 * spring.target, tolerance=tolerance, relative=True, unit="N/m")
    if K is None:
        return replace(target_verdict(name, None, target, "not made, so not solved"), passed=None)
    return target_verdict(name, K.times(1e3, "N/m"), target, "FE of the exported housing; tolerance relative")


def printable_verdict(spring: FittedSpring) -> Verdict:
    """Return the verdict on whether the process can make one spring.

    Its value is the length of its leaves as they are made [mm]; there is none for a spring that was not solved.
    """
    printable = spring.printable
    strain = spring.root_strain
    reason = printable.reason
    passed = printable.passed
    limit = printable.strain_limit
    if strain is not None and strain.value + strain.error > limit:
        value = with_bar(strain.value, strain.error, in_percent=True)
        reason = f"{reason}; FE root strain {value} must be at most {limit:g}"
        passed = False if strain.value > limit or passed is False else None
    return Verdict(
        name=printable.name,
        value=None if spring.K is None else printable.length_mm,
        unit="mm",
        limit=f"{printable.shortest_mm:g} to {printable.longest_mm:g}",
        tolerance=None,
        passed=passed,
        reference=reason,
    )


# Tips and skin


def tip_face_verdict(design: Design, press: ScenePress) -> Verdict:
    """Return the verdict on the farthest contact from the middle of a dome's face [mm], which half the face must hold.

    A printed dome ends in a square, whose sides the contact must keep; that of a pin in a circle. The reach is Hertz's,
    at full travel and every modulus.
    """
    tips = design.tips
    radius = relative_radius(tips.dome_radius_mm or math.inf, min(design.fruit.radii_mm))
    slopes = [_slope_under(design, position) for position in tips.places_mm]
    farthest = 0.0
    forces_at_full_travel = press.table.F[:, -1]
    for E, forces in zip(press.table.E, forces_at_full_travel, strict=True):
        for force, slope in zip(forces, slopes, strict=True):
            if np.isfinite(force):
                reach = contact_reach(force, E, design.fruit.poisson, radius, slope)
                farthest = max(farthest, reach)
    steepest = math.degrees(math.atan(max(slopes)))
    towards = "across the sides of" if tips.socket == "none" else "under"
    half_face = 0.5 * tips.side_mm
    words = (
        f"farthest contact from the middle of a face, Hertz, at full travel and every E; the fruit is up to "
        f"{steepest:.2g} deg steep {towards} a tip; must be at most half of tips.side_mm"
    )
    return margin_verdict("geometry.tip_face", Estimate(farthest, 0.0, "mm"), half_face, words, at_most=True)


def _slope_under(design: Design, position: Position) -> float:
    """Return the slope [1] of the fruit against a tip at a position [mm], with tilt and roll of the press added.

    It is the steepest slope, or for a printed tip, whose face is a square, the steepest towards one of its sides.
    """
    radius, radius_across = design.fruit.radii_mm
    u, v = design.fruit.to_principal(position.x, position.y)
    # Near its apex the fruit is a paraboloid, whose slopes at u, v are u / R1 and v / R2.
    slope_along, slope_across = design.fruit.from_principal(u / radius, v / radius_across)
    along = abs(slope_along) + abs(math.tan(math.radians(design.press.tilt_deg)))
    across = abs(slope_across) + abs(math.tan(math.radians(design.press.roll_deg)))
    return max(along, across) if design.tips.socket == "none" else math.hypot(along, across)


def bruise_verdict(pressure: Estimate, limit: float) -> Verdict:
    """Return the verdict on the mean pressure under a tip [MPa] against the fruit's limit."""
    words = "largest force over the face of a tip, at the largest E and full travel; must be at most the limit"
    return margin_verdict("bruise", pressure, limit, words, at_most=True)


def skin_verdict(pressures: Sequence[SkinPressure]) -> Verdict:
    """Return the verdict on the mean pressure under the worst tip [MPa], at the modulus nearest to its limit."""
    worst = pressures[first_largest(pressure.over_limit for pressure in pressures)]
    words = f"mean pressure over what a tip touches, at {worst.E:.3g} MPa, {worst.placement}; must be at most the limit"
    return margin_verdict("bruise", worst.pressure, worst.limit, words, at_most=True)


# Readings


def reading_verdicts(design: Design, readings: Readings | None) -> tuple[Verdict, ...]:
    """Return the verdicts on bias, uncertainty, touch and bruising; none for a design that is checked by its ratio."""
    if design.reading is None or readings is None:
        return ()
    bruise = (skin_verdict(readings.pressures),) if readings.pressures else ()
    return *analysis_verdicts(readings, design.reading), *bruise


def analysis_verdicts(readings: Readings, reading: Reading) -> tuple[Verdict, ...]:
    """Return the verdicts reading.bias, reading.uncertainty and reading.touch, all [1].

    Their references name the modulus and the pose, or the source, of the worst number.
    """
    bias_words = "largest |E read / E - 1| without noise, over all fruits and poses"
    uncertainty_words = "uncertainty of E over all fruits and poses"
    if readings.moduli:
        worst = readings.worst_bias
        bias_words += f": at {worst.E:.3g} MPa, {worst.worst}"
        widest = readings.worst_uncertainty
        sources = widest.sources.contributions
        largest = list(sources)[first_largest(sources.values())]
        uncertainty_words += f", at {widest.E:.3g} MPa; largest source: {largest}"
    refused = readings.refused
    touch_words = "travel at which all tips touch over the whole travel, the largest of all; at most the limit"
    limit = readings.worst_uncertainty.uncertainty_limit if readings.moduli else reading.least_uncertainty_limit
    return (
        _bias_verdict(readings, reading.bias_limit, bias_words),
        _reading_verdict("reading.uncertainty", readings.uncertainty, limit, uncertainty_words, refused),
        margin_verdict("reading.touch", readings.touch, LARGEST_TOUCH_FRACTION, touch_words, at_most=True),
    )


def _bias_verdict(readings: Readings, limit: float, words: str) -> Verdict:
    """Return the verdict on the largest bias, undecided too where the bar of a smaller one reaches across the limit."""
    verdict = _reading_verdict("reading.bias", readings.bias, limit, words, readings.refused)
    reach = readings.reach
    if reach is None or verdict.passed is False:
        return verdict
    reaching = margin_verdict(verdict.name, reach, limit, words, at_most=True)
    if reaching.passed is verdict.passed:
        return verdict
    other = f"the bar of a smaller one, {with_bar(100.0 * reach.value, 100.0 * reach.error, '%')}, reaches the limit"
    return replace(verdict, passed=all_passed([verdict, reaching]), reference=f"{verdict.reference}; {other}")


def _reading_verdict(name: str, estimate: Estimate | None, limit: float, words: str, refused: str | None) -> Verdict:
    """Return the verdict on a number of readings [1], which fails where a pose that occurs has none.

    Its value is that of the other poses, none where a level press has no reading.
    """
    if estimate is None:
        return failed_verdict(name, limit, unit="1", reference=words if refused is None else f"{refused}; {words}")
    verdict = margin_verdict(name, estimate, limit, words, at_most=True)
    if refused is None:
        return verdict
    return replace(verdict, passed=False, reference=f"{refused}; of the others: {words}")


def relaxation_verdicts(design: Design, over_time: ReadingOverTime | None) -> tuple[Verdict, ...]:
    """Return the verdict on the largest change of a reading in the seconds in which it may be taken [1].

    There is none for flesh that does not relax. A design without `[reading]` has the default limit of the bias.
    """
    if over_time is None:
        return ()
    name = "reading.relaxation"
    limit = (design.reading or Reading()).bias_limit
    read_s = over_time.t[over_time.at]
    steadiest = over_time.steadiest
    words = (
        f"largest |E read / E read at {read_s:.3g} s - 1| from {design.stop_s:.3g} to {design.release_s:.3g} s; least, "
        f"{100.0 * steadiest.moves:.2g} %, at {steadiest.at_s:.3g} s"
    )
    if not math.isfinite(over_time.moves.value + over_time.moves.error):
        return (failed_verdict(name, limit, unit="1", reference="a tip is off the fruit during the hold"),)
    return (margin_verdict(name, over_time.moves, limit, words, at_most=True),)
