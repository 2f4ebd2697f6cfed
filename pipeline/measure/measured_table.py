"""The one reader of measured tables: text to rows, headers to columns with their unit, cells to numbers.

Cells are parted by commas, semicolons or tabs; numbers have a decimal point or a decimal comma. A header names each
column with its unit, as in `force_N`, `Force (kgf)` or `Stroke [mm]`.
"""

import csv
import io
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

from cad.input_file import read_bytes
from cad.quantity import nearest, validation_error, written_number

_LONGEST_LINE = 65536  # bytes of a line of a stream: what is longer is no line of numbers
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+")
_IN_BRACKETS = re.compile(r"(.*?)\s*[(\[\uff08]\s*([^)\]\uff09]*)\s*[)\]\uff09]")  # as wide brackets too
_UNIT_BEHIND = re.compile(r"(.*?)[\s_/,:-]+([^\s_/,:-]+)")

STANDARD_GRAVITY = 9.80665
"""[m/s^2], ISO 80000-3."""
FORCE = {
    **{"N": 1.0, "kN": 1e3, "mN": 1e-3},
    **{"kgf": STANDARD_GRAVITY, "gf": 1e-3 * STANDARD_GRAVITY, "lbf": 4.4482216152605},
    **{"kg": STANDARD_GRAVITY, "g": 1e-3 * STANDARD_GRAVITY, "lb": 4.4482216152605},
}
"""Newtons in one unit of force, or in the weight of one unit of mass; the pound-force is exact (NIST SP 811)."""
LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "in": 25.4}
"""Millimetres in one unit."""
TIME = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
"""Seconds in one unit."""
MODULUS = {"MPa": 1.0, "kPa": 1e-3, "GPa": 1e3}
"""Megapascals in one unit."""
_SPELLINGS = {
    **{"n": "N", "newton": "N", "kn": "kN", "lbs": "lb", "µm": "um", "μm": "um", "inch": "in"},
    **{"sec": "s", "sec.": "s", "second": "s", "seconds": "s", "秒": "s", "msec": "ms", "分": "min", "mpa": "MPa"},
}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What a column may hold: a number in one of some units, or a text where there are none.

    `default` is the unit of a header that gives none; without it a unit must be given. `most` bounds the size of the
    number in the unit whose factor is 1. `words` are other names that headers have for it.
    """

    units: Mapping[str, float]
    default: str = ""
    most: float = math.inf
    words: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class HeaderFlags:
    """What flags say of a header that is not understood: the header and the unit of a quantity, by its name."""

    columns: Mapping[str, str]
    units: Mapping[str, str]


NO_FLAGS = HeaderFlags(columns={}, units={})


class Row(NamedTuple):
    """One line of a file: its number, from 1, and its cells without spaces around them."""

    line: int
    cells: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Say whether no cell holds anything."""
        return not any(self.cells)


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column by its index, from 0: the name of its quantity, and what one of its unit is; 0 for a column of texts."""

    index: int
    label: str
    name: str
    factor: float
    most: float
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class CsvFormat:
    """What parts the cells of a source, which errors name."""

    source: str
    delimiter: str

    def row(self, line: int, text: str) -> Row:
        """Return the cells of a line; raises InputError for a quote that stays open and for a huge cell."""
        try:
            cells = next(csv.reader([text], delimiter=self.delimiter, strict=True), [])
        except csv.Error as error:
            place = f"{self.source}, line {line}"
            raise validation_error(place, text[:40], "", f"cells of a table ({error})", "mend that line") from error
        return Row(line, tuple(cell.strip() for cell in cells))

    def number(self, row: Row, column: Column) -> float:
        """Return the number in a cell [mm, N, s, MPa or 1]; raises InputError that names file, line and column."""
        cell = row.cells[column.index]
        value = written_number(cell.replace(",", "."))
        place = place_of(self.source, row.line, column.label)
        if value is None or not math.isfinite(value):
            bound = "a finite number" if cell else "a number, and the cell is empty"
            raise validation_error(place, cell[:40], "", bound, "correct it, or leave the row out")
        if abs(value * column.factor) > column.most:
            bound = f"at most {column.most / column.factor:g}"
            raise validation_error(place, cell, "", bound, "check the unit of the column")
        return value * column.factor

    def last_digit(self, row: Row, column: Column) -> float:
        """Return what one step of the last written digit of a number is worth [unit of the number]."""
        exponent = Decimal(row.cells[column.index].replace(",", ".")).as_tuple().exponent
        return 10.0 ** int(exponent) * column.factor


def place_of(source: str, line: int, label: str = "") -> str:
    """Return how an error names a place in a file."""
    return f"{source}, line {line}, column {label!r}" if label else f"{source}, line {line}"


def is_number(cell: str) -> bool:
    """Say whether a cell is written as a number, with a decimal point or comma, in digits 0 to 9."""
    return written_number(cell.replace(",", ".")) is not None or _THOUSANDS.fullmatch(cell) is not None


def read_csv(source: Path | str) -> tuple[CsvFormat, list[Row]]:
    """Return the rows of a file, or of the standard input for `-`; raises InputError for what is no table."""
    lines = list(lines_of(source))
    form = format_of(str(source), lines)
    rows = [form.row(number, text) for number, text in enumerate(lines, start=1)]
    if all(row.empty for row in rows):
        bound = "a CSV file with a header and numbers, and it is empty"
        raise validation_error(str(source), "", "", bound, "export the table again")
    _refuse_two_readings(str(source), rows)
    return form, rows


def format_of(source: str, lines: Sequence[str]) -> CsvFormat:
    """Return how cells are parted: by the tab or the semicolon that half the lines have, else by the comma."""
    filled = [line for line in lines if line.strip()]
    for delimiter in ("\t", ";"):
        if filled and 2 * sum(delimiter in line for line in filled) >= len(filled):
            return CsvFormat(source=source, delimiter=delimiter)
    return CsvFormat(source=source, delimiter=",")


def lines_of(source: Path | str) -> Iterator[str]:
    """Yield the lines of a regular file, or of the standard input for `-` as they come; raises InputError."""
    if str(source) == "-":
        yield from _lines_of_stream()
        return
    content = read_bytes(source, "FILE")
    if content.startswith(_UTF_16):
        encodings = ["utf-16"]
    elif b"\0" in content:
        raise validation_error(str(source), "binary", "", "a text file, CSV", "export the table as CSV")
    else:
        # Shift JIS is what Japanese machines write; nearly every file could be it, so its words have to be there.
        japanese = any(word in content.decode("cp932", "ignore") for word in ("試験力", "荷重", "変位", "ストローク"))
        encodings = ["utf-8-sig", "cp932"] if japanese else ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        yield from (line.rstrip("\n") for line in io.StringIO(text, newline=None))
        return
    raise validation_error(str(source), "bytes", "", "text in UTF-8", "save it as UTF-8")


def _lines_of_stream() -> Iterator[str]:
    number = 0
    while raw := sys.stdin.buffer.readline(_LONGEST_LINE):
        number += 1
        try:
            text = raw.decode("utf-8-sig" if number == 1 else "utf-8")
        except UnicodeDecodeError:
            text = "\0"
        if "\0" in text or len(raw) == _LONGEST_LINE:
            raise validation_error(place_of("-", number), "bytes", "", "a line of text in UTF-8", "send CSV")
        yield text.rstrip("\r\n")


def _refuse_two_readings(source: str, rows: Sequence[Row]) -> None:
    """Raise InputError where numbers have two decimal signs, or none has a comma that cannot part thousands."""
    numbers = [(row, cell) for row in rows for cell in row.cells if is_number(cell)]
    commas = [(row, cell) for row, cell in numbers if "," in cell]
    points = [(row, cell) for row, cell in numbers if "." in cell]
    hint = "export it with one decimal sign, a point"
    if commas and points:
        row, cell = points[0]
        bound = "a number with a decimal comma, as others of this file have"
        raise validation_error(place_of(source, row.line), cell, "", bound, hint)
    if commas and all(_THOUSANDS.fullmatch(cell) for _, cell in commas):
        row, cell = commas[0]
        bound = "a number whose comma is surely decimal, and all of this file may part thousands"
        raise validation_error(place_of(source, row.line), cell, "", bound, hint)


def header_flags(columns: str | None, units: str | None, quantities: Mapping[str, Quantity]) -> HeaderFlags:
    """Return what `--columns NAME=HEADER,...` and `--units NAME=UNIT,...` say; raises InputError for another name."""
    given: dict[str, dict[str, str]] = {"--columns": {}, "--units": {}}
    for flag, text in (("--columns", columns), ("--units", units)):
        for part in text.split(",") if text else ():
            name, sign, value = part.partition("=")
            if not sign or name.strip() not in quantities:
                bound = f"NAME=TEXT parted by commas, each NAME one of {', '.join(quantities)}"
                raise validation_error(flag, part, "", bound, "write for instance force=Kraft or force=kN")
            given[flag][name.strip()] = value.strip()
    for name, unit in given["--units"].items():
        given["--units"][name] = unit_of("--units", quantities[name], unit)
    return HeaderFlags(columns=given["--columns"], units=given["--units"])


def columns_of(
    source: str, header: Row, quantities: Mapping[str, Quantity], flags: HeaderFlags = NO_FLAGS
) -> list[Column]:
    """Return the columns of a header that name a quantity, by their order; others are left out.

    Raises InputError for a unit that the quantity does not have, and for one that a flag contradicts.
    """
    columns = []
    for index, label in enumerate(header.cells):
        place = place_of(source, header.line, label)
        name, written = _split_header(label, quantities, flags.columns)
        if name is None:
            continue
        quantity = quantities[name]
        if not quantity.units:
            columns.append(Column(index=index, label=label, name=name, factor=0.0, most=0.0))
            continue
        given = flags.units.get(name, "")
        unit = unit_of(place, quantity, written or given or quantity.default)
        if given and unit != given:
            raise validation_error(place, written, "", f"in {given}, as a flag says", "leave that flag out")
        note = "" if written or given else f"the unit of {label!r} is not given: {unit} is assumed"
        factor = quantity.units[unit]
        columns.append(Column(index=index, label=label, name=name, factor=factor, most=quantity.most, note=note))
    return columns


def only_columns(
    source: str, header: Row, quantities: Mapping[str, Quantity], needed: Sequence[str] = ()
) -> list[Column]:
    """Return the columns of a header all of which name a quantity, each once; raises InputError otherwise."""
    columns = columns_of(source, header, quantities)
    understood = {column.index for column in columns}
    for index, label in enumerate(header.cells):
        if index not in understood:
            names = [f"{name}_{next(iter(quantity.units), '')}".strip("_") for name, quantity in quantities.items()]
            hint = f"did you mean {nearest(label, names)}?"
            raise validation_error(place_of(source, header.line, label), label, "", f"one of {', '.join(names)}", hint)
    names = [column.name for column in columns]
    for column in columns:
        if names.count(column.name) > 1:
            place = place_of(source, header.line, column.label)
            raise validation_error(place, column.label, "", f"the only column of {column.name}", "leave one out")
    for name in needed:
        if name not in names:
            bound = f"columns {', '.join(needed)}, each with its unit"
            raise validation_error(place_of(source, header.line), ", ".join(names), "", bound, f"add a column {name}")
    return columns


def unit_of(place: str, quantity: Quantity, text: str) -> str:
    """Return the unit of a quantity that a text spells; raises InputError that names the place."""
    unit = _SPELLINGS.get(text.lower(), text)
    if unit not in quantity.units:
        hint = f"did you mean {nearest(text, [*quantity.units])}?"
        raise validation_error(place, text, "", f"in one of {', '.join(quantity.units)}", hint)
    return unit


def is_unit(cell: str) -> bool:
    """Say whether a cell is one of the units of force, length or time, as in a row of units under a header."""
    text = cell.strip("()[] ")
    return _SPELLINGS.get(text.lower(), text) in FORCE | LENGTH | TIME


def _split_header(label: str, quantities: Mapping[str, Quantity], columns: Mapping[str, str]) -> tuple[str | None, str]:
    """Return the name of the quantity that a header means, None for none, and the unit that it writes, "" for none."""
    names = {}
    for name, quantity in quantities.items():
        for word in (name, *quantity.words):
            names[_normal(word)] = name
    for name, header in columns.items():
        bracketed = _IN_BRACKETS.fullmatch(header)
        names[_normal(bracketed[1] if bracketed else header)] = name
    bracketed = _IN_BRACKETS.fullmatch(label)
    if bracketed:
        return names.get(_normal(bracketed[1])), bracketed[2].strip()
    behind = _UNIT_BEHIND.fullmatch(label)
    if _normal(label) in names or behind is None:
        return names.get(_normal(label)), ""
    return names.get(_normal(behind[1])), behind[2]


def _normal(words: str) -> str:
    return re.sub(r"[\s_]+", " ", words).strip().lower()


class MeasuredRow(NamedTuple):
    """One row: its line in the file, and its texts and numbers [mm, N, MPa, 1] by the name of their quantity.

    `digits` is what one step of the last written digit of each number is worth.
    """

    line: int
    texts: Mapping[str, str]
    numbers: Mapping[str, float]
    digits: Mapping[str, float]


def read_table(source: Path | str, quantities: Mapping[str, Quantity]) -> list[MeasuredRow]:
    """Return the rows of a file whose first line is its header; raises InputError at the first that cannot be used."""
    form, rows = read_csv(source)
    columns = only_columns(form.source, rows[0], quantities)
    measured = []
    for row in rows[1:]:
        if row.empty:
            continue
        refuse_other_length(form, row, len(columns))
        numbers = [column for column in columns if column.factor]
        measured.append(
            MeasuredRow(
                row.line,
                {column.name: row.cells[column.index] for column in columns if not column.factor},
                {column.name: form.number(row, column) for column in numbers},
                {column.name: form.last_digit(row, column) for column in numbers},
            )
        )
    if not measured:
        raise validation_error(form.source, 0, "rows", "at least one row below the header", "measure the unit")
    return measured


def refuse_other_length(form: CsvFormat, row: Row, columns: int) -> None:
    """Raise InputError for a row of more or fewer cells than there are columns."""
    if len(row.cells) != columns:
        hint = "part cells by semicolons where numbers have decimal commas"
        place = place_of(form.source, row.line)
        raise validation_error(place, len(row.cells), "cells", f"{columns} cells, as its header", hint)


def refuse_missing(source: str, row: MeasuredRow, names: Sequence[str]) -> None:
    """Raise InputError where a table has no column of a quantity."""
    for name in names:
        if name not in row.numbers:
            bound = f"columns {', '.join(names)}, each with its unit"
            raise validation_error(place_of(source, 1), ", ".join(row.numbers), "", bound, f"add a column {name}")
