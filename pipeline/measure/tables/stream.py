"""A table that is read as its lines come, from a file or from a board."""

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from pipeline.measure.tables.blocks import MOST_BELOW
from pipeline.measure.tables.columns import (
    Column,
    CsvFormat,
    clock_column,
    columns_below,
    refuse_other_length,
    refuse_twice,
)
from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.headers import HeaderWords, folded, label_parts
from pipeline.measure.tables.measured_table import MOST_BANNER, no_header
from pipeline.measure.tables.numbers import is_number
from pipeline.measure.tables.rows import TableRow, delimiter_of, row_of
from pipeline.measure.tables.units import Quantity
from sensor.quantity import validation_error


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
        refuse_twice(self.form, self.header, self.columns, example)
        names = {column.name: column.label for column in self.columns}
        if not names.keys() >= set(needed):
            bound = f"a header that also has {' and '.join(name for name in needed if name not in names)}"
            text = self.form.delimiter.join(self.header.cells)
            place = place_of(self.form.source, self.header.line)
            raise validation_error(place, text, "", bound, f"write for instance {example}")
        further = [label for name, label in names.items() if name not in needed and name not in others]
        for label in self.header.cells:
            if label and label not in names.values():
                words = [label, *(words for words, _ in label_parts(label))]
                further += [label] if any(re.fullmatch(channel, folded(word)) for word in words) else []
        if further:
            place = place_of(self.form.source, self.header.line, further[0])
            bound = f"one of {', '.join((*others, *needed))}, as this sensor has"
            raise validation_error(place, further[0], "", bound, f"write for instance {example}")


def table_stream(
    lines: Iterable[str], source: str, quantities: Mapping[str, Quantity], needed: Sequence[Sequence[str]], example: str
) -> TableStream:
    """Return the table in lines that come one by one.

    Its header names all quantities of one set in `needed`. Lines that a board prints before it are skipped. Raises
    InputError where no such header comes.
    """
    words = HeaderWords(quantities)
    by_number = next((names for names in needed if words.by_number(names)), None)
    numbered = enumerate(lines, start=1)
    before: list[TableRow] = []
    form = CsvFormat(source=source, delimiter=",")
    for number, text in numbered:
        if len(before) == MOST_BANNER:
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
                    if len(below) == MOST_BELOW or any(map(is_number, words.used_cells(row, first))):
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
    columns, unit_row = columns_below(form, header, words, [*below, *filter(None, [first])], ())
    begin = [row for row in (*below, first) if row is not None and row is not unit_row]
    columns += clock_column(begin[0] if begin else header, words.quantities, columns)

    def rows() -> Iterator[TableRow]:
        for row in itertools.chain(begin, itertools.starmap(form.row, lines)):
            if not row.empty:
                refuse_other_length(form, _without_empty_ends(row, len(header.cells)), len(header.cells))
                yield row

    return TableStream(form=form, header=header, columns=columns, rows=rows())


def _without_empty_ends(row: TableRow, width: int) -> TableRow:
    return row if any(row.cells[width:]) else row._replace(cells=row.cells[:width])
