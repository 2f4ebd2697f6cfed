"""The force-travel curves of a file: two columns, or an export of TRAPEZIUM X in either of its layouts.

A table begins at a header that names a force and a travel, and ends at a blank line. Several specimens may stand side
by side, each with its own TIME, FORCE and STROKE. What else a file says, of its method or its results, is passed over.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.measure.tables.blocks import TableBlock, tables_of
from pipeline.measure.tables.columns import Column, CsvFormat, with_decimal_sign
from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.measured_table import no_header
from pipeline.measure.tables.numbers import is_number
from pipeline.measure.tables.rows import sheets_of
from pipeline.measure.tables.units import FORCE, LENGTH, TIME, Quantity
from pipeline.measure.tables.words import WORDS
from sensor.arrays import Floats
from sensor.quantity import validation_error

QUANTITIES = {
    "force": Quantity(units=FORCE, default="N", words=tuple(WORDS["words"]["force"])),
    "travel": Quantity(units=LENGTH, default="mm", words=tuple(WORDS["words"]["travel"])),
    "time": Quantity(units=TIME, default="s", words=tuple(WORDS["words"]["time"]), by_clock=True),
}
"""What the headers of common testing machines mean."""
_NEEDED = {"force", "travel"}


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """One curve: travel [mm], force [N] and time [s] as measured, shape (rows,), and the line of each row.

    `labels` are the headers by quantity; `notes` say what was assumed on reading it, `understood` in one line what was
    read. `path` is the file without the name of a sheet.
    """

    file: str
    name: str
    travel: Floats
    force: Floats
    time: Floats | None
    lines: tuple[int, ...]
    labels: dict[str, str]
    notes: tuple[str, ...]
    understood: str = ""
    path: str = ""

    def __str__(self) -> str:
        """Return how an error names it."""
        return f"{self.file}, specimen {self.name!r}"

    def cell(self, row: int, quantity: str) -> str:
        """Return how an error names the cell of a quantity in a row of the curve."""
        return place_of(self.file, self.lines[row], self.labels[quantity])


def read_specimens(source: Path, quantities: Mapping[str, Quantity] = QUANTITIES) -> list[Specimen]:
    """Return every curve of a file; raises InputError."""
    specimens: list[Specimen] = []
    sheets = [(CsvFormat(source=name, delimiter=delimiter), rows) for name, delimiter, rows in sheets_of(source)]
    for form, rows in sheets:
        for table in tables_of(form, rows, quantities, _NEEDED):
            of_table = _specimens_of_table(form, table, len(specimens))
            specimens += [replace(specimen, path=str(source)) for specimen in of_table]
    if not specimens:
        form, rows = sheets[0]
        raise no_header(form, rows, quantities, sorted(_NEEDED), "force_N,travel_mm")
    return specimens


def _specimens_of_table(form: CsvFormat, table: TableBlock, count: int) -> list[Specimen]:
    """Return the specimens of a table, where `count` have come before."""
    # A force or a travel that comes again begins the next specimen.
    groups: list[dict[str, Column]] = [{}]
    for column in table.columns:
        if column.name in groups[-1] and (column.name in _NEEDED or groups[-1].keys() >= _NEEDED):
            groups.append({})
        groups[-1].setdefault(column.name, column)
    if groups[1:] and not groups[-1].keys() & _NEEDED:
        groups.pop()

    names_above = table.above + ("",) * len(table.header.cells)
    specimens = []
    for number, columns in enumerate(groups, start=count + 1):
        if not columns.keys() >= _NEEDED:
            labels = [column.label for column in columns.values()]
            bound = "for each specimen one force and one travel"
            hint = "choose one of each by --columns force=HEADER,travel=HEADER, each a header or the number of a column"
            raise validation_error(place_of(form.source, table.header.line), ", ".join(labels), "", bound, hint)
        above, *others = (names_above[column.index] for column in columns.values())
        name = "" if any(others) or is_number(above) else above
        specimens.append(_specimen(form, table, columns, name or f"{number}"))
    return specimens


def _specimen(form: CsvFormat, table: TableBlock, columns: Mapping[str, Column], name: str) -> Specimen:
    """Return the curve of some columns; beside longer specimens the cells of a shorter one are empty."""
    filled = [row for row in table.rows if any(column.cell(row) for column in columns.values())]
    form = with_decimal_sign(form, [*columns.values()], filled)
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
        understood=table.understood(form, [*columns.values()], filled),
    )
