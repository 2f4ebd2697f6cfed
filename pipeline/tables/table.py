"""Find tables in rows of cells: a header that names quantities and units, and the rows of numbers below it.

The rows come from a file, or one by one from a board. Other columns and lines are skipped. The units that they state
are still compared with the units of the table, so that no contradiction goes unnoticed.
"""

import enum
import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pipeline.tables.columns import Column, StatedUnits, UnitStatement
from pipeline.tables.decoding import SHOWN_CELL, place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import HeaderWords, fold_words
from pipeline.tables.number_formats import as_number, decimal_sign, is_missing, is_number, seconds_of_day
from pipeline.tables.rows import Row, Rows, WholeRows, refuse_fault, single_sheet
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, Quantity, is_unit, no_unit, unit_of
from sensor.quantity import InputError, validation_error

MAX_ROWS_BELOW = 4  # maximum number of rows of units, or of a second language, below a header
MAX_BANNER = 1000  # maximum number of lines of a stream before its header
_MAX_SEARCHED = 50_000  # maximum number of lines of a file that are searched for a header
_MAX_LISTED = 8  # maximum number of columns or lines that a summary lists
# If this many rows have the same number of decimals, the file contains trailing zeros. At least one of 50 random
# numbers ends in 0 with a probability of 0.995.
_ROWS_FOR_DECIMALS = 50
_STATISTICS = set(map(fold_words, WORDS["results"]["rows"]))
_LABELLED = re.compile(
    r"([^\W\d][^:=,;|]{0,60}?)\s*[:=]\s*[+-]?[0-9][0-9.]*(?:\s?[^\W\d_]{1,4}(?=[\s,;|]))?"  # such as `Force: 1.5 N`
)


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundTable:
    """A table in a source: its header, the row above the header, its columns, and its rows that are not empty.

    `decimal` is the decimal sign of all numbers. The sign is "" for rows that arrive one by one from a board, whose
    numbers each determine their own sign. `left_out` collects the lines of text and statistics between the rows, and
    `skipped` collects rows without numbers, whose cells are empty or state that the number is missing.
    """

    source: str
    header: Row
    above: Row
    columns: list[Column]
    rows: Iterable[Row]
    decimal: str = ""
    left_out: list[Row] = field(default_factory=list)
    skipped: list[Row] = field(default_factory=list)

    def place(self, line: int, column: Column) -> str:
        """Return the name of a cell for error messages: its file, line and column."""
        return place_of(self.source, line, column.label)

    def limited_to(self, columns: Sequence[Column], rows: Sequence[Row]) -> "FoundTable":
        """Return a copy of the table with only these columns and rows, and with the decimal sign of their numbers.

        Raises InputError if the numbers have different decimal signs, or do not show which sign is decimal.
        """
        cells = [[(row.line, column.cell(row)) for row in rows] for column in columns if column.is_written]
        return replace(self, columns=list(columns), rows=rows, decimal=decimal_sign(self.source, cells))

    def plain(self, cell: str) -> str | None:
        """Return the number in a cell in Python's notation.

        The result is None if the text is not a number. If the table has no decimal sign, the result is also None for a
        number whose comma may be decimal or may separate thousands.
        """
        number = as_number(cell)
        if number is None or (not self.decimal and "," in number.text and number.is_unclear):
            return None
        return number.plain(self.decimal)

    def number(self, row: Row, column: Column) -> float:
        """Return the number in a cell, converted to mm, N, s, MPa or 1.

        Raises InputError if the cell does not hold a finite number, if its unit differs from the unit of its column, or
        if the number exceeds the largest value that its quantity allows. The message names the file, line and column.
        """
        cell = column.cell(row)
        value = self._value(cell, column)
        if value is None or not math.isfinite(value):
            bound = "a finite number" if cell else "a number, and not an empty cell"
            if value is None and as_number(cell) is not None:
                bound = "a number whose comma is clearly decimal, because commas may separate thousands here"
            raise self._cell_error(row, column, cell, bound, "correct it, or leave the row out")
        self._refuse_other_unit(row, column, cell)
        value *= column.factor
        if abs(value) > column.quantity.most:
            bound = f"at most {column.quantity.most / column.factor:g}"
            raise self._cell_error(row, column, cell, bound, "check the unit of the column")
        return value

    def _value(self, cell: str, column: Column) -> float | None:
        """Return the number in a cell in the unit of its column; None if there is none.

        In a column of seconds, a time of day is a number too.
        """
        plain = self.plain(cell)
        if plain is not None:
            return float(plain)
        return seconds_of_day(cell) if column.unit == "s" else None

    def _refuse_other_unit(self, row: Row, column: Column, cell: str) -> None:
        """Raise InputError if a row states another unit for its number than the unit of the column.

        The unit may follow the number in the `cell`, or be in the column of units. The message shows the cell that
        states it.
        """
        number = as_number(cell)
        unit_after_number = number.unit if number else ""
        unit_cell = "" if column.unit_index is None else row.cell(column.unit_index)
        for unit, text in ((unit_after_number, cell), (unit_cell, unit_cell)):
            if unit and unit_of(column.quantity, unit) != column.unit:
                bound = f"in {column.unit}, the unit of its column"
                raise self._cell_error(row, column, text, bound, "use the same unit in the whole column")

    def _cell_error(self, row: Row, column: Column, text: str, bound: str, hint: str) -> InputError:
        """Return the error for a cell; the message shows the beginning of `text`."""
        return validation_error(self.place(row.line, column), text[:SHOWN_CELL], "", bound, hint)

    @property
    def passed_over(self) -> list[str]:
        """Return the labels of the columns that are not used."""
        used = {column.index for column in self.columns} | {column.unit_index for column in self.columns}
        return [label[:SHOWN_LABEL] for index, label in enumerate(self.header.cells) if label and index not in used]

    @property
    def summary(self) -> str:
        """Return a one-line summary of what was read: the columns, the lines of the rows, and what was skipped."""
        parts = [", ".join(map(str, self.columns))]
        if isinstance(self.rows, Sequence):  # not a generator, whose rows are read only once
            lines = f", lines {self.rows[0].line} to {self.rows[-1].line}" if self.rows else ""
            parts.append(f"{len(self.rows)} rows{lines}")
        if self.decimal == ",":
            parts.append("decimal commas")
        if self.passed_over:
            parts.append(f"passed over {_list_first(list(map(repr, self.passed_over)))}")
        if self.skipped:
            parts.append(f"{len(self.skipped)} without numbers left out")
        if self.left_out:
            parts.append(f"left out {_list_first(list(map(row_text, self.left_out)))}")
        return f"{self.source}: {'; '.join(parts)}"


def _list_first(texts: Sequence[str]) -> str:
    """Return a list of the first texts, with "and others" if there are more than `_MAX_LISTED`."""
    return ", ".join(texts[:_MAX_LISTED]) + (" and others" if len(texts) > _MAX_LISTED else "")


def row_text(row: Row) -> str:
    """Return the description of a skipped line for notes: its number and the beginning of its text."""
    return f"line {row.line}, {row.text[:SHOWN_LABEL]!r}"


class _RowKind(enum.Enum):
    """What a row below the first row of numbers holds."""

    NUMBERS = enum.auto()
    TEXT = enum.auto()  # only text, for example a remark or another header
    STATISTIC = enum.auto()  # a statistic of the rows, such as their mean
    INCOMPLETE = enum.auto()  # a last line that was not written completely
    MISSING = enum.auto()  # placeholders instead of all numbers


@dataclass(kw_only=True)
class _HeaderSearch:
    """The state of the search for the header of a table.

    `above` holds the rows before the table. `header_index` is the index in `above` of the row that is taken for the
    header, or None. `number_columns` are the indices of the columns in which numbers are expected below the header.
    """

    number_columns: Collection[int]
    above: list[Row] = field(default_factory=list)
    header_index: int | None = None
    texts_left: int = 0  # number of rows of text that may still follow the header

    @property
    def follows_blank_line(self) -> bool:
        """Return whether the next row follows an empty row."""
        return bool(self.above) and self.above[-1].is_empty

    def take_as_header(self, number_columns: Collection[int]) -> None:
        """Use the row that is added to `above` next as the header, with numbers expected in `number_columns`."""
        self.header_index = len(self.above)
        self.number_columns = number_columns
        self.texts_left = MAX_ROWS_BELOW

    def gives_up_header(self, row: Row) -> bool:
        """Count a row of text below the header, and return whether the header is given up.

        A header is given up if too many rows of text follow, because it then was an ordinary line of text.
        """
        if self.header_index is None or not _has_text(row, self.number_columns):
            return False
        self.texts_left -= 1
        if self.texts_left >= 0:
            return False
        self.header_index, self.number_columns = None, ()
        return True


class TableReader:
    """A reader that finds tables in rows as they arrive.

    A table begins at the first row of numbers below a header. A header must name all quantities of at least one set in
    `needed`. No header is required if flags select the columns by number. A table ends at a blank row or at the next
    header, unless the source has only one table (`is_single`).
    """

    def __init__(
        self,
        quantities: Mapping[str, Quantity],
        needed: Sequence[Collection[str]],
        example: str,
        *,
        is_single: bool = False,
    ) -> None:
        """Prepare the search for tables whose columns hold `quantities`.

        A header must name all quantities of at least one set in `needed`. Messages show the header `example`.
        """
        self.quantities = quantities
        self.needed = needed
        self.example = example
        self.is_single = is_single
        self.words = HeaderWords(quantities)
        self.stated_units = StatedUnits(self.words)
        # The quantities of the columns that flags select by number, keyed by the index of the column. If there are no
        # such flags, the mapping is empty, and a header is required.
        self._by_number = self.words.columns_by_number(needed)
        # For each source without a table, its name and the row that is most similar to a header.
        self._candidates: list[tuple[str, Row]] = []
        self._pending: list[Row] = []  # the row that ended a table, with which the next search begins

    def tables(self, rows: Rows) -> Iterator[FoundTable]:
        """Yield the tables of one source.

        Raises InputError for invalid units, and for rows that cannot belong to their table.
        """
        feed = iter(rows)
        table = self._find_table(rows, feed, None)
        while table is not None:
            yield table
            for _ in table.rows:  # reads the rows that the caller did not read, because the next table is below them
                pass
            table = self._find_table(rows, feed, table)

    def no_header(self) -> InputError:
        """Return the error for sources without a table; it states what the row most similar to a header lacks."""
        source, header = max(self._candidates, key=lambda candidate: self._name_count(candidate[1]))
        names, labels = self.words.names(header), self._labels(header)
        # The sets in `needed` are alternatives. The row is compared with the set that it fits best.
        needed = max(self.needed, key=lambda needed_names: len((names | labels) & set(needed_names)))
        missing = [name for name in needed if name not in names]
        bound = f"a header that also has {' and '.join(missing)}"
        place = place_of(source, header.line)
        if labels >= set(needed):  # all quantities are named, but as labels of numbers, as in `Force: 1.5 N`
            hint = f"every line of this file has labels: write {self.example} once, and then lines without labels"
            return validation_error(place, header.text, "", bound, hint)
        near_miss = self.words.find_near_miss(header, missing)
        if near_miss is not None:  # a label names a missing quantity, but its unit is unknown
            label, name, tail = near_miss
            return no_unit(place_of(source, header.line, label), self.quantities[name], tail)
        if not missing:  # the header is complete, but no numbers follow
            no_numbers = Row(0, ())
            self.stated_units.columns(source, header, [], no_numbers)  # raises InputError if a unit is invalid
            return validation_error(source, 0, "rows", "at least one row of numbers below the header", "add one")
        flag_value = ",".join(f"{name}={number}" for number, name in enumerate(needed, start=1))
        hint = f"write, for example, {self.example}, or name columns by their header or number: --columns {flag_value}"
        return validation_error(place, header.text, "", bound, hint)

    def _find_table(self, rows: Rows, feed: Iterator[Row], previous: FoundTable | None) -> FoundTable | None:
        """Return the next table after the `previous` one, or None if there is none; `feed` yields the rows to search.

        A row of numbers begins the table. A row above it that names the quantities is its header, unless more than
        `MAX_ROWS_BELOW` rows of text follow. Raises InputError if a row of numbers after a blank line has no header, or
        if the units of the table are invalid.
        """
        is_stream = not isinstance(rows, WholeRows)
        max_rows = MAX_BANNER if is_stream else _MAX_SEARCHED
        search = _HeaderSearch(number_columns=self._by_number)
        pending = self._pending  # the row that ended the previous table
        self._pending = []
        for row in itertools.chain(pending, feed):
            if row.is_empty:
                search.above.append(row)
                continue
            has_no_header = search.header_index is None
            if has_no_header and previous is not None and search.follows_blank_line:
                # Numbers after a blank line may belong to the previous table if they have no header.
                self._refuse_stray_numbers(rows.source, row)
            if not self._by_number and self.words.is_header(row, self.needed):
                search.take_as_header(self.words.numeric_columns(row))
                rows.keep_delimiter()  # all further lines are split at the delimiter of the header
            elif self._begins_table(row, search.number_columns):
                rows.keep_delimiter()
                return self._open_table(rows, search.above, search.header_index, row, feed)
            elif search.gives_up_header(row):
                rows.keep_delimiter(keep=False)
            search.above.append(row)
            # A stream never ends, so the search is given up if its lines have labels instead of a header.
            if len(search.above) > max_rows or (is_stream and self._has_labels(row)):
                break
        return self._empty_table_or_none(rows, search.above, search.header_index, previous)

    def _empty_table_or_none(
        self, rows: Rows, remaining: list[Row], header_index: int | None, previous: FoundTable | None
    ) -> FoundTable | None:
        """Return the result of a search that found no row of numbers in the `remaining` rows.

        `header_index` is the index of the header among these rows, or None. If the source has only one table, a header
        without rows is returned as a table, so that the caller can report that the table is empty. In any other case,
        the remaining rows are checked, and the result is None.
        """
        if header_index is not None and self.is_single and not self._has_labels(remaining[header_index]):
            no_numbers = Row(remaining[header_index].line, ())
            return self._open_table(rows, remaining, header_index, no_numbers, iter(()))
        self._check_remaining_rows(rows.source, remaining, header_index, previous)
        return None

    def _begins_table(self, row: Row, number_columns: Collection[int]) -> bool:
        """Return whether a row is the first row of numbers of a table.

        `number_columns` are the indices of the columns of numbers. Below a header, a number in one of them is enough,
        because other cells may be missing. If flags select the columns by number, all of them must hold numbers.
        """
        have_numbers = [is_number(row.cell(index)) for index in number_columns]
        if self._by_number:
            return all(have_numbers)
        return any(have_numbers)

    def _check_remaining_rows(
        self, source: str, remaining: list[Row], header_index: int | None, previous: FoundTable | None
    ) -> None:
        """Check the remaining rows, which contain no further table.

        If there is no `previous` table, the row that is most similar to a header is stored for `no_header`. If there is
        one, InputError is raised if the rows state a unit that contradicts it, or hold a header without numbers.
        """
        rows_above_header = remaining[:header_index]  # all rows if there is no header (None)
        stated = self.stated_units.record_statements(source, rows_above_header)
        if previous is None:
            texts = [row for row in remaining if not row.is_empty][:MAX_BANNER]
            self._candidates.append((source, max(texts, key=self._name_count, default=Row(1, ()))))
            return
        if header_index is not None:
            header = remaining[header_index]
            bound = "a header with rows of numbers below it"
            raise validation_error(place_of(source, header.line), header.text, "", bound, "remove it, or add its rows")
        for column in previous.columns:
            column.refuse_other_unit(stated.get(column.name, []))

    def _name_count(self, row: Row) -> int:
        """Return the number of quantities that a row names, as a header or as labels of numbers."""
        return max(len(self.words.names(row)), len(self._labels(row)))

    def _labels(self, row: Row) -> set[str]:
        """Return the quantities that label a number in a row, as in `Force: 1.5 N`."""
        labels = _LABELLED.findall(" ".join(row.cells)[: 4 * LONGEST_LABEL])
        return {name for label in labels if (name := self.words.interpret_label(label[:LONGEST_LABEL]).name)}

    def _has_labels(self, row: Row) -> bool:
        """Return whether a row labels a number for all quantities of at least one set in `needed`."""
        return any(self._labels(row) >= set(names) for names in self.needed)

    @staticmethod
    def _refuse_stray_numbers(source: str, row: Row) -> None:
        """Raise InputError for a row of numbers that a blank line separates from its table."""
        if len(row.cells) > 1 and all(map(is_number, filter(None, row.cells))):
            bound = "a header, because it follows a blank line"
            hint = "remove the blank line if no row is missing there"
            raise validation_error(place_of(source, row.line), row.text, "", bound, hint)

    def _open_table(
        self, rows: Rows, above: list[Row], header_index: int | None, first: Row, feed: Iterator[Row]
    ) -> FoundTable:
        """Return the table whose first row of numbers is `first`; its other rows are read from `feed` when needed.

        `header_index` is the index of its header in the rows `above`, or None if flags select the columns by number. An
        empty header is then inserted into `above`, if none of the rows can be the header. Raises InputError if the
        units of a column are invalid or contradict each other.
        """
        if header_index is None:
            header_index = self._find_or_insert_header(above, first)
        header = above[header_index]
        self.stated_units.record_statements(rows.source, above if self._by_number else above[:header_index])
        texts = [row for row in above[header_index + 1 :] if not row.is_empty]
        number_columns = self.words.numeric_columns(header)
        # Rows of text in the columns of numbers may state units. All other rows are skipped.
        below = [row for row in texts if _has_text(row, number_columns)]
        columns = self._used_columns(self.stated_units.columns(rows.source, header, below, first), first)
        table = FoundTable(
            source=rows.source,
            header=header,
            above=self._row_above_header(above, header_index),
            columns=columns,
            rows=(),  # replaced below, because the generator of the rows also fills the lists of this table
            skipped=[row for row in texts if row not in below],
        )
        return replace(table, rows=self._number_rows(table, first, feed, by_spaces=rows.are_split_at_spaces))

    def _row_above_header(self, above: Sequence[Row], header_index: int) -> Row:
        """Return the row above the header of a table, or a row without cells if there is none.

        If flags select columns by number, the header need not be a real one. The row above such a header has no
        meaning, so a row without cells is returned then too.
        """
        if header_index == 0 or self._by_number:
            return Row(0, ())
        return above[header_index - 1]

    def _used_columns(self, columns: list[Column], first: Row) -> list[Column]:
        """Return the `columns` of a header that the table uses, and the clock of a serial monitor if it is needed.

        In a source that may have several tables, an optional column may have a header but no numbers. Such a column is
        left out if the `first` row of numbers has no number there. A serial monitor writes the time of day before each
        line. This clock replaces a missing column of times if the quantity permits it.
        """
        used_columns = list(columns)
        if not self.is_single:
            required = set(itertools.chain.from_iterable(self.needed))
            used_columns = [column for column in columns if column.name in required or _has_number(column.cell(first))]
        times = [name for name, quantity in self.quantities.items() if quantity.by_clock]
        has_times = any(column.name in times for column in used_columns)
        if first.clock and times and not has_times:
            clock = Column(index=-1, label="clock", name=times[0], quantity=self.quantities[times[0]], unit="s")
            used_columns.append(clock)
        return used_columns

    def _find_or_insert_header(self, above: list[Row], first: Row) -> int:
        """Return the index in `above` of the header of a table whose columns are selected by number.

        The words of this header need not be known. The header is the last row above the rows of units. If this row has
        numbers, or fewer cells than the `first` row of numbers, or if there is no such row, an empty header is inserted
        into `above`.
        """
        end = len(above)  # index after the row that may be the header
        while end and (above[end - 1].is_empty or self._are_units(above[end - 1])):
            end -= 1
        if end:
            cells = above[end - 1].cells
            if len(cells) >= len(first.cells) and not any(map(is_number, cells)):
                return end - 1
        above.insert(end, Row(first.line, ("",) * len(first.cells)))
        return end

    def _are_units(self, row: Row) -> bool:
        """Return whether a row has units in all columns that flags select by number."""
        return all(unit_of(quantity, row.cell(index)) for index, quantity in self._by_number.items())

    def _number_rows(self, table: FoundTable, first: Row, feed: Iterator[Row], *, by_spaces: bool) -> Iterator[Row]:
        """Yield the rows of a table that hold numbers, until the table ends.

        `first` is the first row of numbers, and `feed` yields the rows below it. `table.skipped` collects the rows in
        which all numbers are missing. `table.left_out` collects text, statistics and an incomplete last line. In a
        source that may have several tables, a blank row or another header ends the table. The row that ends the table
        is stored in `self._pending`, because the search for the next table begins with it.

        With `by_spaces`, spaces separate the cells, so an empty cell shows only as a row that is too short. Raises
        InputError for a row of the wrong length, and for a line of text that states another unit or is a different
        header.
        """
        classifier = _RowClassifier(table)
        header_width = len(table.header.cells)
        min_width = self._min_width(header_width, classifier.used_width, by_spaces=by_spaces)
        for row in itertools.chain([first], feed):
            if row.is_empty:
                if self.is_single:
                    continue
                self._pending = [row]
                return
            refuse_fault(table.source, row)
            kind = classifier.kind_of(row)
            if kind is _RowKind.TEXT and not self.is_single and self.words.is_header(row, self.needed):
                self._pending = [row]
                return
            if kind is not _RowKind.NUMBERS:
                self._set_aside(table, row, kind)
                continue
            is_too_short = len(row.cells) < min_width
            has_text_beyond_header = any(row.cells[header_width:])  # empty cells there are allowed
            if is_too_short or has_text_beyond_header:
                check_row_length(table.source, row, header_width)
            classifier.count_decimals(row)
            yield row

    def _set_aside(self, table: FoundTable, row: Row, kind: _RowKind) -> None:
        """Store a row that is not read in the list of the table for its `kind`.

        Raises InputError for a line of text that states another unit or is a different header.
        """
        if kind is _RowKind.MISSING:
            table.skipped.append(row)
            return
        if kind is _RowKind.TEXT:
            self._refuse_contradicting_text(table, row)
        table.left_out.append(row)

    def _min_width(self, header_width: int, used_width: int, *, by_spaces: bool) -> int:
        """Return the smallest allowed number of cells in a row of numbers.

        `used_width` is the number of cells from the start of a row to the last column that is used.
        """
        if by_spaces:  # a missing cell shifts all cells after it, so rows must be as long as the header
            return header_width
        return used_width if self.is_single else 0  # in a source with several tables, cells may be absent

    def _refuse_contradicting_text(self, table: FoundTable, row: Row) -> None:
        """Raise InputError if a line of text between the rows states other units, or is a different header."""
        place = place_of(table.source, row.line)
        if self.words.is_header(row, self.needed) and row.cells != table.header.cells:
            bound = f"the same as the header in line {table.header.line}, or left out"
            raise validation_error(place, row.text, "", bound, "save each table in its own file")
        stated = self.stated_units.record_statements(table.source, [row])
        for column in table.columns:
            statements = list(stated.get(column.name, []))
            if is_unit(column.cell(row)):
                statements.append(UnitStatement(column.cell(row), place))
            column.refuse_other_unit(statements)


class _RowClassifier:
    """Determines what each row of a table holds.

    `used_width` is the number of cells from the start of a row to the last column that is used.
    """

    def __init__(self, table: FoundTable) -> None:
        """Derive the properties of the columns from the `table` whose rows are classified."""
        self.used_width = 1 + max(column.index for column in table.columns)  # indices are counted from 0
        self._number_columns = [column for column in table.columns if column.is_written]
        # A column of text may hold any text, so lines of text cannot be recognised in such a table.
        self._has_text_columns = not all(column.unit for column in table.columns)
        # The first cell may name a statistic if no column of the table has the index 0.
        self._is_first_cell_unused = all(column.index for column in table.columns)
        self._row_counts: Counter[int] = Counter()  # number of rows, keyed by the number of decimals in the last cell

    def count_decimals(self, row: Row) -> None:
        """Count the decimals of a row of numbers, with which an incomplete last line is recognised."""
        self._row_counts[_decimal_count(row)] += 1

    def kind_of(self, row: Row) -> _RowKind:
        """Return what a row holds that is not empty.

        A row may be of several kinds. The kinds are tested in a fixed order, and the first that applies is returned.
        """
        has_no_numbers = not self._has_text_columns and not any(
            is_number(column.cell(row)) for column in self._number_columns
        )
        if has_no_numbers and _is_text(row):
            return _RowKind.TEXT
        if self._is_first_cell_unused and is_statistic(row):
            return _RowKind.STATISTIC
        if row.cut and _is_incomplete(row, self.used_width, self._row_counts):
            return _RowKind.INCOMPLETE
        if has_no_numbers and all(is_missing(column.cell(row)) for column in self._number_columns):
            return _RowKind.MISSING
        return _RowKind.NUMBERS


def is_statistic(row: Row) -> bool:
    """Return whether the first cell of a row names a statistic, as in `Mean,24.1,3.8`."""
    return not row.cells[0][:1].isdecimal() and fold_words(row.cells[0]) in _STATISTICS


def _is_incomplete(row: Row, needed: int, decimals: Mapping[int, int]) -> bool:
    """Return whether the last line, which has no line end, was not written completely.

    An incomplete line has fewer cells than `needed`, or fewer decimals in its last cell than all earlier lines.
    `decimals` maps a number of decimals to the number of earlier lines that have it.
    """
    has_fixed_decimals = len(decimals) == 1 and sum(decimals.values()) >= _ROWS_FOR_DECIMALS
    return len(row.cells) < needed or (has_fixed_decimals and _decimal_count(row) < min(decimals))


def _decimal_count(row: Row) -> int:
    """Return the number of characters after the decimal sign in the last cell of a row."""
    sign = max(row.cells[-1].rfind("."), row.cells[-1].rfind(","))
    return len(row.cells[-1]) - 1 - sign if sign >= 0 else 0


def _is_text(row: Row) -> bool:
    """Return whether a row holds only text: no cell is a number or begins like a number."""
    return not all(map(is_missing, row.cells)) and not any(
        _has_number(cell) or (cell[:1] in "+-.,0123456789" and not is_missing(cell)) for cell in row.cells
    )


def _has_text(row: Row, columns: Collection[int]) -> bool:
    """Return whether a row has text in at least one of the columns with these indices."""
    return not all(is_missing(row.cell(index)) for index in columns)


def _has_number(cell: str) -> bool:
    """Return whether a cell holds a number or a time of day."""
    return is_number(cell) or seconds_of_day(cell) is not None


def check_row_length(source: str, row: Row, columns: int) -> None:
    """Raise InputError for a row whose number of cells is not the number of `columns` in the header."""
    if len(row.cells) != columns:
        bound = f"{columns} cells, like its header"
        hint = "separate cells by semicolons if numbers have decimal commas"
        if len(row.cells) < columns:
            hint = "the line may be incomplete: correct it, or leave it out"
        raise validation_error(place_of(source, row.line), len(row.cells), "cells", bound, hint)


def _refuse_duplicates(table: FoundTable, example: str) -> None:
    """Raise InputError if two columns hold the same quantity; the message shows the header `example`."""
    names: set[str] = set()
    for column in table.columns:
        if column.name in names:
            hint = f"write for instance {example}, or choose one by --columns {column.name}=HEADER"
            raise validation_error(column.place, column.label, "", f"the only column of {column.name}", hint)
        names.add(column.name)


def one_table(
    rows: Rows, quantities: Mapping[str, Quantity], needed: Sequence[Collection[str]], example: str
) -> FoundTable:
    """Return the only table of a source, whose columns may hold `quantities`.

    The header must name all quantities of at least one set in `needed`, and each quantity only once. If all rows are
    available, as in a file, they determine the decimal sign. Raises InputError if there is no such table; the message
    shows the header `example`.
    """
    reader = TableReader(quantities, needed, example, is_single=True)
    table = next(reader.tables(rows), None)
    if table is None:
        raise reader.no_header()
    _refuse_duplicates(table, example)
    if not isinstance(rows, WholeRows):  # rows that arrive one by one cannot determine a common decimal sign
        return table
    return table.limited_to(table.columns, list(table.rows))


def only_table(
    source: Path | str, quantities: Mapping[str, Quantity], needed: Sequence[Collection[str]], example: str
) -> FoundTable:
    """Return the only table of a file, as `one_table` does; InputError is also raised if the table has no rows.

    `source` is the path of the file, or `-` for the standard input.
    """
    table = one_table(single_sheet(source), quantities, needed, example)
    if not table.rows and table.left_out:
        row = table.left_out[0]  # the first of the rows that could not be read
        bound = "a row of numbers that fits its header"
        raise validation_error(place_of(table.source, row.line), row.text, "", bound, "complete that line")
    if not table.rows:
        raise validation_error(table.source, 0, "rows", "at least one row below the header", "measure the unit")
    return table
