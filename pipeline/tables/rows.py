"""Rows of cells from lines of text: delimiters, quotes, comments and clocks."""

import csv
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipeline.tables.decoding import LONGEST_LINE, MOST_LINES, lines_of_stream, lines_of_text, place_of
from pipeline.tables.number_formats import is_number
from pipeline.tables.workbook import cells_of_workbook
from sensor.input_file import read_bytes
from sensor.quantity import validation_error

_MOST_JOINED = 5  # most lines of a row with a quoted cell
_SAMPLE = 400  # lines that determine the delimiter
_DELIMITERS = ("\t", ";", "|", ",", "  ", " ")
_SPACES = {
    " ": re.compile(r"(?<![ \u3000])[ \u3000]++(?![(\[{<])"),  # a unit in brackets stays with its word
    "  ": re.compile(r"[ \u3000]{2,}"),
}
_COMMENT = re.compile(r"\s*(?:#|%|//)\s*")
_CLOCK_BEFORE = re.compile(r"\s*((?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)\s*(?:->|→)\s?")
_MARKED = ('"', "'", ">", "\u2192", "#", "%", "/")  # signs of quoted cells, clocks and comments


class Row(NamedTuple):
    """One line of a file: its number, from 1, and its stripped cells.

    `clock` is the time of day that a serial monitor writes before it. `fault` is the reason why its cells are invalid.
    A row is `cut` if it is the last one and has no line end, while earlier lines have one.
    """

    line: int
    cells: tuple[str, ...]
    clock: str = ""
    fault: str = ""
    cut: bool = False
    commented: bool = False

    @property
    def empty(self) -> bool:
        """Return whether all cells are empty."""
        return not any(self.cells)

    def cell(self, index: int) -> str:
        """Return a cell, "" beyond the end of the row."""
        return self.cells[index] if 0 <= index < len(self.cells) else ""

    @property
    def text(self) -> str:
        """Return the row as text for errors."""
        return ",".join(self.cells)


class Rows:
    """The rows of lines, or of the cells of a workbook, as they arrive.

    They are split at `delimiter`. If it is empty, each line determines its own delimiter, until the reader of a table
    keeps the header's. A commented line with numbers is skipped as data that somebody removed. A commented line without
    numbers may be the header.
    """

    def __init__(self, lines: Iterable[str | Sequence[str]], source: str, delimiter: str = "") -> None:
        """Store lines, with or without their ends."""
        self.source = source
        self._lines = lines
        self._fixed = delimiter
        self._last = delimiter

    @property
    def are_parted_by_spaces(self) -> bool:
        """Return whether spaces delimit the last row, so that empty cells are invisible."""
        return not self._last.strip(" ")

    def keep_delimiter(self, *, keep: bool = True) -> None:
        """Split all further lines like the last one; without `keep`, each by its own cells again."""
        self._fixed = self._last if keep else ""

    def __iter__(self) -> Iterator[Row]:
        """Yield the rows."""
        numbered = enumerate(self._lines, start=1)
        waiting: list[tuple[int, str | Sequence[str]]] = []
        has_ends = False
        while (line := waiting.pop(0) if waiting else next(numbered, None)) is not None:
            row = self._row(*line)
            if row.fault and str(line[1]).count('"') % 2:  # a quoted cell may continue in the next lines
                waiting += itertools.islice(numbered, _MOST_JOINED - 1 - len(waiting))
                for end in range(1, len(waiting) + 1):
                    joined = self._row(row.line, " ".join(str(text).rstrip() for _, text in (line, *waiting[:end])))
                    if not joined.fault:
                        row, waiting = joined, waiting[end:]
                        break
            is_whole = not isinstance(line[1], str) or line[1].endswith(("\n", "\r"))
            if not row.commented or not any(map(is_number, row.cells)):
                yield row if is_whole or not has_ends else row._replace(cut=True)
            has_ends = has_ends or is_whole

    def _row(self, number: int, line: str | Sequence[str]) -> Row:
        self._last = self._fixed or delimiter_of([line])
        return row_of(self._last, number, line)


class WholeRows(Rows):
    """The rows of a sheet, all available, without empty rows if every other row is empty."""

    def __init__(self, lines: Sequence[str | Sequence[str]], source: str) -> None:
        """Store all lines, which share one delimiter."""
        super().__init__(lines, source, delimiter_of(lines))
        self.rows = list(super().__iter__())
        if all(one.empty or other.empty for one, other in itertools.pairwise(self.rows)):
            self.rows = [row for row in self.rows if not row.empty]

    def __iter__(self) -> Iterator[Row]:
        """Yield the rows."""
        return iter(self.rows)


def sheets_of(source: Path | str, name: str = "FILE") -> list[WholeRows]:
    """Return each sheet of a file that is not empty; a text is one sheet. Raises InputError for a file without tables.

    `name` is the name of an unreadable file in the error.
    """
    named: Iterable[tuple[str, Sequence[str | Sequence[str]]]]
    if str(source) == "-":
        named = [("-", list(itertools.islice(lines_of_stream(), MOST_LINES)))]
    elif (content := read_bytes(source, name)).startswith(b"PK\x03\x04"):
        named = cells_of_workbook(str(source), content)
    else:
        named = [(str(source), lines_of_text(str(source), content))]
    sheets = [WholeRows(lines, name) for name, lines in named]
    filled = [sheet for sheet in sheets if not all(row.empty for row in sheet.rows)]
    if not filled:
        bound = "a CSV file with a header and numbers, not an empty one"
        raise validation_error(str(source), "", "", bound, "export the table again")
    return filled


def single_sheet(source: Path | str, name: str = "FILE") -> WholeRows:
    """Return the only sheet with numbers; raises InputError like `sheets_of`."""
    sheets = sheets_of(source, name)
    with_numbers = [sheet for sheet in sheets if any(is_number(cell) for row in sheet.rows for cell in row.cells)]
    if len(with_numbers) > 1:
        name = ", ".join(sheet.source for sheet in with_numbers)
        hint = "save that sheet as its own file"
        raise validation_error(name, len(with_numbers), "sheets", "the only sheet with numbers", hint)
    return (with_numbers or sheets)[0]


def rows_of(source: Path | str, name: str = "FILE") -> Rows:
    """Return the rows of a file, or of the standard input for `-` as they arrive.

    Raises InputError like `sheets_of`.
    """
    return Rows(lines_of_stream(), "-") if str(source) == "-" else single_sheet(source, name)


def delimiter_of(lines: Sequence[str | Sequence[str]]) -> str:
    """Return the delimiter that gives the most numbers, or else the first one in half of the lines."""
    filled = [line[:LONGEST_LINE] for line in lines if isinstance(line, str) and line.strip()]
    filled = filled[:: max(1, len(filled) // _SAMPLE)]
    best = ""
    most = (1, 0)  # a single number has no delimiter
    for delimiter in _DELIMITERS:
        cells = [cell for line in filled if delimiter in line for cell in row_of(delimiter, 0, line).cells]
        numbers = sum(map(is_number, cells))
        if (numbers, numbers - len(cells)) > most:
            best, most = delimiter, (numbers, numbers - len(cells))
    half = max(1, len(filled)) / 2
    return best or next((each for each in _DELIMITERS if sum(each in line for line in filled) >= half), ",")


def row_of(delimiter: str, number: int, line: str | Sequence[str]) -> Row:
    """Return the cells of a line; an open quote or a huge cell is its fault."""
    # true for most lines
    if isinstance(line, str) and delimiter.strip(" ") and not any(mark in line for mark in _MARKED):
        return Row(number, tuple(map(str.strip, line.split(delimiter))))
    first, *others = [line.rstrip("\r\n")] if isinstance(line, str) else line or [""]
    comment = _COMMENT.match(first)
    first = first[comment.end() :] if comment else first
    clock = _CLOCK_BEFORE.match(first)
    cells = [first[clock.end() :] if clock else first, *others]
    fault = ""
    is_text = isinstance(line, str)
    if is_text and delimiter in _SPACES:
        cells = _SPACES[delimiter].split(cells[0].strip())
    elif is_text:
        try:
            cells = next(csv.reader(cells, delimiter=delimiter, strict=True, skipinitialspace=True), [])
        except csv.Error as error:
            fault = str(error)
    return Row(number, tuple(map(_bare, cells)), clock[1] if clock else "", fault, commented=comment is not None)


def _bare(cell: str) -> str:
    """Return a cell without surrounding spaces, single quotes or a spreadsheet's =""."""
    bare = cell.strip()
    if bare.startswith('="') and bare.endswith('"'):
        return bare[2:-1].strip()
    return bare.strip("'").strip() if bare.startswith("'") else bare


def refuse_fault(source: str, row: Row) -> None:
    """Raise InputError for a row with invalid cells."""
    if row.fault:
        name = place_of(source, row.line)
        raise validation_error(name, row.cells[0][:40], "", f"cells of a table ({row.fault})", "correct that line")
