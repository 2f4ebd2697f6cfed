"""The force-travel curves of a file: two columns, or an export of TRAPEZIUM X in either of its layouts.

A table begins at a header that names a force and a travel, and ends at a blank line. Several specimens may stand side
by side, each with its own TIME, FORCE and STROKE. What else a file says, of its method or its results, is passed over.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.measure.measured_table import (
    FORCE,
    LENGTH,
    TIME,
    Column,
    CsvFormat,
    Quantity,
    TableRow,
    columns_of,
    is_number,
    place_of,
    read_csv,
    refuse_other_length,
)
from sensor.arrays import Floats
from sensor.quantity import validation_error

_FORCE_WORDS = (
    "load, f, test force, compression force, compressive force, compressive load, standard force, axial force, "
    "kraft, standardkraft"
)
_TRAVEL_WORDS = (
    "distance, stroke, displacement, disp, disp., crosshead, position, deformation, x, compression, "
    "compressive extension, extension, weg, standardweg, traversenweg"
)
_TIME_WORDS = "t, elapsed time, zeit, prüfzeit"
QUANTITIES = {
    "force": Quantity(units=FORCE, default="N", words=tuple(_FORCE_WORDS.split(", "))),
    "travel": Quantity(units=LENGTH, default="mm", words=tuple(_TRAVEL_WORDS.split(", "))),
    "time": Quantity(units=TIME, default="s", words=tuple(_TIME_WORDS.split(", "))),
}
"""What the headers of common testing machines mean."""


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """One curve: travel [mm], force [N] and time [s] as measured, shape (rows,), and the line of each row.

    `labels` are the headers by quantity; `notes` say what was assumed on reading it.
    """

    file: str
    name: str
    travel: Floats
    force: Floats
    time: Floats | None
    lines: tuple[int, ...]
    labels: dict[str, str]
    notes: tuple[str, ...]

    def __str__(self) -> str:
        """Return how an error names it."""
        return f"{self.file}, specimen {self.name!r}"

    def cell(self, row: int, quantity: str) -> str:
        """Return how an error names the cell of a quantity in a row of the curve."""
        return place_of(self.file, self.lines[row], self.labels[quantity])


def read_specimens(source: Path, quantities: Mapping[str, Quantity] = QUANTITIES) -> list[Specimen]:
    """Return every curve of a file; raises InputError."""
    form, rows = read_csv(source)
    specimens: list[Specimen] = []
    for is_empty, block_rows in itertools.groupby(rows, key=lambda row: row.empty):
        if is_empty:
            continue
        block = list(block_rows)
        start = _header_index(form, block, quantities)
        if start is not None:
            specimens += _specimens_of_block(form, block, start, quantities, len(specimens))
        elif specimens and len(block[0].cells) > 1 and all(is_number(cell) for cell in block[0].cells if cell):
            bound = "a header, or the end of the file, after a blank line"
            hint = "take the blank line away if no row is missing there"
            raise validation_error(place_of(form.source, block[0].line), ",".join(block[0].cells), "", bound, hint)
    if not specimens:
        first = next(row for row in rows if not row.empty)
        known = "; ".join(f"{name}: {', '.join((name, *quantities[name].words))}" for name in ("force", "travel"))
        bound = "a table whose header names a force and a travel"
        hint = f"known words, each with its unit: {known}; or name yours by --columns force=HEADER,travel=HEADER"
        raise validation_error(place_of(form.source, first.line), ",".join(first.cells), "", bound, hint)
    return specimens


def _header_index(form: CsvFormat, block: Sequence[TableRow], quantities: Mapping[str, Quantity]) -> int | None:
    for index, row in enumerate(block):
        if not any(is_number(cell) for cell in row.cells):
            names = {column.name for column in columns_of(form.source, row, quantities)}
            if {"force", "travel"} <= names:
                return index
    return None


def _specimens_of_block(
    form: CsvFormat, block: Sequence[TableRow], start: int, quantities: Mapping[str, Quantity], count: int
) -> list[Specimen]:
    """Return the specimens of a table whose header is that row of the block; `count` have come before."""
    header = block[start]
    width = len(header.cells)
    rows = []
    for row in block[start + 1 :]:
        if any(row.cells[width:]):
            refuse_other_length(form, row, width)
        rows.append(TableRow(row.line, (row.cells + ("",) * width)[:width]))
    if rows and not any(is_number(cell) for cell in rows[0].cells):  # a row of units
        units = [unit.strip("()[] ") for unit in rows.pop(0).cells]
        with_units = (f"{label} ({unit})" if unit else label for label, unit in zip(header.cells, units, strict=True))
        header = TableRow(header.line, tuple(with_units))

    # A quantity that comes again begins the next specimen.
    column_groups: list[dict[str, Column]] = [{}]
    for column in columns_of(form.source, header, quantities):
        if column.name in column_groups[-1]:
            column_groups.append({})
        column_groups[-1][column.name] = column

    names_above = (block[start - 1].cells if start else ()) + ("",) * width
    specimens = []
    for number, columns in enumerate(column_groups, start=count + 1):
        if not {"force", "travel"} <= columns.keys():
            labels = [column.label for column in columns.values()]
            bound = "for each specimen one force and one travel"
            hint = "leave only one column of each in the table"
            raise validation_error(place_of(form.source, header.line), ", ".join(labels), "", bound, hint)
        above, *others = (names_above[column.index] for column in columns.values())
        name = "" if any(others) or is_number(above) else above
        specimens.append(_specimen(form, rows, columns, name or f"{number}"))
    return specimens


def _specimen(form: CsvFormat, rows: Sequence[TableRow], columns: Mapping[str, Column], name: str) -> Specimen:
    """Return the curve of some columns; beside longer specimens the cells of a shorter one are empty."""
    filled = [row for row in rows if any(row.cells[column.index] for column in columns.values())]
    values = {}
    for quantity, column in columns.items():
        values[quantity] = np.array([form.number(row, column) for row in filled])
    notes = []
    for quantity in ("force", "travel"):
        if columns[quantity].note:
            notes.append(f"{columns[quantity].note}; --units {quantity}=UNIT says another")
    return Specimen(
        file=form.source,
        name=name,
        travel=values["travel"],
        force=values["force"],
        time=values.get("time"),
        lines=tuple(row.line for row in filled),
        labels={quantity: column.label for quantity, column in columns.items()},
        notes=tuple(notes),
    )
