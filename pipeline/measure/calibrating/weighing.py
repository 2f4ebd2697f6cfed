"""Springs from weights: each tip loaded along the press, its deflection read; a straight line through them is 1 / K."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import COVERAGE, InputError
from pipeline.measure.calibrating.measured_table import MeasuredRow, only_columns

FEWEST = 3
# Student's t that holds 95 %, by degrees of freedom from 1; beyond them 2.
_STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13)
_LEAST_SHARE = 1e-4  # of a stiffness: no dial and no weight is better
_LEAST_GIVE = 1e-6  # [mm/N] of a spring: below, nothing gave
_ROUNDED = 12.0**-0.5  # standard deviation of a rounded number, of its last digit (JCGM 100:2008, F.2.2.1)


@dataclass(frozen=True)
class WeighedSpring:
    """A stiffness [N/mm], half of what holds it with 95 % as a share [1], and the deflection without weight [mm]."""

    K: float
    share: float
    zero: float


def weighed_springs(path: Path, rows: Sequence[MeasuredRow], word: str, names: Sequence[str]) -> list[WeighedSpring]:
    """Return the spring of each name in the column `word`, in the order of the names.

    Raises InputError for a name without at least three rows of two weights: one weight cannot tell zero from stiffness.
    """
    only_columns(path, rows, (word, "force", "deflection"))
    for row in rows:
        if row.words[word] not in names:
            shown = f"{path} line {row.line} column {word!r} = {row.words[word]!r}"
            msg = f"{shown}: must be one of {', '.join(names)}; take the names in report.json"
            raise InputError(msg)
    return [weighed_spring(path, name, [row for row in rows if row.words[word] == name]) for name in names]


def weighed_spring(path: Path, name: str, rows: Sequence[MeasuredRow]) -> WeighedSpring:
    """Return the spring of rows that load it; a constant error of the zero drops out. Raises InputError."""
    forces = [row.numbers["force"] for row in rows]
    deflections = [row.numbers["deflection"] for row in rows]
    if len(rows) < FEWEST or max(forces) == min(forces):
        weights = len(set(forces))
        bound = f"at least {FEWEST} rows of 2 weights; one weight cannot tell a wrong zero from a wrong stiffness"
        msg = f"{path}: {name} has {len(rows)} rows, of {weights} different weights: must have {bound}; add one without"
        raise InputError(msg)
    rounding = _ROUNDED * min(row.digits["deflection"] for row in rows)
    slope, zero, error = _straight_line(forces, deflections, rounding)
    _refuse_no_spring(path, name, slope, error)
    return WeighedSpring(K=1.0 / slope, share=max(error / slope, _LEAST_SHARE), zero=zero)


def _refuse_no_spring(path: Path, name: str, slope: float, error: float) -> None:
    """Raise InputError for a slope [mm/N] that no spring has, or that its error leaves open altogether."""
    if not slope > _LEAST_GIVE:
        bound = f"more than {_LEAST_GIVE:g}"
        msg = (
            f"{path}: {name} gives by {slope:g} mm per N: must be {bound}; swap columns, turn the sign, or mend a unit"
        )
        raise InputError(msg)
    if error > slope:
        msg = f"{path}: {name} gives by {slope:g} +- {2.0 * error:.2g} mm per N: must be known to 200 %; weigh again"
        raise InputError(msg)


def _straight_line(x: Sequence[float], y: Sequence[float], rounding: float) -> tuple[float, float, float]:
    """Return slope and intercept of the line of least squares, and half of what holds the slope with 95 %.

    Each y has the scatter about the line and, beside it, the standard deviation of its rounding [unit of y].
    """
    middle, level = math.fsum(x) / len(x), math.fsum(y) / len(y)
    spread = math.fsum((one - middle) ** 2 for one in x)
    slope = math.fsum((one - middle) * (other - level) for one, other in zip(x, y, strict=True)) / spread
    zero = level - slope * middle
    left = math.fsum((other - zero - slope * one) ** 2 for one, other in zip(x, y, strict=True))
    freedom = len(x) - 2
    student = _STUDENT[freedom - 1] if freedom <= len(_STUDENT) else COVERAGE
    scatter = student / COVERAGE * math.sqrt(left / freedom)
    return slope, zero, math.hypot(scatter, rounding) / math.sqrt(spread)
