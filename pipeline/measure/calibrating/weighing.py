"""Springs from weights: each tip loaded along the press, its deflection read; a straight line through them is 1 / K."""

import math
import statistics
from collections.abc import Sequence

from cad.quantity import COVERAGE, Estimate, validation_error
from pipeline.measure.measured_table import MeasuredRow, place_of, refuse_missing

FEWEST = 3
# Student's t that holds 95 %, by degrees of freedom from 1; beyond them 2.
_STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13)
_LEAST_ERROR = 1e-4  # of a stiffness: no dial and no weight is better
_LEAST_COMPLIANCE = 1e-6  # [mm/N] of a spring: below, nothing moved
_ROUNDED = 12.0**-0.5  # standard deviation of a rounded number, of its last digit (JCGM 100:2008, F.2.2.1)


def weighed_springs(source: str, rows: Sequence[MeasuredRow], column: str, names: Sequence[str]) -> list[Estimate]:
    """Return the stiffness [N/mm] of each name in a column, in the order of the names, half of what holds 95 % beside.

    Raises InputError for a name without at least three rows of two weights: one weight cannot tell zero from stiffness.
    """
    refuse_missing(source, rows[0], ("force", "deflection"))
    for row in rows:
        name = row.texts[column]
        if name not in names:
            bound = f"one of {', '.join(names)}"
            raise validation_error(place_of(source, row.line, column), name, "", bound, "take the names in report.json")
    return [_weighed_spring(source, name, [row for row in rows if row.texts[column] == name]) for name in names]


def _weighed_spring(source: str, name: str, rows: Sequence[MeasuredRow]) -> Estimate:
    """Return the stiffness [N/mm] by rows that load one spring; a constant error of the zero drops out."""
    field = f"{source}: compliance of {name}"
    forces = [row.numbers["force"] for row in rows]
    deflections = [row.numbers["deflection"] for row in rows]
    if len(rows) < FEWEST or max(forces) == min(forces):
        bound = f"at least {FEWEST}, of 2 weights; one weight cannot tell a wrong zero from a wrong stiffness"
        weights = f"rows, of {len(set(forces))} different weights"
        raise validation_error(field, len(rows), weights, bound, "add a row without weight")
    rounding = _ROUNDED * min(row.digits["deflection"] for row in rows)
    compliance = _slope(forces, deflections, rounding)
    if not compliance.value > _LEAST_COMPLIANCE:
        hint = "swap columns, turn the sign, or mend a unit"
        raise validation_error(field, compliance.value, "mm/N", f"more than {_LEAST_COMPLIANCE:g}", hint)
    if compliance.error > compliance.value:
        bound = f"known to 200 %, not +- {2.0 * compliance.error:.2g} mm/N"
        raise validation_error(field, compliance.value, "mm/N", bound, "weigh again")
    K = 1.0 / compliance.value
    return Estimate(K, K * max(compliance.relative, _LEAST_ERROR), "N/mm")


def _slope(x: Sequence[float], y: Sequence[float], rounding: float) -> Estimate:
    """Return the slope of the line of least squares, and half of what holds it with 95 %.

    Each y has the scatter about the line and, beside it, the standard deviation of its rounding [unit of y].
    """
    slope, zero = statistics.linear_regression(x, y)
    middle = statistics.fmean(x)
    spread = math.fsum((at - middle) ** 2 for at in x)
    residual = math.fsum((value - zero - slope * at) ** 2 for at, value in zip(x, y, strict=True))
    freedom = len(x) - 2
    student = _STUDENT[freedom - 1] if freedom <= len(_STUDENT) else COVERAGE
    scatter = student / COVERAGE * math.sqrt(residual / freedom)
    return Estimate(slope, math.hypot(scatter, rounding) / math.sqrt(spread), "mm/N")
