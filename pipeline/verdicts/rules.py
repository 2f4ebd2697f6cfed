"""Functions that each judge one quantity of a sensor, with the texts that describe its value.

Bounds that are not stated here, and whether a value must be at most or at least its bound, are in sensor/verdicts.toml.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.reading.analysis import ReadingAccuracy
from pipeline.reading.reading_over_time import ReadingOverTime
from pipeline.response.scene_press import ScenePress
from pipeline.springs.spring import MadeSpring
from pipeline.storage.plain import first_largest
from sensor.design.parameters import Design, Targets
from sensor.design.printability import Printable
from sensor.design.reading import LARGEST_TOUCH_FRACTION, ReadingRequirements
from sensor.quantity import Estimate
from sensor.theory.hertz import contact_reach, relative_radius
from sensor.tips.layouts import Position
from sensor.verdict import Verdict, all_passed, judge, row_of
from sensor.words import value_with_bar
from solve.contact.linear_response import SensorResponse

LIFTED = "a tip is off the fruit at full travel, so that there is no force ratio"


# Force ratio


def P_max_verdict(P_max: Estimate | None, targets: Targets, scene_text: str) -> Verdict:
    """Judge P_max [1] against its target. The verdict fails if P_max is None, because a tip is out of contact.

    `scene_text` describes the springs and the scene of the value.
    """
    reference = f"force ratio at E_max {scene_text}; tolerance relative to the target"
    return judge("P_max", P_max, LIFTED if P_max is None else reference, limit=targets.P_max)


def NL_verdict(NL: Estimate | None, targets: Targets, scene_text: str) -> Verdict:
    """Judge NL [1] against its target. The verdict fails if NL is None, because a tip is out of contact.

    `scene_text` describes the springs and the scene of the value.
    """
    reference = f"departure of P from its straight line, {targets.NL_definition}, {scene_text}; tolerance absolute"
    return judge("NL", NL, LIFTED if NL is None else reference, limit=targets.NL)


def displacement_verdict(table: SensorResponse) -> Verdict:
    """Judge the relative variation of P over the travel [1], at the modulus with the largest variation.

    The force ratio should depend only on the fruit, not on the travel. The verdict fails if, at some modulus, fewer
    than two travels have a force ratio.
    """
    name = "P_displacement_independent"
    largest_variation = 0.0
    for P in table.P:  # over the travel, at one modulus
        known_P = P[np.isfinite(P)]  # P is not finite at travels at which a tip is out of contact
        if known_P.size <= 1:  # a single value does not show a variation
            return judge(name, None, "a tip is off the fruit for the whole travel, or for all but one step of it")
        largest_variation = max(largest_variation, float(np.ptp(known_P) / known_P.mean()))
    # The variation is a difference of two P, so its error is twice the error of P. Only a contact solved on cells has
    # an error; a closed form has none.
    errors = table.P_error[np.isfinite(table.P_error)]
    error = 2.0 * float(errors.max()) if table.cells and errors.size else 0.0
    reference = "(max P - min P) / mean P over the travel, the worst of all E"
    return judge(name, Estimate(largest_variation, error), reference)


def monotonic_verdict(scan: SensorResponse) -> Verdict:
    """Judge whether P increases with E: the smallest relative increase [1] between neighbouring moduli, at full travel.

    A modulus can only be read from P if every P belongs to one modulus. `scan` has at least two moduli, in increasing
    order. The verdict passes if all increases are positive, and fails if a tip is out of contact at some modulus.
    """
    name = "P_monotonic"
    P = scan.P[:, -1]  # P of each modulus, at full travel
    if not np.isfinite(P).all():
        return judge(name, None, "a tip is off the fruit at full travel")
    smallest_step = float((np.diff(P) / P[:-1]).min())
    grid = f"{len(scan.E)} moduli in equal steps from {scan.E[0]:.3g} to {scan.E[-1]:.3g} MPa"
    reference = f"smallest relative step of P between neighbouring ones of {grid}, at full travel"
    return judge(name, smallest_step, reference, passed=smallest_step > 0.0)


# Springs


def stiffness_verdict(name: str, spring: MadeSpring, *, monolithic: bool) -> Verdict:
    """Judge the stiffness of a spring [N/m] against its target. The verdict is undecided if the spring was not made.

    `monolithic` is false for a housing with glued pins, which make the stiffness uncertain. The tolerance of such a
    spring is wider if the error of its stiffness exceeds the usual tolerance.
    """
    row = row_of(name)
    limit = 1e3 * spring.target  # from N/mm to N/m
    if spring.K is None:
        return judge(name, None, "not made, so not solved", limit=limit, passed=None)
    is_known = monolithic or spring.error <= (row.tolerance or 0.0) * spring.target
    tolerance = row.tolerance if is_known else row.tolerance_with_pins
    reference = "FE of the exported housing; tolerance relative"
    K = Estimate(spring.K, spring.error, "N/mm")
    return judge(name, K.times(1e3, "N/m"), reference, limit=limit, tolerance=tolerance)


def own_part_verdict(name: str, K: Estimate, target: float, reference: str) -> Verdict:
    """Judge the stiffness K of a spring [N/m] in a part that the user made, against its target [N/m].

    `reference` describes how K was determined. The tolerance is wider if the error bar exceeds the usual tolerance.
    """
    row = row_of(name)
    is_known = K.error <= (row.tolerance or 0.0) * target
    return judge(name, K, reference, limit=target, tolerance=row.tolerance if is_known else row.tolerance_of_own_part)


def printable_verdict(printable: Printable, spring: MadeSpring) -> Verdict:
    """Judge whether the process can print a spring.

    `printable` is the result of beam theory. Even if `printable` passes, the verdict fails if the strain of the solved
    spring exceeds its limit. The verdict is undecided if only the error bar of this strain exceeds the limit. The value
    of the verdict is the length of the leaves [mm], or None for a spring that was not solved.
    """
    reason = printable.reason
    passed = printable.passed
    limit = printable.strain_limit
    if spring.highest_strain > limit:  # the upper end of the error bar
        strain = spring.root_strain or 0.0
        bar = value_with_bar(strain, spring.highest_strain - strain, in_percent=True)
        reason = f"{reason}; FE root strain {bar} must be at most {limit:g}"
        exceeds_limit = strain > limit  # the strain itself, not only its error bar
        passed = False if exceeds_limit or printable.passed is False else None
    value = None if spring.K is None else printable.length_mm
    length_range = f"{printable.shortest_mm:g} to {printable.longest_mm:g}"
    return judge(printable.name, value, reason, limit=length_range, passed=passed)


# Tips and skin


def tip_face_verdict(design: Design, press: ScenePress) -> Verdict:
    """Judge whether each dome touches the fruit only within its face, at every modulus and full travel.

    The value of the verdict is the largest distance from the centre of the face to the edge of a contact [mm]. This
    distance must be at most half the width of the face. A printed dome ends in a square face, and a dome on a pin in a
    circular face.
    """
    tips = design.tips
    slopes = [_slope_under_tip(design, position) for position in tips.places_mm]
    farthest = _farthest_contact(design, press, slopes)
    steepest = math.degrees(math.atan(max(slopes)))
    towards = "across the sides of" if tips.socket == "none" else "under"
    half_face = 0.5 * tips.side_mm
    reference = (
        f"farthest contact from the middle of a face, Hertz, at full travel and every E; the fruit is up to "
        f"{steepest:.2g} deg steep {towards} a tip; must be at most half of tips.side_mm"
    )
    return judge("geometry.tip_face", Estimate(farthest, 0.0, "mm"), reference, limit=half_face)


def _farthest_contact(design: Design, press: ScenePress, slopes: Sequence[float]) -> float:
    """Return the largest distance from the centre of a dome's face to the edge of its contact [mm], by Hertz's law.

    The distance is the largest of all tips and moduli, at full travel. `slopes` (tips,) [1] are the slopes of the fruit
    under the tips, which move the contacts away from the centres of the faces.
    """
    # The smaller principal radius of the fruit gives the relative radius of curvature [mm].
    relative_R = relative_radius(design.tips.dome_radius_mm or math.inf, min(design.fruit.radii_mm))
    farthest = 0.0
    forces_at_full_travel = press.table.F[:, -1]  # (moduli, tips) [N]
    for E, forces in zip(press.table.E, forces_at_full_travel, strict=True):
        for force, slope in zip(forces, slopes, strict=True):
            if np.isfinite(force):  # skips a force that could not be computed
                reach = contact_reach(force, E, design.fruit.poisson, relative_R, slope)
                farthest = max(farthest, reach)
    return farthest


def _slope_under_tip(design: Design, position: Position) -> float:
    """Return the slope [1] of the fruit relative to a tip at `position` [mm], including the tilt and roll of the press.

    The slope of the fruit and the tilt add up, whatever their signs, so the result is an upper bound. A printed tip has
    a square face, so the result is the larger of the slopes across its two pairs of sides. For a tip on a pin, the
    result is the slope in the steepest direction.
    """
    radius, radius_across = design.fruit.radii_mm
    u, v = design.fruit.to_principal(position.x, position.y)  # coordinates along the principal directions [mm]
    # Near its apex the fruit is a paraboloid, whose slopes at (u, v) are u / R1 and v / R2.
    slope_along, slope_across = design.fruit.from_principal(u / radius, v / radius_across)
    along = abs(slope_along) + abs(math.tan(math.radians(design.press.tilt_deg)))
    across = abs(slope_across) + abs(math.tan(math.radians(design.press.roll_deg)))
    has_square_face = design.tips.socket == "none"  # a tip without a socket is printed with the housing
    return max(along, across) if has_square_face else math.hypot(along, across)


# Readings


def bias_verdict(readings: ReadingAccuracy, reading: ReadingRequirements) -> Verdict:
    """Judge the largest bias of a reading [1] over all fruits and poses. `reading` states its limit.

    A smaller bias of another pose may have an error bar that extends farther. So the bias whose error bar extends
    farthest is compared with the limit too. If this error bar reaches the limit, the verdict is undecided.
    """
    reference = "largest |E read / E - 1| without noise, over all fruits and poses"
    if readings.moduli:
        accuracy = readings.worst_bias
        reference += f": at {accuracy.E:.3g} MPa, {accuracy.worst}"
    limit = reading.bias_limit
    verdict = _judge_over_poses("reading.bias", readings.bias, limit, reference, readings.refused)
    farthest = readings.reach  # the bias whose error bar extends farthest, with its error
    if farthest is None or verdict.passed is False:
        return verdict
    farthest_verdict = judge(verdict.name, farthest, reference, limit=limit)
    if farthest_verdict.passed is verdict.passed:
        return verdict
    bar = value_with_bar(100.0 * farthest.value, 100.0 * farthest.error, "%")
    reason = f"{verdict.reference}; the bar of a smaller one, {bar}, reaches the limit"
    return replace(verdict, passed=all_passed([verdict, farthest_verdict]), reference=reason)


def uncertainty_verdict(readings: ReadingAccuracy, reading: ReadingRequirements) -> Verdict:
    """Judge the standard uncertainty of a reading [1] at the modulus at which it is worst compared with its limit.

    The reference text states this modulus and the largest source of uncertainty. The limit of the verdict is the limit
    in `reading` at this modulus, or the smallest limit in `reading` if no modulus can be read.
    """
    reference = "uncertainty of E over all fruits and poses"
    limit = reading.least_uncertainty_limit
    if readings.moduli:
        accuracy = readings.worst_uncertainty
        sources = accuracy.sources.contributions
        largest_source = list(sources)[first_largest(sources.values())]
        reference += f", at {accuracy.E:.3g} MPa; largest source: {largest_source}"
        limit = accuracy.uncertainty_limit
    return _judge_over_poses("reading.uncertainty", readings.uncertainty, limit, reference, readings.refused)


def calibration_verdict(readings: ReadingAccuracy, _reading: ReadingRequirements) -> Verdict | None:
    """Judge the largest standard uncertainty of a spring stiffness after calibration on the bench [1].

    If the design gives this uncertainty, the bench is not used and the verdict passes. The result is None if the
    uncertainty is unknown. `_reading` is unused, but all verdicts on readings have the same parameters.
    """
    name = "reading.calibration"
    errors = readings.calibration
    if errors is None:
        return None
    if "stiffness_percent" in errors.typed:  # given in the design file
        reference = "as reading.stiffness_percent gives it; the bench is not used"
        return judge(name, errors.largest_stiffness, reference, limit="as given", passed=True)
    bench = f"a balance of {errors.balance_g:g} g up to {errors.balance_max_g:g} g, and a dial of {errors.dial_mm:g} mm"
    spring = f"uncertainty of the spring of {errors.worst_tip} after calibration"
    return judge(name, errors.largest_stiffness, f"{spring}, most of it by the {errors.by}; with {bench}")


def touch_verdict(readings: ReadingAccuracy, _reading: ReadingRequirements) -> Verdict:
    """Judge the travel at which the last tip touches the fruit, as a fraction of the whole travel [1]."""
    reference = "travel at which all tips touch over the whole travel, the largest of all; at most the limit"
    return judge("reading.touch", readings.touch, reference, limit=LARGEST_TOUCH_FRACTION)


def skin_verdict(readings: ReadingAccuracy, _reading: ReadingRequirements) -> Verdict | None:
    """Judge the largest mean pressure under a tip [MPa]; return None if the fruit has no bruise limit.

    Each modulus has a pressure and a limit. The verdict is on the pressure that is highest relative to its limit.
    """
    pressures = readings.pressures
    if not pressures:
        return None
    worst = pressures[first_largest(pressure.over_limit for pressure in pressures)]
    reference = (
        f"mean pressure over what a tip touches, at {worst.E_MPa:.3g} MPa, {worst.worst}; must be at most the limit"
    )
    return judge("bruise", Estimate(worst.pressure_MPa, worst.error_MPa, "MPa"), reference, limit=worst.limit_MPa)


def _judge_over_poses(
    name: str, estimate: Estimate | None, limit: float, reference: str, refused: str | None
) -> Verdict:
    """Judge an estimate over all poses [1]. The verdict fails if a pose has no reading.

    `name` is the verdict, and `reference` describes the estimate. `refused` is the text that counts and explains the
    poses without a reading, which the estimate leaves out; it is None if there are none. The estimate is None if even a
    level press has no reading.
    """
    if refused is None:
        return judge(name, estimate, reference, limit=limit)
    whose = "" if estimate is None else "of the others: "
    verdict = judge(name, estimate, f"{refused}; {whose}{reference}", limit=limit)
    return replace(verdict, passed=False)


def relaxation_verdict(design: Design, over_time: ReadingOverTime) -> Verdict:
    """Judge the largest change of a reading [1] that the relaxation of the flesh causes during the hold.

    The limit is the limit for the bias, or its default for a design without `[reading]`. The verdict fails if a tip
    leaves the fruit during the hold.
    """
    name = "reading.relaxation"
    limit = (design.reading or ReadingRequirements()).bias_limit
    largest_change = over_time.moves
    if not math.isfinite(largest_change.value + largest_change.error):  # a tip out of contact has no force
        return judge(name, None, "a tip is off the fruit during the hold", limit=limit)
    read_s = over_time.t[over_time.at]  # time of the reading [s]
    steadiest = over_time.steadiest  # the time of a reading at which the reading would change least
    reference = (
        f"largest |E read / E read at {read_s:.3g} s - 1| from {design.stop_s:.3g} to {design.release_s:.3g} s; least, "
        f"{steadiest.moves_percent:.2g} %, at {steadiest.at_s:.3g} s"
    )
    return judge(name, largest_change, reference, limit=limit)
