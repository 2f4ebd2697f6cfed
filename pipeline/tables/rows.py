"""From lines of text to rows of cells: what parts them, quotes, comments and clocks."""

import csv
import itertools
import re
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipeline.tables.files import LONGEST_LINE, MOST_LINES, lines_of_stream, lines_of_text, place_of
from pipeline.tables.numbers import is_number
from pipeline.tables.workbook import cells_of_workbook
from sensor.input_file import read_bytes
from sensor.quantity import validation_error

_MOST_JOINED = 5  # lines of a row with a quoted cell
_SAMPLE = 400  # lines that show what parts cells
_SPACES = re.compile(r"(?<![ \u3000])[ \u3000]++(?![(\[{<])")  # no unit in brackets is parted from its word
_WIDE_SPACES = re.compile(r"[ \u3000]{2,}")
_CLOCK_BEFORE = re.compile(r"\s*((?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)\s*(?:->|→)\s?")
_MARKED = ('"', "'", ">", "\u2192")  # what quoted cells and clocks have
_COMMENT = re.compile(r"\s*(#|%|//)\s*")


class Row(NamedTuple):
    """One line of a file: its number, from 1, and its cells without spaces around them.

    `clock` is the time of day that a serial monitor writes before it, `fault` why its cells cannot be told. A row is
    `cut` if it is the last one and its line has no end, while the lines before it have one.
    """

    line: int
    cells: tuple[str, ...]
    clock: str = ""
    fault: str = ""
    cut: bool = False

    @property
    def empty(self) -> bool:
        """Return whether no cell holds anything."""
        return not any(self.cells)

    def cell(self, index: int) -> str:
        """Return a cell, "" if the row ends before it."""
        return self.cells[index] if 0 <= index < len(self.cells) else ""

    @property
    def text(self) -> str:
        """Return the row as an error shows it."""
        return ",".join(self.cells)


class Rows:
    """The rows of lines as they come.

    They are parted by `delimiter`. If it is empty, each line is parted by what parts its own cells, until the reader of
    a table keeps the delimiter of the header. A commented line with numbers is left out, as data that somebody took
    out. A commented line without numbers may be the header.
    """

    def __init__(self, lines: Iterable[str], source: str, delimiter: str = "") -> None:
        """Take lines with their ends, or without."""
        self.source = source
        self._lines = lines
        self._fixed = delimiter
        self._last = delimiter

    @property
    def are_parted_by_spaces(self) -> bool:
        """Return whether spaces part the cells of the last row, so that an empty cell cannot be seen."""
        return not self._last.strip(" ")

    def keep_delimiter(self, *, keep: bool = True) -> None:
        """Part all further lines like the last one; if not `keep`, each by its own cells again."""
        self._fixed = self._last if keep else ""

    def __iter__(self) -> Iterator[Row]:
        """Yield the rows."""
        numbered = enumerate(self._lines, start=1)
        waiting: deque[tuple[int, str]] = deque()
        has_ends = False
        while (numbered_line := waiting.popleft() if waiting else next(numbered, None)) is not None:
            number, raw = numbered_line
            text = raw.rstrip("\r\n")
            comment = _COMMENT.match(text)
            row = self._row(number, text[comment.end() :] if comment else text)
            if row.fault and text.count('"') % 2 == 1:
                row = self._joined(row, text, waiting, numbered)
            if not comment or not any(map(is_number, row.cells)):
                yield row._replace(cut=True) if has_ends and text == raw else row
            has_ends = has_ends or text != raw

    def _row(self, number: int, text: str) -> Row:
        self._last = self._fixed or delimiter_of([text])
        return row_of(self._last, number, text)

    def _joined(self, row: Row, text: str, waiting: deque[tuple[int, str]], numbered: Iterator[tuple[int, str]]) -> Row:
        """Return a row whose quoted cell goes on in the next lines, or the row as it is if the quote stays open."""
        waiting.extend(itertools.islice(numbered, max(0, _MOST_JOINED - 1 - len(waiting))))
        for count in range(1, min(_MOST_JOINED - 1, len(waiting)) + 1):
            text = f"{text} {waiting[count - 1][1].rstrip()}"
            joined = self._row(row.line, text)
            if not joined.fault:
                for _ in range(count):
                    waiting.popleft()
                return joined
        return row


class WholeRows(Rows):
    """The rows of a sheet, all at hand."""

    def __init__(self, rows: Sequence[Row], source: str, delimiter: str) -> None:
        """Take the rows; without the empty ones if every other row is empty."""
        super().__init__((), source, delimiter)
        is_double_spaced = all(one.empty or other.empty for one, other in itertools.pairwise(rows))
        self.rows = [row for row in rows if not row.empty] if is_double_spaced else list(rows)

    @classmethod
    def of_lines(cls, lines: Sequence[str], source: str) -> "WholeRows":
        """Return the rows of lines, which one delimiter parts."""
        delimiter = delimiter_of(lines)
        return cls(list(Rows(lines, source, delimiter)), source, delimiter)

    @classmethod
    def of_cells(cls, cells: Sequence[Sequence[str]], source: str) -> "WholeRows":
        """Return the rows of a sheet of a workbook."""
        rows = (_row_of_cells(number, row) for number, row in enumerate(cells, start=1))
        return cls(list(filter(None, rows)), source, "\t")

    def __iter__(self) -> Iterator[Row]:
        """Yield the rows."""
        return iter(self.rows)

    def keep_delimiter(self, *, keep: bool = True) -> None:
        """Do nothing: one delimiter parts all lines of a file."""


def sheets_of(source: Path | str) -> list[WholeRows]:
    """Return each sheet of a file that holds anything; a text is one sheet; raises InputError for what is no table."""
    sheets = [sheet for sheet in _every_sheet(source) if not all(row.empty for row in sheet.rows)]
    if not sheets:
        bound = "a CSV file with a header and numbers, not an empty one"
        raise validation_error(str(source), "", "", bound, "export the table again")
    return sheets


def _every_sheet(source: Path | str) -> list[WholeRows]:
    if str(source) == "-":
        return [WholeRows.of_lines(list(itertools.islice(lines_of_stream(), MOST_LINES)), "-")]
    content = read_bytes(source, "FILE")
    if content.startswith(b"PK\x03\x04"):
        return [WholeRows.of_cells(cells, name) for name, cells in cells_of_workbook(str(source), content)]
    return [WholeRows.of_lines(lines_of_text(str(source), content), str(source))]


def single_sheet(source: Path | str) -> WholeRows:
    """Return the one sheet that holds numbers; raises InputError like `sheets_of`."""
    sheets = sheets_of(source)
    with_numbers = [sheet for sheet in sheets if any(is_number(cell) for row in sheet.rows for cell in row.cells)]
    if len(with_numbers) > 1:
        name = ", ".join(sheet.source for sheet in with_numbers)
        raise validation_error(name, len(with_numbers), "sheets", "the only sheet with numbers", "save it alone")
    return (with_numbers or sheets)[0]


def rows_of(source: Path | str) -> Rows:
    """Return the rows of a file, or of the standard input for `-` as they come; raises InputError."""
    return Rows(lines_of_stream(), "-") if str(source) == "-" else single_sheet(source)


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


def row_of(delimiter: str, line: int, text: str) -> Row:
    """Return the cells of a line; a quote that stays open and a huge cell are its fault."""
    text = text.rstrip("\r\n")
    if delimiter.strip(" ") and not any(mark in text for mark in _MARKED):  # as most are
        return Row(line, tuple(map(str.strip, text.split(delimiter))))
    clock, rest = _without_clock(text)
    fault = ""
    try:
        cells = _cells(rest, delimiter)
    except csv.Error as error:
        cells = [rest]
        fault = str(error)
    return Row(line, tuple(_bare(cell) for cell in cells), clock, fault)


def _row_of_cells(line: int, cells: Sequence[str]) -> Row | None:
    """Return a row of a workbook; None if it is commented and has numbers, like such a line of a text."""
    clock, first = _without_clock(cells[0] if cells else "")
    comment = _COMMENT.match(first)
    texts = (first[comment.end() :] if comment else first, *cells[1:])
    row = Row(line, tuple(map(_bare, texts)), clock)
    return None if comment and any(map(is_number, row.cells)) else row


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


def refuse_fault(source: str, row: Row) -> None:
    """Raise InputError for a row whose cells cannot be told."""
    if row.fault:
        name = place_of(source, row.line)
        raise validation_error(name, row.cells[0][:40], "", f"cells of a table ({row.fault})", "correct that line")
