"""The force-travel curves of a file: two columns, or an export of TRAPEZIUM X in either of its layouts.

A table begins at a header that names a force and a travel. One table may hold several specimens side by side, each
with its own TIME, FORCE and STROKE; several tables may follow each other, parted by blank lines. What else a file
says, of its method or its results, is passed over.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cad.quantity import validation_error
from pipeline.measure.compression.columns import UNITS, Column, Kind, column_of, is_unit, unit_of
from pipeline.measure.compression.csv_text import CsvText, Row, is_number, number, read_csv_text

Floats = NDArray[np.float64]

DEFAULT_UNITS: dict[Kind, str] = {"force": "N", "travel": "mm", "time": "s"}
_EXAMPLE = "begin the table with a line such as force_N,travel_mm"


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """One curve: travel [mm] and force [N] as measured, shape (rows,), the line that each row stands on, and labels.

    `notes` say what was assumed on reading it.
    """

    file: str
    name: str
    travel: Floats
    force: Floats
    time: Floats | None
    lines: tuple[int, ...]
    labels: dict[Kind, str]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Table:
    """A header with the rows under it."""

    header: Row
    title: Row | None
    units: Row | None
    rows: tuple[Row, ...]


def read_specimens(path: Path, units: Mapping[Kind, str]) -> list[Specimen]:
    """Return every curve of a file; `units` are those given by flags. Raises InputError."""
    text = read_csv_text(path)
    found: list[Specimen] = []
    for table in _tables(text):
        for columns in _groups(text, table):
            found.append(_specimen(text, table, columns, units, f"{len(found) + 1}"))
    if not found:
        first = next(row for row in text.rows if not row.empty)
        place = f"{text.name}, line {first.line}"
        bound = "a table whose header names a force and a travel"
        raise validation_error(place, text.delimiter.join(first.cells)[:60], "", bound, _EXAMPLE)
    return found


def _tables(text: CsvText) -> list[_Table]:
    rows, place = text.rows, 0
    found: list[_Table] = []
    while place < len(rows):
        if not _is_header(rows[place]):
            place += 1
            continue
        header, title = rows[place], rows[place - 1] if place else None
        place += 1
        units = rows[place] if place < len(rows) and _is_units(rows[place]) else None
        place += units is not None
        start = place
        while place < len(rows) and not rows[place].empty and not _ends(rows, place):
            place += 1
        found.append(_Table(header=header, title=title, units=units, rows=rows[start:place]))
        _refuse_loose_numbers(text, place)
    return found


def _is_header(row: Row) -> bool:
    kinds = {column.kind for column in _columns(row)}
    return {"force", "travel"} <= kinds


def _columns(row: Row) -> list[Column]:
    if any(is_number(cell) for cell in row.cells):
        return []
    return [column for place, cell in enumerate(row.cells) if cell and (column := column_of(place, cell))]


def _is_units(row: Row) -> bool:
    filled = [cell for cell in row.cells if cell]
    return bool(filled) and not any(is_number(cell) for cell in filled) and any(is_unit(cell) for cell in filled)


def _ends(rows: tuple[Row, ...], place: int) -> bool:
    """Say whether a next table begins here without a blank line: at its header, or at the title above it."""
    here = _is_header(rows[place])
    return here or (place + 1 < len(rows) and _is_header(rows[place + 1]) and not is_number(rows[place].cells[0]))


def _refuse_loose_numbers(text: CsvText, place: int) -> None:
    """Raise InputError where numbers go on after a blank line: rows may be missing there."""
    below = next((row for row in text.rows[place:] if not row.empty), None)
    if below is not None and len([cell for cell in below.cells if cell]) > 1 and all(map(is_number, below.cells)):
        bound = "a header, or the end of the file, after a blank line"
        remedy = "take the blank line away if no row is missing there"
        where = f"{text.name}, line {below.line}"
        raise validation_error(where, text.delimiter.join(below.cells)[:60], "", bound, remedy)


def _groups(text: CsvText, table: _Table) -> list[dict[Kind, Column]]:
    """Return for each specimen of a table its columns; a kind that comes again begins the next specimen."""
    groups: list[dict[Kind, Column]] = [{}]
    for column in _columns(table.header):
        if column.kind in groups[-1]:
            groups.append({})
        groups[-1][column.kind] = column
    for group in groups:
        if not {"force", "travel"} <= group.keys():
            place = f"{text.name}, line {table.header.line}"
            shown = ", ".join(column.label for column in group.values())
            bound = "for each specimen one force and one travel"
            raise validation_error(place, shown, "", bound, "leave only one column of each in the table")
    return groups


def _specimen(
    text: CsvText, table: _Table, columns: dict[Kind, Column], given: Mapping[Kind, str], default: str
) -> Specimen:
    notes, scales = [], {}
    for kind, column in columns.items():
        unit = _unit(text, table, column, given)
        if unit is None:
            unit = DEFAULT_UNITS[kind]
            if kind != "time":
                notes.append(
                    f"the unit of {column.label!r} is not given: {unit} is assumed; --{kind}-unit says another"
                )
        scales[kind] = UNITS[kind][unit]
    rows = _filled_rows(text, table, columns)
    values = {
        kind: np.array([scales[kind] * number(text, row, column.label, row.cells[column.place]) for row in rows])
        for kind, column in columns.items()
    }
    return Specimen(
        file=text.name,
        name=_name(table, columns) or default,
        travel=values["travel"],
        force=values["force"],
        time=values.get("time"),
        lines=tuple(row.line for row in rows),
        labels={kind: column.label for kind, column in columns.items()},
        notes=tuple(notes),
    )


def _unit(text: CsvText, table: _Table, column: Column, given: Mapping[Kind, str]) -> str | None:
    below = table.units.cells[column.place] if table.units and column.place < len(table.units.cells) else ""
    place = f"{text.name}, line {table.units.line if table.units else table.header.line}, column {column.label!r}: unit"
    stated = unit_of(column.kind, below.strip("()[] "), place) if below else column.unit
    wanted = given.get(column.kind)
    if stated is not None and wanted is not None and stated != wanted:
        raise validation_error(
            place, stated, "", f"the unit that --{column.kind}-unit gives, {wanted}", "leave that flag out"
        )
    return stated or wanted


def _filled_rows(text: CsvText, table: _Table, columns: dict[Kind, Column]) -> list[Row]:
    """Return the rows of one specimen: all of them, or up to where its cells stay empty beside longer specimens."""
    last = max(column.place for column in columns.values())
    rows = [_long_enough(text, table, row, last) for row in table.rows]
    filled = [any(row.cells[column.place] for column in columns.values()) for row in rows]
    count = len(filled) - filled[::-1].index(True) if any(filled) else 0
    return rows[:count]


def _long_enough(text: CsvText, table: _Table, row: Row, last: int) -> Row:
    """Return a row with a cell for every column; raises InputError for one with more cells than the header."""
    if any(row.cells[len(table.header.cells) :]):
        bound = f"{len(table.header.cells)} cells as in the header, and it has {len(row.cells)}"
        remedy = "part cells by semicolons where numbers have decimal commas"
        where = f"{text.name}, line {row.line}"
        raise validation_error(where, text.delimiter.join(row.cells)[:60], "", bound, remedy)
    return Row(line=row.line, cells=row.cells + ("",) * (last + 1 - len(row.cells)))


def _name(table: _Table, columns: dict[Kind, Column]) -> str:
    """Return the specimen's name: the text above its first column, where there is any."""
    first = min(column.place for column in columns.values())
    if table.title is None or table.title.empty or len(table.title.cells) <= first:
        return ""
    above = table.title.cells[first]
    beside = [table.title.cells[c.place] for c in columns.values() if first < c.place < len(table.title.cells)]
    return "" if any(beside) or is_number(above) or is_unit(above) else above
