"""The force-travel curves of a file: two columns, or an export of TRAPEZIUM X in either of its layouts.

A table begins at a header that names a force and a travel, and ends at a blank line. Several specimens may stand side
by side, each with its own TIME, FORCE and STROKE. What else a file says, of its method or its results, is passed over.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cad.quantity import validation_error
from pipeline.measure.measured_table import (
    FORCE,
    LENGTH,
    TIME,
    Column,
    CsvFormat,
    HeaderFlags,
    Quantity,
    Row,
    columns_of,
    is_number,
    is_unit,
    place_of,
    read_csv,
)

Floats = NDArray[np.float64]

QUANTITIES = {
    "force": Quantity(
        units=FORCE,
        default="N",
        words=(
            *("load", "f", "test force", "compression force", "compressive force", "compressive load"),
            *("standard force", "axial force", "kraft", "standardkraft", "試験力", "荷重", "力"),
        ),
    ),
    "travel": Quantity(
        units=LENGTH,
        default="mm",
        words=(
            *("distance", "stroke", "displacement", "disp", "disp.", "crosshead", "position", "deformation", "x"),
            *("compression", "compressive extension", "extension", "weg", "standardweg", "traversenweg"),
            *("ストローク", "変位"),
        ),
    ),
    "time": Quantity(units=TIME, default="s", words=("t", "elapsed time", "zeit", "prüfzeit", "時間", "時刻")),
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


def read_specimens(source: Path, flags: HeaderFlags) -> list[Specimen]:
    """Return every curve of a file; raises InputError."""
    form, rows = read_csv(source)
    specimens: list[Specimen] = []
    for block in _blocks(rows):
        start = _header_index(form, block, flags)
        if start is not None:
            specimens += _specimens(form, block, start, flags, len(specimens))
        elif specimens and len(block[0].cells) > 1 and all(is_number(cell) for cell in block[0].cells if cell):
            bound = "a header, or the end of the file, after a blank line"
            hint = "take the blank line away if no row is missing there"
            place = place_of(form.source, block[0].line)
            raise validation_error(place, form.delimiter.join(block[0].cells)[:60], "", bound, hint)
    if not specimens:
        first = next(row for row in rows if not row.empty)
        bound = "a table whose header names a force and a travel"
        hint = "begin it with force_N,travel_mm, or name its headers by --columns force=HEADER,travel=HEADER"
        text = form.delimiter.join(first.cells)[:60]
        raise validation_error(place_of(form.source, first.line), text, "", bound, hint)
    return specimens


def _blocks(rows: Sequence[Row]) -> list[list[Row]]:
    """Return the rows between blank lines."""
    blocks: list[list[Row]] = [[]]
    for row in rows:
        if not row.empty:
            blocks[-1].append(row)
        elif blocks[-1]:
            blocks.append([])
    return [block for block in blocks if block]


def _header_index(form: CsvFormat, block: Sequence[Row], flags: HeaderFlags) -> int | None:
    for index, row in enumerate(block):
        if any(is_number(cell) for cell in row.cells):
            continue
        names = {column.name for column in columns_of(form.source, row, QUANTITIES, flags)}
        if {"force", "travel"} <= names:
            return index
    return None


def _specimens(form: CsvFormat, block: Sequence[Row], start: int, flags: HeaderFlags, count: int) -> list[Specimen]:
    """Return the specimens of a table whose header is that row of the block; `count` have come before."""
    header = block[start]
    rows = block[start + 1 :]
    if rows and any(is_unit(cell) for cell in rows[0].cells) and not any(is_number(cell) for cell in rows[0].cells):
        units = rows[0].cells + ("",) * len(header.cells)
        labels = [
            f"{cell} ({unit.strip('()[] ')})" if unit else cell for cell, unit in zip(header.cells, units, strict=False)
        ]
        header = Row(header.line, tuple(labels))
        rows = rows[1:]
    title = block[start - 1].cells if start else ()
    groups = _groups(form, columns_of(form.source, header, QUANTITIES, flags), header)
    return [
        _specimen(form, header, rows, group, _title(title, group) or f"{count + number}")
        for number, group in enumerate(groups, start=1)
    ]


def _groups(form: CsvFormat, columns: Sequence[Column], header: Row) -> list[dict[str, Column]]:
    """Return for each specimen of a table its columns; a quantity that comes again begins the next specimen."""
    groups: list[dict[str, Column]] = [{}]
    for column in columns:
        if column.name in groups[-1]:
            groups.append({})
        groups[-1][column.name] = column
    for group in groups:
        if not {"force", "travel"} <= group.keys():
            labels = ", ".join(column.label for column in group.values())
            bound = "for each specimen one force and one travel"
            hint = "leave only one column of each in the table"
            raise validation_error(place_of(form.source, header.line), labels, "", bound, hint)
    return groups


def _title(cells: Sequence[str], columns: dict[str, Column]) -> str:
    """Return the text above the first column of a specimen, where nothing stands above its others."""
    indices = sorted(column.index for column in columns.values())
    above = [cells[index] if index < len(cells) else "" for index in indices]
    return above[0] if not any(above[1:]) and not is_number(above[0]) and not is_unit(above[0]) else ""


def _specimen(form: CsvFormat, header: Row, rows: Sequence[Row], columns: dict[str, Column], name: str) -> Specimen:
    last = max(column.index for column in columns.values())
    filled = []
    end = 0  # beside longer specimens the cells of a shorter one stay empty
    for row in rows:
        if any(row.cells[len(header.cells) :]):
            hint = "part cells by semicolons where numbers have decimal commas"
            bound = f"{len(header.cells)} cells, as its header"
            raise validation_error(place_of(form.source, row.line), len(row.cells), "cells", bound, hint)
        filled.append(Row(row.line, row.cells + ("",) * (last + 1 - len(row.cells))))
        if any(filled[-1].cells[column.index] for column in columns.values()):
            end = len(filled)
    values = {}
    for quantity, column in columns.items():
        values[quantity] = np.array([form.number(row, column) for row in filled[:end]])
    noted = [columns[quantity] for quantity in ("force", "travel")]
    return Specimen(
        file=form.source,
        name=name,
        travel=values["travel"],
        force=values["force"],
        time=values.get("time"),
        lines=tuple(row.line for row in filled[:end]),
        labels={quantity: column.label for quantity, column in columns.items()},
        notes=tuple(f"{column.note}; --{column.name}-unit says another" for column in noted if column.note),
    )
