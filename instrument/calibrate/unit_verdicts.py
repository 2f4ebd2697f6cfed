"""Verdicts on a unit: whether it meets the targets of its design with its measured springs and its domes."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from instrument.calibrate.unit_table import STEP, UnitRow, error_sources, half_width_by_springs
from instrument.press.measuring import MeasuringUnit
from pipeline.springs.sizing import fruit_stiffening
from pipeline.verdicts.rules import NL_verdict, P_max_verdict
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate
from sensor.theory.two_spring_law import Springs, force_ratio, nonlinearity
from sensor.verdict import Verdict, judge

_DEFAULT_UNCERTAINTY_LIMIT = 0.1  # limit of the relative standard uncertainty of E [1] for a design without [reading]
_BALL_HINT = (
    "correct the unit with a reference ball, --ball: the form of its domes is too uncertain, but its springs are not"
)


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> list[Verdict]:
    """Judge whether the springs and domes of a unit meet the targets of its design.

    If the design has targets but no requirements for a reading, the verdicts are about P_max and NL. Otherwise the only
    verdict is about the uncertainty of the readings, at the modulus where it is largest relative to its limit. `rows`
    are the readings of the unit at moduli that span the range of its design.
    """
    design = sensor.report.design
    requirements = design.reading
    if requirements is None and design.targets is not None:
        return _judge_targets(sensor)

    def uncertainty_limit(E: float) -> float:
        if requirements is None:
            return _DEFAULT_UNCERTAINTY_LIMIT
        return requirements.uncertainty_limit_at(E, design.fruit.E_MPa)

    worst = max(rows, key=lambda row: row.u / uncertainty_limit(row.E))
    limit = uncertainty_limit(worst.E)
    reference = f"{error_sources(sensor)}, at {worst.E:.3g} MPa"
    verdict = judge("unit.uncertainty", Estimate(worst.u / COVERAGE, 0.0), reference, limit=limit)
    if _fails_by_form(sensor, worst, limit):
        return [replace(verdict, remedy=_BALL_HINT)]
    return [verdict]


def _fails_by_form(sensor: MeasuringUnit, worst: UnitRow, limit: float) -> bool:
    """Return whether a unit exceeds the uncertainty limit only because of the form errors of its domes.

    Presses on a reference ball would remove these errors. `limit` [1] applies to the relative standard uncertainty.
    `worst` is the row with the largest ratio of the uncertainty to its limit.
    """
    if sensor.unit.ball is not None or not sensor.report.design.takes_ball:
        return False
    form_error_squared = sum((COVERAGE * error) ** 2 for error in sensor.form_deviations(worst.E))
    without_form = math.sqrt(max(worst.u**2 - form_error_squared, 0.0))  # round-off may make the difference negative
    return worst.u > COVERAGE * limit >= without_form


def _judge_targets(sensor: MeasuringUnit) -> list[Verdict]:
    """Judge P_max and NL of a pair, computed with the law by which its springs were sized."""
    targets = sensor.report.design.nominal_targets
    values = _compute_targets(sensor)
    # Finite differences give the derivatives with respect to ln K of each spring, which propagate the stiffness errors.
    slopes = [(_compute_targets(sensor.with_stiffness(tip, 1.0 + STEP)) - values) / STEP for tip in range(2)]
    P_slopes, NL_slopes = np.transpose(slopes)
    P = Estimate(float(values[0]), half_width_by_springs(sensor, P_slopes))
    NL = Estimate(float(values[1]), half_width_by_springs(sensor, NL_slopes))
    reference = "by the two-spring law with the stiffnesses of the unit"
    return [_add_hint(P_max_verdict(P, targets, reference)), _add_hint(NL_verdict(NL, targets, reference))]


def _compute_targets(sensor: MeasuringUnit) -> Floats:
    """Return P_max and NL [1] of a unit as an array, by the two-spring law with the largest modulus of the design."""
    definition = sensor.report.design.nominal_targets.NL_definition
    E_max = sensor.report.design.fruit.E_max_MPa
    K_low, K_high = sensor.unit.stiffnesses
    springs = Springs(K_l=K_low, K_h=K_high)
    contact = sensor.report.compliance
    K_m = E_max * contact.at(E_max).K_m_over_E()
    ratio = contact.at(E_max).stiffness_ratio()
    NL = nonlinearity(springs, K_m, definition, ratio, fruit_stiffening(E_max, contact))
    return np.array([force_ratio(springs, K_m, ratio), NL])


def _add_hint(verdict: Verdict) -> Verdict:
    """Return the verdict; if stiffness errors leave it undecided, add a hint with the accuracy that would decide it.

    A stiffness error decreases with the square root of the number of readings.
    """
    is_decided = verdict.passed is not None
    if is_decided or verdict.error is None:
        return verdict
    factor = verdict.error / verdict.allowed_miss
    hint = f"measure the springs {factor:.2g} times more accurately: take about {factor**2:.2g} times as many readings"
    return replace(verdict, remedy=f"{hint}, or use heavier weights and a finer dial")
