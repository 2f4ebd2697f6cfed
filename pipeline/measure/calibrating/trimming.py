"""What a unit does with its own springs: its table, and how to trim it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError, contrast_slopes, read_modulus
from cad.theory.leaf_spring import Flexure, pair_length
from cad.theory.pair_line import ratio_modulus
from pipeline.measure.unit.deep_reading import curve_share
from pipeline.measure.unit.measuring import MeasuringUnit

Floats = NDArray[np.float64]

MODULI = 7
_STEPS, _SETTLED = 60, 1e-13
STEP = 1e-4  # of a stiffness, for slopes over it


@dataclass(frozen=True, kw_only=True)
class UnitRow:
    """What a level unit shows of a fruit of modulus E [MPa] at full travel.

    `forces` [N], P = F_high / F_low [1], the half width that holds 95 % of E by what `open_in_words` names [1], and the
    share by which E is read wrong with the stiffnesses of the design [1].
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


def open_in_words(sensor: MeasuringUnit) -> str:
    """Return what the error of a calibrated unit counts: its springs, and at large strain the curve of a tip."""
    return "by the springs alone" if sensor.deep is None else "by springs and curve of a tip"


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
    of_curve = 0.0 if sensor.deep is None else curve_share(sensor.deep, [(1, forces[0], forces[1])], E)
    u = math.hypot(open_by_springs(sensor, _spring_slopes(sensor, forces, E)), open_by_curve(of_curve))
    try:
        with_design = read_level(nominal, forces) / E - 1.0
    except ReadingError:
        with_design = math.inf
    return UnitRow(E=E, forces=tuple(forces), P=stiff / soft, u=u, with_design=with_design)


def open_by_springs(sensor: MeasuringUnit, slopes: Sequence[float]) -> float:
    """Return the half width that holds 95 % of a value [its unit] by its springs, of its slopes over their shares."""
    shares = zip(slopes, sensor.unit.K_percent, strict=True)
    return COVERAGE * math.hypot(*(slope * 0.01 * percent for slope, percent in shares))


def open_by_curve(bound: float) -> float:
    """Return the half width that holds 95 % of a value that the curve of a tip moves by at most a bound [same unit].

    What lies anywhere within a bound has the bound over the root of three as standard deviation (JCGM 100:2008, 4.3.7).
    """
    return COVERAGE * bound / math.sqrt(3.0)


def _spring_slopes(sensor: MeasuringUnit, forces: Sequence[float], E: float) -> list[float]:
    """Return the share by which E moves per share of each spring [1]."""
    if sensor.law is not None:
        return list(contrast_slopes(sensor.law, forces, E).springs)
    changed = [sensor.with_stiffness(tip, 1.0 + STEP) for tip in range(len(forces))]
    return [(read_level(other, forces) / E - 1.0) / STEP for other in changed]


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
