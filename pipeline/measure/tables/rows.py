"""From lines of text to rows of cells: what parts them, quotes, comments, clocks, and cells that name themselves."""

import csv
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipeline.measure.tables.files import LONGEST_LINE, lines_of_stream, place_of, tabbed, texts_of
from pipeline.measure.tables.numbers import as_number, decimal_sign, is_number
from sensor.quantity import InputError, validation_error

_MOST_JOINED = 5  # lines of a row with a quoted cell
_SAMPLE = 400  # lines that show what parts cells
_SPACES = re.compile(r"(?<![ \u3000])[ \u3000]++(?![(\[{<])")  # no unit in brackets is parted from its word
_WIDE_SPACES = re.compile(r"[ \u3000]{2,}")
_CLOCK_BEFORE = re.compile(r"\s*((?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)\s*(?:->|→)\s?")
_MARKED = ('"', "'", ">", "\u2192")  # what quoted cells and clocks have
_COMMENT = re.compile(r"\s*(#|%|//)\s*")


class TableRow(NamedTuple):
    """One line of a file: its number, from 1, and its cells without spaces around them.

    `clock` is the time of day that a serial monitor writes before it, `fault` why its cells cannot be told.
    """

    line: int
    cells: tuple[str, ...]
    clock: str = ""
    fault: str = ""

    @property
    def empty(self) -> bool:
        """Say whether no cell holds anything."""
        return not any(self.cells)


def sheets_of(source: Path | str) -> list[tuple[str, str, list[TableRow]]]:
    """Return name, delimiter and rows of each sheet of a file that holds anything; a text is one sheet.

    Raises InputError for what is no table.
    """
    sheets = []
    for name, lines in texts_of(source):
        delimiter = delimiter_of(lines)
        rows = _rows(delimiter, lines)
        if not all(row.empty for row in rows):
            sheets.append((name, delimiter, rows))
    if not sheets:
        bound = "a CSV file with a header and numbers, not an empty one"
        raise validation_error(str(source), "", "", bound, "export the table again")
    return sheets


def single_sheet(source: Path | str) -> tuple[str, str, list[TableRow]]:
    """Return name, delimiter and rows of the one sheet that holds numbers; raises InputError as `sheets_of`."""
    sheets = sheets_of(source)
    with_numbers = [sheet for sheet in sheets if any(is_number(cell) for row in sheet[2] for cell in row.cells)]
    if len(with_numbers) > 1:
        name = ", ".join(name for name, _, _ in with_numbers)
        raise validation_error(name, len(with_numbers), "sheets", "the only sheet with numbers", "save it alone")
    return (with_numbers or sheets)[0]


def lines_of(source: Path | str) -> Iterator[str]:
    """Yield the lines of a regular file, or of the standard input for `-` as they come; raises InputError.

    Those of a file are parted by tabs and have decimal points.
    """
    if str(source) == "-":
        yield from lines_of_stream()
        return
    name, _, rows = single_sheet(source)
    columns: dict[int, list[tuple[int, str]]] = {}
    for row in rows:
        for index, cell in enumerate(row.cells):
            columns.setdefault(index, []).append((row.line, cell))
    try:
        sign = decimal_sign(name, columns.values())
    except InputError:  # the column may be one that nobody reads; a reader refuses the cell itself
        sign = ""  # leaves numbers as they are written
    line = 1
    for row in rows:
        yield from itertools.repeat("", row.line - line)  # so that errors name the lines of the file
        line = row.line + 1
        clock = f"{row.clock} -> " if row.clock else ""
        # a row whose cells cannot be told goes on as it is, to be refused by its reader
        yield clock + (row.cells[0] if row.fault else tabbed(_with_points(row.cells, sign)))


def _with_points(cells: Sequence[str], sign: str) -> list[str]:
    return [number.plain(sign) if sign and (number := as_number(cell)) else cell for cell in cells]


def delimiter_of(lines: Sequence[str]) -> str:
    """Return what parts the cells: that by which most of them are numbers, else the first that half the lines have."""
    filled = [line for line in lines if line.strip()]
    filled = [_without_clock(line[:LONGEST_LINE])[1] for line in filled[:: max(1, len(filled) // _SAMPLE)]]
    candidates = ("\t", ";", "|", ",", "  ", " ")
    best = ""
    most = (1, 0)  # a single number has nothing beside it
    for delimiter in candidates:
        cells = [cell for line in filled if delimiter in line for cell in row_of(delimiter, 0, line).cells]
        numbers = sum(map(is_number, cells))
        if (numbers, numbers - len(cells)) > most:
            best, most = delimiter, (numbers, numbers - len(cells))
    if best:
        return best
    for delimiter in candidates:
        if 2 * sum(delimiter in line for line in filled) >= max(1, len(filled)):
            return delimiter
    return ","


def _rows(delimiter: str, lines: Sequence[str]) -> list[TableRow]:
    """Return the rows of lines; without the empty ones where every other line is empty.

    A commented line with numbers is left out, as data that somebody took out. A commented line without numbers may be
    the header.
    """
    rows: list[TableRow] = []
    index = 0
    while index < len(lines):
        row, count = _row_at(delimiter, lines, index)
        if not _COMMENT.match(lines[index]) or not any(map(is_number, row.cells)):
            rows.append(row)
        index += count
    rows = list(_without_labels(rows))
    is_double_spaced = all(one.empty or other.empty for one, other in itertools.pairwise(rows))
    return [row for row in rows if not row.empty] if is_double_spaced else rows


def _row_at(delimiter: str, lines: Sequence[str], index: int) -> tuple[TableRow, int]:
    """Return the row that begins at an index of lines, and the number of lines it takes: a quoted cell may go on."""
    text = lines[index]
    number = index + 1
    comment = _COMMENT.match(text)
    row = row_of(delimiter, number, text[comment.end() :] if comment else text)
    if row.fault and text.count('"') % 2 == 1:
        for count in range(2, min(_MOST_JOINED, len(lines) - index) + 1):
            joined = row_of(delimiter, number, " ".join(lines[index : index + count]))
            if not joined.fault:
                return joined, count
    return row, 1


def row_of(delimiter: str, line: int, text: str) -> TableRow:
    """Return the cells of a line; a quote that stays open and a huge cell are its fault."""
    if delimiter.strip(" ") and not any(mark in text for mark in _MARKED):  # as most are
        return TableRow(line, tuple(map(str.strip, text.split(delimiter))))
    clock, rest = _without_clock(text)
    fault = ""
    try:
        cells = _cells(rest, delimiter)
    except csv.Error as error:
        cells = [rest]
        fault = str(error)
    return TableRow(line, tuple(_bare(cell) for cell in cells), clock, fault)


def _without_clock(text: str) -> tuple[str, str]:
    """Return the time of day that a serial monitor writes before a line, and the line."""
    clock = _CLOCK_BEFORE.match(text)
    return (clock[1], text[clock.end() :]) if clock else ("", text)


def _bare(cell: str) -> str:
    """Return a cell without spaces, single quotes and a spreadsheet's ="" around it."""
    bare = cell.strip()
    if bare.startswith('="') and bare.endswith('"'):
        return bare[2:-1].strip()
    return bare.strip("'").strip() if bare.startswith("'") else bare


def _cells(text: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return _SPACES.split(text.strip())
    if delimiter == "  ":
        return _WIDE_SPACES.split(text.strip())
    return next(csv.reader([text], delimiter=delimiter, strict=True, skipinitialspace=True), [])


def _without_labels(rows: Iterable[TableRow]) -> Iterator[TableRow]:
    """Yield rows; where each cell says what it is, as in `force_N:1.2,travel_mm:3.4`, below a header of that."""
    header: tuple[str, ...] = ()
    for row in rows:
        is_labelled = len(row.cells) > 1 and ":" in row.cells[0]
        parts = [cell.rpartition(":") for cell in row.cells] if is_labelled else []
        if parts and all(label and is_number(value.strip()) and not label.isdecimal() for label, _, value in parts):
            if header != (header := tuple(label.strip() for label, _, _ in parts)):
                yield TableRow(row.line, header)
            yield row._replace(cells=tuple(value.strip() for _, _, value in parts))
        else:
            yield row


def refuse_fault(source: str, row: TableRow) -> None:
    """Raise InputError for a row whose cells cannot be told."""
    if row.fault:
        name = place_of(source, row.line)
        raise validation_error(name, row.cells[0][:40], "", f"cells of a table ({row.fault})", "correct that line")
