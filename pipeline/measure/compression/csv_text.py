"""The text of a machine's CSV file as rows of cells, and a cell as a number; what reads two ways is refused."""

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import InputError, validation_error

_ENCODINGS = ("utf-8-sig", "cp932")
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_LARGEST_BYTES = 200_000_000
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+$")
_EXPORT = "export the test as CSV again"


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of a file: its number, from 1, and its cells without spaces around them."""

    line: int
    cells: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Say whether no cell holds anything."""
        return not any(self.cells)


@dataclass(frozen=True, kw_only=True)
class CsvText:
    """A file as rows; `decimal_comma` says that its numbers have a comma where others have a point."""

    name: str
    rows: tuple[Row, ...]
    delimiter: str
    decimal_comma: bool


def read_csv_text(path: Path) -> CsvText:
    """Return the rows of a file; raises InputError for one that cannot be read, is empty or is no text."""
    text = _decoded(path)
    if not text.strip():
        raise validation_error(str(path), "", "", "a CSV file with a header and numbers, and it is empty", _EXPORT)
    delimiter = _delimiter(text)
    try:
        lines = list(csv.reader(text.splitlines(), delimiter=delimiter))
    except csv.Error as error:
        raise validation_error(str(path), str(error), "", "a CSV file", _EXPORT) from error
    rows = tuple(
        Row(line=number, cells=tuple(cell.strip() for cell in cells)) for number, cells in enumerate(lines, start=1)
    )
    return CsvText(name=str(path), rows=rows, delimiter=delimiter, decimal_comma=_has_decimal_comma(str(path), rows))


def is_number(cell: str) -> bool:
    """Say whether a cell is written as a number, with a point or a comma."""
    return bool(_NUMBER.match(cell.replace(",", "."))) or bool(_THOUSANDS.match(cell))


def number(text: CsvText, row: Row, column: str, cell: str) -> float:
    """Return the number in a cell [unit of its column]; raises InputError that names file, line and column."""
    place = f"{text.name}, line {row.line}, column {column!r}"
    if not cell:
        raise validation_error(
            place, cell, "", "a number, and the cell is empty", "fill it in, or leave the whole row out"
        )
    plain = cell.replace(",", ".") if text.decimal_comma else cell
    value = float(plain) if _NUMBER.match(plain) else math.nan
    if not math.isfinite(value):
        raise validation_error(place, cell, "", "a finite number", "correct it, or leave the row out")
    return value


def _decoded(path: Path) -> str:
    try:
        if not path.is_file():
            raise validation_error("FILE", str(path), "", "an existing CSV file", "check its name")
        if path.stat().st_size > _LARGEST_BYTES:
            raise validation_error(
                str(path), path.stat().st_size, "bytes", f"at most {_LARGEST_BYTES}", "split it by specimens"
            )
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise validation_error(
            "FILE", str(path), "", f"a file that can be read ({reason})", "check its permissions"
        ) from error
    encodings = ("utf-16",) if content.startswith(_UTF_16) else _ENCODINGS
    if len(encodings) > 1 and b"\0" in content:
        raise validation_error(str(path), "binary", "", "a text file, CSV", _EXPORT)
    for encoding in encodings:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise validation_error(str(path), "bytes", "", "text in UTF-8, UTF-16 or Shift JIS (cp932)", "save it as UTF-8")


def _delimiter(text: str) -> str:
    """Return what stands between cells: a tab or a semicolon where lines have them, else a comma."""
    lines = [line for line in text.splitlines() if line.strip()]
    for mark in ("\t", ";"):
        if 2 * sum(mark in line for line in lines) >= len(lines):
            return mark
    return ","


def _has_decimal_comma(name: str, rows: tuple[Row, ...]) -> bool:
    """Say whether numbers have a decimal comma; raises InputError where a comma may also part thousands."""
    cells = [(row, cell) for row in rows for cell in row.cells if is_number(cell)]
    commas = [(row, cell) for row, cell in cells if "," in cell]
    if not commas:
        return False
    for row, cell in cells:
        if "." in cell:
            bound = "numbers with one decimal sign, and others of this file have a comma"
            place = f"{name}, line {row.line}"
            raise validation_error(place, cell, "", bound, "export it with one decimal sign")
    if all(_THOUSANDS.match(cell) for _, cell in commas):
        row, cell = commas[0]
        bound = "a number whose comma is surely decimal, and all of this file may part thousands"
        place = f"{name}, line {row.line}"
        raise validation_error(place, cell, "", bound, "export it with a decimal point")
    return True
