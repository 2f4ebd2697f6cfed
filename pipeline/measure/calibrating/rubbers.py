"""Springs from readings on reference rubbers: what the springs must be so that each rubber reads as its own modulus.

The contrast (a line or a square) or the difference of both tips (a pair) is linear in the compliances of the springs:
each reading gives one equation. Springs of one kind are prints of one drawing and taken for alike within 3 %.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cad.quantity import Estimate, validation_error
from cad.theory.contrast_law import ContrastLaw, contrast_terms
from cad.theory.hertz import relative_curvature
from pipeline.measure.measured_table import MeasuredRow, place_of, refuse_missing
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.signals import force_keys

Floats = NDArray[np.float64]

FEWEST_RUBBERS = 2
AVERAGED = 0.1
"""Of the noise of a sample: each row is the mean of some hundred while the press is held."""
MOST_OPEN = 0.3
"""Of a stiffness, one sigma: a calibration that leaves more is none."""
ALIKE_POISSON = 0.005
"""Over it the curve of log neo-Hooke moves by 0.2 % at most."""
ALIKE = 0.03
"""Of a compliance, one sigma: two prints of one drawing on one machine."""
_RANK = 1e-9  # of the largest singular value: below it springs are not resolvable
_MOVED = 1e-3  # of a rubber's modulus, for what its error does to the springs


class _Equation(NamedTuple):
    """Coefficients of the springs' relative compliances [mm], the right-hand side [mm], and its noise [mm]."""

    coefficients: Floats
    right: float
    noise: float


class _Solution(NamedTuple):
    """By what each spring is softer than the unit's [1], (tips,), and its standard deviation by noise."""

    softness: Floats
    deviation: Floats


def springs_on_rubbers(
    source: str, rows: Sequence[MeasuredRow], sensor: MeasuringUnit
) -> tuple[list[Estimate], list[str]]:
    """Return the stiffness of each spring [N/mm] with its standard deviation, and what was assumed.

    Raises InputError for readings that tell none.
    """
    tips = sensor.report.tips
    refuse_missing(source, rows[0], force_keys(len(tips)))
    names = list(dict.fromkeys(row.texts["rubber"] for row in rows))
    if len(names) < FEWEST_RUBBERS:
        bound = f"at least {FEWEST_RUBBERS} of different modulus"
        raise validation_error(source, len(names), "rubbers", bound, "add a reading")
    moduli = {row.line: _modulus(source, row, sensor) for row in rows}
    softness, by_noise = _solved(source, sensor, rows, moduli)
    deviations = [by_noise]
    for name in names:
        readings = [row for row in rows if row.texts["rubber"] == name]
        harder = moduli | {row.line: moduli[row.line] * (1.0 + _MOVED) for row in readings}
        change = _solved(source, sensor, rows, harder).softness - softness
        deviations.append(change / _MOVED * readings[0].numbers.get("E_error", 0.0))
    relative = np.linalg.norm(deviations, axis=0) / softness
    springs = []
    for tip, C, factor, error in zip(
        tips, np.diag(np.array(sensor.C)), softness.tolist(), relative.tolist(), strict=True
    ):
        field = f"{source}: spring of tip {tip.name}"
        if not factor > 0.0:
            bound = "above 0, by forces of this sensor on these rubbers"
            raise validation_error(field, 1.0 / (factor * C), "N/mm", bound, "check units and order of the columns")
        if error > MOST_OPEN:
            hint = "press more often and deeper, take a harder rubber, or weigh it"
            bound = f"known to {100.0 * MOST_OPEN:g} %"
            raise validation_error(field, f"+- {100.0 * error:.0f} %", "", bound, hint)
        springs.append(Estimate(1.0 / (C * factor), error / (C * factor), "N/mm"))
    return springs, _assumed(source, rows[0].numbers, sensor)


def _assumed(source: str, numbers: Mapping[str, float], sensor: MeasuringUnit) -> list[str]:
    assumed = [f"{source}: each row is taken for the mean of a hundred samples"]
    if "E_error" not in numbers:
        assumed.append(f"{source}: no column E_error_percent, the moduli of the rubbers are taken for exact")
    if "radius" not in numbers:
        shape = "the rubbers are taken for flat, and as large as the design's fruit"
        assumed.append(f"{source}: no column radius_mm, {shape}")
    if len(sensor.report.tips) > len(set(sensor.design.tips.springs)):
        assumed.append(f"springs of one kind are taken for alike within {100.0 * ALIKE:g} %")
    return assumed


def _modulus(source: str, row: MeasuredRow, sensor: MeasuringUnit) -> float:
    """Return the modulus [MPa] that a fruit of the design's Poisson's ratio has where it is as stiff as a rubber."""
    numbers = row.numbers
    poisson = sensor.design.fruit.poisson
    place = place_of(source, row.line)
    if sensor.deep is not None and not abs(numbers.get("poisson", np.inf) - poisson) <= ALIKE_POISSON:
        # E / (1 - nu^2) makes two bodies alike at small strain only: another nu bends the curve otherwise.
        bound = f"within {ALIKE_POISSON:g} of the fruit's {poisson:g} at large strain"
        field = f"{place}: poisson of rubber {row.texts['rubber']}"
        raise validation_error(field, numbers.get("poisson"), "", bound, "calibrate with weights")
    if "E_over_1_minus_nu2" in numbers:
        reduced = numbers["E_over_1_minus_nu2"]
    elif "E" in numbers and "poisson" in numbers:
        reduced = numbers["E"] / (1.0 - numbers["poisson"] ** 2) if abs(numbers["poisson"]) < 1.0 else np.inf
    else:
        bound = "E_over_1_minus_nu2_MPa, or E_MPa beside poisson"
        raise validation_error(place_of(source, 1), None, "", bound, "add the columns")
    if not 0.0 < reduced < np.inf:
        raise validation_error(place, reduced, "MPa", "greater than 0", "mend that line")
    return reduced * (1.0 - poisson**2)


def _solved(source: str, sensor: MeasuringUnit, rows: Sequence[MeasuredRow], moduli: Mapping[int, float]) -> _Solution:
    """Solve the equations of all readings by least squares; `moduli` [MPa] by the line of a row. Raises InputError."""
    tips = len(sensor.report.tips)
    rubbers = list(dict.fromkeys(row.texts["rubber"] for row in rows)) if sensor.law is None else []
    matrix = []
    right = []
    for row in rows:
        equation = _equation(source, sensor, row, moduli[row.line])
        # One tip of a pair may stand before the other, on each rubber anew: an unknown for each.
        offsets = [-1.0 if row.texts["rubber"] == name else 0.0 for name in rubbers]
        matrix.append(np.array([*equation.coefficients, *offsets]) / equation.noise)
        right.append(equation.right / equation.noise)
    for kind in sensor.design.tips.spring_groups:
        for first, second in itertools.pairwise(kind):
            alike = np.zeros(tips + len(rubbers))
            alike[first] = 1.0 / ALIKE
            alike[second] = -1.0 / ALIKE
            matrix.append(alike)
            right.append(0.0)
    scale = np.linalg.norm(matrix, axis=0)
    A = np.array(matrix) / scale
    solution, _, rank, _ = np.linalg.lstsq(A, np.array(right), rcond=_RANK)
    if rank < A.shape[1]:
        bound = "readings that tell the springs apart, of rubbers of different modulus"
        raise validation_error(source, len(rows), "rows", bound, "add another rubber")
    residual = A @ solution - np.array(right)
    variance = max(1.0, float(residual @ residual) / max(1, A.shape[0] - A.shape[1]))
    deviation = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    return _Solution((solution / scale)[:tips], (deviation / scale)[:tips])


def _equation(source: str, sensor: MeasuringUnit, row: MeasuredRow, E: float) -> _Equation:
    """Return the equation of a reading on a rubber of modulus E [MPa]."""
    forces = np.array([row.numbers[key] for key in force_keys(len(sensor.report.tips))])
    if not (forces > 0.0).all():
        place = place_of(source, row.line)
        raise validation_error(place, float(forces.min()), "N", "above 0, on every tip", "press farther")
    C = np.array(sensor.C)
    compliance = np.diag(C)
    coupled = (C - np.diag(compliance)) @ forces  # how far the frame moves each tip for the forces of the others
    noises = AVERAGED * np.array(sensor.noises)
    if sensor.law is None:
        weights = np.array([1.0, -1.0])
        skin = sensor.own_less_other / E
        sunk = skin * float(weights @ forces)
        if sensor.deep is not None:
            sunk = float(sensor.deep.skin_difference(forces, E))
        noise = float(np.linalg.norm(np.hypot(compliance, skin) * noises))
        return _Equation(weights * compliance * forces, -sunk - float(weights @ coupled), noise)
    law = _on_rubber(sensor, sensor.law, row.numbers.get("radius", np.inf))
    weights = np.array(law.weights)
    _, dome, body = contrast_terms(law, forces.tolist())
    rest = float(weights @ (coupled + np.array(law.gaps))) + dome * E ** (-2.0 / 3.0) + body / E
    return _Equation(weights * compliance * forces, -rest, float(np.linalg.norm(weights * compliance * noises)))


def _on_rubber(sensor: MeasuringUnit, law: ContrastLaw, radius: float) -> ContrastLaw:
    """Return the law on a rubber of a radius [mm], infinite for a flat one, instead of on the design's fruit."""
    dome = sensor.design.tips.dome_radius_mm or 0.0
    fruit = sensor.design.fruit.radii_mm[0]
    squares = np.square(sensor.places).sum(axis=1)
    fall = 0.5 * squares * (1.0 / (dome + radius) - 1.0 / (dome + fruit))
    hertz = law.hertz
    if dome:
        hertz *= (relative_curvature(dome, fruit) / relative_curvature(dome, radius)) ** (1.0 / 3.0)
    return replace(law, gaps=tuple((np.array(law.gaps) + fall).tolist()), hertz=hertz)
