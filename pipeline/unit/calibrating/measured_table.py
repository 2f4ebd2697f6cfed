"""What somebody measured of a print, as a CSV table whose header names columns and units."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import InputError

STANDARD_GRAVITY = 9.80665  # [m/s^2], ISO 80000-3
UNITS = {
    "weight": {"g": 1e-3 * STANDARD_GRAVITY, "kg": STANDARD_GRAVITY},
    "force": {"N": 1.0, "mN": 1e-3},
    "F": {"N": 1.0, "mN": 1e-3},
    "deflection": {"mm": 1.0, "um": 1e-3},
    "E": {"MPa": 1.0, "kPa": 1e-3},
    "E_over_1_minus_nu2": {"MPa": 1.0, "kPa": 1e-3},
    "radius": {"mm": 1.0},
    "E_error": {"percent": 0.01},
}
"""What one unit of a quantity is in N, mm, MPa or as a share."""
TEXTS = ("tip", "coupon", "rubber")
BARE = ("poisson",)


@dataclass(frozen=True)
class MeasuredRow:
    """One row: its line in the file, its words and its numbers [N, mm, MPa, 1] by the name of their columns."""

    line: int
    words: Mapping[str, str]
    numbers: Mapping[str, float]


def measured_rows(path: Path) -> list[MeasuredRow]:
    """Return the rows of a table; raises InputError that names line, column and value of what cannot be used."""
    head, *lines = _cells(path)
    columns = [_column(path, name.strip()) for name in head]
    rows = []
    for number, cells in enumerate(lines, start=2):
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) != len(columns):
            bound = f"{len(columns)}, as its header; write decimals with a point and leave no value out"
            msg = f"{path} line {number}: {len(cells)} values; must be {bound}"
            raise InputError(msg)
        rows.append(_row(path, number, columns, cells))
    if not rows:
        msg = f"MEASURED.csv = {str(path)!r}: no rows below its header; must have one for each weight; weigh the unit"
        raise InputError(msg)
    return rows


def _cells(path: Path) -> list[list[str]]:
    """Return the cells of each line of a CSV file, parted by commas, semicolons or tabs."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        msg = f"MEASURED.csv = {str(path)!r}: must be a CSV file in UTF-8 ({type(error).__name__}); check the file"
        raise InputError(msg) from error
    if "\0" in text:
        msg = f"MEASURED.csv = {str(path)!r}: must be text, not a binary file; export it as CSV"
        raise InputError(msg)
    first = text.partition("\n")[0]
    if not first.strip():
        bound = "a header like tip,weight_g,deflection_mm and rows"
        msg = f"MEASURED.csv = {str(path)!r}: empty; must have {bound}; weigh the unit"
        raise InputError(msg)
    delimiter = next((sign for sign in (";", "\t") if sign in first), ",")
    return list(csv.reader(io.StringIO(text), delimiter=delimiter))


def only_columns(path: Path, rows: Sequence[MeasuredRow], wanted: Sequence[str]) -> None:
    """Raise InputError where a table has no column of a name that is wanted."""
    given = {*rows[0].words, *rows[0].numbers}
    for name in wanted:
        if name not in given:
            msg = (
                f"{path} line 1: no column {name}; must have {', '.join(wanted)}, each with its unit; name the columns"
            )
            raise InputError(msg)


@dataclass(frozen=True)
class _Column:
    header: str
    name: str
    factor: float | None


def _column(path: Path, header: str) -> _Column:
    """Return what a column holds by its header: a text, a number without a unit, or a quantity and its unit."""
    if header in TEXTS:
        return _Column(header, header, None)
    if header in BARE:
        return _Column(header, header, 1.0)
    quantity, _, unit = header.rpartition("_")
    kind = "F" if quantity.startswith("F_") else quantity
    if kind not in UNITS:
        known = ", ".join([*TEXTS, *BARE, *(f"{name}_{next(iter(units))}" for name, units in UNITS.items())])
        msg = f"{path} line 1 column {header!r}: must be one of {known}; name the column and its unit"
        raise InputError(msg)
    if unit not in UNITS[kind]:
        msg = f"{path} line 1 column {header!r}: unit must be one of {', '.join(UNITS[kind])}; convert the column"
        raise InputError(msg)
    return _Column(header, quantity, UNITS[kind][unit])


def _row(path: Path, number: int, columns: Sequence[_Column], cells: Sequence[str]) -> MeasuredRow:
    words, numbers = {}, {}
    for column, cell in zip(columns, cells, strict=True):
        if column.factor is None:
            words[column.name] = cell.strip()
        else:
            value = _number(cell)
            if not math.isfinite(value):
                shown = f"{path} line {number} column {column.header!r} = {cell.strip()!r}"
                msg = f"{shown}: must be a finite number; write decimals with a point"
                raise InputError(msg)
            numbers["force" if column.name == "weight" else column.name] = value * column.factor
    return MeasuredRow(number, words, numbers)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan
