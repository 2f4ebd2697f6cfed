"""Where the tables of a file begin and end, and which of its rows they have.

A header names each column with its unit, as in `force_N`, `Force (kgf)` or `Stroke [mm]`. A row of units may lie below
it, and lines above it may state them. What other columns and lines say is passed over.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from pipeline.measure.tables.columns import (
    Column,
    CsvFormat,
    clock_column,
    columns_below,
    refuse_other_length,
    seconds_of_day,
)
from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.headers import HeaderWords
from pipeline.measure.tables.numbers import is_missing, is_number
from pipeline.measure.tables.rows import TableRow, refuse_fault
from pipeline.measure.tables.units import SHOWN_LABEL, Quantity
from sensor.quantity import validation_error

MOST_BELOW = 4  # rows of units or of a second language below a header
_MOST_ABOVE = 200  # rows above a header that may state units


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
        others = [label[:SHOWN_LABEL] for index, label in enumerate(self.header.cells) if label and index not in used]
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
        columns, unit_row = columns_below(form, start.header, words, [*below, *body[:1]], stated)
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
        if not needed or column.name in needed or is_number(cell) or seconds_of_day(cell) is not None:
            kept.append(column)
    return kept + clock_column(first, words.quantities, kept)


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
            texts = [] if any(map(is_number, row.cells)) else [*texts[1 - MOST_BELOW :], row]
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
    return start._replace(below=[*start.below, row]) if len(start.below) < MOST_BELOW else None


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
            for after in rows[index + 1 : index + 2 + MOST_BELOW]
            for cell in words.used_cells(row, after)
        ):
            return index
    return len(rows)


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
