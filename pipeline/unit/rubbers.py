"""Springs from readings on reference rubbers: what the springs must be so that each rubber reads as its own modulus.

The contrast (a line or a square) or the difference of both tips (a pair) is linear in the compliances of the springs:
each reading gives one equation. Springs of one kind are prints of one drawing and taken for alike within 3 %.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cad.quantity import InputError
from cad.theory.contrast_law import ContrastLaw, contrast_terms
from cad.theory.hertz import relative_curvature
from pipeline.unit.measured_table import MeasuredRow, only_columns
from pipeline.unit.measuring import MeasuringUnit
from pipeline.unit.signals import force_keys

Floats = NDArray[np.float64]

FEWEST_RUBBERS = 2
ALIKE = 0.03  # of a compliance, one sigma: two prints of one drawing on one machine
_MOVED = 1e-3  # of a rubber's modulus, for what its error does to the springs


@dataclass(frozen=True, kw_only=True)
class RubberSprings:
    """Stiffness of each spring [N/mm] with its standard deviation as a share [1], (tips,), and what was assumed."""

    K: tuple[float, ...]
    shares: tuple[float, ...]
    assumed: tuple[str, ...]


def springs_on_rubbers(path: Path, rows: Sequence[MeasuredRow], sensor: MeasuringUnit) -> RubberSprings:
    """Return the springs that readings on at least two rubbers tell; raises InputError for what tells none."""
    keys = force_keys(len(sensor.report.tips))
    only_columns(path, rows, ("rubber", *keys))
    names = list(dict.fromkeys(row.words["rubber"] for row in rows))
    if len(names) < FEWEST_RUBBERS:
        msg = f"{path}: {len(names)} rubber: must be at least {FEWEST_RUBBERS} of different modulus; add a reading"
        raise InputError(msg)
    moduli = {row.line: _modulus(path, row, sensor) for row in rows}
    found, spread = _solved(sensor, rows, moduli, names)
    variances = np.square(spread)
    for name in names:
        own = [row for row in rows if row.words["rubber"] == name]
        share = own[0].numbers.get("E_error", 0.0)
        moved = {line: E * (1.0 + _MOVED * (line in {row.line for row in own})) for line, E in moduli.items()}
        variances += np.square((_solved(sensor, rows, moved, names)[0] - found) / _MOVED * share)
    if not (found > 0.0).all():
        bound = "must be forces of this sensor on these rubbers; check units and order of the columns"
        msg = f"{path}: the readings need springs below zero: {bound}"
        raise InputError(msg)
    nominal = np.diag(np.array(sensor.C))
    return RubberSprings(
        K=tuple((1.0 / (nominal * found)).tolist()),
        shares=tuple((np.sqrt(variances) / found).tolist()),
        assumed=_assumed(path, rows, sensor),
    )


def _assumed(path: Path, rows: Sequence[MeasuredRow], sensor: MeasuringUnit) -> tuple[str, ...]:
    told = []
    if "E_error" not in rows[0].numbers:
        told.append(f"{path}: no column E_error_percent, the moduli of the rubbers are taken for exact")
    if "radius" not in rows[0].numbers:
        told.append(f"{path}: no column radius_mm, the rubbers are taken for flat, and as large as the design's fruit")
    if len(sensor.report.tips) > len(set(sensor.design.tips.springs)):
        told.append(f"springs of one kind are taken for alike within {100.0 * ALIKE:g} %")
    return tuple(told)


def _modulus(path: Path, row: MeasuredRow, sensor: MeasuringUnit) -> float:
    """Return the modulus [MPa] that a fruit of the design's Poisson's ratio has where it is as stiff as a rubber."""
    numbers, nu = row.numbers, sensor.design.fruit.poisson
    if "E_over_1_minus_nu2" in numbers:
        reduced = numbers["E_over_1_minus_nu2"]
    elif "E" in numbers and "poisson" in numbers:
        reduced = numbers["E"] / (1.0 - numbers["poisson"] ** 2)
    else:
        bound = "E_over_1_minus_nu2_MPa, or E_MPa beside poisson"
        msg = f"{path} line 1: no modulus of the rubbers; must have {bound}; add the columns"
        raise InputError(msg)
    if not 0.0 < reduced < np.inf:
        msg = f"{path} line {row.line}: modulus = {reduced:g} MPa: must be greater than 0; mend that line"
        raise InputError(msg)
    return reduced * (1.0 - nu**2)


def _solved(
    sensor: MeasuringUnit, rows: Sequence[MeasuredRow], moduli: dict[int, float], rubbers: Sequence[str]
) -> tuple[Floats, Floats]:
    """Return by what each spring is softer than the unit's [1], (tips,), and its standard deviation by noise."""
    equations = [_equation(sensor, row, moduli[row.line], rubbers) for row in rows]
    ties = _ties(sensor, len(equations[0][0]))
    A = np.array([left / noise for left, _, noise in equations] + [left / ALIKE for left in ties])
    b = np.array([right / noise for _, right, noise in equations] + [0.0] * len(ties))
    scale = np.linalg.norm(A, axis=0)
    solution, _, rank, _ = np.linalg.lstsq(A / scale, b, rcond=1e-9)
    if rank < A.shape[1]:
        msg = "the readings do not tell the springs apart: must be of rubbers of different modulus; add another rubber"
        raise InputError(msg)
    left = float(np.square(A / scale @ solution - b).sum())
    covariance = np.linalg.inv((A / scale).T @ (A / scale)) * max(1.0, left / max(1, len(b) - A.shape[1]))
    tips = len(sensor.report.tips)
    return (solution / scale)[:tips], (np.sqrt(np.diag(covariance)) / scale)[:tips]


def _equation(sensor: MeasuringUnit, row: MeasuredRow, E: float, rubbers: Sequence[str]) -> tuple[Floats, float, float]:
    """Return the coefficients of the compliances (and of a pair's leads), the other side [mm], and its noise [mm]."""
    forces = np.array([row.numbers[key] for key in force_keys(len(sensor.report.tips))])
    if not (forces > 0.0).all():
        msg = f"line {row.line}: a tip is off the rubber: must be forces above 0 N; press farther"
        raise InputError(msg)
    C = np.array(sensor.C)
    coupled = (C - np.diag(np.diag(C))) @ forces
    noises = np.array(sensor.noises)
    if sensor.law is None:
        own_less_other = sensor.report.read_out.own_less_other_per_mm or 0.0
        weights = np.array([1.0, -1.0])
        right = own_less_other * (forces[1] - forces[0]) / E - float(weights @ coupled)
        leads = np.array([-1.0 * (row.words["rubber"] == name) for name in rubbers])
        through = np.hypot(weights * np.diag(C), own_less_other / E)
        return np.concatenate([weights * np.diag(C) * forces, leads]), right, float(np.linalg.norm(through * noises))
    law = _on_rubber(sensor, sensor.law, row.numbers.get("radius", np.inf))
    _, dome, body = contrast_terms(law, forces.tolist())
    weights = np.array(law.weights)
    known = float(weights @ (coupled + np.array(law.gaps))) + dome * E ** (-2.0 / 3.0) + body / E
    return weights * np.diag(C) * forces, -known, float(np.linalg.norm(weights * np.diag(C) * noises))


def _on_rubber(sensor: MeasuringUnit, law: ContrastLaw, radius: float) -> ContrastLaw:
    """Return the law on a rubber of a radius [mm], infinite for a flat one, instead of on the design's fruit."""
    tips, fruit = sensor.design.tips, sensor.design.fruit
    dome, own = tips.dome_radius_mm or 0.0, fruit.radii_mm[0]
    squares = np.square(sensor.places).sum(axis=1)
    fall = 0.5 * squares * (1.0 / (dome + radius) - 1.0 / (dome + own))
    hertz = law.hertz
    if dome:
        hertz *= (relative_curvature(dome, own) / relative_curvature(dome, radius)) ** (1.0 / 3.0)
    return replace(law, gaps=tuple((np.array(law.gaps) + fall).tolist()), hertz=hertz)


def _ties(sensor: MeasuringUnit, columns: int) -> list[Floats]:
    """Return the rows that hold springs of one kind alike."""
    rows = []
    for kind in sensor.design.tips.kinds:
        for one, other in itertools.pairwise(kind):
            row = np.zeros(columns)
            row[one], row[other] = 1.0, -1.0
            rows.append(row)
    return rows
