"""The only table in a file, as arrays of numbers and tuples of strings."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np

from pipeline.tables.columns import Column
from pipeline.tables.table import FoundTable, only_table
from pipeline.tables.units import Quantity
from sensor.arrays import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredTable:
    """The columns of a table by quantity: `texts` (rows,), and `numbers` (rows,) in mm, N, s, MPa or 1.

    `last_digits` (rows,) is the resolution of each number: the value of one step in its last written digit. `header` is
    the line number of the header in the file, and `lines` are the line numbers of the rows. `passed_over` holds the
    labels of columns that were skipped. `summary` summarises in one line which columns and rows were read.
    """

    source: str
    header: int
    lines: tuple[int, ...]
    texts: Mapping[str, tuple[str, ...]]
    numbers: Mapping[str, Floats]
    last_digits: Mapping[str, Floats]
    passed_over: tuple[str, ...] = ()
    summary: str = ""


def numbers_of(
    source: Path | str, quantities: Mapping[str, Quantity], needed: Sequence[Collection[str]], example: str
) -> MeasuredTable:
    """Read the only table of a file as numbers and texts.

    The columns may hold `quantities`. The header must name all quantities of at least one set in `needed`; messages
    show the header `example`. Raises InputError if the file has no such table or several, and for the first invalid
    cell.
    """
    table = only_table(source, quantities, needed, example)
    rows = list(table.rows)
    texts = {}
    numbers = {}
    last_digits = {}
    for column in table.columns:
        cells = tuple(column.cell(row) for row in rows)
        if not column.unit:  # a column of text
            texts[column.name] = cells
            continue
        numbers[column.name] = np.array([table.number(row, column) for row in rows])
        last_digits[column.name] = _last_digits(table, column, cells)
    return MeasuredTable(
        source=table.source,
        header=table.header.line,
        lines=tuple(row.line for row in rows),
        texts=texts,
        numbers=numbers,
        last_digits=last_digits,
        passed_over=tuple(table.passed_over),
        summary=table.summary,
    )


def _last_digits(table: FoundTable, column: Column, cells: Sequence[str]) -> Floats:
    """Return the value of one step in the last written digit of each cell (rows,), in mm, N, s, MPa or 1.

    It is 0.01 N for the cell `24.10` of a column in N. For a time of day, which is not a plain number, it is 1 s.
    """
    exponents = [Decimal(table.plain(cell) or "0").as_tuple().exponent for cell in cells]
    return np.asarray(column.factor * 10.0 ** np.array(exponents, dtype=np.float64))
