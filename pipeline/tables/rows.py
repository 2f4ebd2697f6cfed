"""Split lines of text into rows of cells: delimiters, quotes, comments and clocks."""

import csv
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipeline.tables.decoding import (
    LONGEST_LINE,
    MAX_LINES,
    SHOWN_CELL,
    lines_of_stream,
    lines_of_text,
    place_of,
)
from pipeline.tables.number_formats import is_number
from pipeline.tables.workbook import cells_of_workbook
from sensor.input_file import read_bytes
from sensor.quantity import validation_error

_MAX_JOINED = 5  # maximum number of lines over which a quoted cell may extend
_SAMPLE_LINES = 400  # number of lines that determine the delimiter
_DELIMITERS = ("\t", ";", "|", ",", "  ", " ")  # two spaces represent any larger number of them
_SPACES = {
    " ": re.compile(r"(?<![ \u3000])[ \u3000]++(?![(\[{<])"),  # no split before a unit in brackets
    "  ": re.compile(r"[ \u3000]{2,}"),
}
_COMMENT = re.compile(r"\s*(?:#|%|//)\s*")
# The time of day that a serial monitor writes before a line, as in `12:30:01.250 -> `
_CLOCK_BEFORE = re.compile(r"\s*((?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)\s*(?:->|→)\s?")
_SPECIAL_CHARACTERS = ('"', "'", ">", "\u2192", "#", "%", "/")  # characters of quoted cells, clocks and comments


_NumberedLine = tuple[int, str | Sequence[str]]
"""The number of a line, counted from 1, and its text or the cells of a workbook's row."""


class Row(NamedTuple):
    """One line of a file: its number, counted from 1, and its cells without surrounding spaces.

    `clock` is the time of day that a serial monitor writes before the line. `fault` states why the cells are invalid.
    `cut` is True for the last row if it has no line end although earlier lines have one. `commented` is True if the
    line begins with a comment sign.
    """

    line: int
    cells: tuple[str, ...]
    clock: str = ""
    fault: str = ""
    cut: bool = False
    commented: bool = False

    @property
    def is_empty(self) -> bool:
        """Return whether all cells are empty."""
        return not any(self.cells)

    def cell(self, index: int) -> str:
        """Return the cell at an index, or "" beyond either end of the row."""
        return self.cells[index] if 0 <= index < len(self.cells) else ""

    @property
    def text(self) -> str:
        """Return the row as text for error messages."""
        return ",".join(self.cells)


class Rows:
    """The rows of a file, which are split from lines of text one by one, or taken from a sheet of a workbook.

    Lines are split at `delimiter`. If the delimiter is empty, each line determines its own delimiter, until the reader
    of a table calls `keep_delimiter` at the header. A commented line with numbers is skipped, because somebody removed
    these data. A commented line without numbers may be the header. `source` is the name of the file in messages.
    """

    def __init__(self, lines: Iterable[str | Sequence[str]], source: str, delimiter: str = "") -> None:
        """Store the lines, which are read only when the rows are iterated; they may come from a stream."""
        self.source = source
        self._lines = lines
        self._kept_delimiter = delimiter
        self._last_delimiter = delimiter

    @property
    def are_split_at_spaces(self) -> bool:
        """Return whether spaces separate the cells of the last row, so that an empty cell cannot be recognised."""
        return not self._last_delimiter.strip(" ")

    def keep_delimiter(self, *, keep: bool = True) -> None:
        """Split all further lines at the delimiter of the last line.

        If `keep` is False, each further line determines its own delimiter again.
        """
        self._kept_delimiter = self._last_delimiter if keep else ""

    def __iter__(self) -> Iterator[Row]:
        """Yield the rows, without commented lines that hold numbers.

        A quoted cell may extend over several lines, which become one row.
        """
        numbered_lines = enumerate(self._lines, start=1)
        lookahead: list[_NumberedLine] = []  # lines read ahead for a quoted cell, but not used yet
        earlier_has_line_end = False  # True if at least one earlier line has a line end
        while True:
            numbered_line = lookahead.pop(0) if lookahead else next(numbered_lines, None)
            if numbered_line is None:
                return
            number, line = numbered_line
            row = self._split_line(number, line)
            has_open_quote = str(line).count('"') % 2 == 1
            if row.fault and has_open_quote:
                # The quoted cell may continue in the next lines. The maximum includes this line, so 1 is subtracted.
                lookahead += itertools.islice(numbered_lines, _MAX_JOINED - 1 - len(lookahead))
                row, joined_count = self._join_lines(row, line, lookahead)
                lookahead = lookahead[joined_count:]
            # The row of a workbook is a sequence of cells, which is always complete.
            has_line_end = not isinstance(line, str) or line.endswith(("\n", "\r"))
            if earlier_has_line_end and not has_line_end:
                row = row._replace(cut=True)
            is_removed_data = row.commented and any(map(is_number, row.cells))
            if not is_removed_data:
                yield row
            earlier_has_line_end = earlier_has_line_end or has_line_end

    def _join_lines(self, row: Row, line: str | Sequence[str], next_lines: Sequence[_NumberedLine]) -> tuple[Row, int]:
        """Return the row of a line and of the fewest `next_lines` that close its quoted cell, and their number.

        If none of them closes the cell, the result is the faulty `row` of the line, and 0.
        """
        for count in range(1, len(next_lines) + 1):
            lines = [line, *(next_line for _, next_line in next_lines[:count])]
            joined = self._split_line(row.line, " ".join(str(text).rstrip() for text in lines))
            if not joined.fault:
                return joined, count
        return row, 0

    def _split_line(self, number: int, line: str | Sequence[str]) -> Row:
        """Return the row of a line, and store the delimiter at which it was split."""
        self._last_delimiter = self._kept_delimiter or delimiter_of([line])
        return row_of(self._last_delimiter, number, line)


class WholeRows(Rows):
    """The rows of a sheet, which are all available at once and share one delimiter.

    If every second row is empty, as after a wrong conversion of line ends, the empty rows are removed.
    """

    def __init__(self, lines: Sequence[str | Sequence[str]], source: str) -> None:
        """Split all lines at the delimiter that suits them best."""
        super().__init__(lines, source, delimiter_of(lines))
        self.rows = list(super().__iter__())
        is_every_second_empty = all(one.is_empty or other.is_empty for one, other in itertools.pairwise(self.rows))
        if is_every_second_empty:
            self.rows = [row for row in self.rows if not row.is_empty]

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)


def sheets_of(source: Path | str, name: str = "FILE") -> list[WholeRows]:
    """Return the sheets of a file that are not empty.

    A text file and the standard input have one sheet. The `source` of the standard input is `-`. Raises InputError if
    the file cannot be read, or if all its sheets are empty. The message states `name`, the command's parameter for the
    file.
    """
    lines_by_sheet: Iterable[tuple[str, Sequence[str | Sequence[str]]]]
    if str(source) == "-":
        lines_by_sheet = [("-", list(itertools.islice(lines_of_stream(), MAX_LINES)))]
    elif (content := read_bytes(source, name)).startswith(b"PK\x03\x04"):  # a ZIP archive, as every workbook is
        lines_by_sheet = cells_of_workbook(str(source), content)
    else:
        lines_by_sheet = [(str(source), lines_of_text(str(source), content))]
    sheets = [WholeRows(lines, sheet_name) for sheet_name, lines in lines_by_sheet]
    filled_sheets = [sheet for sheet in sheets if not all(row.is_empty for row in sheet.rows)]
    if not filled_sheets:
        bound = "a CSV file with a header and numbers, not an empty one"
        raise validation_error(str(source), "", "", bound, "export the table again")
    return filled_sheets


def single_sheet(source: Path | str, name: str = "FILE") -> WholeRows:
    """Return the only sheet of a file with numbers; raises InputError like `sheets_of`, and if several have numbers."""
    sheets = sheets_of(source, name)
    with_numbers = [sheet for sheet in sheets if any(is_number(cell) for row in sheet.rows for cell in row.cells)]
    if len(with_numbers) > 1:
        name = ", ".join(sheet.source for sheet in with_numbers)
        hint = "save that sheet as its own file"
        raise validation_error(name, len(with_numbers), "sheets", "the only sheet with numbers", hint)
    return (with_numbers or sheets)[0]


def rows_of(source: Path | str, name: str = "FILE") -> Rows:
    """Return the rows of a file, or the rows of the standard input as they arrive if `source` is `-`.

    Raises InputError like `sheets_of`.
    """
    return Rows(lines_of_stream(), "-") if str(source) == "-" else single_sheet(source, name)


def delimiter_of(lines: Sequence[str | Sequence[str]]) -> str:
    """Return the delimiter that splits the lines into the most numbers.

    If two delimiters yield equally many numbers, the one with fewer other cells is chosen. If no delimiter yields two
    numbers, the first delimiter that occurs in half of the lines is returned, or else a comma. In a long file, only a
    sample of the lines is tested.
    """
    texts = [line[:LONGEST_LINE] for line in lines if isinstance(line, str) and line.strip()]
    sample = texts[:: max(1, len(texts) // _SAMPLE_LINES)]
    best_delimiter = ""
    best_score = (1, 0)  # a delimiter must yield more than one number, because a single number needs no delimiter
    for delimiter in _DELIMITERS:
        score = _delimiter_score(delimiter, sample)
        if score > best_score:
            best_delimiter, best_score = delimiter, score
    if best_delimiter:
        return best_delimiter
    half = max(1, len(sample)) / 2  # half of the lines; without any line, no delimiter is frequent
    for delimiter in _DELIMITERS:
        if sum(delimiter in line for line in sample) >= half:
            return delimiter
    return ","


def _delimiter_score(delimiter: str, lines: Sequence[str]) -> tuple[int, int]:
    """Return the score of a delimiter: the number of cells with numbers, and minus the number of other cells.

    Tuples are compared item by item, so the number of other cells decides only between equal numbers. Lines without the
    delimiter are not counted.
    """
    cells = [cell for line in lines if delimiter in line for cell in row_of(delimiter, 0, line).cells]
    numbers = sum(map(is_number, cells))
    return numbers, numbers - len(cells)


def row_of(delimiter: str, number: int, line: str | Sequence[str]) -> Row:
    """Split a line at a delimiter and return its row; `number` is the number of the line.

    A line of text is a string. The row of a workbook is a sequence of cells, which is not split. A comment sign and the
    clock of a serial monitor are removed from the start of the line. An unclosed quote or a huge cell is recorded as
    the fault of the row.
    """
    # Shortcut for speed: most lines have no quotes, clocks or comments.
    if isinstance(line, str) and delimiter.strip(" ") and not any(mark in line for mark in _SPECIAL_CHARACTERS):
        return Row(number, tuple(map(str.strip, line.split(delimiter))))
    # A line of text is one piece until it is split below. The cells of a workbook are separate already.
    pieces = [line.rstrip("\r\n")] if isinstance(line, str) else line or [""]
    first, *other_cells = pieces
    comment = _COMMENT.match(first)
    first = first[comment.end() :] if comment else first
    clock = _CLOCK_BEFORE.match(first)
    first = first[clock.end() :] if clock else first
    cells = [first, *other_cells]
    fault = ""
    if isinstance(line, str):
        try:
            cells = _split_text(first, delimiter)
        except csv.Error as error:
            fault = str(error)
    return Row(number, tuple(map(_strip_cell, cells)), clock[1] if clock else "", fault, commented=comment is not None)


def _split_text(text: str, delimiter: str) -> list[str]:
    """Split a text at a delimiter; raises csv.Error for an unclosed quote or a huge cell.

    The csv module has no delimiter of several spaces, so a text is split at spaces by a pattern, without quotes.
    """
    if delimiter in _SPACES:
        return _SPACES[delimiter].split(text.strip())
    return next(csv.reader([text], delimiter=delimiter, strict=True, skipinitialspace=True), [])


def _strip_cell(cell: str) -> str:
    """Return a cell without surrounding spaces and single quotes, and without the ="" that spreadsheets write."""
    stripped = cell.strip()
    if stripped.startswith('="') and stripped.endswith('"'):
        return stripped[2:-1].strip()
    return stripped.strip("'").strip() if stripped.startswith("'") else stripped


def refuse_fault(source: str, row: Row) -> None:
    """Raise InputError if the cells of a row are invalid."""
    if row.fault:
        name = place_of(source, row.line)
        bound = f"a valid row of a table ({row.fault})"
        raise validation_error(name, row.cells[0][:SHOWN_CELL], "", bound, "correct that line")
