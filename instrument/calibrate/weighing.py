"""Springs from weights: each tip loaded along the press, its deflection read; a straight line through them is 1 / K."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from instrument.calibrate.line_checks import LEAST_SPAN, ROUNDED, Bend, bend_of, odd_row
from pipeline.tables.files import place_of
from pipeline.tables.measured_table import MeasuredTable
from sensor.quantity import COVERAGE, Estimate, validation_error

FEWEST = 3
# Student's t that holds 95 %, by degrees of freedom from 1; beyond them 2.
_STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13)
LEAST_ERROR = 1e-4
"""Of a stiffness: no dial and no weight is better."""
_LEAST_COMPLIANCE = 1e-6  # [mm/N] of a spring: below, nothing moved


class Line(NamedTuple):
    """A straight line: its slope, with half of what holds 95 % beside, and how far it is bent."""

    slope: Estimate
    bend: Bend


class WeighedSpring(NamedTuple):
    """The stiffness [N/mm] of a spring, with half of what holds 95 % beside, and the bend of its deflection."""

    K: Estimate
    bend: Bend


def weighed_springs(table: MeasuredTable, column: str, names: Sequence[str]) -> list[WeighedSpring]:
    """Return the spring of each name in a column, in the order of the names.

    Raises InputError for a name without at least three rows of two weights: one weight cannot tell zero from stiffness.
    """
    weighed = table.texts[column]
    for line, name in zip(table.lines, weighed, strict=True):
        if name not in names:
            place = place_of(table.source, line, column)
            raise validation_error(place, name, "", f"one of {', '.join(names)}", "take the names in report.json")
    springs = []
    for name in names:
        rows = np.flatnonzero(np.array(weighed) == name)
        forces, deflections = table.numbers["force"][rows], table.numbers["deflection"][rows]
        last_digits = table.last_digits["deflection"][rows]
        if rows.size and np.ptp(forces) > LEAST_SPAN:  # first: one wrong row spoils the line of all
            refuse_odd_row(table, rows, "force", "deflection", "mm", float(np.ptp(deflections)))
        springs.append(_weighed_spring(f"{table.source}: compliance of {name}", forces, deflections, last_digits))
    return springs


def refuse_odd_row(table: MeasuredTable, rows: NDArray[np.intp], over: str, shown: str, unit: str, span: float) -> None:
    """Raise InputError, which names its line, for a row that does not fit the straight line of the others.

    The line is that of a column that is shown over another; a residual counts from a hundredth of a span on.
    """
    values = table.numbers[shown][rows]
    found = odd_row(table.numbers[over][rows], values, table.last_digits[shown][rows], span)
    if found is not None:
        place = place_of(table.source, table.lines[int(rows[found.index])], shown)
        bound = f"about {found.expected:.6g}, where the line of the other rows is"
        raise validation_error(
            place, float(values[found.index]), unit, bound, "measure that row again, or leave it out"
        )


def _weighed_spring(
    field: str, forces: NDArray[np.float64], deflections: NDArray[np.float64], last_digits: NDArray[np.float64]
) -> WeighedSpring:
    """Return the spring that some rows load."""
    compliance, bend = line_through(field, forces, deflections, last_digits, "mm/N")
    if not compliance.value > _LEAST_COMPLIANCE:
        hint = "swap columns, turn the sign, or mend a unit"
        raise validation_error(field, compliance.value, "mm/N", f"more than {_LEAST_COMPLIANCE:g}", hint)
    if compliance.error > compliance.value:
        bound = f"known to 200 %, not ± {COVERAGE * compliance.error:.2g} mm/N"
        raise validation_error(field, compliance.value, "mm/N", bound, "weigh again")
    relative = max(compliance.error / compliance.value, LEAST_ERROR)
    return WeighedSpring(Estimate(1.0 / compliance.value, relative / compliance.value, "N/mm"), bend)


def line_through(
    field: str, forces: NDArray[np.float64], shown: NDArray[np.float64], last_digits: NDArray[np.float64], unit: str
) -> Line:
    """Return the line of what is shown over forces [N]; a wrong zero drops out.

    The scatter is that about a parabola where the line is bent. Raises InputError for fewer than three rows or one
    weight.
    """
    weights = len(set(forces.tolist()))
    if len(forces) < FEWEST or weights == 1 or not np.ptp(forces) > LEAST_SPAN:
        bound = f"at least {FEWEST}, of 2 weights; one weight cannot tell a wrong zero from a wrong slope"
        rows = f"rows, of {weights} different weights within {np.ptp(forces):.2g} N"
        raise validation_error(field, len(forces), rows, bound, "add a row without weight")

    slope, zero = np.polyfit(forces, shown, 1).tolist()
    bend = bend_of(forces, shown, last_digits)
    scatter = bend.scatter
    if bend.excess == 0.0:
        residual = shown - zero - slope * forces
        freedom = len(forces) - 2
        student = _STUDENT[freedom - 1] if freedom <= len(_STUDENT) else COVERAGE
        scatter = student / COVERAGE * math.sqrt(float(residual @ residual) / freedom)
    # Each number has the scatter about the line and, beside it, the standard deviation of its rounding.
    rounding = ROUNDED * float(last_digits.min())
    error = math.hypot(scatter, rounding) / float(np.linalg.norm(forces - forces.mean()))
    if bend.excess > 0.0:
        error = math.hypot(error, 0.5 * bend.deviation * slope)  # at either end of the line
    return Line(Estimate(slope, error, unit), bend)
