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
from pipeline.measure.calibrating.measured_table import MeasuredRow, only_columns
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.signals import force_keys
from pipeline.storage.plain import first_largest

Floats = NDArray[np.float64]
Moduli = dict[int, float]  # of the rubber of each line [MPa]

FEWEST_RUBBERS = 2
AVERAGED = 0.1  # of the noise of a sample: each row is the mean of some hundred while the press is held
MOST_OPEN = 0.3  # of a stiffness, one sigma: a calibration that leaves more is none
ALIKE_POISSON = 0.005  # over it the curve of log neo-Hooke moves by 0.2 % at most
ALIKE = 0.03  # of a compliance, one sigma: two prints of one drawing on one machine
_RANK = 1e-9  # of the largest singular value: below it springs are not told apart
_MOVED = 1e-3  # of a rubber's modulus, for what its error does to the springs


@dataclass(frozen=True)
class _Equation:
    """Coefficients of the compliances (and of a pair's leads), the other side [mm], and its noise [mm]."""

    left: Floats
    right: float
    noise: float


@dataclass(frozen=True, kw_only=True)
class RubberSprings:
    """Stiffness of each spring [N/mm] with its standard deviation as a share [1], (tips,), and what was assumed."""

    K: tuple[float, ...]
    shares: tuple[float, ...]
    assumed: tuple[str, ...]


def springs_on_rubbers(path: Path, rows: Sequence[MeasuredRow], sensor: MeasuringUnit) -> RubberSprings:
    """Return the springs that readings on at least two rubbers tell; raises InputError for what tells none."""
    only_columns(path, rows, ("rubber", *force_keys(len(sensor.report.tips))))
    names = list(dict.fromkeys(row.words["rubber"] for row in rows))
    if len(names) < FEWEST_RUBBERS:
        msg = f"{path}: {len(names)} rubber: must be at least {FEWEST_RUBBERS} of different modulus; add a reading"
        raise InputError(msg)
    moduli = {row.line: _modulus(path, row, sensor) for row in rows}
    found, spread = _solved(sensor, rows, moduli)
    of_rubbers = [_by_rubber(sensor, rows, moduli, found, name) for name in names]
    shares = np.linalg.norm([spread, *of_rubbers], axis=0) / found
    _refuse_open(path, sensor, found, shares)
    return RubberSprings(
        K=tuple((1.0 / (np.diag(np.array(sensor.C)) * found)).tolist()),
        shares=tuple(shares.tolist()),
        assumed=_assumed(path, rows, sensor),
    )


def _refuse_other_poisson(path: Path, row: MeasuredRow, poisson: float) -> None:
    """Raise InputError for a rubber of another Poisson's ratio [1] than the fruit's, whose curve bends otherwise.

    E / (1 - nu^2) makes two bodies alike at small strain only.
    """
    nu = row.numbers.get("poisson")
    if nu is None or abs(nu - poisson) > ALIKE_POISSON:
        given = "not given" if nu is None else f"{nu:g}"
        bound = f"within {ALIKE_POISSON:g} of the fruit's {poisson:g} at large strain; calibrate with weights"
        msg = f"{path} line {row.line}: poisson of rubber {row.words['rubber']} = {given}: must be {bound}"
        raise InputError(msg)


def _refuse_open(path: Path, sensor: MeasuringUnit, found: Floats, shares: Floats) -> None:
    """Raise InputError for compliances [1] below zero, or known to shares [1] that make no calibration."""
    if not (found > 0.0).all():
        bound = "must be forces of this sensor on these rubbers; check units and order of the columns"
        msg = f"{path}: the readings need springs below zero: {bound}"
        raise InputError(msg)
    if shares.max() > MOST_OPEN:
        name = sensor.report.tips[first_largest(shares.tolist())].name
        bound = f"known to {100.0 * MOST_OPEN:g} %; press more often and deeper, take a harder rubber, or weigh it"
        msg = (
            f"{path}: the readings leave the spring of tip {name} open by {100.0 * shares.max():.0f} %: must be {bound}"
        )
        raise InputError(msg)


def _by_rubber(sensor: MeasuringUnit, rows: Sequence[MeasuredRow], moduli: Moduli, found: Floats, name: str) -> Floats:
    """Return by how much the error of one rubber's modulus moves the compliances found [1], (tips,)."""
    own = [row for row in rows if row.words["rubber"] == name]
    lines = {row.line for row in own}
    moved = {line: E * (1.0 + _MOVED * (line in lines)) for line, E in moduli.items()}
    change = _solved(sensor, rows, moved)[0] - found
    return np.asarray(change / _MOVED * own[0].numbers.get("E_error", 0.0))


def _assumed(path: Path, rows: Sequence[MeasuredRow], sensor: MeasuringUnit) -> tuple[str, ...]:
    told = [f"{path}: each row is taken for the mean of a hundred samples"]
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
    if sensor.deep is not None:
        _refuse_other_poisson(path, row, nu)
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


def _solved(sensor: MeasuringUnit, rows: Sequence[MeasuredRow], moduli: Moduli) -> tuple[Floats, Floats]:
    """Return by what each spring is softer than the unit's [1], (tips,), and its standard deviation by noise."""
    law = sensor.law
    if law is None:
        equations = [_pair_equation(sensor, row, moduli[row.line], _leads(row, rows)) for row in rows]
    else:
        equations = [_contrast_equation(sensor, law, row, moduli[row.line]) for row in rows]
    ties = _ties(sensor, len(equations[0].left))
    A = np.array([each.left / each.noise for each in equations] + [left / ALIKE for left in ties])
    b = np.array([each.right / each.noise for each in equations] + [0.0] * len(ties))
    solution, spread = _least_squares(A, b)
    tips = len(sensor.report.tips)
    return solution[:tips], spread[:tips]


def _least_squares(A: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return the solution of weighted rows and its standard deviations, by noise or by what is left where that is more.

    Raises InputError where the rows do not tell all unknowns.
    """
    scale = np.linalg.norm(A, axis=0)
    scaled = A / scale
    solution, _, rank, _ = np.linalg.lstsq(scaled, b, rcond=_RANK)
    if rank < A.shape[1]:
        msg = "the readings do not tell the springs apart: must be of rubbers of different modulus; add another rubber"
        raise InputError(msg)
    left = scaled @ solution - b
    larger = max(1.0, float(left @ left) / max(1, A.shape[0] - A.shape[1]))
    spread = np.sqrt(larger * np.diag(np.linalg.inv(scaled.T @ scaled)))
    return np.asarray(solution / scale), np.asarray(spread / scale)


def _leads(row: MeasuredRow, rows: Sequence[MeasuredRow]) -> list[float]:
    """Return the coefficients of a pair's leads: one tip may stand before the other, on each rubber anew."""
    names = dict.fromkeys(each.words["rubber"] for each in rows)
    return [-1.0 if row.words["rubber"] == name else 0.0 for name in names]


def _forces(sensor: MeasuringUnit, row: MeasuredRow) -> Floats:
    forces = np.array([row.numbers[key] for key in force_keys(len(sensor.report.tips))])
    if not (forces > 0.0).all():
        msg = f"line {row.line}: a tip is off the rubber: must be forces above 0 N; press farther"
        raise InputError(msg)
    return forces


def _coupled(sensor: MeasuringUnit, forces: Floats) -> Floats:
    """Return how far the springs of the other tips move each tip through the frame [mm], (tips,)."""
    C = np.array(sensor.C)
    return np.asarray((C - np.diag(np.diag(C))) @ forces)


def _pair_equation(sensor: MeasuringUnit, row: MeasuredRow, E: float, leads: list[float]) -> _Equation:
    forces, weights, own = _forces(sensor, row), np.array([1.0, -1.0]), np.diag(np.array(sensor.C))
    fruit = (sensor.report.read_out.own_less_other_per_mm or 0.0) / E
    sunk = fruit * float(weights @ forces) if sensor.deep is None else sensor.deep.sunk(forces.tolist(), E)
    right = -sunk - float(weights @ _coupled(sensor, forces))
    noise = float(np.linalg.norm(np.hypot(own, fruit) * AVERAGED * np.array(sensor.noises)))
    return _Equation(np.concatenate([weights * own * forces, leads]), right, noise)


def _contrast_equation(sensor: MeasuringUnit, known: ContrastLaw, row: MeasuredRow, E: float) -> _Equation:
    forces, own = _forces(sensor, row), np.diag(np.array(sensor.C))
    law = _on_rubber(sensor, known, row.numbers.get("radius", np.inf))
    _, dome, body = contrast_terms(law, forces.tolist())
    weights = np.array(law.weights)
    rest = float(weights @ (_coupled(sensor, forces) + np.array(law.gaps))) + dome * E ** (-2.0 / 3.0) + body / E
    noise = float(np.linalg.norm(weights * own * AVERAGED * np.array(sensor.noises)))
    return _Equation(weights * own * forces, -rest, noise)


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
