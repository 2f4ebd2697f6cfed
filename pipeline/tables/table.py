"""Tables from rows: a header that names each quantity with its unit, and the rows of numbers below it.

Files and boards share one generator of rows. The content of other columns and lines is skipped, except units: a unit
anywhere in the file is never skipped silently.
"""

import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pipeline.tables.columns import Column, Said, StatedUnits
from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import HeaderWords, folded
from pipeline.tables.number_formats import as_number, decimal_sign, is_missing, is_number, seconds_of_day
from pipeline.tables.rows import Row, Rows, WholeRows, refuse_fault, single_sheet
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, Quantity, is_unit, no_unit, unit_of
from sensor.quantity import InputError, validation_error

MOST_BELOW = 4  # most rows of units, or of a second language, below a header
MOST_BANNER = 1000  # most lines of a stream before its header
_MOST_TEXTS = 50_000  # most lines of a file that are searched for a header
_MOST_SHOWN = 8  # most columns or lines listed in a sentence
# rows that show that trailing zeros are written: of 50 numbers one would end in 0 with probability 0.995
_FEWEST_ROWS = 50
_STATISTICS = set(map(folded, WORDS["results"]["rows"]))
_LABELLED = re.compile(
    r"([^\W\d][^:=,;|]{0,60}?)\s*[:=]\s*[+-]?[0-9][0-9.]*(?:\s?[^\W\d_]{1,4}(?=[\s,;|]))?"  # such as `Force: 1.5 N`
)


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundTable:
    """A table in a source: its header, the row above it, its columns, and its rows, none of them empty.

    The rows of a board arrive one by one, and each number shows its own decimal sign. `left_out` collects skipped lines
    of text and statistics, and `skipped` lines whose cells state that a number is missing.
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
        """Return the name of a cell in error messages."""
        return place_of(self.source, line, column.label)

    def limited_to(self, columns: Sequence[Column], rows: Sequence[Row]) -> "FoundTable":
        """Return the table with some columns and rows, whose decimal sign they determine.

        Raises InputError if they do not.
        """
        cells = [[(row.line, column.cell(row)) for row in rows] for column in columns if column.is_written]
        return replace(self, columns=list(columns), rows=rows, decimal=decimal_sign(self.source, cells))

    def plain(self, cell: str) -> str | None:
        """Return a number in Python's notation; None for other text, and if its comma may separate thousands."""
        number = as_number(cell)
        if number is None or (not self.decimal and "," in number.text and number.unclear):
            return None
        return number.plain(self.decimal)

    def number(self, row: Row, column: Column) -> float:
        """Return the number in a cell [mm, N, s, MPa or 1]; raises InputError, which names file, line and column."""
        cell = column.cell(row)
        written = as_number(cell)
        plain = self.plain(cell)
        value = float(plain) if plain is not None else seconds_of_day(cell) if column.unit == "s" else None
        if value is None or not math.isfinite(value):
            bound = "a finite number" if cell else "a number, and not an empty cell"
            if value is None and written is not None:
                bound = "a number whose comma is surely decimal: commas may separate thousands here"
            raise self._cell_error(row, column, cell, bound, "correct it, or leave the row out")
        beside = "" if column.unit_index is None else row.cell(column.unit_index)
        for unit, text in ((written.unit if written else "", cell), (beside, beside)):
            if unit and unit_of(column.quantity, unit) != column.unit:
                bound = f"in {column.unit}, like its column"
                raise self._cell_error(row, column, text, bound, "write one unit in a column")
        value *= column.factor
        if abs(value) > column.quantity.most:
            bound = f"at most {column.quantity.most / column.factor:g}"
            raise self._cell_error(row, column, cell, bound, "check the unit of the column")
        return value

    def _cell_error(self, row: Row, column: Column, text: str, bound: str, hint: str) -> InputError:
        return validation_error(self.place(row.line, column), text[:40], "", bound, hint)

    @property
    def passed_over(self) -> list[str]:
        """Return the labels of the skipped columns."""
        used = {column.index for column in self.columns} | {column.unit_index for column in self.columns}
        return [label[:SHOWN_LABEL] for index, label in enumerate(self.header.cells) if label and index not in used]

    @property
    def understood(self) -> str:
        """Return a one-line summary of what was read: columns, and the lines of available rows."""
        parts = [", ".join(map(str, self.columns))]
        if isinstance(self.rows, Sequence):
            lines = f", lines {self.rows[0].line} to {self.rows[-1].line}" if self.rows else ""
            parts.append(f"{len(self.rows)} rows{lines}")
        if self.decimal == ",":
            parts.append("decimal commas")
        if self.passed_over:
            parts.append(f"passed over {_first_of(list(map(repr, self.passed_over)))}")
        if self.skipped:
            parts.append(f"{len(self.skipped)} without numbers left out")
        if self.left_out:
            parts.append(f"left out {_first_of(list(map(shown, self.left_out)))}")
        return f"{self.source}: {'; '.join(parts)}"


def _first_of(texts: Sequence[str]) -> str:
    return ", ".join(texts[:_MOST_SHOWN]) + (" and others" if len(texts) > _MOST_SHOWN else "")


def shown(row: Row) -> str:
    """Return the name of a skipped line in notes."""
    return f"line {row.line}, {row.text[:SHOWN_LABEL]!r}"


class TableReader:
    """A reader that finds tables in rows as they arrive; each begins at the first row of numbers with a header above.

    The header names all quantities of one set in `needed`. Columns that flags select by number need no header. A blank
    row ends a table, unless the table is the only one (`alone`); so does the next header. Raises InputError for invalid
    units, and for rows that cannot belong to their table.
    """

    def __init__(
        self,
        quantities: Mapping[str, Quantity],
        needed: Sequence[Collection[str]],
        example: str,
        *,
        alone: bool = False,
    ) -> None:
        """Store the allowed quantities, and an example of a header for errors."""
        self.quantities = quantities
        self.needed = needed
        self.example = example
        self.alone = alone
        self.words = HeaderWords(quantities)
        self.said = StatedUnits(self.words)
        self._by_number = self.words.columns_by_number(needed)
        self._likeliest: list[tuple[str, Row]] = []  # the row of each source that is most like a header
        self._after: list[Row] = []  # the row that ended a table

    def tables(self, rows: Rows) -> Iterator[FoundTable]:
        """Yield the tables in the rows of one source."""
        feed = iter(rows)
        table = self._next(rows, feed, None)
        while table is not None:
            yield table
            for _ in table.rows:  # rows that the caller did not read
                pass
            table = self._next(rows, feed, table)

    def no_header(self) -> InputError:
        """Return the error for rows without a header, about the row that is most like one."""
        source, header = max(self._likeliest, key=lambda found: self._likeness(found[1]))
        named, labels = self.words.names(header), self._labels(header)
        needed = max(self.needed, key=lambda each: len((named | labels) & set(each)))
        missing = [name for name in needed if name not in named]
        numbers = ",".join(f"{name}={index}" for index, name in enumerate(needed, start=1))
        bound = f"a header that also has {' and '.join(missing)}"
        hint = f"write for instance {self.example}, or name columns by their header or number: --columns {numbers}"
        if labels >= set(needed):
            hint = f"this file has labels in each line: write {self.example} once, and each line without labels"
        elif near := self.words.near(header, missing):
            label, name, tail = near
            return no_unit(place_of(source, header.line, label), self.quantities[name], tail)
        elif not missing:
            self.said.columns(source, header, [], Row(0, ()))  # its units may be invalid
            return validation_error(source, 0, "rows", "at least one row of numbers below the header", "add one")
        return validation_error(place_of(source, header.line), header.text, "", bound, hint)

    def _next(self, rows: Rows, feed: Iterator[Row], last: FoundTable | None) -> FoundTable | None:
        """Return the table after the last one, or None."""
        is_stream = not isinstance(rows, WholeRows)
        most = MOST_BANNER if is_stream else _MOST_TEXTS
        above: list[Row] = []
        at: int | None = None  # index of the header
        left = 0  # number of text rows that may still follow it
        used: Collection[int] = self._by_number  # columns in which numbers begin a table
        are_enough = all if self._by_number else any
        after, self._after = self._after, []
        for row in itertools.chain(after, feed):
            cells = [row.cell(index) for index in used]
            if row.empty:
                above.append(row)
                continue
            if at is None and last is not None and above and above[-1].empty:
                self._refuse_stray_numbers(rows.source, row)
            if not self._by_number and self.words.is_header(row, self.needed):
                at, left, used = len(above), MOST_BELOW, self.words.measured(row)
                rows.keep_delimiter()
            elif cells and are_enough(map(is_number, cells)):
                rows.keep_delimiter()
                return self._opened(rows, above, at, row, feed)
            elif at is not None and not all(map(is_missing, cells)):
                left -= 1
                if left < 0:
                    at, used = None, ()
                    rows.keep_delimiter(keep=False)
            above.append(row)
            if len(above) > most or (is_stream and self._has_labels(row)):
                break
        if at is not None and self.alone and not self._has_labels(above[at]):
            return self._opened(rows, above, at, Row(above[at].line, ()), iter(()))
        self._end(rows.source, above, at, last)
        return None

    def _end(self, source: str, above: list[Row], at: int | None, last: FoundTable | None) -> None:
        """Raise InputError for rows after the last table that state another unit, or begin a table without rows."""
        stated = self.said.hear(source, above[:at])
        if last is None:
            texts = [row for row in above if not row.empty][:MOST_BANNER]
            self._likeliest.append((source, max(texts, key=self._likeness, default=Row(1, ()))))
            return
        if at is not None:
            bound = "a header with rows of numbers below it"
            raise validation_error(
                place_of(source, above[at].line), above[at].text, "", bound, "remove it, or add its rows"
            )
        for column in last.columns:
            column.refuse_other_unit(stated.get(column.name, []))

    def _likeness(self, row: Row) -> int:
        """Return the number of quantities that a row names."""
        return max(len(self.words.names(row)), len(self._labels(row)))

    def _labels(self, row: Row) -> set[str]:
        """Return the quantities whose names precede a number in a row, as in `Force: 1.5 N`."""
        found = _LABELLED.findall(" ".join(row.cells)[: 4 * LONGEST_LABEL])
        return {name for label in found if (name := self.words.named(label[:LONGEST_LABEL])[0])}

    def _has_labels(self, row: Row) -> bool:
        return any(self._labels(row) >= set(names) for names in self.needed)

    @staticmethod
    def _refuse_stray_numbers(source: str, row: Row) -> None:
        """Raise InputError for numbers that a blank line separates from their table."""
        if len(row.cells) > 1 and all(map(is_number, filter(None, row.cells))):
            bound = "a header, or the end of the file, after a blank line"
            hint = "remove the blank line if no row is missing there"
            raise validation_error(place_of(source, row.line), row.text, "", bound, hint)

    def _opened(self, rows: Rows, above: list[Row], at: int | None, first: Row, feed: Iterator[Row]) -> FoundTable:
        """Return the table whose first row of numbers is `first`; its rows are read until the table ends.

        `at` is the index of its header in the lines above, None if it is not found yet.
        """
        if at is None:
            at = self._place_of_header(above, first)
        header = above[at]
        self.said.hear(rows.source, above if self._by_number else above[:at])
        texts = [row for row in above[at + 1 :] if not row.empty]
        used = self.words.measured(header)
        below = [row for row in texts if not all(is_missing(row.cell(index)) for index in used)]
        columns = self.said.columns(rows.source, header, below, first)
        if not self.alone:  # a file of several tables may have optional columns without numbers
            always = set(itertools.chain.from_iterable(self.needed))
            columns = [column for column in columns if column.name in always or _has_number(column.cell(first))]
        # Lines of a serial monitor begin with its clock, which stands for a column of times that is missing.
        times = [name for name, quantity in self.quantities.items() if quantity.by_clock]
        if first.clock and times and not any(column.name in times for column in columns):
            columns.append(Column(index=-1, label="clock", name=times[0], quantity=self.quantities[times[0]], unit="s"))
        table = FoundTable(
            source=rows.source,
            header=header,
            above=above[at - 1] if at and not self._by_number else Row(0, ()),
            columns=columns,
            rows=(),
            skipped=[row for row in texts if row not in below],
        )
        return replace(table, rows=self._body(table, first, feed, by_spaces=rows.are_parted_by_spaces))

    def _place_of_header(self, above: list[Row], first: Row) -> int:
        """Return the index of the header of columns that flags select by number: above their units.

        If no line there is as wide as the first row of numbers, an empty header is inserted.
        """
        at = len(above)
        while at and (above[at - 1].empty or self._are_units(above[at - 1])):
            at -= 1
        if at and len(above[at - 1].cells) >= len(first.cells) and not any(map(is_number, above[at - 1].cells)):
            return at - 1
        above.insert(at, Row(first.line, ("",) * len(first.cells)))
        return at

    def _are_units(self, row: Row) -> bool:
        """Return whether a row has units in the columns that flags select by number."""
        return all(unit_of(quantity, row.cell(index)) for index, quantity in self._by_number.items())

    def _body(self, table: FoundTable, first: Row, feed: Iterator[Row], *, by_spaces: bool) -> Iterator[Row]:
        """Yield the rows of a table that hold numbers; other rows are noted in the table."""
        numbers = [column for column in table.columns if column.is_written]
        has_texts = not all(column.unit for column in table.columns)
        is_first_free = all(column.index for column in table.columns)
        width = len(table.header.cells)
        needed = 1 + max(column.index for column in table.columns)
        least = width if by_spaces else needed if self.alone else 0
        decimals: Counter[int] = Counter()  # number of rows by the decimals of their last cell
        for row in itertools.chain([first], feed):
            if row.empty and self.alone:
                continue
            if row.empty:
                self._after = [row]
                return
            refuse_fault(table.source, row)
            has_none = not has_texts and not any(is_number(column.cell(row)) for column in numbers)
            if has_none and _is_text(row):
                if not self.alone and self.words.is_header(row, self.needed):
                    self._after = [row]
                    return
                self._refuse_other_units(table, row)
                table.left_out.append(row)
            elif (is_first_free and is_statistic(row)) or (row.cut and _is_cut(row, needed, decimals)):
                table.left_out.append(row)
            elif has_none and all(is_missing(column.cell(row)) for column in numbers):
                table.skipped.append(row)
            else:
                if len(row.cells) < least or any(row.cells[width:]):
                    refuse_length(table.source, row, width)
                decimals[_decimals(row)] += 1
                yield row

    def _refuse_other_units(self, table: FoundTable, row: Row) -> None:
        """Raise InputError for a line of text among numbers that states another unit, or is another header."""
        place = place_of(table.source, row.line)
        if self.words.is_header(row, self.needed) and row.cells != table.header.cells:
            bound = f"the header of line {table.header.line}, or left out"
            raise validation_error(place, row.text, "", bound, "give each table a file of its own")
        stated = self.said.hear(table.source, [row])
        for column in table.columns:
            beside = [Said(column.cell(row), place)] if is_unit(column.cell(row)) else []
            column.refuse_other_unit([*stated.get(column.name, []), *beside])


def is_statistic(row: Row) -> bool:
    """Return whether the name of a row is a statistic, as in `Mean,24.1,3.8`."""
    return not row.cells[0][:1].isdecimal() and folded(row.cells[0]) in _STATISTICS


def _is_cut(row: Row, needed: int, decimals: Mapping[int, int]) -> bool:
    """Return whether the last line, which has no line end, lacks cells or digits that all earlier lines have."""
    is_alike = len(decimals) == 1 and sum(decimals.values()) >= _FEWEST_ROWS
    return len(row.cells) < needed or (is_alike and _decimals(row) < min(decimals))


def _decimals(row: Row) -> int:
    """Return the number of characters after the decimal sign in the last cell of a row."""
    sign = max(row.cells[-1].rfind("."), row.cells[-1].rfind(","))
    return len(row.cells[-1]) - 1 - sign if sign >= 0 else 0


def _is_text(row: Row) -> bool:
    """Return whether a row holds only text: no number, and nothing that begins like one."""
    return not all(map(is_missing, row.cells)) and not any(
        _has_number(cell) or (cell[:1] in "+-.,0123456789" and not is_missing(cell)) for cell in row.cells
    )


def _has_number(cell: str) -> bool:
    return is_number(cell) or seconds_of_day(cell) is not None


def refuse_length(source: str, row: Row, columns: int) -> None:
    """Raise InputError for a row with more or fewer cells than columns."""
    if len(row.cells) != columns:
        bound = f"{columns} cells, like its header"
        hint = "separate cells by semicolons if numbers have decimal commas"
        if len(row.cells) < columns:
            hint = "the line may be cut: complete it, or leave it out"
        raise validation_error(place_of(source, row.line), len(row.cells), "cells", bound, hint)


def _refuse_twice(table: FoundTable, example: str) -> None:
    """Raise InputError, with an example of a header, if two columns have one name."""
    seen: set[str] = set()
    for column in table.columns:
        if column.name in seen:
            hint = f"write for instance {example}, or choose one by --columns {column.name}=HEADER"
            raise validation_error(column.place, column.label, "", f"the only column of {column.name}", hint)
        seen.add(column.name)


def one_table(
    rows: Rows, quantities: Mapping[str, Quantity], needed: Sequence[Collection[str]], example: str
) -> FoundTable:
    """Return the only table of a source, whose header names each quantity once and all of one needed set.

    The rows of a sheet are available at once and determine its decimal sign. Raises InputError, with an example of a
    header.
    """
    reader = TableReader(quantities, needed, example, alone=True)
    table = next(reader.tables(rows), None)
    if table is None:
        raise reader.no_header()
    _refuse_twice(table, example)
    return table.limited_to(table.columns, list(table.rows)) if isinstance(rows, WholeRows) else table


def only_table(
    source: Path | str, quantities: Mapping[str, Quantity], needed: Sequence[Collection[str]], example: str
) -> FoundTable:
    """Return the only table of a file like `one_table`; raises InputError also if it has no rows."""
    table = one_table(single_sheet(source), quantities, needed, example)
    if not table.rows and table.left_out:
        (row, *_) = table.left_out
        bound = "a row of numbers like its header"
        raise validation_error(place_of(table.source, row.line), row.text, "", bound, "complete that line")
    if not table.rows:
        raise validation_error(table.source, 0, "rows", "at least one row below the header", "measure the unit")
    return table
