"""The force-travel curves of a file: two columns, or an export of TRAPEZIUM X in either of its layouts.

A table begins at a header that names a force and a travel, and ends at a blank line. Several specimens may stand side
by side, each with its own TIME, FORCE and STROKE. What else a file says, of its method or its results, is passed over.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cad.quantity import InputError, validation_error
from pipeline.measure.measured_table import (
    FORCE,
    LENGTH,
    TIME,
    Column,
    CsvFormat,
    Quantity,
    Row,
    columns_of,
    is_number,
    is_unit,
    place_of,
    read_csv,
)

Floats = NDArray[np.float64]

_FORCE_WORDS = (
    "load, f, test force, compression force, compressive force, compressive load, standard force, axial force, "
    "kraft, standardkraft, 試験力, 荷重, 力"
)
_TRAVEL_WORDS = (
    "distance, stroke, displacement, disp, disp., crosshead, position, deformation, x, compression, "
    "compressive extension, extension, weg, standardweg, traversenweg, ストローク, 変位"
)
_TIME_WORDS = "t, elapsed time, zeit, prüfzeit, 時間, 時刻"
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
            raise _row_error(form, block[0], bound, hint)
    if not specimens:
        first = next(row for row in rows if not row.empty)
        known = "; ".join(f"{name}: {', '.join((name, *quantities[name].words))}" for name in ("force", "travel"))
        hint = f"known words, each with its unit: {known}; or name yours by --columns force=HEADER,travel=HEADER"
        raise _row_error(form, first, "a table whose header names a force and a travel", hint)
    return specimens


def _row_error(form: CsvFormat, row: Row, bound: str, hint: str) -> InputError:
    text = form.delimiter.join(row.cells)[:60]
    return validation_error(place_of(form.source, row.line), text, "", bound, hint)


def _header_index(form: CsvFormat, block: Sequence[Row], quantities: Mapping[str, Quantity]) -> int | None:
    for index, row in enumerate(block):
        if any(is_number(cell) for cell in row.cells):
            continue
        names = {column.name for column in columns_of(form.source, row, quantities)}
        if {"force", "travel"} <= names:
            return index
    return None


def _specimens_of_block(
    form: CsvFormat, block: Sequence[Row], start: int, quantities: Mapping[str, Quantity], count: int
) -> list[Specimen]:
    """Return the specimens of a table whose header is that row of the block; `count` have come before."""
    header = block[start]
    rows = block[start + 1 :]
    if rows and any(is_unit(cell) for cell in rows[0].cells) and not any(is_number(cell) for cell in rows[0].cells):
        labels = list(header.cells)
        for index, unit in enumerate(rows[0].cells[: len(labels)]):
            if unit:
                labels[index] += f" ({unit.strip('()[] ')})"
        header = Row(header.line, tuple(labels))
        rows = rows[1:]

    # A quantity that comes again begins the next specimen.
    column_groups: list[dict[str, Column]] = [{}]
    for column in columns_of(form.source, header, quantities):
        if column.name in column_groups[-1]:
            column_groups.append({})
        column_groups[-1][column.name] = column

    title_row = block[start - 1].cells if start else ()
    specimens = []
    for number, columns in enumerate(column_groups, start=count + 1):
        if not {"force", "travel"} <= columns.keys():
            labels = [column.label for column in columns.values()]
            bound = "for each specimen one force and one travel"
            hint = "leave only one column of each in the table"
            raise validation_error(place_of(form.source, header.line), ", ".join(labels), "", bound, hint)
        title = _title_above(title_row, columns) or f"{number}"
        specimens.append(_specimen(form, header, rows, columns, title))
    return specimens


def _title_above(cells: Sequence[str], columns: Mapping[str, Column]) -> str:
    """Return the text above the first column of a specimen, "" where something stands above its others too."""
    first, *others = sorted(column.index for column in columns.values())
    title = cells[first] if first < len(cells) else ""
    is_alone = not any(cells[index] for index in others if index < len(cells))
    return title if is_alone and not is_number(title) and not is_unit(title) else ""


def _specimen(form: CsvFormat, header: Row, rows: Sequence[Row], columns: Mapping[str, Column], title: str) -> Specimen:
    last = max(column.index for column in columns.values())
    padded = []
    end = 0  # beside longer specimens the cells of a shorter one stay empty
    for row in rows:
        if any(row.cells[len(header.cells) :]):
            hint = "part cells by semicolons where numbers have decimal commas"
            bound = f"{len(header.cells)} cells, as its header"
            raise validation_error(place_of(form.source, row.line), len(row.cells), "cells", bound, hint)
        missing = last + 1 - len(row.cells)
        padded.append(Row(row.line, row.cells + ("",) * missing))
        if any(padded[-1].cells[column.index] for column in columns.values()):
            end = len(padded)
    values = {}
    for name, column in columns.items():
        values[name] = np.array([form.number(row, column) for row in padded[:end]])
    notes = []
    for name in ("force", "travel"):
        if columns[name].note:
            notes.append(f"{columns[name].note}; --units {name}=UNIT says another")
    return Specimen(
        file=form.source,
        name=title,
        travel=values["travel"],
        force=values["force"],
        time=values.get("time"),
        lines=tuple(row.line for row in padded[:end]),
        labels={name: column.label for name, column in columns.items()},
        notes=tuple(notes),
    )
