"""The columns of a table: each with the unit of its header, of a row below or above it, or of a flag."""

import datetime
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.headers import HeaderWords, folded
from pipeline.measure.tables.numbers import as_number, decimal_sign, is_missing, is_number
from pipeline.measure.tables.rows import TableRow, refuse_fault, row_of, single_sheet
from pipeline.measure.tables.units import (
    LONGEST_LABEL,
    SHOWN_LABEL,
    Quantity,
    is_unit,
    needed_unit,
    no_unit,
    unit_of,
)
from pipeline.measure.tables.words import WORDS
from sensor.quantity import validation_error

_CLOCK = re.compile(r"(?:(\d{4})-(\d\d)-(\d\d)[ T])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d{1,9})?)", re.ASCII)
_FILLERS = set(WORDS["fillers"])
_UNIT_WORDS = set(map(folded, WORDS["words"]["unit"]))


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column by its index, from 0: its header, the name of its quantity, its unit and what one of that is.

    `factor` is 0 for a column of texts. `note` says which unit was assumed, if any. The index of the clock of a serial
    monitor is -1.
    """

    index: int
    label: str
    name: str
    unit: str = ""
    factor: float = 0.0
    most: float = 0.0
    note: str = ""

    def __str__(self) -> str:
        """Return how an answer names it."""
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        return f"{self.name} = {self.label[:SHOWN_LABEL]!r}{unit}"

    def cell(self, row: TableRow) -> str:
        """Return the cell of a row in this column, "" where the row ends before it."""
        if self.index < 0:
            return row.clock
        return row.cells[self.index] if self.index < len(row.cells) else ""


@dataclass(frozen=True, kw_only=True)
class CsvFormat:
    """What parts the cells of a source, which errors name, and its decimal sign, "" where each number tells it."""

    source: str
    delimiter: str
    decimal: str = ""

    def row(self, line: int, text: str) -> TableRow:
        """Return the cells of a line; raises InputError for a quote that stays open and for a huge cell."""
        row = row_of(self.delimiter, line, text)
        refuse_fault(self.source, row)
        return row

    def plain(self, cell: str) -> str | None:
        """Return a number as Python writes it; None for other text, and where its sign may part thousands."""
        number = as_number(cell)
        if number is None or (number.unclear and not self.decimal and "," in number.text):
            return None
        return number.plain(self.decimal or number.decimal or ".")

    def number(self, row: TableRow, column: Column) -> float:
        """Return the number in a cell [mm, N, s, MPa or 1]; raises InputError that names file, line and column."""
        cell = column.cell(row)
        name = place_of(self.source, row.line, column.label)
        value = self._value(cell, column)
        if value is None or not math.isfinite(value):
            bound = "a finite number" if cell else "a number, and not an empty cell"
            if value is None and is_number(cell):
                bound = "a number whose comma is surely decimal: commas may part thousands here"
            raise validation_error(name, cell[:40], "", bound, "correct it, or leave the row out")
        number = as_number(cell)
        if number is not None and number.unit not in ("", column.unit):
            raise validation_error(name, cell, "", f"in {column.unit}, as its column", "write one unit in a column")
        if abs(value * column.factor) > column.most:
            bound = f"at most {column.most / column.factor:g}"
            raise validation_error(name, cell, "", bound, "check the unit of the column")
        return value * column.factor

    def _value(self, cell: str, column: Column) -> float | None:
        """Return the number in a cell, or the seconds of a time of day; None for other text."""
        plain = self.plain(cell)
        if plain is not None:
            return float(plain)
        return seconds_of_day(cell) if column.unit == "s" else None


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


def read_csv(source: Path | str) -> tuple[CsvFormat, list[TableRow]]:
    """Return the rows of a file, or of the standard input for `-`; raises InputError for what is no table."""
    name, delimiter, rows = single_sheet(source)
    return CsvFormat(source=name, delimiter=delimiter), rows


def with_decimal_sign(form: CsvFormat, columns: Sequence[Column], rows: Sequence[TableRow]) -> CsvFormat:
    """Return the format with the decimal sign of some columns; raises InputError where it is not clear."""
    used = [column for column in columns if column.factor and column.index >= 0]
    cells = [[(row.line, column.cell(row)) for row in rows] for column in used]
    return replace(form, decimal=decimal_sign(form.source, cells))


def columns_below(
    form: CsvFormat,
    header: TableRow,
    words: HeaderWords,
    below: Sequence[TableRow],
    above: Sequence[TableRow],
) -> tuple[list[Column], TableRow | None]:
    """Return the columns of a header by their order, and the row of their units, if there is one.

    `below` are the rows below it, the last of numbers, behind which units may stand.
    """
    named = sorted(words.columns(header))
    unit_row = _unit_row(form, header, words, below)
    stated: dict[str, str] = {}
    if any(words.quantities[column.name].default and words.is_open(column) for column in named):
        stated = _stated_units(form, words, above)
    columns = []
    for column in named:
        quantity = words.quantities[column.name]
        label = header.cells[column.at] or f"{column.at + 1}"
        if not quantity.units:
            columns.append(Column(index=column.at, label=label, name=column.name))
            continue
        told = _ToldUnits(
            in_header=column.unit,
            in_row=_unit_below(column.at, unit_row, below),
            by_flag=quantity.flag_unit,
            above=stated.get(column.name, ""),
        )
        unit = told.unit(quantity, form.source, label, header, unit_row)
        columns.append(
            Column(
                index=column.at,
                label=label,
                name=column.name,
                unit=unit,
                factor=quantity.units[unit],
                most=quantity.most,
                note=told.note(label, unit),
            )
        )
    return columns, unit_row


class _ToldUnits(NamedTuple):
    """What is said of the unit of a column, each "" where nothing is: the nearest word counts, from the first on."""

    in_header: str
    in_row: str
    by_flag: str
    above: str

    def unit(self, quantity: Quantity, source: str, label: str, header: TableRow, unit_row: TableRow | None) -> str:
        """Return the unit, the default one where none is told; raises InputError for words that contradict it."""
        place = place_of(source, header.line, label)
        beside = self.in_header or self.in_row
        unit = needed_unit(place, quantity, beside or self.by_flag or self.above or quantity.default)
        if self.by_flag not in ("", unit):
            raise validation_error(place, beside, "", f"in {self.by_flag}, as a flag says", "leave that flag out")
        if unit_row is not None and self.in_row and unit_of(quantity, self.in_row) != unit:
            place = place_of(source, unit_row.line, label)
            raise validation_error(place, self.in_row, "", f"in {unit}, as its header says", "correct one of them")
        return unit

    def note(self, label: str, unit: str) -> str:
        """Return what an answer says of a unit that is assumed, "" for one that is told."""
        return (
            "" if any(self) or unit == "1" else f"the unit of {label[:SHOWN_LABEL]!r} is not given: {unit} is assumed"
        )


def _unit_below(index: int, unit_row: TableRow | None, below: Sequence[TableRow]) -> str:
    """Return what a row of units says of a column, else the unit behind its first number, else ""."""
    if unit_row is not None and index < len(unit_row.cells) and not is_missing(unit_row.cells[index]):
        return unit_row.cells[index]
    number = as_number(below[-1].cells[index]) if below and index < len(below[-1].cells) else None
    return "" if number is None else number.unit


def _unit_row(form: CsvFormat, header: TableRow, words: HeaderWords, below: Sequence[TableRow]) -> TableRow | None:
    """Return the row of units below a header, None where there is none.

    Raises InputError where some of its cells are units and others none, and for a second row with units. A text below
    a column whose unit is open is refused too: it may be a unit that is not known.
    """
    unit_row: TableRow | None = None
    for row in below:
        if any(map(is_number, row.cells)):
            continue
        place = place_of(form.source, row.line)
        filled = [
            (column, row.cells[column.at])
            for column in words.measured(header)
            if column.at < len(row.cells) and not is_missing(row.cells[column.at])
        ]
        if unit_row is not None:
            second = next((cell for _, cell in filled if is_unit(cell)), "")
            if second:
                bound = f"left out below the units of line {unit_row.line}"
                raise validation_error(place, second, "", bound, "write one row of units")
            continue
        has_units = any(unit_of(words.quantities[column.name], cell) for column, cell in filled)
        for column, cell in filled:
            quantity = words.quantities[column.name]
            if (has_units or words.is_open(column)) and not unit_of(quantity, cell):
                raise no_unit(place, quantity, cell)
        if has_units:
            unit_row = row
    return unit_row


def _stated_units(form: CsvFormat, words: HeaderWords, above: Sequence[TableRow]) -> dict[str, str]:
    """Return by quantity the units that rows above a header state, as in `Force unit: kN` or `Units,N,mm`."""
    stated: dict[str, str] = {}
    for row in above:
        for index, cell in enumerate(row.cells):
            key, _, value = cell[:LONGEST_LABEL].partition(":")
            parts = folded(key).split(" ")
            if not any(part in _UNIT_WORDS for part in parts):
                continue
            values = list(filter(None, (value.strip(), *row.cells[index + 1 :])))
            of = " ".join(part for part in parts if part not in _UNIT_WORDS and part not in _FILLERS)
            name = words.name_of(of) if of else ""
            if name and words.quantities[name].units and values:
                stated[name] = needed_unit(place_of(form.source, row.line), words.quantities[name], values[0])
            elif not of:
                stated |= _units_of_all(
                    form, words, row, [part for text in values for part in re.split(r"[\s,;]+", text)]
                )
    return stated


def _units_of_all(form: CsvFormat, words: HeaderWords, row: TableRow, texts: Sequence[str]) -> dict[str, str]:
    """Return by quantity the units in texts, each that of all quantities that have it; raises InputError."""
    stated: dict[str, str] = {}
    for text in filter(None, texts):
        names = [name for name, quantity in words.quantities.items() if unit_of(quantity, text)]
        if not names:
            bound = "units of the columns, each named at its column"
            raise validation_error(
                place_of(form.source, row.line), text, "", bound, "say them by --units force=N,travel=mm"
            )
        stated |= dict.fromkeys(names, text)
    return stated


def clock_column(row: TableRow, quantities: Mapping[str, Quantity], columns: Sequence[Column]) -> list[Column]:
    """Return the column of the clock of a serial monitor, where a row has one and no column is a time."""
    times = [name for name, quantity in quantities.items() if quantity.by_clock]
    if not row.clock or not times or any(column.name in times for column in columns):
        return []
    return [Column(index=-1, label="clock", name=times[0], unit="s", factor=1.0, most=math.inf)]


def refuse_other_length(form: CsvFormat, row: TableRow, columns: int) -> None:
    """Raise InputError for a row of more or fewer cells than there are columns."""
    if len(row.cells) != columns:
        bound = f"{columns} cells, as its header"
        hint = "part cells by semicolons where numbers have decimal commas"
        raise validation_error(place_of(form.source, row.line), len(row.cells), "cells", bound, hint)


def refuse_twice(form: CsvFormat, header: TableRow, columns: Sequence[Column], example: str) -> None:
    """Raise InputError where two columns have one name; it shows an example of a header."""
    seen: set[str] = set()
    for column in columns:
        if column.name in seen:
            place = place_of(form.source, header.line, column.label)
            hint = f"write for instance {example}, or choose one by --columns {column.name}=HEADER"
            raise validation_error(place, column.label, "", f"the only column of {column.name}", hint)
        seen.add(column.name)
