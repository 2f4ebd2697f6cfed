"""Is it good enough: one rule for each kind of target, against its value with its error bar and its tolerance."""

import math
from collections.abc import Sequence
from dataclasses import replace

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
from sensor.verdict import Verdict, failed_verdict, one_sided
from solve.contact.linear_response import SensorResponse

P_MAX_TOLERANCE = 0.01  # of the target
NL_TOLERANCE = 0.001
STIFFNESS_TOLERANCE = 0.001  # of the target, for springs of one piece
FITTED_TOLERANCE = 0.005  # with gauges or pins glued on, where no mesh knows them to 0.1 %
SPREAD_TOLERANCE = 0.01
PARTS = 2.0  # an error of P or of NL adds those of both springs and of the contact
UNDECIDED = "undecided by its error bar"


def target_verdict(
    name: str,
    estimate: Estimate | None,
    limit: float,
    tolerance: float,
    reference: str,
    *,
    relative: bool = False,
    unit: str = "1",
) -> Verdict:
    """Return the verdict that passes when a value lies within the tolerance of its limit [unit].

    The tolerance is a fraction of the limit where `relative` [1]. Undecided where the error bar is wider than the
    tolerance and the value not farther off than both together; failed without a value.
    """
    passed: bool | None = False
    if estimate is not None:
        allowed = tolerance * limit if relative else tolerance
        distance = abs(estimate.value - limit)
        passed = distance <= allowed
        if estimate.error > allowed:
            passed = False if distance > allowed + estimate.error else None
    return Verdict(
        name=name,
        value=None if estimate is None else estimate.value,
        unit=unit,
        limit=limit,
        tolerance=tolerance,
        passed=passed,
        reference=reference,
        error=None if estimate is None else estimate.error,
        relative=relative,
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
    """Return the `--tol` [1], of one digit, that would decide a verdict that its error bar leaves undecided.

    None for any other verdict. An error beyond what all parts have at the tolerance asked for was met by no mesh: a
    smaller tolerance does not help.
    """
    limit = verdict.limit
    tolerance = verdict.tolerance
    error = verdict.error
    if verdict.passed is not None or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return None
    scale = abs(limit) or 1.0
    allowed = tolerance if verdict.relative else tolerance / scale
    if error / scale <= allowed:
        return None
    if allowed > 0.0 and error / scale <= PARTS * asked:
        wanted = allowed / PARTS
        digit = 10.0 ** math.floor(math.log10(wanted))
        tighter = round(math.floor(wanted / digit * (1.0 + 1e-9)) * digit, 12)
        if tighter < asked and TOLERANCES.hold(tighter):
            return f"{UNDECIDED}, `--tol {tighter:g}` would decide"
    return f"{UNDECIDED}, no `--tol` would decide"


# Force ratio


def target_verdicts(
    P_max: Estimate | None, NL: Estimate | None, targets: Targets, of_what: str = "", *, manufactured: bool = True
) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL [1], `of_what` in words.

    A value that is missing, because a tip is off the fruit, fails; springs that were not made leave both undecided.
    """
    lifted = "a tip is off the fruit at full travel, so that there is no force ratio"
    P_words = f"force ratio at E_max {of_what}; tolerance relative to the target"
    NL_words = f"departure of P from its straight line, {targets.NL_definition}, {of_what}; tolerance absolute"
    of_P = target_verdict(
        "P_max", P_max, targets.P_max, P_MAX_TOLERANCE, lifted if P_max is None else P_words, relative=True
    )
    of_NL = target_verdict("NL", NL, targets.NL, NL_TOLERANCE, lifted if NL is None else NL_words)
    if not manufactured:
        return replace(of_P, passed=None), replace(of_NL, passed=None)
    return of_P, of_NL


def displacement_verdict(table: SensorResponse) -> Verdict:
    """Return the verdict on the spread of P over the travel [1], the worst of all moduli.

    The spread may be off by twice the error of P where cells are solved; where P is one number it is exact.
    """
    name = "P_displacement_independent"
    largest = 0.0
    for P in table.P:
        touching = P[np.isfinite(P)]
        if touching.size <= 1:
            lifted = "a tip is off the fruit for the whole travel, or for all but one step of it"
            return target_verdict(name, None, 0.0, SPREAD_TOLERANCE, lifted)
        largest = max(largest, float(np.ptp(touching) / touching.mean()))
    errors = table.P_error[np.isfinite(table.P_error)]
    error = 2.0 * float(errors.max()) if table.cells and errors.size else 0.0
    words = "(max P - min P) / mean P over the travel, the worst of all E"
    return target_verdict(name, Estimate(largest, error), 0.0, SPREAD_TOLERANCE, words)


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


def stiffness_verdict(name: str, spring: FittedSpring, *, monolithic: bool = True) -> Verdict:
    """Return the verdict on one spring [N/m]; undecided when it was not made.

    One that is not of one piece, with gauges or pins glued on, may miss by more where it is not known to the tolerance.
    """
    limit = 1e3 * spring.target
    K = spring.K
    is_known = monolithic or K is None or K.error <= STIFFNESS_TOLERANCE * spring.target
    tolerance = STIFFNESS_TOLERANCE if is_known else FITTED_TOLERANCE
    value = None if K is None else K.times(1e3, "N/m")
    words = "not made, so not solved" if K is None else "FE of the exported housing; tolerance relative"
    verdict = target_verdict(name, value, limit, tolerance, words, relative=True, unit="N/m")
    return replace(verdict, passed=None) if K is None else verdict


def printable_verdict(spring: FittedSpring) -> Verdict:
    """Return the verdict on whether the process can make one spring: its value is the leaf length [mm]."""
    printable = spring.printable
    strain = spring.root_strain
    reason = printable.reason
    passed = printable.passed
    limit = printable.strain_limit
    if strain is not None and strain.value + strain.error > limit:
        value = f"{strain.value:.3g} ± {strain.percent:.2g} %"
        reason = f"{reason}; FE root strain {value} must be at most {limit:g}"
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


# Tips and skin


def tip_face_verdict(design: Design, press: ScenePress) -> Verdict:
    """Return how far from the middle of its face a dome is touched at most [mm], which half its face must hold.

    A printed dome ends in a square, whose sides the contact must keep; that of a pin in a circle.
    """
    tips = design.tips
    radius = relative_radius(tips.dome_radius_mm or math.inf, min(design.fruit.radii_mm))
    slopes = [_slope_under(design, place) for place in tips.places_mm]
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


def _slope_under(design: Design, place: Position) -> float:
    """Return the slope [1] of the fruit against a tip at x, y [mm], tilt and roll of the press added.

    It is the steepest slope, or for a printed tip that towards a side of its square.
    """
    radius, radius_across = design.fruit.radii_mm
    u, v = design.fruit.to_principal(place.x, place.y)
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
    """Return the verdicts reading.bias, reading.uncertainty and reading.touch, all [1]."""
    bias_words = "largest |E read / E - 1| without noise, over all fruits and poses"
    uncertainty_words = "standard uncertainty of E over all fruits and poses"
    if readings.moduli:
        worst = readings.worst_bias
        bias_words += f": at {worst.E:.3g} MPa, {worst.worst}"
        widest = readings.worst_uncertainty
        sources = widest.sources.contributions
        largest = list(sources)[first_largest(sources.values())]
        uncertainty_words += f", at {widest.E:.3g} MPa; largest source: {largest}"
    refused = readings.refused
    touch_words = "travel at which all tips touch over the whole travel, the largest of all; at most the limit"
    limit = readings.uncertainty_limit if readings.moduli else reading.least_uncertainty_limit
    return (
        _reading_verdict("reading.bias", readings.bias, reading.bias_limit, bias_words, refused),
        _reading_verdict("reading.uncertainty", readings.uncertainty, limit, uncertainty_words, refused),
        margin_verdict("reading.touch", readings.touch, LARGEST_TOUCH_FRACTION, touch_words, at_most=True),
    )


def _reading_verdict(name: str, estimate: Estimate | None, limit: float, words: str, refused: str | None) -> Verdict:
    """Return the verdict on a number of readings [1], which fails where a pose that occurs has none.

    Its value is that of the other poses, none where a level press has no reading.
    """
    if estimate is None:
        return failed_verdict(name, limit, unit="1", reference=words if refused is None else f"{refused}; {words}")
    verdict = margin_verdict(name, estimate, limit, words, at_most=True)
    return (
        verdict if refused is None else replace(verdict, passed=False, reference=f"{refused}; of the others: {words}")
    )


def relaxation_verdicts(design: Design, over_time: ReadingOverTime | None) -> tuple[Verdict, ...]:
    """Return the verdict on how far a reading moves in the seconds in which it may be taken [1].

    None for flesh that does not relax. A design without readings has the usual limit of their bias.
    """
    if over_time is None:
        return ()
    name = "reading.relaxation"
    limit = (design.reading or Reading()).bias_limit
    read = over_time.t[over_time.at]
    steadiest = over_time.steadiest
    words = (
        f"largest |E read / E read at {read:.3g} s - 1| from {design.stop_s:.3g} to {design.release_s:.3g} s; least, "
        f"{100.0 * steadiest.moves:.2g} %, at {steadiest.at_s:.3g} s of a press by {steadiest.speed_mm_per_s:.3g} mm/s"
    )
    if not math.isfinite(over_time.moves.value + over_time.moves.error):
        return (failed_verdict(name, limit, unit="1", reference="a tip is off the fruit during the hold"),)
    return (margin_verdict(name, over_time.moves, limit, words, at_most=True),)
