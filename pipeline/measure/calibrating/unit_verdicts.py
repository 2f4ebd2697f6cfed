"""Whether a unit meets the targets of its design with its own springs."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from cad.quantity import COVERAGE
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

P_TOLERANCE = 0.01
"""That of the verdict of a run, relative."""
NL_TOLERANCE = 0.001
_USUAL_UNCERTAINTY = 0.1


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> list[Verdict]:
    """Return whether a unit meets the targets of its design: P_max and NL, or what its springs leave of a reading."""
    design = sensor.design
    if design.reading is None and design.targets is not None:
        return _target_verdicts(sensor)
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
    return [verdict]


class _Reached(NamedTuple):
    """The force ratio at the largest modulus and the nonlinearity of a pair [1]."""

    P_max: float
    NL: float


def _target_verdicts(sensor: MeasuringUnit) -> list[Verdict]:
    """Return the verdicts on P_max and NL of a pair, by the law that sized its springs."""
    targets = sensor.design.nominal_targets
    deep = sensor.deep
    reached = _reached(sensor, deep)
    P_slopes = []
    NL_slopes = []
    for tip in range(2):
        stiffer = sensor.with_stiffness(tip, 1.0 + STEP)
        moved = _reached(stiffer, stiffer.deep)
        P_slopes.append((moved.P_max - reached.P_max) / STEP)
        NL_slopes.append((moved.NL - reached.NL) / STEP)
    P_by_curve = 0.0
    NL_by_curve = 0.0
    if deep is not None:
        # P_max is of one modulus: any curve within its bars. One curve serves every modulus of NL, which is checked, as
        # in a run, with a curve that is off alike at every depth.
        P_bound = deep.curve_contributions(lambda curve: _reached(sensor, curve).P_max - reached.P_max)
        P_by_curve = error_by_curve(P_bound)
        off_alike = deep.with_factors(1.0 + deep.errors)
        NL_by_curve = error_by_curve(abs(_reached(sensor, off_alike).NL - reached.NL))

    law = "two-spring law" if deep is None else "curve of a tip at large strain"
    P = Verdict(
        name="P_max",
        value=reached.P_max,
        unit="1",
        limit=targets.P_max,
        tolerance=P_TOLERANCE,
        relative=True,
        passed=None,
        reference=f"{law} with the stiffnesses of the unit",
    )
    NL = replace(P, name="NL", value=reached.NL, limit=targets.NL, tolerance=NL_TOLERANCE, relative=False)
    P_off = abs(reached.P_max - targets.P_max)
    NL_off = abs(reached.NL - targets.NL)
    return [
        _decided(P, P_off, P_TOLERANCE * targets.P_max, error_by_springs(sensor, P_slopes), P_by_curve),
        _decided(NL, NL_off, NL_TOLERANCE, error_by_springs(sensor, NL_slopes), NL_by_curve),
    ]


def _reached(sensor: MeasuringUnit, deep: DeepPair | None) -> _Reached:
    """Return what a unit reaches, with the curve of a tip where its flesh is at large strain."""
    definition = sensor.design.nominal_targets.NL_definition
    E_max = sensor.design.fruit.E_max_MPa
    if deep is None:
        K_low, K_high = sensor.unit.stiffnesses
        springs = Springs(K_l=K_low, K_h=K_high)
        contact = sensor.report.compliance
        K_m = E_max * contact.at(E_max).K_m_over_E()
        ratio = contact.at(E_max).stiffness_ratio()
        stiffening = fruit_stiffening(E_max, contact)
        NL = nonlinearity(springs, K_m, definition, ratio, stiffening)
        return _Reached(force_ratio(springs, K_m, ratio), NL)
    steps = 2 if definition == "mid-range" else CURVE_STEPS  # mid-range is of both ends and the middle
    moduli = [E_max * fraction for fraction in curve_shares(steps)]
    ratios = []
    for E in moduli:
        low, high = deep.forces(E, sensor.design.press.travel_mm).tolist()
        ratios.append(high / low)
    return _Reached(ratios[-1], curve_nonlinearity(ratios, moduli, definition))


def _decided(verdict: Verdict, off: float, allowed: float, by_springs: float, by_curve: float) -> Verdict:
    """Return a verdict on a value that is off its target, with its error bar [all in the unit of the value].

    It is undecided where the bar is wider than what is allowed, and fails all the same where the value is off by more
    than both together. The error of a spring falls with the root of the number of its readings, that of the curve does
    not.
    """
    error = math.hypot(by_springs, by_curve)
    if error <= allowed:
        return replace(verdict, error=error, passed=off <= allowed)
    if off > allowed + error:
        return replace(verdict, error=error, passed=False)
    if by_curve >= allowed:
        hint = f"press less deep: the curve of a tip leaves {by_curve:.2g} open, whatever the springs are"
    else:
        times = by_springs / math.sqrt(allowed**2 - by_curve**2)
        hint = f"know the springs {times:.2g} times better: about {times**2:.2g} times as many readings"
        hint += ", or heavier weights and a finer dial"
    reference = f"{verdict.reference}, whose error is wider than the tolerance"
    return replace(verdict, error=error, passed=None, reference=reference, remedy=hint)
