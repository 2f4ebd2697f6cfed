"""What somebody measured of a print, as a CSV table whose header names columns and units."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
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
_MOST = {
    "weight": 100.0 * STANDARD_GRAVITY,
    "force": 1e3,
    "F": 1e3,
    "deflection": 100.0,
    "E": 1e6,
    "E_over_1_minus_nu2": 1e6,
    "radius": 1e6,
    "E_error": 1.0,
    "poisson": 1.0,
}
"""The largest size of a quantity [N, mm, MPa, 1]: no print is measured beyond."""
TEXTS = ("tip", "coupon", "rubber")
BARE = ("poisson",)


@dataclass(frozen=True)
class MeasuredRow:
    """One row: its line in the file, its words and its numbers [N, mm, MPa, 1] by the name of their columns.

    `digits` is what one step of the last written digit of each number is worth [N, mm, MPa, 1].
    """

    line: int
    words: Mapping[str, str]
    numbers: Mapping[str, float]
    digits: Mapping[str, float]


def measured_rows(path: Path) -> list[MeasuredRow]:
    """Return the rows of a table; raises InputError that names line, column and value of what cannot be used."""
    head, *lines = _cells(path)
    columns = [_column(path, name.strip()) for name in head]
    _refuse_twice(path, columns)
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
    kind: str
    factor: float | None


def _column(path: Path, header: str) -> _Column:
    """Return what a column holds by its header: a text, a number without a unit, or a quantity and its unit."""
    if header in TEXTS:
        return _Column(header, header, header, None)
    if header in BARE:
        return _Column(header, header, header, 1.0)
    quantity, _, unit = header.rpartition("_")
    kind = "F" if quantity.startswith("F_") else quantity
    if kind not in UNITS:
        known = ", ".join([*TEXTS, *BARE, *(f"{name}_{next(iter(units))}" for name, units in UNITS.items())])
        msg = f"{path} line 1 column {header!r}: must be one of {known}; name the column and its unit"
        raise InputError(msg)
    if unit not in UNITS[kind]:
        msg = f"{path} line 1 column {header!r}: unit must be one of {', '.join(UNITS[kind])}; convert the column"
        raise InputError(msg)
    return _Column(header, "force" if kind == "weight" else quantity, kind, UNITS[kind][unit])


def _refuse_twice(path: Path, columns: Sequence[_Column]) -> None:
    """Raise InputError where two columns tell one quantity, or a table is of more than one thing."""
    headers: dict[str, str] = {}
    for column in columns:
        what = "text" if column.factor is None else column.name
        if what in headers:
            bound = f"the only one of its kind, and column {headers[what]!r} is another"
            msg = f"{path} line 1 column {column.header!r}: must be {bound}; leave one of the two out"
            raise InputError(msg)
        headers[what] = column.header


def _row(path: Path, line: int, columns: Sequence[_Column], cells: Sequence[str]) -> MeasuredRow:
    words, numbers, digits = {}, {}, {}
    for column, cell in zip(columns, cells, strict=True):
        if column.factor is None:
            words[column.name] = cell.strip()
            continue
        value, most = _number(cell), _MOST[column.kind] / column.factor
        shown = f"{path} line {line} column {column.header!r} = {cell.strip()!r}"
        if value is None:
            msg = f"{shown}: must be a finite number; write decimals with a point"
            raise InputError(msg)
        if abs(value) > most:
            msg = f"{shown}: must be at most {most:g}; check the unit of the column"
            raise InputError(msg)
        numbers[column.name] = float(value) * column.factor
        digits[column.name] = float(Decimal((0, (1,), int(value.as_tuple().exponent)))) * column.factor
    return MeasuredRow(line, words, numbers, digits)


def _number(cell: str) -> Decimal | None:
    """Return a number with the digits that are written, None for a text that is none."""
    try:
        value = Decimal(cell.strip())
    except InvalidOperation:
        return None
    return value if value.is_finite() else None
