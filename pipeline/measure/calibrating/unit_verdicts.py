"""Whether a unit meets the targets of its design with its own springs."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

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

Value = Callable[[MeasuringUnit, DeepPair | None], float]
"""A number of a unit [1], with the curve of a tip where its flesh is at large strain."""


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
    allowed = P_TOLERANCE * targets.P_max
    P = equal("P_max", _P_max(sensor, deep), targets.P_max, allowed, unit="1", reference=reference)
    NL = equal("NL", _NL(sensor, deep), targets.NL, NL_TOLERANCE, unit="1", reference=reference)
    # One curve serves every modulus: NL is checked, as in a run, with a curve that is off alike at every depth.
    bent = () if deep is None else deep.perturbed()
    shifted = () if deep is None else [(deep.at_upper_errors(), 1.0)]
    checked_P = _with_error(P, allowed, _error_by_springs(sensor, _P_max), _error_by_curve(sensor, _P_max, bent))
    checked_NL = _with_error(NL, NL_TOLERANCE, _error_by_springs(sensor, _NL), _error_by_curve(sensor, _NL, shifted))
    return replace(checked_P, tolerance=P_TOLERANCE, relative=True), checked_NL


def _P_max(sensor: MeasuringUnit, deep: DeepPair | None) -> float:
    E_max = sensor.design.fruit.E_max_MPa
    if deep is not None:
        return _deep_ratio(sensor, deep, E_max)
    K_low, K_high = sensor.unit.stiffnesses
    return force_ratio(Springs(K_l=K_low, K_h=K_high), E_max / (sensor.own_less_other or math.inf))


def _NL(sensor: MeasuringUnit, deep: DeepPair | None) -> float:
    definition = sensor.design.nominal_targets.NL_definition
    E_max = sensor.design.fruit.E_max_MPa
    if deep is None:
        K_low, K_high = sensor.unit.stiffnesses
        springs = Springs(K_l=K_low, K_h=K_high)
        return nonlinearity(springs, E_max / (sensor.own_less_other or math.inf), definition)
    steps = 2 if definition == "mid-range" else CURVE_STEPS  # mid-range is of both ends and the middle
    moduli = [E_max * fraction for fraction in curve_shares(steps)]
    return curve_nonlinearity([_deep_ratio(sensor, deep, E) for E in moduli], moduli, definition)


def _deep_ratio(sensor: MeasuringUnit, deep: DeepPair, E: float) -> float:
    """Return P of a level pair at full travel and large strain on a fruit of modulus E [MPa]."""
    low, high = deep.forces(E, sensor.design.press.travel_mm)
    return high / low


def _error_by_springs(sensor: MeasuringUnit, value: Value) -> float:
    """Return the half width that holds 95 % of a value, by what calibration left of each spring."""
    nominal = value(sensor, sensor.deep)
    slopes = []
    for tip in range(len(sensor.unit.tips)):
        stiffer = sensor.with_stiffness(tip, 1.0 + STEP)
        slopes.append((value(stiffer, stiffer.deep) - nominal) / STEP)
    return error_by_springs(sensor, slopes)


def _error_by_curve(sensor: MeasuringUnit, value: Value, curves: Iterable[tuple[DeepPair, float]]) -> float:
    """Return the half width that holds 95 % of a value, by what other curves, each a number of times, do to it."""
    nominal = value(sensor, sensor.deep)
    return error_by_curve(math.fsum(times * abs(value(sensor, curve) - nominal) for curve, times in curves))


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
