"""The one table of a file as numbers and texts.

The modules beside it lead here: bytes to lines (`files`), lines to cells (`rows`), and cells to numbers (`numbers`).
Headers become quantities (`headers`, `units`), and both become columns (`columns`) and tables (`blocks`).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from pipeline.measure.tables.blocks import TableBlock, tables_of
from pipeline.measure.tables.columns import CsvFormat, refuse_twice, with_decimal_sign
from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.headers import HeaderWords
from pipeline.measure.tables.rows import TableRow
from pipeline.measure.tables.units import Quantity, no_unit
from sensor.arrays import Floats
from sensor.quantity import InputError, validation_error


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
    refuse_twice(form, table.header, table.columns, example)
    if not table.rows:
        raise validation_error(form.source, 0, "rows", "at least one row below the header", "measure the unit")
    return with_decimal_sign(form, table.columns, table.rows), table


MOST_BANNER = 1000  # lines of a stream before its header


def no_header(
    form: CsvFormat, rows: Sequence[TableRow], quantities: Mapping[str, Quantity], needed: Collection[str], example: str
) -> InputError:
    """Return the error of rows none of which is a header, about the one that is the most like it."""
    words = HeaderWords(quantities)
    filled = [row for row in rows if not row.empty][:MOST_BANNER]
    header = max(filled, key=lambda row: len(words.names(row)), default=TableRow(1, ()))
    missing = [name for name in needed if name not in words.names(header)]
    near = words.near(header, missing)
    if near is not None:
        label, name, tail = near
        return no_unit(place_of(form.source, header.line, label), quantities[name], tail)
    text = form.delimiter.join(header.cells)
    numbers = ",".join(f"{name}={index}" for index, name in enumerate(needed, start=1))
    if not missing:
        bound = "a header with rows of numbers below it"
        return validation_error(place_of(form.source, header.line), text, "", bound, "export the table again")
    bound = f"a header that also has {' and '.join(missing)}"
    hint = f"write for instance {example}, or name columns by their header or number: --columns {numbers}"
    return validation_error(place_of(form.source, header.line), text, "", bound, hint)
