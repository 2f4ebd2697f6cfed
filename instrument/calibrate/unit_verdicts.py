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
    """Return the verdicts on a unit: P_max and NL if the design has targets, else the uncertainty of its readings."""
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
    """Return whether a unit would keep a limit [1] if a reference ball removed the form errors of its domes."""
    if sensor.unit.ball is not None or not sensor.report.design.takes_ball:
        return False
    left = worst.u**2 - sum((COVERAGE * error) ** 2 for error in sensor.by_form(worst.E))
    return worst.u > COVERAGE * limit >= math.sqrt(max(left, 0.0))


def _target_verdicts(sensor: MeasuringUnit) -> list[Verdict]:
    """Return the verdicts on P_max and NL of a pair, by the law that sized its springs."""
    targets = sensor.report.design.nominal_targets
    reached = _reached(sensor)
    slopes = [(_reached(sensor.with_stiffness(tip, 1.0 + STEP)) - reached) / STEP for tip in range(2)]
    by_springs = [error_by_springs(sensor, of_value) for of_value in np.transpose(slopes)]
    P, NL = (Estimate(float(value), error) for value, error in zip(reached, by_springs, strict=True))
    words = "by the two-spring law with the stiffnesses of the unit"
    return [_hinted(P_max_verdict(P, targets, words)), _hinted(NL_verdict(NL, targets, words))]


def _reached(sensor: MeasuringUnit) -> Floats:
    """Return P_max and NL [1] of a unit."""
    definition = sensor.report.design.nominal_targets.NL_definition
    E_max = sensor.report.design.fruit.E_max_MPa
    K_low, K_high = sensor.unit.stiffnesses
    springs = Springs(K_l=K_low, K_h=K_high)
    contact = sensor.report.compliance
    K_m = E_max * contact.at(E_max).K_m_over_E()
    ratio = contact.at(E_max).stiffness_ratio()
    NL = nonlinearity(springs, K_m, definition, ratio, fruit_stiffening(E_max, contact))
    return np.array([force_ratio(springs, K_m, ratio), NL])


def _hinted(verdict: Verdict) -> Verdict:
    """Return a verdict; if the error of its springs leaves it undecided, with the accuracy that would decide it.

    The error of a spring falls with the root of the number of its readings.
    """
    if verdict.passed is not None or verdict.error is None:
        return verdict
    times = verdict.error / verdict.allowed_miss
    hint = f"know the springs {times:.2g} times better: about {times**2:.2g} times as many readings"
    return replace(verdict, remedy=f"{hint}, or heavier weights and a finer dial")
