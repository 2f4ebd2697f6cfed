"""Whether a unit meets the targets of its design with its own springs."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cad.quantity import COVERAGE, Estimate
from cad.theory.two_spring_law import (
    CURVE_STEPS,
    Springs,
    curve_nonlinearity,
    curve_shares,
    force_ratio,
    nonlinearity,
)
from cad.verdict import Verdict
from pipeline.measure.calibrating.unit_table import STEP, UnitRow, error_by_curve, error_by_springs, error_sources
from pipeline.measure.unit.deep_pair import DeepPair
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.springs.sizing import fruit_stiffening
from pipeline.verdicts.rules import NL_TOLERANCE, P_MAX_TOLERANCE, margin_verdict, target_verdicts

Floats = NDArray[np.float64]

_USUAL_UNCERTAINTY = 0.1


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> list[Verdict]:
    """Return whether a unit meets the targets of its design: P_max and NL, or what its springs leave of a reading."""
    design = sensor.design
    if design.reading is None and design.targets is not None:
        return _target_verdicts(sensor)
    worst = max(rows, key=lambda row: row.u)
    limit = _USUAL_UNCERTAINTY if design.reading is None else design.reading.uncertainty_limit
    words = f"{error_sources(sensor)}, at {worst.E:.3g} MPa"
    return [margin_verdict("unit.uncertainty", Estimate(worst.u / COVERAGE, 0.0), limit, words, at_most=True)]


def _target_verdicts(sensor: MeasuringUnit) -> list[Verdict]:
    """Return the verdicts on P_max and NL of a pair, by the law that sized its springs."""
    targets = sensor.design.nominal_targets
    deep = sensor.deep
    reached = _reached(sensor, deep)
    slopes = []
    for tip in range(2):
        stiffer = sensor.with_stiffness(tip, 1.0 + STEP)
        slopes.append((_reached(stiffer, stiffer.deep) - reached) / STEP)
    by_springs = [error_by_springs(sensor, of_value) for of_value in np.transpose(slopes)]
    by_curve = [0.0, 0.0]
    if deep is not None:
        # P_max is of one modulus: any curve within its bars. One curve serves every modulus of NL, which is checked, as
        # in a run, with a curve that is off alike at every depth.
        P_bound = deep.curve_contributions(lambda curve: float((_reached(sensor, curve) - reached)[0]))
        NL_bound = float(abs(_reached(sensor, deep.with_factors(1.0 + deep.errors)) - reached)[1])
        by_curve = [error_by_curve(P_bound), error_by_curve(NL_bound)]
    P, NL = (Estimate(float(value), math.hypot(*of)) for value, *of in zip(reached, by_springs, by_curve, strict=True))
    law = "two-spring law" if deep is None else "curve of a tip at large strain"
    verdicts = target_verdicts(P, NL, targets, f"by the {law} with the stiffnesses of the unit")
    allowed = (P_MAX_TOLERANCE * targets.P_max, NL_TOLERANCE)
    return [_hinted(*each) for each in zip(verdicts, allowed, by_springs, by_curve, strict=True)]


def _reached(sensor: MeasuringUnit, deep: DeepPair | None) -> Floats:
    """Return P_max and NL [1] of a unit, with the curve of a tip where its flesh is at large strain."""
    definition = sensor.design.nominal_targets.NL_definition
    E_max = sensor.design.fruit.E_max_MPa
    if deep is None:
        K_low, K_high = sensor.unit.stiffnesses
        springs = Springs(K_l=K_low, K_h=K_high)
        contact = sensor.report.compliance
        K_m = E_max * contact.at(E_max).K_m_over_E()
        ratio = contact.at(E_max).stiffness_ratio()
        NL = nonlinearity(springs, K_m, definition, ratio, fruit_stiffening(E_max, contact))
        return np.array([force_ratio(springs, K_m, ratio), NL])
    steps = 2 if definition == "mid-range" else CURVE_STEPS  # mid-range is of both ends and the middle
    moduli = [E_max * fraction for fraction in curve_shares(steps)]
    low, high = np.transpose([deep.forces(E, sensor.design.press.travel_mm) for E in moduli])
    ratios = (high / low).tolist()
    return np.array([ratios[-1], curve_nonlinearity(ratios, moduli, definition)])


def _hinted(verdict: Verdict, allowed: float, by_springs: float, by_curve: float) -> Verdict:
    """Return a verdict that its errors leave open, each in the unit of the value, with what would decide it.

    The error of a spring falls with the root of the number of its readings, that of the curve does not.
    """
    if verdict.passed is not None:
        return verdict
    if by_curve >= allowed:
        hint = f"press less deep: the curve of a tip leaves {by_curve:.2g} open, whatever the springs are"
    else:
        times = by_springs / math.sqrt(allowed**2 - by_curve**2)
        hint = f"know the springs {times:.2g} times better: about {times**2:.2g} times as many readings"
        hint += ", or heavier weights and a finer dial"
    return replace(verdict, remedy=hint)
