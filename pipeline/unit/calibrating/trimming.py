"""What a unit does with its own springs: its table, whether it meets the targets of its design, how to trim it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design, Targets
from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError, contrast_slopes, read_modulus
from cad.theory.leaf_spring import Flexure, pair_length
from cad.theory.pair_line import ratio_modulus
from cad.theory.two_spring_law import Springs, force_ratio, nonlinearity
from cad.verdict import Verdict, equal
from pipeline.unit.measuring import MeasuringUnit

Floats = NDArray[np.float64]

MODULI = 7
P_TOLERANCE, NL_TOLERANCE = 0.01, 0.001  # those of the verdicts of a run
DEEP_MODULI = 72  # at which the largest nonlinearity is looked for at large strain
SOFTEST = 1e-9  # of E_max: springs are rigid against such a fruit
_STEPS, _SETTLED = 60, 1e-13
_STEP = 1e-4


@dataclass(frozen=True, kw_only=True)
class UnitRow:
    """What a level unit shows of a fruit of modulus E [MPa] at full travel.

    `forces` [N], P = F_high / F_low [1], the half width that holds 95 % of E by the springs alone [1], and the share by
    which E is read wrong with the stiffnesses of the design [1].
    """

    E: float
    forces: tuple[float, ...]
    P: float
    u: float
    with_design: float


@dataclass(frozen=True, kw_only=True)
class Trim:
    """By how much the leaves of a spring must be longer (filed) or shorter (clamped, below 0) to meet its target [mm].

    `K` and `target` [N/mm].
    """

    name: str
    K: float
    target: float
    longer: float


def unit_table(sensor: MeasuringUnit, nominal: MeasuringUnit) -> tuple[UnitRow, ...]:
    """Return what a unit shows over the range of its design; `nominal` is the unit exactly as designed."""
    least, largest = sensor.range_MPa
    return tuple(_row(sensor, nominal, E) for E in np.geomspace(least, largest, MODULI).tolist())


def level_forces(sensor: MeasuringUnit, E: float) -> list[float]:
    """Return the forces of all tips [N] of a level unit at full travel on a fruit of modulus E [MPa].

    Newton's method on travel + least gap = (C F)_i + h E^(-2/3) F_i^(2/3) + (S F)_i / E + gap_i; raises ReadingError
    where a tip is off. At large strain by the curve of a tip.
    """
    if sensor.deep is not None:
        return sensor.deep.forces(E, sensor.design.press.travel_mm)
    linear, hertz, travel = _level_equations(sensor, E)
    roots = np.cbrt(np.maximum(travel, 0.0) / (np.diag(linear) + hertz))
    for _ in range(_STEPS):
        residual = linear @ roots**3 + hertz * roots**2 - travel
        if np.abs(residual).max() <= _SETTLED * np.abs(travel).max():
            return [float(force) for force in roots**3]
        step = np.linalg.solve(3.0 * linear * roots**2 + np.diag(2.0 * hertz * roots), residual)
        roots = np.maximum(roots - step, 0.2 * roots)
    msg = f"a level press at {E:g} MPa: must have every tip on the fruit; its springs are too far from the design"
    raise ReadingError(msg)


def _level_equations(sensor: MeasuringUnit, E: float) -> tuple[Floats, float, Floats]:
    """Return C + S / E [mm/N], h E^(-2/3) [mm/N^(2/3)] and how far each tip is pressed in [mm], (tips,)."""
    law, C = sensor.law, np.array(sensor.C)
    S = np.array(sensor.report.contact.compliance_per_mm if law is None else law.S)
    gaps = np.zeros(len(C)) if law is None else np.array(law.gaps)
    hertz = 0.0 if law is None else law.hertz * E ** (-2.0 / 3.0)
    return C + S / E, hertz, sensor.design.press.travel_mm + gaps.min() - gaps  # travel counts from the first touch


def read_level(sensor: MeasuringUnit, forces: Sequence[float]) -> float:
    """Return the modulus [MPa] that a unit reads of the forces [N] of a level press; raises ReadingError."""
    if sensor.law is not None:
        return read_modulus(sensor.law, forces)
    if sensor.deep is not None:
        return sensor.deep.ratio_modulus(forces)
    return ratio_modulus(sensor.C, sensor.report.read_out.own_less_other_per_mm or 0.0, forces)


def _row(sensor: MeasuringUnit, nominal: MeasuringUnit, E: float) -> UnitRow:
    forces = level_forces(sensor, E)
    soft, stiff = (math.fsum(forces[tip] for tip in kind) / len(kind) for kind in sensor.design.tips.kinds)
    shares = zip(_spring_slopes(sensor, forces, E), sensor.unit.K_percent, strict=True)
    u = COVERAGE * math.hypot(*(slope * 0.01 * percent for slope, percent in shares))
    try:
        with_design = read_level(nominal, forces) / E - 1.0
    except ReadingError:
        with_design = math.inf
    return UnitRow(E=E, forces=tuple(forces), P=stiff / soft, u=u, with_design=with_design)


def _spring_slopes(sensor: MeasuringUnit, forces: Sequence[float], E: float) -> list[float]:
    """Return the share by which E moves per share of each spring [1]."""
    if sensor.law is not None:
        return list(contrast_slopes(sensor.law, forces, E).springs)
    changed = [sensor.with_stiffness(tip, 1.0 + _STEP) for tip in range(len(forces))]
    return [(read_level(other, forces) / E - 1.0) / _STEP for other in changed]


def unit_verdicts(sensor: MeasuringUnit, rows: Sequence[UnitRow]) -> tuple[Verdict, ...]:
    """Return whether a unit meets the targets of its design: P_max and NL, or what its springs leave of a reading."""
    design = sensor.design
    if design.reading is not None or design.targets is None:
        limit = 0.1 if design.reading is None else design.reading.uncertainty_limit
        worst = max(rows, key=lambda row: row.u)
        sd = worst.u / COVERAGE
        reference = f"by the springs alone, at {worst.E:.3g} MPa"
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
    targets, E_max = design.nominal_targets, design.fruit.E_max_MPa

    def P(unit: MeasuringUnit) -> float:
        return _level_ratio(unit, E_max)

    def NL(unit: MeasuringUnit) -> float:
        if unit.deep is not None:
            return _deep_nonlinearity(unit, targets)
        own_less_other = unit.report.read_out.own_less_other_per_mm or math.inf
        return nonlinearity(_springs(unit), E_max / own_less_other, targets.NL_definition)

    law = "two-spring law" if sensor.deep is None else "curve of a tip at large strain"
    reference = f"{law} with the stiffnesses of the unit"
    allowed = P_TOLERANCE * targets.P_max
    found = equal("P_max", P(sensor), targets.P_max, allowed, unit="1", reference=reference)
    on_P = _with_error(found, allowed, _error_by_springs(sensor, P))
    found = equal("NL", NL(sensor), targets.NL, NL_TOLERANCE, unit="1", reference=reference)
    on_NL = _with_error(found, NL_TOLERANCE, _error_by_springs(sensor, NL))
    return replace(on_P, tolerance=P_TOLERANCE, relative=True), on_NL


def _level_ratio(sensor: MeasuringUnit, E: float) -> float:
    """Return P of a level pair at full travel on a fruit of modulus E [MPa]."""
    if sensor.deep is None:
        return force_ratio(_springs(sensor), E / (sensor.report.read_out.own_less_other_per_mm or math.inf))
    soft, stiff = sensor.deep.forces(E, sensor.design.press.travel_mm)
    return stiff / soft


def _deep_nonlinearity(sensor: MeasuringUnit, targets: Targets) -> float:
    """Return the departure of P from its straight line over E / E_max [1] at full travel and large strain, (7)."""
    shares = [0.5] if targets.NL_definition == "mid-range" else [place / DEEP_MODULI for place in range(1, DEEP_MODULI)]
    E_max = sensor.design.fruit.E_max_MPa
    first, last = _level_ratio(sensor, SOFTEST * E_max), _level_ratio(sensor, E_max)
    return max((_level_ratio(sensor, share * E_max) - first) / (last - first) - share for share in shares)


def _springs(sensor: MeasuringUnit) -> Springs:
    stiffnesses = zip(fields(Springs), sensor.unit.stiffnesses, strict=True)
    return Springs(**{item.name: K for item, K in stiffnesses})


def _error_by_springs(sensor: MeasuringUnit, value: Callable[[MeasuringUnit], float]) -> float:
    """Return the half width that holds 95 % of a value of the unit, by what calibration left of each spring."""
    at = value(sensor)
    moved = [value(sensor.with_stiffness(tip, 1.0 + _STEP)) - at for tip in range(len(sensor.unit.tips))]
    shares = zip(moved, sensor.unit.K_percent, strict=True)
    return COVERAGE * math.hypot(*(step / _STEP * 0.01 * percent for step, percent in shares))


def _with_error(verdict: Verdict, allowed: float, error: float) -> Verdict:
    """Return a verdict with its error bar [unit of the value], undecided where that is wider than what is allowed.

    One that is off by more than both together fails all the same. The error of a spring falls with the root of the
    number of its readings.
    """
    if error <= allowed or verdict.value is None or not isinstance(verdict.limit, float):
        return replace(verdict, error=error)
    if abs(verdict.value - verdict.limit) > allowed + error:
        return replace(verdict, error=error, passed=False)
    times = (error / allowed) ** 2
    remedy = f"know the springs {error / allowed:.2g} times better: about {times:.2g} times as many readings"
    reason = f"{verdict.reference}, whose error is wider than the tolerance"
    remedy += ", or heavier weights and a finer dial"
    return replace(verdict, error=error, passed=None, reference=reason, remedy=remedy)


def trims(sensor: MeasuringUnit, targets: Sequence[float]) -> tuple[Trim, ...]:
    """Return how to trim each spring to its target [N/mm], one for each tip; none where no housing is made.

    A pair of leaves has K = 2 E w (t / L)^3: what it measures gives E as it acts, and that the length for the target.
    """
    housing = sensor.report.housing
    if housing is None:
        return ()
    flexures = {arm.name: arm.flexure for arm in housing.arms}
    return tuple(
        _trim(tip.name, flexures[tip.spring], K, target)
        for tip, K, target in zip(sensor.report.tips, sensor.unit.stiffnesses, targets, strict=True)
    )


def _trim(name: str, flexure: Flexure, K: float, target: float) -> Trim:
    acting = 0.5 * K / flexure.depth * (flexure.length / flexure.thickness) ** 3
    length = pair_length(acting, flexure.depth, flexure.thickness, target)
    return Trim(name=name, K=K, target=target, longer=length - flexure.length)
