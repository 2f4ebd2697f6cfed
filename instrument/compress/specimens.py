"""Reader for force-travel curves in a file with two columns, or in an export of TRAPEZIUM X in either of its layouts.

A table begins at a header that names a force and a travel, and ends at a blank line. A table may contain several
specimens side by side, each with its own columns TIME, FORCE and STROKE. A header may be repeated within one test, as
in files from LabVIEW, which writes a header for each segment. Other content of a file, such as a method or results, is
skipped.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.tables.clock import Clock
from pipeline.tables.columns import Column
from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.number_formats import is_number
from pipeline.tables.rows import Row, sheets_of
from pipeline.tables.table import FoundTable, TableReader, is_statistic
from pipeline.tables.units import FORCE, LENGTH, TIME, Quantity
from sensor.arrays import Floats
from sensor.quantity import validation_error

QUANTITIES = {
    "force": Quantity(
        units=FORCE,
        default="N",
        words=tuple(WORDS["words"]["force"]),
        words_with_unit=tuple(WORDS["words_with_unit"]["force"]),
    ),
    "travel": Quantity(
        units=LENGTH,
        default="mm",
        words=tuple(WORDS["words"]["travel"]),
        words_with_unit=tuple(WORDS["words_with_unit"]["travel"]),
    ),
    "time": Quantity(units=TIME, default="s", words=tuple(WORDS["words"]["time"]), by_clock=True),
}
"""The quantities in a table, with the words by which common testing machines name them in headers."""
LEAST_ROWS = 12
"""Minimum number of rows of a curve. A shorter table in a file with longer ones contains results."""
_REQUIRED = {"force", "travel"}
# A segment is only continued by the next one if it ends near its largest compression, within this fraction of its
# travel.
_AT_END = 0.05
_STEPS = 3.0  # largest distance from the end of a segment to the start of the next one, in steps between rows


@dataclass(frozen=True, kw_only=True, eq=False)
class Specimen:
    """One curve: the measured travel [mm], force [N] and time [s], all (rows,), and the line number of each row.

    `file` and `name` are the names of the file, with its sheet, and of the specimen. `path` is the file without the
    sheet. `labels` holds the header of each quantity. `notes` are assumptions made while reading, and `summary`
    summarises in one line which columns and rows were read. `time` is None if the table has no times.
    """

    file: str
    name: str
    travel: Floats
    force: Floats
    time: Floats | None
    lines: tuple[int, ...]
    labels: dict[str, str]
    notes: tuple[str, ...]
    summary: str = ""
    path: str = ""

    def __str__(self) -> str:
        """Return the file and the name of the specimen, as text for messages."""
        return f"{self.file}, specimen {self.name!r}"

    def cell(self, row: int, quantity: str) -> str:
        """Return the location of a quantity's cell in a row, as text for messages."""
        return place_of(self.file, self.lines[row], self.labels[quantity])

    def up_to(self, end: int) -> "Specimen":
        """Return the curve up to, but not including, the row with index `end`."""
        time = None if self.time is None else self.time[:end]
        return replace(self, travel=self.travel[:end], force=self.force[:end], time=time, lines=self.lines[:end])


def read_specimens(source: Path, quantities: Mapping[str, Quantity] = QUANTITIES) -> list[Specimen]:
    """Read all curves in the file of a compression test.

    `quantities` describes the columns. Segments of the same test are joined. A table with statistics, or a short table
    in a file with longer ones, contains results. Such a table is skipped, and `summary` of each specimen mentions it.
    Raises InputError for a file without force and travel, and for cells that cannot be read.
    """
    reader = TableReader(quantities, [sorted(_REQUIRED)], "force_N,travel_mm")
    tables = [replace(table, rows=list(table.rows)) for sheet in sheets_of(source) for table in reader.tables(sheet)]
    if not tables:
        raise reader.no_header()
    # A table with a row of statistics contains results, unless all tables have such a row.
    curves = [table for table in tables if not any(map(is_statistic, table.left_out))] or tables
    specimens = _read_and_join(curves)
    longest = max(len(specimen.lines) for specimen in specimens)
    # If all tables are short, they are kept, so that the error names the missing rows instead of a missing table.
    least_rows = LEAST_ROWS if longest >= LEAST_ROWS else 0
    long_enough = [specimen for specimen in specimens if len(specimen.lines) >= least_rows]
    # The line numbers of each skipped table.
    skipped_lines = [specimen.lines for specimen in specimens if len(specimen.lines) < least_rows]
    skipped_lines += [tuple(row.line for row in table.rows) for table in tables if table not in curves]
    note = "".join(f"; skipped results from line {lines[0]} on" for lines in sorted(skipped_lines) if lines)
    return [replace(specimen, path=str(source), summary=specimen.summary + note) for specimen in long_enough]


def _read_and_join(tables: Sequence[FoundTable]) -> list[Specimen]:
    """Read the specimens of all tables in a file, and join consecutive segments of the same test.

    A segment only continues the table before it if it repeats the header of this table.
    """
    specimens: list[Specimen] = []
    previous_header: tuple[str, ...] = ()
    for table in tables:
        repeats_header = table.header.cells == previous_header
        for specimen in _specimens_of_table(table, len(specimens)):
            if specimens and repeats_header and _is_continuation(specimens[-1], specimen):
                specimens[-1] = _join_segments(specimens[-1], specimen)
            else:
                specimens.append(specimen)
        previous_header = table.header.cells
    return specimens


def _is_continuation(first: Specimen, second: Specimen) -> bool:
    """Return whether the second curve continues the first one, as the next segment of the same test.

    Both curves must be in the same file, and the first one must end at its largest compression. The second curve must
    begin within a few steps of this end, in travel and in force, but not more than one step before it.
    """
    travel = first.travel
    if first.file != second.file or len(travel) < 2 or len(second.travel) < 2:  # noqa: PLR2004 - a step needs two rows
        return False
    compression = travel[-1] - travel[0]  # negative if the travel decreases in compression
    is_at_end = abs(compression) >= (1.0 - _AT_END) * np.ptp(travel) > 0.0
    is_near = _begins_near_end(travel, second.travel) and _begins_near_end(first.force, second.force)
    # Distance from the end of the first curve to the start of the second, positive in the direction of compression.
    advance = (second.travel[0] - travel[-1]) * np.sign(compression)
    goes_back = not advance > -_largest_step(travel)
    return bool(is_at_end and is_near and not goes_back)


def _begins_near_end(before: Floats, after: Floats) -> bool:
    """Return whether a column `after` begins within `_STEPS` steps of the end of the column `before`."""
    step = max(_largest_step(before), _largest_step(after))
    return bool(abs(after[0] - before[-1]) <= _STEPS * step)


def _largest_step(values: Floats) -> float:
    """Return the largest absolute difference between two consecutive values."""
    return float(np.abs(np.diff(values)).max())


def _join_segments(first: Specimen, second: Specimen) -> Specimen:
    """Join two consecutive segments of a test into one curve; raises InputError if the time restarts in the second.

    The curve has times only if both segments have times.
    """
    time = None
    if first.time is not None and second.time is not None:
        if second.time[0] < first.time[-1]:
            bound = f"at least {first.time[-1]:g} s, the time of the line before, because travel and force continue"
            hint = "correct the times, or leave out their column"
            raise validation_error(second.cell(0, "time"), float(second.time[0]), "s", bound, hint)
        time = np.concatenate([first.time, second.time])
    return replace(
        first,
        travel=np.concatenate([first.travel, second.travel]),
        force=np.concatenate([first.force, second.force]),
        time=time,
        lines=first.lines + second.lines,
        notes=tuple(dict.fromkeys(first.notes + second.notes)),
        summary=f"{first.summary}; continues in lines {second.lines[0]} to {second.lines[-1]}",
    )


def _specimens_of_table(table: FoundTable, count: int) -> Iterator[Specimen]:
    """Yield the specimens in a table, which may hold several side by side.

    `count` is the number of specimens that were read before this table; a specimen without a name gets the next number.
    Raises InputError for a specimen without a force or a travel.
    """
    groups = _group_columns(table.columns)
    for number, columns in enumerate(groups, start=count + 1):  # the first specimen of a file is number 1
        if not columns.keys() >= _REQUIRED:
            labels = [column.label for column in columns.values()]
            bound = "one force and one travel for each specimen"
            hint = "choose them with --columns force=HEADER,travel=HEADER, where HEADER is a header or a column number"
            raise validation_error(place_of(table.source, table.header.line), ", ".join(labels), "", bound, hint)
        # The row above the header may contain the name of the specimen, only above its first column.
        above_first, *above_others = (table.above.cell(column.index) for column in columns.values())
        name = "" if any(above_others) or is_number(above_first) else above_first
        yield _read_specimen(table, columns, name or f"{number}")


def _group_columns(columns: Sequence[Column]) -> list[dict[str, Column]]:
    """Divide the columns of a table into one group for each specimen; each group is keyed by quantity."""
    groups: list[dict[str, Column]] = [{}]
    for column in columns:
        group = groups[-1]
        # A repeated column begins the next specimen, but a repeated time only if force and travel are already present.
        if column.name in group and (column.name in _REQUIRED or group.keys() >= _REQUIRED):
            group = {}
            groups.append(group)
        group.setdefault(column.name, column)  # the first of several times before force and travel is used
    if groups[1:] and not groups[-1].keys() & _REQUIRED:  # columns with only times are not a specimen
        groups.pop()
    return groups


def _read_specimen(table: FoundTable, columns: Mapping[str, Column], name: str) -> Specimen:
    """Read the curve of the specimen called `name` from a table; `columns` holds its columns, keyed by quantity.

    Raises InputError for a cell that cannot be read.
    """
    # A specimen that is shorter than its neighbours ends with rows of empty cells, which are left out.
    filled = [row for row in table.rows if any(column.cell(row) for column in columns.values())]
    specimen_table = table.limited_to([*columns.values()], filled)
    notes = [
        f"{columns[quantity].note}; --units {quantity}=UNIT sets another unit"
        for quantity in ("force", "travel")
        if columns[quantity].note
    ]
    arrays = {quantity: _read_column(specimen_table, column, filled, notes) for quantity, column in columns.items()}
    return Specimen(
        file=table.source,
        name=name,
        travel=arrays["travel"],
        force=arrays["force"],
        time=arrays.get("time"),
        lines=tuple(row.line for row in filled),
        labels={quantity: column.label for quantity, column in columns.items()},
        notes=tuple(notes),
        summary=specimen_table.summary,
    )


def _read_column(table: FoundTable, column: Column, rows: Sequence[Row], notes: list[str]) -> Floats:
    """Return the values of a column in `rows`, shape (rows,).

    A time of day restarts at midnight, so a Clock converts times to seconds; its notes are appended to `notes`.
    """
    if column.name != "time":
        return np.array([table.number(row, column) for row in rows])
    clock = Clock(table, column, lambda note: notes.append(f"{table.source}: {note}"))
    return np.array([clock.seconds(row) for row in rows])
