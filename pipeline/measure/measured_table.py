"""The one reader of measured tables: headers to columns with their unit, cells to numbers.

A header names each column with its unit, as in `force_N`, `Force (kgf)` or `Stroke [mm]`; a row of units may lie below
it, and lines above it may state them. What other columns and lines say is passed over. How bytes become cells is in
`table_text`, the words of headers are in table_words.toml.
"""

import datetime
import functools
import itertools
import math
import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.measure.table_text import (
    WORDS,
    TableRow,
    as_number,
    decimal_sign,
    delimiter_of,
    is_missing,
    is_number,
    place_of,
    refuse_fault,
    row_of,
    single_sheet,
)
from sensor.arrays import Floats
from sensor.quantity import STANDARD_GRAVITY, InputError, nearest, validation_error

_LONGEST_LABEL = 200
_SHOWN_LABEL = 60
_MOST_BELOW = 4  # rows of units or of a second language below a header
_MOST_ABOVE = 200  # rows above a header that may state units
_MOST_LOOKS = 50_000  # for a header: after more lines of text none is found
_MOST_BANNER = 1000  # lines of a stream before its header
_IN_BRACKETS = re.compile(r"([^(\[{<]*)[(\[{<]([^)\]}>]*)[)\]}>]")
_SEPARATOR = re.compile(r"[\s_/,:;-]+")
_CLOCK = re.compile(r"(?:(\d{4})-(\d\d)-(\d\d)[ T])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d{1,9})?)", re.ASCII)
_FILLERS = {"of", "for", "in", "de", "der", "des", "du", "für", "fur", "di", "della", "do", "da", "van"}

FORCE = {
    "N": 1.0,
    "kN": 1e3,
    "mN": 1e-3,
    "cN": 1e-2,
    "daN": 10.0,
    "kgf": STANDARD_GRAVITY,
    "gf": 1e-3 * STANDARD_GRAVITY,
    "lbf": 4.4482216152605,
    "ozf": 4.4482216152605 / 16.0,
    "kg": STANDARD_GRAVITY,
    "g": 1e-3 * STANDARD_GRAVITY,
    "lb": 4.4482216152605,
    "oz": 4.4482216152605 / 16.0,
}
"""Newtons in one unit of force, or in the weight of one unit of mass; the pound-force is exact (NIST SP 811)."""
LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "nm": 1e-6, "in": 25.4, "mil": 25.4e-3, "ft": 304.8}
"""Millimetres in one unit."""
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
"""Seconds in one unit."""
MODULUS = {"MPa": 1.0, "kPa": 1e-3, "GPa": 1e3}
"""Megapascals in one unit."""
_MEASURED = (FORCE, LENGTH, TIME, MODULUS)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What a column may hold: a number in one of some units, or a text where there are none.

    `default` is the unit of a header that gives none; without it a unit must be given. `most` bounds the size of the
    number in the unit whose factor is 1. `words` are other names that headers have for it. `flag_unit` is the unit that
    a flag gives, which a header may leave out and not contradict; `chosen` is the header, or the number of a column
    from 1, that a flag gives.
    """

    units: Mapping[str, float]
    default: str = ""
    most: float = math.inf
    words: tuple[str, ...] = ()
    flag_unit: str = ""
    chosen: str = ""


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
        return f"{self.name} = {self.label[:_SHOWN_LABEL]!r}{unit}"

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
        plain = self.plain(cell)
        if plain is not None:
            value: float | None = float(plain)
        else:
            value = _seconds(cell) if column.unit == "s" else None
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


def _seconds(text: str) -> float | None:
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


class ColumnFlags(NamedTuple):
    """What `--columns NAME=HEADER,...` and `--units NAME=UNIT,...` say; `others` are names of other tables."""

    columns: str | None = None
    units: str | None = None
    others: tuple[str, ...] = ()

    def applied(self, quantities: Mapping[str, Quantity]) -> dict[str, Quantity]:
        """Return quantities with what the flags say of them; raises InputError for another name or unit."""
        flagged = dict(quantities)
        names = (*quantities, *self.others)
        for name, header in _named_values("--columns", self.columns, names):
            if name in flagged:
                flagged[name] = replace(flagged[name], chosen=header)
        for name, unit in _named_values("--units", self.units, names):
            if name in flagged:
                flagged[name] = replace(flagged[name], flag_unit=_needed_unit("--units", flagged[name], unit))
        return flagged


NO_FLAGS = ColumnFlags()


def _named_values(flag: str, text: str | None, names: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield name and value of each part of NAME=VALUE,..., whose values may have commas; raises InputError."""
    if text is None:
        return
    known = "|".join(sorted(map(re.escape, names), key=len, reverse=True))
    start, *parts = re.split(rf"(?:^|,)\s*({known})\s*=", text)
    values = dict(zip(parts[::2], map(str.strip, parts[1::2]), strict=True))
    is_whole = not start and 0 < 2 * len(values) == len(parts) and all(values.values())
    if not is_whole or any(re.search(r",\s*\w+\s*=", value) for value in values.values()):
        bound = f"NAME=TEXT parted by commas, each NAME once and one of {', '.join(names)}"
        raise validation_error(flag, text, "", bound, "write for instance force=Kraft, force=2 or force=kN")
    yield from values.items()


class NamedColumn(NamedTuple):
    """A column that a row names: at which index, from 0, its quantity, and the unit in the label, "" for none."""

    at: int
    name: str
    unit: str


class HeaderWords:
    """What labels say of some quantities."""

    def __init__(self, quantities: Mapping[str, Quantity]) -> None:
        """Take the words of quantities; what a flag chooses has no other words."""
        self.quantities = quantities
        self._names: dict[str, str] = {}
        for name, quantity in quantities.items():
            if not quantity.chosen:
                self._names |= dict.fromkeys(map(_folded, (name, *quantity.words)), name)
        self._joined = {words.replace(" ", ""): name for words, name in self._names.items() if " " in words}
        self._looks = _MOST_LOOKS
        self._read = functools.lru_cache(maxsize=4096)(self._read_label)

    def name_of(self, words: str) -> str:
        """Return the quantity that words mean, "" for none."""
        folded = _folded(words)
        return self._names.get(folded) or self._joined.get(folded, "")

    def columns(self, row: TableRow) -> Iterator[NamedColumn]:
        """Yield the columns that a row names, those that flags choose first."""
        for name, quantity in self.quantities.items():
            for index in _chosen_columns(row.cells, quantity):
                yield NamedColumn(index, name, _unit_behind(row.cells[index], quantity))
        for index, label in enumerate(row.cells):
            if label and len(label) <= _LONGEST_LABEL:
                name, unit, is_known = self._read(label)
                if name and is_known:
                    yield NamedColumn(index, name, unit)

    def names(self, row: TableRow) -> set[str]:
        """Return the quantities that a row names."""
        return {column.name for column in self.columns(row)}

    def is_header(self, row: TableRow, needed: Collection[str]) -> bool:
        """Say whether a row names all that are needed, or any quantity where none is, and no number is among them."""
        if all(cell[:1] in "+-.,0123456789" for cell in row.cells) or self._looks == 0:  # empty cells too
            return False
        self._looks -= 1
        named = list(self.columns(row))
        names = {column.name for column in named}
        is_named = names.issuperset(needed) and bool(names)
        return is_named and not any(is_number(row.cells[column.at]) for column in named)

    def used_cells(self, header: TableRow, row: TableRow) -> list[str]:
        """Return the cells of a row in the columns that hold numbers."""
        return [row.cells[column.at] for column in self.measured(header) if column.at < len(row.cells)]

    def is_open(self, column: NamedColumn) -> bool:
        """Say whether neither the label of a column nor a flag tells its unit."""
        return not column.unit and not self.quantities[column.name].flag_unit

    def measured(self, header: TableRow) -> list[NamedColumn]:
        """Return the columns of numbers that a header names."""
        return [column for column in self.columns(header) if self.quantities[column.name].units]

    def by_number(self, needed: Collection[str]) -> bool:
        """Say whether flags tell all that are needed by the number of their column."""
        return bool(needed) and all(self.quantities[name].chosen.isdecimal() for name in needed)

    def are_numbers(self, row: TableRow) -> bool:
        """Say whether a row has numbers in the columns that flags tell by number."""
        return all(
            0 <= index < len(row.cells) and is_number(row.cells[index]) for index, _ in self._columns_by_number()
        )

    def are_units(self, row: TableRow) -> bool:
        """Say whether a row, at least as long as one of numbers, has units in those columns."""
        return all(unit_of(quantity, row.cells[index]) for index, quantity in self._columns_by_number())

    def _columns_by_number(self) -> Iterator[tuple[int, Quantity]]:
        """Yield index and quantity of each column of numbers that a flag tells by its number."""
        for quantity in self.quantities.values():
            if quantity.units and quantity.chosen.isdecimal():
                yield int(quantity.chosen) - 1, quantity

    def near(self, row: TableRow, names: Collection[str]) -> tuple[str, str, str] | None:
        """Return label, quantity and tail of the first column that begins as a quantity and ends in no unit."""
        for label in row.cells:
            if label and len(label) <= _LONGEST_LABEL:
                name, tail, is_known = self._read(label)
                if name in names and not is_known:
                    return label, name, tail
        return None

    def _read_label(self, label: str) -> tuple[str, str, bool]:
        """Return the quantity and the unit of a label; for a tail that is no unit that tail, and False."""
        if name := self.name_of(label):
            return name, "", True
        near = ("", "", False)
        for words, tail in _split(label):
            name = self.name_of(words)
            if name and self.quantities[name].units:
                if not tail or unit_of(self.quantities[name], tail):
                    return name, tail, True
                near = (name, tail, False)
        return near


def _chosen_columns(labels: Sequence[str], quantity: Quantity) -> list[int]:
    """Return the columns whose label is the header that a flag gives, with its unit or without, or their number."""
    if not quantity.chosen:
        return []
    wanted = _folded(quantity.chosen)
    whole = [index for index, label in enumerate(labels) if label and _folded(label) == wanted]
    if whole:
        return whole
    if quantity.chosen.isdecimal() and 0 < int(quantity.chosen) <= len(labels):
        return [int(quantity.chosen) - 1]
    return [
        index
        for index, label in enumerate(labels)
        if any(_folded(words) == wanted and _is_unit(tail) for words, tail in _split(label))
    ]


def _is_unit(text: str) -> bool:
    return any(unit_of(Quantity(units=units), text) for units in _MEASURED)


def _unit_behind(label: str, quantity: Quantity) -> str:
    """Return the unit in a label that a flag chooses: one of the quantity, or what is surely a unit of another one."""
    if not quantity.units:
        return ""
    tails = [tail for _, tail in _split(label)]
    for tail in tails:
        if unit_of(quantity, tail):
            return tail
    return next((tail for tail in tails if "/" in tail or _is_unit(tail)), "")


def _split(label: str) -> Iterator[tuple[str, str]]:
    """Yield each way to part a label into words and a tail, brackets first, then the longest words."""
    label = unicodedata.normalize("NFKC", label[:_LONGEST_LABEL]).strip(" :;,\t")
    in_brackets = _IN_BRACKETS.fullmatch(label)
    if in_brackets:
        yield in_brackets[1].strip(" _/,:;-"), in_brackets[2].strip()
    separators = list(_SEPARATOR.finditer(label))
    for separator in reversed(separators):
        words, tail = label[: separator.start()], label[separator.end() :]
        if words and tail:
            yield words, re.sub(r"^(in|en|em) ", "", tail)
    last = label.rstrip(")]}>")
    opening = max(map(last.rfind, "([{<"))
    if last != label and opening > 0:
        yield last[:opening].strip(), last[opening + 1 :].strip()


def _folded(words: str) -> str:
    """Return words without case, accents and marks, spaces for underscores and hyphens."""
    letters = unicodedata.normalize("NFKD", words[:_LONGEST_LABEL].replace("\u00df", "ss")).casefold()
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return re.sub(r"[\s_-]+", " ", plain).strip(" .:;,*#\"'")


def _short(text: str) -> str:
    return re.sub(r"[\s_.-]+", "", unicodedata.normalize("NFKC", text)).strip("()[]{}<>:;*'\"")


_SPELLINGS = {
    **{_short(name).casefold(): name for units in _MEASURED for name in units},
    **{_short(word).casefold(): name for name, words in WORDS["units"].items() for word in words},
}
_UNIT_WORDS = set(map(_folded, WORDS["words"]["unit"]))


def unit_of(quantity: Quantity, text: str) -> str:
    """Return the unit of a quantity that a text spells, "" for none; `ms`, `mN` and `MPa` keep their case."""
    short = _short(text[:_LONGEST_LABEL])
    if short in quantity.units:
        return short
    # In another case a symbol may be another unit: Ms is no ms, mPa no MPa. Words as "Newton" have no such case.
    unit = _SPELLINGS.get(short.casefold(), "")
    is_symbol = unit.casefold() == short.casefold()
    is_other = is_symbol and unit in ("m", "ms", "mN") and short[0] == "M"
    is_milli = is_symbol and unit == "MPa" and short.startswith("mP")
    return unit if unit in quantity.units and not is_other and not is_milli else ""


def _needed_unit(place: str, quantity: Quantity, text: str) -> str:
    """Return the unit of a quantity that a text spells; raises InputError that names the place."""
    unit = unit_of(quantity, text)
    if not unit:
        raise _no_unit(place, quantity, text)
    return unit


def _no_unit(place: str, quantity: Quantity, text: str) -> InputError:
    """Return the error of a text that spells no unit of a quantity."""
    hint = f"did you mean {nearest(text, [*quantity.units])}?"
    return validation_error(place, text[:_SHOWN_LABEL], "", f"in one of {', '.join(quantity.units)}", hint)


@dataclass(frozen=True, kw_only=True)
class TableBlock:
    """A table in a source: its header, the row above, its columns, those of numbers and texts, and its rows.

    `skipped` counts rows without a number in a used column.
    """

    header: TableRow
    above: tuple[str, ...]
    columns: list[Column]
    rows: list[TableRow]
    skipped: int = 0

    def understood(self, form: CsvFormat, columns: Sequence[Column], rows: Sequence[TableRow]) -> str:
        """Return in one line what was read of it, for some of its columns and rows."""
        lines = f"{len(rows)} rows, lines {rows[0].line} to {rows[-1].line}" if rows else "no rows"
        used = {column.index for column in self.columns}
        others = [label[:_SHOWN_LABEL] for index, label in enumerate(self.header.cells) if label and index not in used]
        parts = [", ".join(map(str, columns)), lines]
        if form.decimal == ",":
            parts.append("decimal commas")
        if others:
            parts.append(f"passed over {', '.join(map(repr, others[:8]))}{' and others' if len(others) > 8 else ''}")  # noqa: PLR2004
        if self.skipped:
            parts.append(f"{self.skipped} without numbers left out")
        return f"{form.source}: {'; '.join(parts)}"


class _Start(NamedTuple):
    """Where a table begins: its header, the rows of text below it, and how many rows there have no numbers.

    `above` is the index of the row above the header, `first` that of the first row of numbers.
    """

    header: TableRow
    above: int
    below: list[TableRow]
    first: int
    skipped: int


def tables_of(
    form: CsvFormat,
    rows: Sequence[TableRow],
    quantities: Mapping[str, Quantity],
    needed: Collection[str],
    *,
    alone: bool = False,
) -> list[TableBlock]:
    """Return the tables in rows whose header names all of `needed`; a blank row ends one, unless it stands `alone`.

    Raises InputError for units that are none, and for rows that cannot be of the table.
    """
    words = HeaderWords(quantities)
    tables: list[TableBlock] = []
    end = 0
    while (start := _next_start(form, rows, end, words, needed)) is not None:
        end = len(rows) if alone else _end_of(rows, start.first, words, needed)
        above = rows[start.above].cells if start.above >= 0 else ()
        body = [row for row in rows[start.first : end] if not row.empty]
        below = start.below
        stated = rows[max(0, start.above + 1 - _MOST_ABOVE) : start.above + 1]
        columns, unit_row = _columns_below(form, start.header, words, [*below, *body[:1]], stated)
        if alone or not body:  # a text among its first rows is none that may be passed over
            body = [row for row in below if row is not unit_row] + body
        tables.append(
            _block(form, start, above, _readable(columns, body, words, () if alone else needed), body, alone=alone)
        )
    return tables


def _readable(
    columns: list[Column], body: Sequence[TableRow], words: HeaderWords, needed: Collection[str]
) -> list[Column]:
    """Return columns without those that are not needed and hold no numbers; the clock is the time where no other is."""
    first = body[0] if body else TableRow(0, ())
    kept = []
    for column in columns:
        cell = column.cell(first)
        if not needed or column.name in needed or is_number(cell) or _seconds(cell) is not None:
            kept.append(column)
    return kept + _clock_column(first, words.quantities, kept)


def _clock_column(row: TableRow, quantities: Mapping[str, Quantity], columns: Sequence[Column]) -> list[Column]:
    """Return the column of the clock of a serial monitor, where a row has one and no column is a time."""
    times = [name for name, quantity in quantities.items() if quantity.units is TIME]
    if not row.clock or not times or any(column.name in times for column in columns):
        return []
    return [Column(index=-1, label="clock", name=times[0], unit="s", factor=1.0, most=math.inf)]


def _next_start(
    form: CsvFormat, rows: Sequence[TableRow], begin: int, words: HeaderWords, needed: Collection[str]
) -> _Start | None:
    """Return where the next table begins, at or after an index; None where there is none.

    A header counts once numbers follow in its columns, but for a few rows of units or of a second language. Columns
    that flags tell by their number need no header: the first row of numbers there begins the table.
    """
    by_number = words.by_number(needed)
    start: _Start | None = None
    texts: list[TableRow] = []
    for index in range(begin, len(rows)):
        row = rows[index]
        if row.empty:
            continue
        if start is None and begin and rows[index - 1].empty:
            _refuse_stray_numbers(form, row)
        if by_number:
            if words.are_numbers(row):
                header, below = _header_above(row, texts, words)
                return _Start(header, index - len(below) - 2, below, index, 0)
            texts = [] if any(map(is_number, row.cells)) else [*texts[1 - _MOST_BELOW :], row]
        elif words.is_header(row, needed):
            start = _Start(row, index - 1, [], len(rows), 0)
        elif start is not None:
            cells = words.used_cells(start.header, row)
            if any(map(is_number, cells)):
                return start._replace(first=index)
            start = _row_below(start, row, cells)
    return start


def _row_below(start: _Start, row: TableRow, cells: Sequence[str]) -> _Start | None:
    """Return a start with a row of no numbers below its header; None where it is followed by too many."""
    if all(map(is_missing, cells)):
        return start._replace(skipped=start.skipped + 1)
    return start._replace(below=[*start.below, row]) if len(start.below) < _MOST_BELOW else None


def _refuse_stray_numbers(form: CsvFormat, row: TableRow) -> None:
    """Raise InputError for numbers that a blank line parts from their table."""
    if len(row.cells) > 1 and all(map(is_number, filter(None, row.cells))):
        bound = "a header, or the end of the file, after a blank line"
        hint = "take the blank line away if no row is missing there"
        raise validation_error(place_of(form.source, row.line), ",".join(row.cells), "", bound, hint)


def _header_above(row: TableRow, texts: Sequence[TableRow], words: HeaderWords) -> tuple[TableRow, list[TableRow]]:
    """Return the header of numbers whose columns are told by number, and the rows of units below it."""
    below: list[TableRow] = []
    for text in reversed(texts):
        if len(text.cells) < len(row.cells):
            break
        if not words.are_units(text):
            return text, below
        below.insert(0, text)
    return TableRow(row.line, ("",) * len(row.cells)), below


def _end_of(rows: Sequence[TableRow], first: int, words: HeaderWords, needed: Collection[str]) -> int:
    """Return the index of the row that ends a table: a blank one, or the header of the next."""
    for index in range(first, len(rows)):
        row = rows[index]
        if row.empty:
            return index
        if words.is_header(row, needed) and any(
            is_number(cell)
            for after in rows[index + 1 : index + 2 + _MOST_BELOW]
            for cell in words.used_cells(row, after)
        ):
            return index
    return len(rows)


def _columns_below(
    form: CsvFormat,
    header: TableRow,
    words: HeaderWords,
    below: Sequence[TableRow],
    above: Sequence[TableRow],
) -> tuple[list[Column], TableRow | None]:
    """Return the columns of a header by their order, and the row of their units, if there is one.

    `below` are the rows below it, the last of numbers, behind which units may stand.
    """
    named = list(words.columns(header))
    quantities = words.quantities
    unit_row = _unit_row(form, header, words, below)
    stated: dict[str, str] = {}
    if any(quantities[column.name].default and words.is_open(column) for column in named):
        stated = _stated_units(form, words, above)
    columns = []
    for index, name, written in sorted(named):
        quantity = quantities[name]
        label = header.cells[index] or f"{index + 1}"
        if not quantity.units:
            columns.append(Column(index=index, label=label, name=name))
            continue
        place = place_of(form.source, header.line, label)
        in_row = _unit_below(index, unit_row, below)
        told = written or in_row
        # the nearest word counts: in the header, below it, of a flag, above it; else it is assumed
        unit = _needed_unit(place, quantity, told or quantity.flag_unit or stated.get(name, "") or quantity.default)
        if quantity.flag_unit not in ("", unit):
            bound = f"in {quantity.flag_unit}, as a flag says"
            raise validation_error(place, told, "", bound, "leave that flag out")
        if unit_row is not None and in_row and unit_of(quantity, in_row) != unit:
            bound = f"in {unit}, as its header says"
            raise validation_error(
                place_of(form.source, unit_row.line, label), in_row, "", bound, "correct one of them"
            )
        is_assumed = unit != "1" and not told and not quantity.flag_unit and name not in stated
        note = f"the unit of {label[:_SHOWN_LABEL]!r} is not given: {unit} is assumed" if is_assumed else ""
        factor = quantity.units[unit]
        columns.append(
            Column(index=index, label=label, name=name, unit=unit, factor=factor, most=quantity.most, note=note)
        )
    return columns, unit_row


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
            second = next((cell for _, cell in filled if _is_unit(cell)), "")
            if second:
                bound = f"left out below the units of line {unit_row.line}"
                raise validation_error(place, second, "", bound, "write one row of units")
            continue
        has_units = any(unit_of(words.quantities[column.name], cell) for column, cell in filled)
        for column, cell in filled:
            quantity = words.quantities[column.name]
            if (has_units or words.is_open(column)) and not unit_of(quantity, cell):
                raise _no_unit(place, quantity, cell)
        if has_units:
            unit_row = row
    return unit_row


def _stated_units(form: CsvFormat, words: HeaderWords, above: Sequence[TableRow]) -> dict[str, str]:
    """Return by quantity the units that rows above a header state, as in `Force unit: kN` or `Units,N,mm`."""
    stated: dict[str, str] = {}
    for row in above:
        for index, cell in enumerate(row.cells):
            key, _, value = cell[:_LONGEST_LABEL].partition(":")
            parts = _folded(key).split(" ")
            if not any(part in _UNIT_WORDS for part in parts):
                continue
            values = list(filter(None, (value.strip(), *row.cells[index + 1 :])))
            of = " ".join(part for part in parts if part not in _UNIT_WORDS and part not in _FILLERS)
            name = words.name_of(of) if of else ""
            if name and words.quantities[name].units and values:
                stated[name] = _needed_unit(place_of(form.source, row.line), words.quantities[name], values[0])
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


def _block(
    form: CsvFormat, start: _Start, above: tuple[str, ...], columns: list[Column], body: list[TableRow], *, alone: bool
) -> TableBlock:
    """Return a table whose rows are as long as its header."""
    header = start.header
    while body and not alone and _is_footer(body[-1]):
        body.pop()
    width = max(len(header.cells), 1)
    rows = []
    skipped = start.skipped
    for row in body:
        refuse_fault(form.source, row)
        is_short = len(row.cells) < width and (alone or form.delimiter in (" ", "  "))
        if is_short or any(row.cells[width:]):
            refuse_other_length(form, row, width)
        if alone or any(not is_missing(column.cell(row)) for column in columns if column.index >= 0):
            rows.append(row)
        else:
            skipped += 1
    return TableBlock(header=header, above=above, columns=columns, rows=rows, skipped=skipped)


def _is_footer(row: TableRow) -> bool:
    """Say whether a row is one text, as in `End of test`."""
    texts = list(filter(None, row.cells))
    return len(texts) == 1 and not is_number(texts[0]) and texts[0] == row.cells[0]


def refuse_other_length(form: CsvFormat, row: TableRow, columns: int) -> None:
    """Raise InputError for a row of more or fewer cells than there are columns."""
    if len(row.cells) != columns:
        bound = f"{columns} cells, as its header"
        hint = "part cells by semicolons where numbers have decimal commas"
        raise validation_error(place_of(form.source, row.line), len(row.cells), "cells", bound, hint)


def with_decimal_sign(form: CsvFormat, columns: Sequence[Column], rows: Sequence[TableRow]) -> CsvFormat:
    """Return the format with the decimal sign of some columns; raises InputError where it is not clear."""
    used = [column for column in columns if column.factor and column.index >= 0]
    cells = [[(row.line, column.cell(row)) for row in rows] for column in used]
    return replace(form, decimal=decimal_sign(form.source, cells))


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredTable:
    """The columns of a table by the name of their quantity: texts, and numbers [mm, N, MPa or 1], shape (rows,).

    `last_digits` is what one step of the last written digit of each number is worth; `lines` are those of the file.
    `understood` says in one line which columns and rows were read.
    """

    source: str
    lines: tuple[int, ...]
    texts: Mapping[str, tuple[str, ...]]
    numbers: Mapping[str, Floats]
    last_digits: Mapping[str, Floats]
    understood: str = ""


def strict_table(
    form: CsvFormat, rows: Sequence[TableRow], quantities: Mapping[str, Quantity], needed: Sequence[str], example: str
) -> tuple[CsvFormat, TableBlock]:
    """Return the one table of a file with its format; its header names each quantity once, and all of `needed`.

    Raises InputError otherwise, which shows an example of a header.
    """
    tables = tables_of(form, rows, quantities, needed, alone=True)
    if not tables:
        raise no_header(form, rows, quantities, needed, example)
    (table,) = tables
    _refuse_twice(form, table.header, table.columns, example)
    if not table.rows:
        raise validation_error(form.source, 0, "rows", "at least one row below the header", "measure the unit")
    return with_decimal_sign(form, table.columns, table.rows), table


def no_header(
    form: CsvFormat, rows: Sequence[TableRow], quantities: Mapping[str, Quantity], needed: Collection[str], example: str
) -> InputError:
    """Return the error of rows none of which is a header, about the one that is the most like it."""
    words = HeaderWords(quantities)
    filled = [row for row in rows if not row.empty][:_MOST_BANNER]
    header = max(filled, key=lambda row: len(words.names(row)), default=TableRow(1, ()))
    missing = [name for name in needed if name not in words.names(header)]
    near = words.near(header, missing)
    if near is not None:
        label, name, tail = near
        return _no_unit(place_of(form.source, header.line, label), quantities[name], tail)
    text = form.delimiter.join(header.cells)
    numbers = ",".join(f"{name}={index}" for index, name in enumerate(needed, start=1))
    if not missing:
        bound = "a header with rows of numbers below it"
        return validation_error(place_of(form.source, header.line), text, "", bound, "export the table again")
    bound = f"a header that also has {' and '.join(missing)}"
    hint = f"write for instance {example}, or name columns by their header or number: --columns {numbers}"
    return validation_error(place_of(form.source, header.line), text, "", bound, hint)


def _refuse_twice(form: CsvFormat, header: TableRow, columns: Sequence[Column], example: str) -> None:
    seen: set[str] = set()
    for column in columns:
        if column.name in seen:
            place = place_of(form.source, header.line, column.label)
            hint = f"write for instance {example}, or choose one by --columns {column.name}=HEADER"
            raise validation_error(place, column.label, "", f"the only column of {column.name}", hint)
        seen.add(column.name)


def numbers_of(
    form: CsvFormat, rows: Sequence[TableRow], quantities: Mapping[str, Quantity], needed: Sequence[str], example: str
) -> MeasuredTable:
    """Return the rows of a file below their header as numbers and texts.

    Raises InputError as `strict_table` does, and at the first cell that cannot be used.
    """
    form, table = strict_table(form, rows, quantities, needed, example)
    texts = {}
    numbers = {}
    last_digits = {}
    for column in table.columns:
        cells = tuple(column.cell(row) for row in table.rows)
        if not column.factor:
            texts[column.name] = cells
            continue
        numbers[column.name] = np.array([form.number(row, column) for row in table.rows])
        exponents = [Decimal(form.plain(cell) or "0").as_tuple().exponent for cell in cells]
        last_digits[column.name] = column.factor * 10.0 ** np.array(exponents, dtype=np.float64)
    return MeasuredTable(
        source=form.source,
        lines=tuple(row.line for row in table.rows),
        texts=texts,
        numbers=numbers,
        last_digits=last_digits,
        understood=table.understood(form, table.columns, table.rows),
    )


@dataclass(frozen=True, kw_only=True)
class TableStream:
    """A table that is read as its lines come: its format, header, columns, and rows, none of them empty."""

    form: CsvFormat
    header: TableRow
    columns: list[Column]
    rows: Iterator[TableRow]

    @property
    def understood(self) -> str:
        """Return in one line which columns are read."""
        return f"{self.form.source}: {', '.join(map(str, self.columns))}"

    def refuse_unlike(self, needed: Sequence[str], others: Sequence[str], channel: str, example: str) -> None:
        """Raise InputError unless all of `needed` are there, each once, beside `others` and no further channel.

        `channel` is the pattern of what names one.
        """
        _refuse_twice(self.form, self.header, self.columns, example)
        names = {column.name: column.label for column in self.columns}
        if not names.keys() >= set(needed):
            bound = f"a header that also has {' and '.join(name for name in needed if name not in names)}"
            text = self.form.delimiter.join(self.header.cells)
            place = place_of(self.form.source, self.header.line)
            raise validation_error(place, text, "", bound, f"write for instance {example}")
        further = [label for name, label in names.items() if name not in needed and name not in others]
        for label in self.header.cells:
            if label and label not in names.values():
                words = [label, *(words for words, _ in _split(label))]
                further += [label] if any(re.fullmatch(channel, _folded(word)) for word in words) else []
        if further:
            place = place_of(self.form.source, self.header.line, further[0])
            bound = f"one of {', '.join((*others, *needed))}, as this sensor has"
            raise validation_error(place, further[0], "", bound, f"write for instance {example}")


def table_stream(
    lines: Iterable[str], source: str, quantities: Mapping[str, Quantity], needed: Sequence[Sequence[str]], example: str
) -> TableStream:
    """Return the table in lines that come one by one, whose header names one of some sets of quantities.

    What a board says before is passed over. Raises InputError where no such header comes.
    """
    words = HeaderWords(quantities)
    by_number = next((names for names in needed if words.by_number(names)), None)
    numbered = enumerate(lines, start=1)
    before: list[TableRow] = []
    form = CsvFormat(source=source, delimiter=",")
    for number, text in numbered:
        if len(before) == _MOST_BANNER:
            break
        form = CsvFormat(source=source, delimiter=delimiter_of([text]))
        row = row_of(form.delimiter, number, text.lstrip("# "))
        if by_number is not None and words.are_numbers(row):
            header = TableRow(number, ("",) * len(row.cells))
            return _opened(form, header, words, [], row, numbered)
        if by_number is None and any(words.is_header(row, names) for names in needed):
            below: list[TableRow] = []
            for index, line in numbered:
                first = form.row(index, line)
                if not first.empty:
                    if len(below) == _MOST_BELOW or any(map(is_number, words.used_cells(row, first))):
                        return _opened(form, row, words, below, first, numbered)
                    below.append(first)
            return _opened(form, row, words, below, None, numbered)
        if not row.empty:
            before.append(row)
    named = [words.names(row) for row in before]
    likeliest = max(needed, key=lambda names: max((len(row & set(names)) for row in named), default=0))
    raise no_header(form, before, quantities, likeliest, example)


def _opened(
    form: CsvFormat,
    header: TableRow,
    words: HeaderWords,
    below: Sequence[TableRow],
    first: TableRow | None,
    lines: Iterator[tuple[int, str]],
) -> TableStream:
    """Return a stream whose first row of numbers has come, None where the lines have ended."""
    columns, unit_row = _columns_below(form, header, words, [*below, *filter(None, [first])], ())
    begin = [row for row in (*below, first) if row is not None and row is not unit_row]
    columns += _clock_column(begin[0] if begin else header, words.quantities, columns)

    def rows() -> Iterator[TableRow]:
        for row in itertools.chain(begin, itertools.starmap(form.row, lines)):
            if not row.empty:
                refuse_other_length(form, _without_empty_ends(row, len(header.cells)), len(header.cells))
                yield row

    return TableStream(form=form, header=header, columns=columns, rows=rows())


def _without_empty_ends(row: TableRow, width: int) -> TableRow:
    return row if any(row.cells[width:]) else row._replace(cells=row.cells[:width])
