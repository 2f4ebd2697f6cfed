"""Verdicts on a unit: whether it meets the targets of its design with its own springs and domes."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from instrument.calibrate.unit_table import STEP, UnitRow, error_by_springs, error_sources
from instrument.press.measuring import MeasuringUnit
from pipeline.springs.sizing import fruit_stiffening
from pipeline.verdicts.rules import NL_verdict, P_max_verdict
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate
from sensor.theory.two_spring_law import Springs, force_ratio, nonlinearity
from sensor.verdict import Verdict, judge

_USUAL_UNCERTAINTY = 0.1
_BALL = "correct the unit by a reference ball, --ball: the form of its domes is too uncertain, its springs are not"


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> list[Verdict]:
    """Return the verdicts on a unit whose readings over the range of moduli are `rows`.

    They are P_max and NL if the design has targets and no requirements for a reading. Otherwise they are the
    uncertainty of the readings.
    """
    design = sensor.report.design
    if design.reading is None and design.targets is not None:
        return _target_verdicts(sensor)
    reading = design.reading

    def limit_at(E: float) -> float:
        return _USUAL_UNCERTAINTY if reading is None else reading.uncertainty_limit_at(E, design.fruit.E_MPa)

    worst = max(rows, key=lambda row: row.u / limit_at(row.E))
    limit = limit_at(worst.E)
    words = f"{error_sources(sensor)}, at {worst.E:.3g} MPa"
    verdict = judge("unit.uncertainty", Estimate(worst.u / COVERAGE, 0.0), words, limit=limit)
    return [replace(verdict, remedy=_BALL) if _fails_by_form(sensor, worst, limit) else verdict]


def _fails_by_form(sensor: MeasuringUnit, worst: UnitRow, limit: float) -> bool:
    """Return whether a unit misses a `limit` [1] only because of the form errors of its domes.

    The limit is for the standard uncertainty. `worst` is the row whose uncertainty is largest relative to its limit. A
    reference ball would remove the form errors.
    """
    if sensor.unit.ball is not None or not sensor.report.design.takes_ball:
        return False
    without_form = worst.u**2 - sum((COVERAGE * error) ** 2 for error in sensor.form_deviations(worst.E))
    return worst.u > COVERAGE * limit >= math.sqrt(max(without_form, 0.0))


def _target_verdicts(sensor: MeasuringUnit) -> list[Verdict]:
    """Return the verdicts on P_max and NL of a pair, by the law that sized its springs."""
    targets = sensor.report.design.nominal_targets
    values = _target_values(sensor)
    # Slopes against ln K of each spring by finite differences, for the errors due to the springs.
    slopes = [(_target_values(sensor.with_stiffness(tip, 1.0 + STEP)) - values) / STEP for tip in range(2)]
    errors = [error_by_springs(sensor, value_slopes) for value_slopes in np.transpose(slopes)]
    P, NL = (Estimate(float(value), error) for value, error in zip(values, errors, strict=True))
    words = "by the two-spring law with the stiffnesses of the unit"
    return [_add_hint(P_max_verdict(P, targets, words)), _add_hint(NL_verdict(NL, targets, words))]


def _target_values(sensor: MeasuringUnit) -> Floats:
    """Return P_max and NL [1] of a unit, at the firmest fruit of its design."""
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
    """Return a verdict; if it is undecided due to the error of the springs, with the accuracy that would decide it.

    The error of a spring falls with the square root of the number of its readings.
    """
    if verdict.passed is not None or verdict.error is None:
        return verdict
    factor = verdict.error / verdict.allowed_miss
    hint = f"know the springs {factor:.2g} times better: about {factor**2:.2g} times as many readings"
    return replace(verdict, remedy=f"{hint}, or heavier weights and a finer dial")
