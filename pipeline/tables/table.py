"""From rows to tables: a header that names each quantity with its unit, and the rows of numbers below it.

The rows of a file and those of a board go through the same generator. What other columns and lines say is passed over,
but for units: a unit that is named anywhere is never passed over silently.
"""

import datetime
import itertools
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pipeline.tables.files import place_of
from pipeline.tables.headers import HeaderWords, NamedColumn, folded
from pipeline.tables.numbers import as_number, decimal_sign, is_missing, is_number
from pipeline.tables.rows import Row, Rows, WholeRows, refuse_fault, single_sheet
from pipeline.tables.said_units import Said, SaidUnits, told_unit
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, Quantity, is_unit, needed_unit, no_unit, unit_of
from pipeline.tables.words import WORDS
from sensor.quantity import InputError, validation_error

MOST_BELOW = 4  # rows of units or of a second language below a header
MOST_BANNER = 1000  # lines of a stream before its header
_MOST_SHOWN = 8  # columns or lines in a sentence
_FEWEST_ROWS = 50  # that show that zeros at the end are written: of 50 numbers without them one ends in 0, at 0.995
_CLOCK = re.compile(r"(?:(\d{4})-(\d\d)-(\d\d)[ T])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d{1,9})?)", re.ASCII)
_UNIT_WORDS = set(map(folded, WORDS["words"]["unit"]))
_STATISTICS = set(map(folded, WORDS["results"]["rows"]))
_LABELLED = re.compile(
    r"([^\W\d][^:=,;|]{0,60}?)\s*[:=]\s*[+-]?[0-9][0-9.]*(?:\s?[^\W\d_]{1,4}(?=[\s,;|]))?"  # as in Force: 1.5 N
)


def seconds_of_day(text: str) -> float | None:
    """Return the seconds of a time of day, with its date or without; None for other text."""
    match = _CLOCK.fullmatch(text)
    if match is None:
        return None
    year, month, day, hour, minute, second = match.groups()
    days = 0
    if year:
        try:
            days = datetime.date(int(year), int(month), int(day)).toordinal()
        except ValueError:
            return None
    return 86400.0 * days + 3600.0 * int(hour) + 60.0 * int(minute) + float(second.replace(",", "."))


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column by its index, from 0: its header, the name of its quantity, its unit and what one of that is.

    `factor` is 0 for a column of texts. `note` says which unit was assumed, if any. `unit_index` is the column of its
    units, if there is one. The index of the clock of a serial monitor is -1.
    """

    index: int
    label: str
    name: str
    unit: str = ""
    factor: float = 0.0
    most: float = 0.0
    note: str = ""
    unit_index: int | None = None

    def __str__(self) -> str:
        """Return how an answer names it."""
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        return f"{self.name} = {self.label[:SHOWN_LABEL]!r}{unit}"

    def cell(self, row: Row) -> str:
        """Return the cell of a row in this column, "" if the row ends before it."""
        return row.clock if self.index < 0 else row.cell(self.index)


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundTable:
    """A table in a source: its header, the row above, its columns, and its rows, none of them empty.

    The rows of a board come one by one, and each number shows its own decimal sign. `left_out` has the lines without
    numbers and of statistics that were passed over until now, and `skipped` those whose cells say that they hold none.
    """

    source: str
    header: Row
    above: Row
    columns: list[Column]
    quantities: Mapping[str, Quantity]
    rows: Iterable[Row]
    decimal: str = ""
    left_out: list[Row] = field(default_factory=list)
    skipped: list[Row] = field(default_factory=list)

    def place(self, line: int, column: Column) -> str:
        """Return how an error names a cell."""
        return place_of(self.source, line, column.label)

    def limited_to(self, columns: Sequence[Column], rows: Sequence[Row]) -> "FoundTable":
        """Return the table of some columns and rows, whose decimal sign they show; raises InputError if they do not."""
        cells = [
            [(row.line, column.cell(row)) for row in rows] for column in columns if column.factor and column.index >= 0
        ]
        return replace(self, columns=list(columns), rows=rows, decimal=decimal_sign(self.source, cells))

    def plain(self, cell: str) -> str | None:
        """Return a number as Python writes it; None for other text, and if its sign may part thousands."""
        number = as_number(cell)
        if number is None or (number.unclear and not self.decimal and "," in number.text):
            return None
        return number.plain(self.decimal or number.decimal or ".")

    def number(self, row: Row, column: Column) -> float:
        """Return the number in a cell [mm, N, s, MPa or 1]; raises InputError that names file, line and column."""
        cell = column.cell(row)
        plain = self.plain(cell)
        value = float(plain) if plain is not None else seconds_of_day(cell) if column.unit == "s" else None
        if value is None or not math.isfinite(value):
            bound = "a finite number" if cell else "a number, and not an empty cell"
            if value is None and is_number(cell):
                bound = "a number whose comma is surely decimal: commas may part thousands here"
            place = self.place(row.line, column)
            raise validation_error(place, cell[:40], "", bound, "correct it, or leave the row out")
        written = as_number(cell)
        units = [written.unit if written else "", "" if column.unit_index is None else row.cell(column.unit_index)]
        for unit in filter(None, units):
            if unit_of(self.quantities[column.name], unit) != column.unit:
                bound = f"in {column.unit}, like its column"
                place = self.place(row.line, column)
                raise validation_error(
                    place, unit if unit != units[0] else cell, "", bound, "write one unit in a column"
                )
        if abs(value * column.factor) > column.most:
            bound = f"at most {column.most / column.factor:g}"
            raise validation_error(self.place(row.line, column), cell, "", bound, "check the unit of the column")
        return value * column.factor

    @property
    def passed_over(self) -> list[str]:
        """Return the labels of the other columns."""
        used = {column.index for column in self.columns} | {column.unit_index for column in self.columns}
        return [label[:SHOWN_LABEL] for index, label in enumerate(self.header.cells) if label and index not in used]

    @property
    def understood(self) -> str:
        """Return in one line what was read: columns, and the lines of rows that are at hand."""
        parts = [", ".join(map(str, self.columns))]
        if isinstance(self.rows, Sequence):
            lines = f", lines {self.rows[0].line} to {self.rows[-1].line}" if self.rows else ""
            parts.append(f"{len(self.rows)} rows{lines}")
        if self.decimal == ",":
            parts.append("decimal commas")
        if others := self.passed_over:
            more = " and others" if len(others) > _MOST_SHOWN else ""
            parts.append(f"passed over {', '.join(map(repr, others[:_MOST_SHOWN]))}{more}")
        if self.skipped:
            parts.append(f"{len(self.skipped)} without numbers left out")
        if self.left_out:
            more = " and others" if len(self.left_out) > _MOST_SHOWN else ""
            parts.append(f"left out {', '.join(map(shown, self.left_out[:_MOST_SHOWN]))}{more}")
        return f"{self.source}: {'; '.join(parts)}"


def shown(row: Row) -> str:
    """Return how a note names a line that is left out."""
    return f"line {row.line}, {row.text[:SHOWN_LABEL]!r}"


@dataclass(frozen=True, kw_only=True)
class _Start:
    """A header, the row above it, the rows of text below it, and those there that say that they hold no numbers."""

    header: Row
    above: Row
    below: tuple[Row, ...] = ()
    skipped: tuple[Row, ...] = ()


class TableReader:
    """Finds tables in rows as they come; each begins at a header and the first numbers below its columns.

    The header names all quantities of one set in `needed`. Columns that flags tell by their number need no header. A
    blank row ends a table, unless the table stands `alone`; so does the next header. Raises InputError for units that
    are none, and for rows that cannot be of their table.
    """

    def __init__(
        self,
        quantities: Mapping[str, Quantity],
        needed: Sequence[Collection[str]],
        example: str,
        *,
        alone: bool = False,
    ) -> None:
        """Take what the columns may hold, and an example of a header for errors."""
        self.quantities = quantities
        self.needed = needed
        self.example = example
        self.alone = alone
        self.words = HeaderWords(quantities)
        self.units = SaidUnits(self.words)
        self._by_number = self.words.by_number(needed)
        self._likeliest: tuple[int, str, Row] = (-1, "", Row(1, ()))
        self._looks = MOST_BANNER
        self._after: list[Row] = []  # the row that ended a table
        self._found = 0

    def tables(self, rows: Rows) -> Iterator[FoundTable]:
        """Yield the tables in the rows of one source."""
        feed = iter(rows)
        self._found = 0
        if not self._likeliest[1]:
            self._likeliest = (-1, rows.source, Row(1, ()))
        last: FoundTable | None = None
        begin = self._next_by_number if self._by_number else self._next_by_header
        while (table := begin(rows, feed)) is not None:
            self._found += 1
            yield table
            for _ in table.rows:  # what its reader has left
                pass
            self.units.begin_block()
            last = table
        if last is not None:
            for column in last.columns:
                self._refuse_other_unit(last, column, self.units.stated_since(column.name))

    def no_header(self) -> InputError:
        """Return the error of rows none of which is a header, about the one that is the most like it."""
        _, source, header = self._likeliest
        place = place_of(source, header.line)
        said = self.words.names(header) | self._labels(header)
        needed = max(self.needed, key=lambda each: len(said & set(each)))
        missing = [name for name in needed if name not in self.words.names(header)]
        if self._labels(header) >= set(needed):
            bound = "a header, and below it rows of numbers only"
            hint = f"this file has labels in each line: write {self.example} once, and each line without labels"
            return validation_error(place, " ".join(header.cells), "", bound, hint)
        near = self.words.near(header, missing)
        if near is not None:
            label, name, tail = near
            return no_unit(place_of(source, header.line, label), self.quantities[name], tail)
        if not missing:
            self._columns(source, header, [], Row(0, ()))  # whose units may be none
            return validation_error(source, 0, "rows", "at least one row of numbers below the header", "add one")
        numbers = ",".join(f"{name}={index}" for index, name in enumerate(needed, start=1))
        bound = f"a header that also has {' and '.join(missing)}"
        hint = f"write for instance {self.example}, or name columns by their header or number: --columns {numbers}"
        return validation_error(place, header.text, "", bound, hint)

    def _next_by_number(self, rows: Rows, feed: Iterator[Row]) -> FoundTable | None:
        """Return the next table in the columns that flags tell by number; None if there is none."""
        texts: list[Row] = []
        for row, before in self._filled(rows, feed):
            if before.line and before.empty and self._found:
                self._refuse_stray_numbers(rows.source, row)
            if self.words.are_numbers(row):
                rows.keep_delimiter()
                return self._opened(rows, self._start_above(row, texts), row, feed)
            texts = [] if any(map(is_number, row.cells)) else [*texts[1 - MOST_BELOW :], row]
            self.units.hear(rows.source, row)
        return None

    def _next_by_header(self, rows: Rows, feed: Iterator[Row]) -> FoundTable | None:
        """Return the next table below a header; None if there is none."""
        source = rows.source
        start: _Start | None = None
        for row, before in self._filled(rows, feed):
            if start is None and before.line and before.empty and self._found:
                self._refuse_stray_numbers(source, row)
            if self.words.is_header(row, self.needed):
                self._hear_former(source, start)
                rows.keep_delimiter()
                start = _Start(header=row, above=before)
            elif start is None:
                self.units.hear(source, row)
            elif any(map(is_number, self.words.used_cells(start.header, row))):
                return self._opened(rows, start, row, feed)
            else:
                start = self._with_row_below(rows, start, row)
        if start is not None and self.alone and not self._has_labels(start.header):
            return self._opened(rows, start, Row(start.header.line, ()), iter(()))
        if start is not None and self._found:
            place = place_of(source, start.header.line)
            bound = "a header with rows of numbers below it"
            raise validation_error(place, start.header.text, "", bound, "take it away, or add its rows")
        return None

    def _with_row_below(self, rows: Rows, start: _Start, row: Row) -> _Start | None:
        """Return a start with a row of no numbers below its header; None if too many texts follow it."""
        if all(map(is_missing, self.words.used_cells(start.header, row))):
            return replace(start, skipped=(*start.skipped, row))
        if len(start.below) < MOST_BELOW:
            return replace(start, below=(*start.below, row))
        self._hear_former(rows.source, start)
        rows.keep_delimiter(keep=False)
        return None

    def _filled(self, rows: Rows, feed: Iterator[Row]) -> Iterator[tuple[Row, Row]]:
        """Yield each row that is not empty, and the row before it; of a stream that says nothing, only the first ones.

        They begin with the row that ended the last table.
        """
        before = Row(0, ())
        after, self._after = self._after, []
        for count, row in enumerate(itertools.chain(after, feed)):
            if not row.empty:
                self._look(rows.source, row)
                if not isinstance(rows, WholeRows) and (count > MOST_BANNER or self._has_labels(row)):
                    return
                yield row, before
            before = row

    def _look(self, source: str, row: Row) -> None:
        """Keep the row that is the most like a header, for an error."""
        if self._looks:
            self._looks -= 1
            names = max(len(self.words.names(row)), len(self._labels(row)))
            if names > self._likeliest[0]:
                self._likeliest = (names, source, row)

    def _labels(self, row: Row) -> set[str]:
        """Return the quantities whose names stand in a row with a number behind them, as in `Force: 1.5 N`."""
        found = _LABELLED.findall(" ".join(row.cells)[: 4 * LONGEST_LABEL])
        return {name for label in found if (name := self.words.said_by(label))}

    def _has_labels(self, row: Row) -> bool:
        return any(self._labels(row) >= set(names) for names in self.needed)

    def _hear_former(self, source: str, start: _Start | None) -> None:
        """Take what is said of units by rows that seemed to begin a table."""
        if start is not None:
            for row in (start.header, *start.below):
                self.units.hear(source, row)

    @staticmethod
    def _refuse_stray_numbers(source: str, row: Row) -> None:
        """Raise InputError for numbers that a blank line parts from their table."""
        if len(row.cells) > 1 and all(map(is_number, filter(None, row.cells))):
            bound = "a header, or the end of the file, after a blank line"
            hint = "take the blank line away if no row is missing there"
            raise validation_error(place_of(source, row.line), row.text, "", bound, hint)

    def _start_above(self, row: Row, texts: Sequence[Row]) -> _Start:
        """Return the header of numbers whose columns are told by number, and the rows of units below it."""
        below: list[Row] = []
        for text in reversed(texts):
            if len(text.cells) < len(row.cells):
                break
            if not self.words.are_units(text):
                return _Start(header=text, above=Row(0, ()), below=tuple(below))
            below.insert(0, text)
        return _Start(header=Row(row.line, ("",) * len(row.cells)), above=Row(0, ()), below=tuple(below))

    def _opened(self, rows: Rows, start: _Start, first: Row, feed: Iterator[Row]) -> FoundTable:
        """Return a table whose first row of numbers has come."""
        columns = self._columns(rows.source, start.header, start.below, first)
        if not self.alone:
            always = set(itertools.chain.from_iterable(self.needed))
            columns = [column for column in columns if column.name in always or _has_number(column.cell(first))]
        times = [name for name, quantity in self.quantities.items() if quantity.by_clock]
        if first.clock and times and not any(column.name in times for column in columns):
            columns.append(Column(index=-1, label="clock", name=times[0], unit="s", factor=1.0, most=math.inf))
        table = FoundTable(
            source=rows.source,
            header=start.header,
            above=start.above,
            columns=columns,
            quantities=self.quantities,
            rows=(),
            skipped=list(start.skipped),
        )
        return replace(table, rows=self._body(table, first, feed, by_spaces=rows.are_parted_by_spaces))

    def _columns(self, source: str, header: Row, below: Sequence[Row], first: Row) -> list[Column]:
        """Return the columns that a header names, each with its unit; raises InputError for what is said otherwise."""
        named = self.words.columns(header)
        unit_columns = self._unit_columns(header, named, first)
        used = {column.at for column in named} | set(unit_columns.values())
        self.units.hear_labels(source, header, used)
        for row in below:
            self.units.hear_labels(source, row, used)
        self.units.hear_cells(source, first, used)
        columns = []
        for column in named:
            quantity = self.quantities[column.name]
            label = header.cells[column.at] or f"{column.at + 1}"
            if not quantity.units:
                columns.append(Column(index=column.at, label=label, name=column.name))
                continue
            place = place_of(source, header.line, label)
            said = [Said(text, "--units") for text in [quantity.flag_unit] if text]
            said += [Said(text, place) for text in column.units]
            said += self._said_below(source, column, named, below, is_open=not said)
            unit_index = unit_columns.get(column.at)
            number = as_number(first.cell(column.at))
            beside = [number.unit if number else "", "" if unit_index is None else first.cell(unit_index)]
            said += [Said(text, place_of(source, first.line, label)) for text in beside if text]
            said += [each for each in self.units.stated(column.name) if not said or unit_of(quantity, each.text)]
            unit = told_unit(quantity, said) or needed_unit(place, quantity, quantity.default)
            note = ""
            if not said and unit != "1" and seconds_of_day(first.cell(column.at)) is None:
                self.units.assume(place, column.name)
                note = f"the unit of {label[:SHOWN_LABEL]!r} is not given: {unit} is assumed"
            columns.append(
                Column(
                    index=column.at,
                    label=label,
                    name=column.name,
                    unit=unit,
                    factor=quantity.units[unit],
                    most=quantity.most,
                    note=note,
                    unit_index=unit_index,
                )
            )
        return columns

    def _unit_columns(self, header: Row, named: Sequence[NamedColumn], first: Row) -> dict[int, int]:
        """Return by the index of a column that of its units: one that says so, or one without a label behind it."""
        taken = {column.at for column in named}
        found: dict[int, int] = {}
        for index in range(max(len(header.cells), len(first.cells))):
            label = header.cell(index)
            words = re.sub(r"[()\[\]]", " ", folded(label[:LONGEST_LABEL])).split()
            said = [word for word in words if re.sub(r"[.\d]+$", "", word) in _UNIT_WORDS]
            if index in taken or not (said or (not label and is_unit(first.cell(index)))):
                continue
            others = " ".join(word for word in words if word not in said and not word.isdecimal())
            name = self.words.quantity_of(others) if others else ""
            of = [column.at for column in named if column.name == name] if name else [index - 1]
            if of and (name or of[0] in taken):
                found.setdefault(of[0], index)
        return found

    def _said_below(
        self, source: str, column: NamedColumn, named: Sequence[NamedColumn], below: Sequence[Row], *, is_open: bool
    ) -> list[Said]:
        """Return what rows below a header say of the unit of a column.

        A row in which any cell is a unit of its column has units in all. Below a column without a unit any text may be
        a unit that is not known.
        """
        said = []
        for row in below:
            cell = row.cell(column.at)
            is_of_units = any(unit_of(self.quantities[each.name], row.cell(each.at)) for each in named)
            if (is_open or is_of_units) and not is_missing(cell):
                said.append(Said(cell, place_of(source, row.line)))
        return said

    def _body(self, table: FoundTable, first: Row, feed: Iterator[Row], *, by_spaces: bool) -> Iterator[Row]:
        """Yield the rows of a table that hold numbers; those that do not are noted in the table."""
        numbers = [column for column in table.columns if column.factor and column.index >= 0]
        has_texts = any(not column.factor for column in table.columns)
        is_first_free = all(column.index for column in table.columns)
        ends = _LastCells()
        for row in itertools.chain([first], feed):
            if row.empty and self.alone:
                continue
            if row.empty:
                self._after = [row]
                return
            refuse_fault(table.source, row)
            has_number = any(is_number(column.cell(row)) for column in numbers)
            if not has_number and not has_texts and _is_text(row):
                if self.words.is_header(row, self.needed) and not self.alone:
                    self._after = [row]
                    return
                self._refuse_other_units(table, row)
                table.left_out.append(row)
            elif (is_first_free and is_statistic(row)) or (row.cut and self._is_cut(table, row, ends)):
                table.left_out.append(row)
            elif not has_number and not has_texts and all(is_missing(column.cell(row)) for column in numbers):
                table.skipped.append(row)
            else:
                self._refuse_other_length(table, row, by_spaces=by_spaces)
                ends.add(row)
                yield row

    def _refuse_other_units(self, table: FoundTable, row: Row) -> None:
        """Raise InputError for a line of text among numbers that says another unit, or is another header."""
        place = place_of(table.source, row.line)
        if self.words.is_header(row, self.needed) and row.cells != table.header.cells:
            bound = f"the header of line {table.header.line}, or left out"
            raise validation_error(place, row.text, "", bound, "give each table a file of its own")
        self.units.hear(table.source, row)
        for column in table.columns:
            beside = [Said(column.cell(row), place)] if is_unit(column.cell(row)) else []
            self._refuse_other_unit(table, column, [*self.units.stated(column.name), *beside])

    @staticmethod
    def _refuse_other_unit(table: FoundTable, column: Column, said: Sequence[Said]) -> None:
        """Raise InputError if another unit is said of a column than it was read in."""
        if column.factor and column.index >= 0:
            first = Said(column.unit, table.place(table.header.line, column))
            told_unit(table.quantities[column.name], [first, *said])

    @staticmethod
    def _is_cut(table: FoundTable, row: Row, ends: "_LastCells") -> bool:
        """Return whether the last line, which has no end, lacks cells or digits that the lines before it have."""
        return len(row.cells) <= max(column.index for column in table.columns) or ends.are_longer(row)

    def _refuse_other_length(self, table: FoundTable, row: Row, *, by_spaces: bool) -> None:
        """Raise InputError for a row of more or fewer cells than there are columns."""
        width = len(table.header.cells)
        least = max(column.index for column in table.columns) + 1
        if any(row.cells[width:]):
            refuse_length(table.source, row, width)
        if len(row.cells) < width if by_spaces else self.alone and len(row.cells) < least:
            refuse_length(table.source, row, width)


def is_statistic(row: Row) -> bool:
    """Return whether a row is named as one of statistics, as `Mean,24.1,3.8`."""
    return not row.cells[0][:1].isdecimal() and folded(row.cells[0]) in _STATISTICS


class _LastCells:
    """How the last cells of rows are written: with so many decimals each, or not alike."""

    def __init__(self) -> None:
        """Begin with no row."""
        self._count = 0
        self._decimals: set[int] = set()

    def add(self, row: Row) -> None:
        """Take a row."""
        self._count += 1
        self._decimals.add(_decimals(row))

    def are_longer(self, row: Row) -> bool:
        """Return whether all rows have more decimals in their last cell than a row has."""
        return self._count >= _FEWEST_ROWS and len(self._decimals) == 1 and _decimals(row) < min(self._decimals)


def _decimals(row: Row) -> int:
    """Return how many letters stand behind the decimal sign of the last cell of a row."""
    cell = row.cells[-1]
    return len(cell) - 1 - max(cell.rfind("."), cell.rfind(",")) if re.search(r"[.,]", cell) else 0


def _is_text(row: Row) -> bool:
    """Return whether a row holds text only: no number, nor what begins like one."""
    return not all(map(is_missing, row.cells)) and not any(
        _has_number(cell) or (cell[:1] in "+-.,0123456789" and not is_missing(cell)) for cell in row.cells
    )


def _has_number(cell: str) -> bool:
    return is_number(cell) or seconds_of_day(cell) is not None


def refuse_length(source: str, row: Row, columns: int) -> None:
    """Raise InputError for a row of more or fewer cells than there are columns."""
    if len(row.cells) != columns:
        bound = f"{columns} cells, like its header"
        hint = "part cells by semicolons if numbers have decimal commas"
        if len(row.cells) < columns:
            hint = "the line may be cut: complete it, or leave it out"
        raise validation_error(place_of(source, row.line), len(row.cells), "cells", bound, hint)


def refuse_twice(table: FoundTable, example: str) -> None:
    """Raise InputError if two columns have one name; it shows an example of a header."""
    seen: set[str] = set()
    for column in table.columns:
        if column.name in seen:
            place = table.place(table.header.line, column)
            hint = f"write for instance {example}, or choose one by --columns {column.name}=HEADER"
            raise validation_error(place, column.label, "", f"the only column of {column.name}", hint)
        seen.add(column.name)


def only_table(
    source: Path | str, quantities: Mapping[str, Quantity], needed: Sequence[Collection[str]], example: str
) -> FoundTable:
    """Return the one table of a file, whose header names each quantity once and all of one set that is needed.

    Raises InputError otherwise, which shows an example of a header.
    """
    reader = TableReader(quantities, needed, example, alone=True)
    sheet = single_sheet(source)
    table = next(reader.tables(sheet), None)
    if table is None:
        raise reader.no_header()
    refuse_twice(table, example)
    rows = list(table.rows)
    if not rows and table.left_out:
        (row, *_) = table.left_out
        bound = "a row of numbers like its header"
        raise validation_error(place_of(table.source, row.line), row.text, "", bound, "complete that line")
    if not rows:
        raise validation_error(table.source, 0, "rows", "at least one row below the header", "measure the unit")
    return table.limited_to(table.columns, rows)
