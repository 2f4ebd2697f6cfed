"""Whether a unit meets the targets of its design with its own springs."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cad.quantity import COVERAGE
from cad.theory.two_spring_law import (
    CURVE_STEPS,
    Springs,
    curve_nonlinearity,
    curve_shares,
    force_ratio,
    nonlinearity,
)
from cad.verdict import Verdict, equal
from pipeline.measure.calibrating.unit_table import STEP, UnitRow, error_by_curve, error_by_springs, error_sources
from pipeline.measure.unit.deep_pair import DeepPair
from pipeline.measure.unit.measuring import MeasuringUnit

P_TOLERANCE = 0.01
"""That of the verdict of a run, relative."""
NL_TOLERANCE = 0.001
_USUAL_UNCERTAINTY = 0.1


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> tuple[Verdict, ...]:
    """Return whether a unit meets the targets of its design: P_max and NL, or what its springs leave of a reading."""
    design = sensor.design
    if design.reading is None and design.targets is not None:
        return _targets_met(sensor)
    worst = max(rows, key=lambda row: row.u)
    deviation = worst.u / COVERAGE
    limit = _USUAL_UNCERTAINTY if design.reading is None else design.reading.uncertainty_limit
    verdict = Verdict(
        name="unit.uncertainty",
        value=deviation,
        unit="1",
        limit=limit,
        tolerance=0.0,
        passed=deviation <= limit,
        reference=f"{error_sources(sensor)}, at {worst.E:.3g} MPa",
    )
    return (verdict,)


def _targets_met(sensor: MeasuringUnit) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL of a pair, by the law that sized its springs."""
    targets = sensor.design.nominal_targets
    deep = sensor.deep
    law = "two-spring law" if deep is None else "curve of a tip at large strain"
    reference = f"{law} with the stiffnesses of the unit"
    values = _P_max_and_NL(sensor, deep)
    slopes = []
    for tip in range(len(sensor.unit.tips)):
        stiffer = sensor.with_stiffness(tip, 1.0 + STEP)
        slopes.append((_P_max_and_NL(stiffer, stiffer.deep) - values) / STEP)
    by_springs = [error_by_springs(sensor, of_value) for of_value in np.transpose(slopes).tolist()]
    by_curve = [0.0, 0.0]
    if deep is not None:
        # P_max is of one modulus: any curve within its bars. One curve serves every modulus of NL, which is checked, as
        # in a run, with a curve that is off alike at every depth.
        bent = math.fsum(times * abs(_P_max_and_NL(sensor, curve)[0] - values[0]) for curve, times in deep.perturbed())
        shifted = abs(_P_max_and_NL(sensor, deep.at_upper_errors())[1] - values[1])
        by_curve = [error_by_curve(bent), error_by_curve(float(shifted))]
    allowed = P_TOLERANCE * targets.P_max
    P = equal("P_max", float(values[0]), targets.P_max, allowed, unit="1", reference=reference)
    NL = equal("NL", float(values[1]), targets.NL, NL_TOLERANCE, unit="1", reference=reference)
    checked_P = _with_error(P, allowed, by_springs[0], by_curve[0])
    checked_NL = _with_error(NL, NL_TOLERANCE, by_springs[1], by_curve[1])
    return replace(checked_P, tolerance=P_TOLERANCE, relative=True), checked_NL


def _P_max_and_NL(sensor: MeasuringUnit, deep: DeepPair | None) -> NDArray[np.float64]:
    """Return P_max and NL of a pair [1], with the curve of a tip where its flesh is at large strain."""
    definition = sensor.design.nominal_targets.NL_definition
    E_max = sensor.design.fruit.E_max_MPa
    if deep is None:
        K_low, K_high = sensor.unit.stiffnesses
        springs = Springs(K_l=K_low, K_h=K_high)
        K_m = E_max / (sensor.own_less_other or math.inf)
        return np.array([force_ratio(springs, K_m), nonlinearity(springs, K_m, definition)])
    steps = 2 if definition == "mid-range" else CURVE_STEPS  # mid-range is of both ends and the middle
    moduli = [E_max * fraction for fraction in curve_shares(steps)]
    ratios = []
    for E in moduli:
        low, high = deep.forces(E, sensor.design.press.travel_mm)
        ratios.append(high / low)
    return np.array([ratios[-1], curve_nonlinearity(ratios, moduli, definition)])


def _with_error(verdict: Verdict, allowed: float, by_springs: float, by_curve: float) -> Verdict:
    """Return a verdict with its error bar [unit of the value], undecided where that is wider than what is allowed.

    One that is off by more than both together fails all the same. The error of a spring falls with the root of the
    number of its readings, that of the curve does not.
    """
    error = math.hypot(by_springs, by_curve)
    if error <= allowed or verdict.value is None or not isinstance(verdict.limit, float):
        return replace(verdict, error=error)
    if abs(verdict.value - verdict.limit) > allowed + error:
        return replace(verdict, error=error, passed=False)
    if by_curve >= allowed:
        hint = f"press less deep: the curve of a tip leaves {by_curve:.2g} open, whatever the springs are"
    else:
        times = by_springs / math.sqrt(allowed**2 - by_curve**2)
        hint = f"know the springs {times:.2g} times better: about {times**2:.2g} times as many readings"
        hint += ", or heavier weights and a finer dial"
    reference = f"{verdict.reference}, whose error is wider than the tolerance"
    return replace(verdict, error=error, passed=None, reference=reference, remedy=hint)
