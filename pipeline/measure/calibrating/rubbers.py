"""Springs from readings on reference rubbers: what the springs must be so that each rubber reads as its own modulus.

The contrast (a line or a square) or the difference of both tips (a pair) is linear in the compliances of the springs:
each reading gives one equation. Springs of one kind are prints of one drawing and taken for alike within 3 %.
"""

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cad.quantity import Estimate, validation_error
from cad.theory.contrast_law import ContrastLaw, contrast_terms
from cad.theory.hertz import relative_radius
from pipeline.measure.measured_table import MeasuredTable, place_of
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.signals import force_keys
from pipeline.reading.measurement import rows_of

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


class _Softness(NamedTuple):
    """By what each spring is softer than the unit's [1], (tips,), and its standard deviation by noise."""

    factors: Floats
    deviations: Floats


def springs_on_rubbers(table: MeasuredTable, sensor: MeasuringUnit) -> list[Estimate]:
    """Return the stiffness of each spring [N/mm] with its standard deviation.

    Raises InputError for readings that tell none.
    """
    tips = sensor.report.tips
    rubbers = np.array(table.texts["rubber"])
    names = list(dict.fromkeys(table.texts["rubber"]))
    if len(names) < FEWEST_RUBBERS:
        bound = f"at least {FEWEST_RUBBERS} of different modulus"
        raise validation_error(table.source, len(names), "rubbers", bound, "add a reading")
    forces = np.column_stack([table.numbers[key] for key in force_keys(len(tips))])
    for line, row in zip(table.lines, forces, strict=True):
        if not row.min() > 0.0:
            place = place_of(table.source, line)
            raise validation_error(place, float(row.min()), "N", "above 0, on every tip", "press farther")

    moduli = _moduli(table, sensor)
    softness = _softness(table, sensor, forces, moduli)
    deviations = [softness.deviations]
    if "E_error" in table.numbers:
        for name in names:
            is_this = rubbers == name
            harder = _softness(table, sensor, forces, np.where(is_this, moduli * (1.0 + _MOVED), moduli))
            error = table.numbers["E_error"][is_this][0]
            deviations.append((harder.factors - softness.factors) / _MOVED * error)
    stiffnesses = 1.0 / (np.diag(sensor.C) * softness.factors)
    errors = np.linalg.norm(deviations, axis=0) / softness.factors

    springs = []
    for tip, K, error in zip(tips, stiffnesses.tolist(), errors.tolist(), strict=True):
        field = f"{table.source}: spring of tip {tip.name}"
        if not K > 0.0:
            bound = "above 0, by forces of this sensor on these rubbers"
            raise validation_error(field, K, "N/mm", bound, "check units and order of the columns")
        if error > MOST_OPEN:
            hint = "press more often and deeper, take a harder rubber, or weigh it"
            bound = f"known to {100.0 * MOST_OPEN:g} %"
            raise validation_error(field, f"+- {100.0 * error:.0f} %", "", bound, hint)
        springs.append(Estimate(K, error * K, "N/mm"))
    return springs


def assumed_of_rubbers(table: MeasuredTable, sensor: MeasuringUnit) -> list[str]:
    """Return a sentence on each thing that is taken for granted."""
    assumed = ["each row is taken for the mean of a hundred samples"]
    if "E_error" not in table.numbers:
        assumed.append("no column E_error_percent, the moduli of the rubbers are taken for exact")
    if "radius" not in table.numbers:
        shape = "the rubbers are taken for flat, and as large as the design's fruit"
        assumed.append(f"no column radius_mm, {shape}")
    sentences = [f"{table.source}: {sentence}" for sentence in assumed]
    if len(sensor.report.tips) > len(set(sensor.design.tips.springs)):
        sentences.append(f"springs of one kind are taken for alike within {100.0 * ALIKE:g} %")
    return sentences


def _moduli(table: MeasuredTable, sensor: MeasuringUnit) -> Floats:
    """Return the modulus [MPa] that fruit of the design's Poisson's ratio has where it is as stiff as each rubber."""
    numbers = table.numbers
    nu = sensor.design.fruit.poisson
    rubber_nu = numbers.get("poisson", np.full(len(table.lines), np.nan))
    if "E_over_1_minus_nu2" in numbers:
        reduced = numbers["E_over_1_minus_nu2"]
    elif "E" in numbers and "poisson" in numbers:
        # a ratio of 1 or more is no rubber's, and leaves no modulus
        reduced = numbers["E"] / np.where(np.abs(rubber_nu) < 1.0, 1.0 - rubber_nu**2, np.nan)
    else:
        bound = "E_over_1_minus_nu2_MPa, or E_MPa beside poisson"
        raise validation_error(place_of(table.source, 1), None, "", bound, "add the columns")
    for index, line in enumerate(table.lines):
        place = place_of(table.source, line)
        if sensor.deep is not None and not abs(rubber_nu[index] - nu) <= ALIKE_POISSON:
            # E / (1 - nu^2) makes two bodies alike at small strain only: another nu bends the curve otherwise.
            bound = f"within {ALIKE_POISSON:g} of the fruit's {nu:g} at large strain"
            field = f"{place}: poisson of rubber {table.texts['rubber'][index]}"
            value = float(rubber_nu[index]) if "poisson" in numbers else None
            raise validation_error(field, value, "", bound, "calibrate with weights")
        if not reduced[index] > 0.0:
            raise validation_error(place, float(reduced[index]), "MPa", "greater than 0", "mend that line")
    return np.asarray(reduced * (1.0 - nu**2))


def _softness(table: MeasuredTable, sensor: MeasuringUnit, forces: Floats, moduli: Floats) -> _Softness:
    """Solve the equations of all readings by least squares: forces [N], (rows, tips), on moduli [MPa], (rows,).

    Raises InputError where they cannot be resolved.
    """
    tips = forces.shape[1]
    rubbers = table.texts["rubber"]
    radii = table.numbers.get("radius", np.full(len(rubbers), np.inf))
    # One tip of a pair may stand before the other, on each rubber anew: an unknown for each.
    offsets = list(dict.fromkeys(rubbers)) if sensor.law is None else []
    matrix = []
    right = []
    for index, rubber in enumerate(rubbers):
        E = float(moduli[index])
        if sensor.law is None:
            equation = _difference_equation(sensor, forces[index], E)
        else:
            law = _on_rubber(sensor, sensor.law, float(radii[index]))
            equation = _contrast_equation(sensor, law, forces[index], E)
        row = np.concatenate([equation.coefficients, np.zeros(len(offsets))])
        if offsets:
            row[tips + offsets.index(rubber)] = -1.0
        matrix.append(row / equation.noise)
        right.append(equation.right / equation.noise)
    for group in sensor.design.tips.spring_groups:
        for first, second in itertools.pairwise(group):
            row = np.zeros(tips + len(offsets))
            row[first] = 1.0 / ALIKE
            row[second] = -1.0 / ALIKE
            matrix.append(row)
            right.append(0.0)

    scale = np.linalg.norm(matrix, axis=0)
    A = np.array(matrix) / scale
    solution, _, rank, _ = np.linalg.lstsq(A, np.array(right), rcond=_RANK)
    if rank < A.shape[1]:
        bound = "readings that tell the springs apart, of rubbers of different modulus"
        raise validation_error(table.source, len(rubbers), "rows", bound, "add another rubber")
    residual = A @ solution - right
    variance = max(1.0, float(residual @ residual) / max(1, A.shape[0] - A.shape[1]))
    deviation = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    return _Softness((solution / scale)[:tips], (deviation / scale)[:tips])


def _difference_equation(sensor: MeasuringUnit, forces: Floats, E: float) -> _Equation:
    """Return the equation of a reading of a pair, forces [N], on a rubber of modulus E [MPa]: one travel."""
    C = np.array(sensor.C)
    compliance = np.diag(C)
    difference = np.array([1.0, -1.0])
    by_frame = (C - np.diag(compliance)) @ forces  # how far the frame moves each tip for the force of the other
    skin = sensor.own_less_other / E
    skin_difference = skin * float(difference @ forces)
    if sensor.deep is not None:
        skin_difference = float(sensor.deep.skin_difference(forces, E))
    noise = math.hypot(*(np.hypot(compliance, skin) * _row_errors(sensor)))
    return _Equation(difference * compliance * forces, -skin_difference - float(difference @ by_frame), noise)


def _contrast_equation(sensor: MeasuringUnit, law: ContrastLaw, forces: Floats, E: float) -> _Equation:
    """Return the equation of a reading of more tips, forces [N], on a rubber of modulus E [MPa]: no contrast."""
    compliance = np.diag(sensor.C)
    weights = np.array(law.weights)
    coefficients = weights * compliance * forces
    rigid, dome, body = contrast_terms(law, forces.tolist())
    without_springs = rigid - coefficients.sum() + dome * E ** (-2.0 / 3.0) + body / E
    noise = math.hypot(*(weights * compliance * _row_errors(sensor)))
    return _Equation(coefficients, -without_springs, noise)


def _row_errors(sensor: MeasuringUnit) -> Floats:
    """Return what the forces of a row are off by [N]: their averaged noise, and the drift of zero, which stays."""
    return np.hypot(AVERAGED * sensor.noises, sensor.zero_drifts)


def _on_rubber(sensor: MeasuringUnit, law: ContrastLaw, radius: float) -> ContrastLaw:
    """Return the law on a rubber of a radius [mm], infinite for a flat one, instead of on the design's fruit."""
    dome = sensor.design.tips.dome_radius_mm or 0.0
    fruit = sensor.design.fruit.radii_mm[0]
    squares = np.square(sensor.positions).sum(axis=1)
    fall = 0.5 * squares * (1.0 / (dome + radius) - 1.0 / (dome + fruit))
    hertz = law.hertz
    lean = np.subtract(law.C, sensor.C) * ((dome + fruit) / (dome + radius)) ** 2
    if dome:
        hertz *= (relative_radius(dome, fruit) / relative_radius(dome, radius)) ** (1.0 / 3.0)
    C = rows_of(sensor.C + lean)
    return replace(law, gaps=tuple((np.array(law.gaps) + fall).tolist()), C=C, hertz=hertz)
