"""Whether a unit meets the targets of its design with its own springs."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, replace

from cad.design.parameters import Design
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
from pipeline.measure.calibrating.trimming import STEP, UnitRow, open_by_curve, open_by_springs, open_in_words
from pipeline.measure.unit.deep_pair import DeepPair
from pipeline.measure.unit.measuring import MeasuringUnit

P_TOLERANCE, NL_TOLERANCE = 0.01, 0.001  # those of the verdicts of a run


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> tuple[Verdict, ...]:
    """Return whether a unit meets the targets of its design: P_max and NL, or what its springs leave of a reading."""
    design = sensor.design
    if design.reading is not None or design.targets is None:
        limit = 0.1 if design.reading is None else design.reading.uncertainty_limit
        worst = max(rows, key=lambda row: row.u)
        sd = worst.u / COVERAGE
        reference = f"{open_in_words(sensor)}, at {worst.E:.3g} MPa"
        return (
            Verdict(
                name="unit.uncertainty",
                value=sd,
                unit="1",
                limit=limit,
                tolerance=0.0,
                passed=sd <= limit,
                reference=reference,
            ),
        )
    return _targets_met(sensor, design)


def _targets_met(sensor: MeasuringUnit, design: Design) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL of a pair, by the law that sized its springs."""
    targets = design.nominal_targets
    law = "two-spring law" if sensor.deep is None else "curve of a tip at large strain"
    reference = f"{law} with the stiffnesses of the unit"
    P_allowed = P_TOLERANCE * targets.P_max
    P = equal("P_max", _P_max(sensor, sensor.deep), targets.P_max, P_allowed, unit="1", reference=reference)
    NL = equal("NL", _NL(sensor, sensor.deep), targets.NL, NL_TOLERANCE, unit="1", reference=reference)
    # One curve serves every modulus: NL is judged, as in a run, with a curve that is off alike at every depth.
    bent, shifted = ((), ()) if sensor.deep is None else (sensor.deep.perturbed(), [(sensor.deep.off_alike(), 1.0)])
    on_P = _with_error(P, P_allowed, _open_springs(sensor, _P_max), _open_curve(sensor, _P_max, bent))
    on_NL = _with_error(NL, NL_TOLERANCE, _open_springs(sensor, _NL), _open_curve(sensor, _NL, shifted))
    return replace(on_P, tolerance=P_TOLERANCE, relative=True), on_NL


Value = Callable[[MeasuringUnit, DeepPair | None], float]
"""A number of a unit [1], with the curve of a tip where its flesh is at large strain."""


def _P_max(sensor: MeasuringUnit, deep: DeepPair | None) -> float:
    E_max = sensor.design.fruit.E_max_MPa
    if deep is None:
        return force_ratio(_springs(sensor), E_max / _own_less_other(sensor))
    return _deep_ratio(sensor, deep, E_max)


def _NL(sensor: MeasuringUnit, deep: DeepPair | None) -> float:
    definition, E_max = sensor.design.nominal_targets.NL_definition, sensor.design.fruit.E_max_MPa
    if deep is None:
        return nonlinearity(_springs(sensor), E_max / _own_less_other(sensor), definition)
    steps = 2 if definition == "mid-range" else CURVE_STEPS  # mid-range is of both ends and the middle
    moduli = [E_max * share for share in curve_shares(steps)]
    return curve_nonlinearity([_deep_ratio(sensor, deep, E) for E in moduli], moduli, definition)


def _springs(sensor: MeasuringUnit) -> Springs:
    stiffnesses = zip(fields(Springs), sensor.unit.stiffnesses, strict=True)
    return Springs(**{item.name: K for item, K in stiffnesses})


def _own_less_other(sensor: MeasuringUnit) -> float:
    """Return s11 - s12 of the fruit times E [1/mm]; infinite where the report has none."""
    return sensor.report.read_out.own_less_other_per_mm or math.inf


def _deep_ratio(sensor: MeasuringUnit, deep: DeepPair, E: float) -> float:
    """Return P of a level pair at full travel and large strain on a fruit of modulus E [MPa]."""
    soft, stiff = deep.forces(E, sensor.design.press.travel_mm)
    return stiff / soft


def _open_springs(sensor: MeasuringUnit, value: Value) -> float:
    """Return the half width that holds 95 % of a value, by what calibration left of each spring."""
    at = value(sensor, sensor.deep)
    stiffer = [sensor.with_stiffness(tip, 1.0 + STEP) for tip in range(len(sensor.unit.tips))]
    return open_by_springs(sensor, [(value(other, other.deep) - at) / STEP for other in stiffer])


def _open_curve(sensor: MeasuringUnit, value: Value, curves: Iterable[tuple[DeepPair, float]]) -> float:
    """Return the half width that holds 95 % of a value, by what other curves, each a number of times, do to it."""
    at = value(sensor, sensor.deep)
    return open_by_curve(math.fsum(times * abs(value(sensor, curve) - at) for curve, times in curves))


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
    reason = f"{verdict.reference}, whose error is wider than the tolerance"
    if by_curve >= allowed:
        remedy = f"press less deep: the curve of a tip leaves {by_curve:.2g} open, whatever the springs are"
    else:
        times = by_springs / math.sqrt(allowed**2 - by_curve**2)
        remedy = f"know the springs {times:.2g} times better: about {times**2:.2g} times as many readings"
        remedy += ", or heavier weights and a finer dial"
    return replace(verdict, error=error, passed=None, reference=reason, remedy=remedy)
