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
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats
from sensor.input_file import read_bytes
from sensor.quantity import STANDARD_GRAVITY, nearest, validation_error, written_number

_LONGEST_LINE = 65536  # bytes of a line of a stream: what is longer is no line of numbers
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+")
_IN_BRACKETS = re.compile(r"(.*?)\s*[(\[]\s*([^)\]]*)\s*[)\]]")
_UNIT_BEHIND = re.compile(r"(.*?)[\s_/,:-]+([^\s_/,:-]+)")

FORCE = {
    "N": 1.0,
    "kN": 1e3,
    "mN": 1e-3,
    "kgf": STANDARD_GRAVITY,
    "gf": 1e-3 * STANDARD_GRAVITY,
    "lbf": 4.4482216152605,
    "kg": STANDARD_GRAVITY,
    "g": 1e-3 * STANDARD_GRAVITY,
    "lb": 4.4482216152605,
}
"""Newtons in one unit of force, or in the weight of one unit of mass; the pound-force is exact (NIST SP 811)."""
LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "in": 25.4}
"""Millimetres in one unit."""
TIME = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
"""Seconds in one unit."""
MODULUS = {"MPa": 1.0, "kPa": 1e-3, "GPa": 1e3}
"""Megapascals in one unit."""
_SPELLINGS = {
    "n": "N",
    "newton": "N",
    "kn": "kN",
    "lbs": "lb",
    "µm": "um",
    "μm": "um",
    "inch": "in",
    "sec": "s",
    "sec.": "s",
    "second": "s",
    "seconds": "s",
    "msec": "ms",
    "mpa": "MPa",
}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What a column may hold: a number in one of some units, or a text where there are none.

    `default` is the unit of a header that gives none; without it a unit must be given. `most` bounds the size of the
    number in the unit whose factor is 1. `words` are other names that headers have for it. `flag_unit` is the unit that
    a flag gives, which a header may leave out and not contradict.
    """

    units: Mapping[str, float]
    default: str = ""
    most: float = math.inf
    words: tuple[str, ...] = ()
    flag_unit: str = ""


class TableRow(NamedTuple):
    """One line of a file: its number, from 1, and its cells without spaces around them."""

    line: int
    cells: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Say whether no cell holds anything."""
        return not any(self.cells)


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column by its index, from 0: its header, the name of its quantity, and what one of its unit is.

    `factor` is 0 for a column of texts. `note` says which unit was assumed, if any.
    """

    index: int
    label: str
    name: str
    factor: float = 0.0
    most: float = 0.0
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class CsvFormat:
    """What parts the cells of a source, which errors name."""

    source: str
    delimiter: str

    def row(self, line: int, text: str) -> TableRow:
        """Return the cells of a line; raises InputError for a quote that stays open and for a huge cell."""
        try:
            cells = next(csv.reader([text], delimiter=self.delimiter, strict=True), [])
        except csv.Error as error:
            name = place_of(self.source, line)
            raise validation_error(name, text[:40], "", f"cells of a table ({error})", "correct that line") from error
        return TableRow(line, tuple(cell.strip() for cell in cells))

    def number(self, row: TableRow, column: Column) -> float:
        """Return the number in a cell [mm, N, s, MPa or 1]; raises InputError that names file, line and column."""
        cell = row.cells[column.index]
        name = place_of(self.source, row.line, column.label)
        value = written_number(cell.replace(",", "."))
        if value is None or not math.isfinite(value):
            bound = "a finite number" if cell else "a number, and not an empty cell"
            raise validation_error(name, cell[:40], "", bound, "correct it, or leave the row out")
        if abs(value * column.factor) > column.most:
            bound = f"at most {column.most / column.factor:g}"
            raise validation_error(name, cell, "", bound, "check the unit of the column")
        return value * column.factor


def place_of(source: str, line: int, label: str = "") -> str:
    """Return how an error names a place in a file."""
    return f"{source}, line {line}, column {label!r}" if label else f"{source}, line {line}"


def is_number(cell: str) -> bool:
    """Say whether a cell is written as a number, with a decimal point or comma, in digits 0 to 9."""
    return written_number(cell.replace(",", ".")) is not None or _THOUSANDS.fullmatch(cell) is not None


def read_csv(source: Path | str) -> tuple[CsvFormat, list[TableRow]]:
    """Return the rows of a file, or of the standard input for `-`; raises InputError for what is no table."""
    lines = list(lines_of(source))
    form = format_of(str(source), lines)
    rows = [form.row(number, text) for number, text in enumerate(lines, start=1)]
    if all(row.empty for row in rows):
        bound = "a CSV file with a header and numbers, not an empty one"
        raise validation_error(str(source), "", "", bound, "export the table again")
    _refuse_unclear_commas(str(source), rows)
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
    try:
        text = content.decode("utf-16" if content.startswith(_UTF_16) else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    if _is_no_text(text):
        raise validation_error(str(source), "bytes", "", "a text file, CSV", "export the table as CSV in UTF-8")
    yield from (line.rstrip("\n") for line in io.StringIO(text, newline=None))


def _lines_of_stream() -> Iterator[str]:
    encoding = "utf-8-sig"
    number = 0
    while raw := sys.stdin.buffer.readline(_LONGEST_LINE):
        number += 1
        text = raw.decode(encoding, "replace")
        encoding = "utf-8"
        if _is_no_text(text) or len(raw) == _LONGEST_LINE:
            raise validation_error(place_of("-", number), "bytes", "", "a line of text in UTF-8", "send CSV")
        yield text.rstrip("\r\n")


def _is_no_text(text: str) -> bool:
    """Say whether decoded bytes hold a NUL, or what was put in place of bytes that are no letters."""
    return "\0" in text or "\ufffd" in text


def _refuse_unclear_commas(source: str, rows: Sequence[TableRow]) -> None:
    """Raise InputError where numbers have two decimal signs, or none has a comma that cannot part thousands."""
    with_comma = []
    has_points = False
    for row in rows:
        numbers = [cell for cell in row.cells if is_number(cell)]
        with_comma += [(row.line, cell) for cell in numbers if "," in cell]
        has_points = has_points or any("." in cell for cell in numbers)
    if with_comma and (has_points or all(_THOUSANDS.fullmatch(cell) for _, cell in with_comma)):
        line, cell = with_comma[0]
        bound = "a number whose comma is surely decimal: commas may part thousands here"
        raise validation_error(place_of(source, line), cell, "", bound, "export it with decimal points")


def quantities_by_flags(
    quantities: Mapping[str, Quantity], columns: str | None, units: str | None
) -> dict[str, Quantity]:
    """Return quantities with what `--columns NAME=HEADER,...` and `--units NAME=UNIT,...` say of them.

    Raises InputError for another name or unit.
    """
    flagged = dict(quantities)
    for name, header in _named_values("--columns", columns, quantities):
        bracketed = _IN_BRACKETS.fullmatch(header)
        flagged[name] = replace(flagged[name], words=(*flagged[name].words, bracketed[1] if bracketed else header))
    for name, unit in _named_values("--units", units, quantities):
        flagged[name] = replace(flagged[name], flag_unit=_unit_of("--units", flagged[name], unit))
    return flagged


def _named_values(flag: str, text: str | None, names: Mapping[str, Quantity]) -> Iterator[tuple[str, str]]:
    """Yield name and value of each part of NAME=VALUE,...; raises InputError for another name."""
    for part in text.split(",") if text else ():
        name, sign, value = part.partition("=")
        if not sign or name.strip() not in names:
            bound = f"NAME=TEXT parted by commas, each NAME one of {', '.join(names)}"
            raise validation_error(flag, part, "", bound, "write for instance force=Kraft or force=kN")
        yield name.strip(), value.strip()


def columns_of(source: str, header: TableRow, quantities: Mapping[str, Quantity]) -> list[Column]:
    """Return the columns of a header that name a quantity, by their order; others are left out.

    Raises InputError for a unit that the quantity does not have, or that is another than a flag gives.
    """
    names: dict[str, str] = {}
    for name, quantity in quantities.items():
        names |= dict.fromkeys(map(_normal, (name, *quantity.words)), name)
    columns = []
    for index, label in enumerate(header.cells):
        words, written_unit = _split_label(label, names)
        if words not in names:
            continue
        name = names[words]
        quantity = quantities[name]
        if not quantity.units:
            columns.append(Column(index=index, label=label, name=name))
            continue
        place = place_of(source, header.line, label)
        unit = _unit_of(place, quantity, written_unit or quantity.flag_unit or quantity.default)
        if quantity.flag_unit not in ("", unit):
            bound = f"in {quantity.flag_unit}, as a flag says"
            raise validation_error(place, written_unit, "", bound, "leave that flag out")
        is_assumed = unit != "1" and not written_unit and not quantity.flag_unit
        note = f"the unit of {label!r} is not given: {unit} is assumed" if is_assumed else ""
        factor = quantity.units[unit]
        columns.append(Column(index=index, label=label, name=name, factor=factor, most=quantity.most, note=note))
    return columns


def _split_label(label: str, names: Mapping[str, str]) -> tuple[str, str]:
    """Return the words of a header in lower case, and the unit that it writes, "" for none."""
    in_brackets = _IN_BRACKETS.fullmatch(label)
    if in_brackets:
        return _normal(in_brackets[1]), in_brackets[2].strip()
    behind = _UNIT_BEHIND.fullmatch(label)
    if behind is None or _normal(label) in names:
        return _normal(label), ""
    return _normal(behind[1]), behind[2]


def _normal(words: str) -> str:
    return re.sub(r"[\s_]+", " ", words).strip().lower()


def _unit_of(place: str, quantity: Quantity, text: str) -> str:
    """Return the unit of a quantity that a text spells; raises InputError that names the place."""
    unit = _SPELLINGS.get(text.lower(), text)
    if unit not in quantity.units:
        hint = f"did you mean {nearest(text, [*quantity.units])}?"
        raise validation_error(place, text, "", f"in one of {', '.join(quantity.units)}", hint)
    return unit


def strict_columns(
    form: CsvFormat, header: TableRow, quantities: Mapping[str, Quantity], needed: Sequence[str], example: str
) -> list[Column]:
    """Return the columns of a header all of which name a quantity, each once, and none of `needed` missing.

    Raises InputError otherwise, which shows an example of a header.
    """
    columns = {column.index: column for column in columns_of(form.source, header, quantities)}
    left = dict.fromkeys(quantities)
    for index, label in enumerate(header.cells):
        if index not in columns or columns[index].name not in left:
            place = place_of(form.source, header.line, label)
            bound = f"one of {', '.join(left)} with its unit, each once"
            raise validation_error(place, label, "", bound, f"write for instance {example}")
        del left[columns[index].name]
    missing = [name for name in needed if name in left]
    if missing:
        text = form.delimiter.join(header.cells)
        bound = f"a header that also has {' and '.join(missing)}"
        raise validation_error(place_of(form.source, header.line), text, "", bound, f"write for instance {example}")
    return list(columns.values())


def refuse_other_length(form: CsvFormat, row: TableRow, columns: int) -> None:
    """Raise InputError for a row of more or fewer cells than there are columns."""
    if len(row.cells) != columns:
        bound = f"{columns} cells, as its header"
        hint = "part cells by semicolons where numbers have decimal commas"
        raise validation_error(place_of(form.source, row.line), len(row.cells), "cells", bound, hint)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredTable:
    """The columns of a table by the name of their quantity: texts, and numbers [mm, N, MPa or 1], shape (rows,).

    `last_digits` is what one step of the last written digit of each number is worth; `lines` are those of the file.
    """

    source: str
    lines: tuple[int, ...]
    texts: Mapping[str, tuple[str, ...]]
    numbers: Mapping[str, Floats]
    last_digits: Mapping[str, Floats]


def numbers_of(
    form: CsvFormat, rows: Sequence[TableRow], quantities: Mapping[str, Quantity], needed: Sequence[str], example: str
) -> MeasuredTable:
    """Return the rows of a file, the first of which is its header, as numbers and texts.

    Raises InputError as `strict_columns` does, and at the first cell that cannot be used.
    """
    columns = strict_columns(form, rows[0], quantities, needed, example)
    filled = [row for row in rows[1:] if not row.empty]
    if not filled:
        raise validation_error(form.source, 0, "rows", "at least one row below the header", "measure the unit")
    for row in filled:
        refuse_other_length(form, row, len(columns))
    texts = {}
    numbers = {}
    last_digits = {}
    for column in columns:
        cells = tuple(row.cells[column.index] for row in filled)
        if not column.factor:
            texts[column.name] = cells
            continue
        numbers[column.name] = np.array([form.number(row, column) for row in filled])
        exponents = [Decimal(cell.replace(",", ".")).as_tuple().exponent for cell in cells]
        last_digits[column.name] = column.factor * 10.0 ** np.array(exponents, dtype=np.float64)
    return MeasuredTable(
        source=form.source,
        lines=tuple(row.line for row in filled),
        texts=texts,
        numbers=numbers,
        last_digits=last_digits,
    )
