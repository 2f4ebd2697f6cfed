"""The columns of a table and their units; all statements in a file about the unit of a column must agree."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import HeaderWords, NamedColumn, fold_words
from pipeline.tables.number_formats import as_number, is_missing, seconds_of_day
from pipeline.tables.rows import Row
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, TIME, Quantity, is_unit, needed_unit, no_unit, unit_of
from sensor.quantity import validation_error

_UNIT_WORDS = set(map(fold_words, WORDS["words"]["unit"]))
_FILLERS = set(WORDS["fillers"])
_SYSTEM_WORDS = {"", "system", "systems", "measure", "measurement", "measurements"}  # as in `Unit system,Imperial`
_UNIT = r"(?!in\s+\w)([^\W\d_]{1,12}|\u00b5m|\u03bcm)"  # "in" is not a unit in `test 3 in air`, but a preposition
_MENTION = re.compile(
    rf"(?<![\w.,:])[+-]?\d[\d.,]*\s?{_UNIT}(?![\w^])"  # after a number
    rf"|[(\[{{<]\s*{_UNIT}\s*[)\]}}>/]"  # in brackets
)


class UnitStatement(NamedTuple):
    """A text that states a unit, and its place in the file for error messages."""

    text: str
    place: str


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column: its index, counted from 0, its label in the header, its quantity, and its unit, "" for text.

    `name` is the name of the quantity. If the unit is assumed, `note` is a sentence that states this. `unit_index` is
    the index of the column that holds the units, if there is one. The clock of a serial monitor is a column with the
    index -1. `place` is the name of the header cell in error messages.
    """

    index: int
    label: str
    name: str
    quantity: Quantity
    unit: str = ""
    note: str = ""
    unit_index: int | None = None
    place: str = ""

    def __str__(self) -> str:
        """Return the column as text for summaries, such as `force = 'Load' [N]`."""
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        return f"{self.name} = {self.label[:SHOWN_LABEL]!r}{unit}"

    @property
    def factor(self) -> float:
        """Return the size of the column's unit in mm, N, s, MPa or 1."""
        return self.quantity.units[self.unit]

    @property
    def is_written(self) -> bool:
        """Return whether the column holds numbers in cells, unlike the clock of a serial monitor."""
        return bool(self.unit) and self.index >= 0

    def cell(self, row: Row) -> str:
        """Return the cell of a row in this column, or "" beyond the end of the row."""
        return row.clock if self.index < 0 else row.cell(self.index)

    def refuse_other_unit(self, statements: Iterable[UnitStatement]) -> None:
        """Raise InputError if a statement gives the column a unit other than its own."""
        if self.is_written:
            agreed_unit(self.quantity, [UnitStatement(self.unit, self.place), *statements])


class StatedUnits:
    """The units that lines of text state, as in `Force unit: kN`, or only mention, as in `load cell 5 kN`.

    A statement is valid for all tables below it, until another statement replaces it. A mention never determines a
    unit, but it prevents the reader from assuming another one.
    """

    def __init__(self, words: HeaderWords) -> None:
        """Begin without any statement; `words` determine which quantity a text names."""
        self._words = words
        # The keys of these three mappings are names of quantities. In `_stated`, "" is the key of statements of a
        # system of units.
        self._stated: dict[str, list[UnitStatement]] = {}
        self._mentioned: dict[str, list[UnitStatement]] = {}  # only units that are not the default
        self._assumed: dict[str, str] = {}  # the place of the header of each quantity whose unit is assumed

    def record_statements(self, source: str, rows: Iterable[Row]) -> Mapping[str, list[UnitStatement]]:
        """Record the statements in lines outside a table, and return them, keyed by the name of the quantity.

        `rows` are these lines of the file `source`. Units that the lines only mention are recorded too. Raises
        InputError if a statement or a mention contradicts a unit that has been assumed for a table.
        """
        stated: dict[str, list[UnitStatement]] = {}
        for row in rows:
            for index, cell in enumerate(row.cells):
                for name, text in self._statements_in_cell(row, index, cell[:LONGEST_LABEL]):
                    stated.setdefault(name, []).append(UnitStatement(text, place_of(source, row.line)))
            self.record_mentions(source, row)
            for name in self._assumed:
                self._refuse_contradiction(name, [*stated.get(name, []), *self._mentioned.get(name, [])])
        self._stated |= stated
        return stated

    def record_mentions(self, source: str, row: Row, used: Collection[int] = ()) -> None:
        """Record the units that cells mention: a cell that is only a unit, or a unit after a number or in brackets.

        Cells with the indices `used` belong to the table and are left out. A unit is recorded for each quantity whose
        default is another unit. Units of time are not recorded, because texts mention them for many other reasons.
        """
        place = place_of(source, row.line)
        # the quantities whose default unit a mention may contradict
        quantities = {
            name: quantity
            for name, quantity in self._words.quantities.items()
            if quantity.default and quantity.units is not TIME
        }
        unused_cells = [cell[:LONGEST_LABEL] for index, cell in enumerate(row.cells) if cell and index not in used]
        for cell in unused_cells:
            # One of the two groups of the pattern is empty in each match.
            mentions = [after_number or in_brackets for after_number, in_brackets in _MENTION.findall(cell)]
            for text in (cell, *mentions):
                for name, quantity in quantities.items():
                    if unit_of(quantity, text) not in ("", quantity.default):
                        self._mentioned.setdefault(name, []).append(UnitStatement(cell, place))

    def columns(self, source: str, header: Row, below: Sequence[Row], first: Row) -> list[Column]:
        """Return the columns that a header names, each with its unit.

        `source` is the name of the file in error messages. `below` are the rows of text between the header and the
        `first` row of numbers. Raises InputError if the statements about the unit of a column differ or are invalid, or
        if no unit is stated but a line mentions a unit other than the default.
        """
        named_columns = self._words.columns(header)
        unit_columns = self._unit_columns(header, named_columns, first)
        used = {column.position for column in named_columns} | set(unit_columns.values())
        # In the first row of numbers, only a cell that is just a unit can be a mention.
        row_of_units = first._replace(cells=tuple(cell if is_unit(cell) else "" for cell in first.cells))
        for row in (header, *below, row_of_units):
            self.record_mentions(source, row, used)
        rows_with_units = self._unit_rows(named_columns, below)
        columns = []
        for named_column in named_columns:
            column = self._make_column(source, header, named_column, unit_columns.get(named_column.position))
            if column.quantity.units:  # not a column of text
                statements = self._statements_by_header(column, named_column)
                # If nothing else states a unit, any text below the header is taken for a unit, which may be unknown.
                rows = rows_with_units if statements else below
                statements += self._statements_in_rows(source, column, rows, first)
                statements += self._statements_above(column, is_stated_in_table=bool(statements))
                is_time_of_day = seconds_of_day(column.cell(first)) is not None
                column = self._with_unit(column, statements, is_known=is_time_of_day)
            columns.append(column)
        return columns

    @staticmethod
    def _statements_by_header(column: Column, named_column: NamedColumn) -> list[UnitStatement]:
        """Return the statements of the unit of a column by the flag `--units` and by its label in the header."""
        flag_unit = column.quantity.flag_unit
        statements = [UnitStatement(flag_unit, "--units")] if flag_unit else []
        return statements + [UnitStatement(text, column.place) for text in named_column.units]

    def _unit_rows(self, named_columns: Sequence[NamedColumn], rows: Sequence[Row]) -> list[Row]:
        """Return the rows that state a unit of at least one column."""
        quantities = self._words.quantities
        return [
            row
            for row in rows
            if any(unit_of(quantities[column.name], row.cell(column.position)) for column in named_columns)
        ]

    def _make_column(self, source: str, header: Row, named_column: NamedColumn, unit_index: int | None) -> Column:
        """Return a column that a header names, before its unit is known.

        `unit_index` is the index of the column that holds its units, or None.
        """
        index = named_column.position
        label = header.cell(index) or f"{index + 1}"  # a column without a label is named by its number, from 1
        return Column(
            index=index,
            label=label,
            name=named_column.name,
            quantity=self._words.quantities[named_column.name],
            unit_index=unit_index,
            place=place_of(source, header.line, label),
        )

    def _statements_above(self, column: Column, *, is_stated_in_table: bool) -> list[UnitStatement]:
        """Return the statements about the quantity of a column in lines above its table.

        If the table states a unit itself, a line above it is ignored unless its text is a known unit of the quantity.
        """
        return [
            statement
            for statement in self._stated.get(column.name, [])
            if not is_stated_in_table or unit_of(column.quantity, statement.text)
        ]

    @staticmethod
    def _statements_in_rows(source: str, column: Column, rows: Sequence[Row], first: Row) -> list[UnitStatement]:
        """Return the statements of the unit of a column in the `rows` below the header and the `first` row of numbers.

        In the row of numbers, the unit follows the number or is in the column of units. `source` is the name of the
        file in error messages.
        """
        statements = [
            UnitStatement(column.cell(row), place_of(source, row.line))
            for row in rows
            if not is_missing(column.cell(row))
        ]
        number = as_number(column.cell(first))
        unit_after_number = number.unit if number else ""
        unit_cell = "" if column.unit_index is None else first.cell(column.unit_index)
        place = place_of(source, first.line, column.label)
        return statements + [UnitStatement(text, place) for text in (unit_after_number, unit_cell) if text]

    def _with_unit(self, column: Column, statements: Sequence[UnitStatement], *, is_known: bool) -> Column:
        """Return a column with the unit that all statements give, or else with the default unit of its quantity.

        A note states that the default unit is assumed, unless `is_known` is True because the numbers are times of day.
        Raises InputError if the statements differ, if a mention contradicts the assumption, or if no unit is stated and
        the quantity has no default.
        """
        quantity = column.quantity
        unit = agreed_unit(quantity, statements) or needed_unit(column.place, quantity, quantity.default)
        if statements or unit == "1" or is_known:
            return replace(column, unit=unit)
        self._assumed[column.name] = column.place
        # A system of units such as Imperial contradicts every assumed unit, except units of time.
        systems = [] if quantity.units is TIME else self._stated.get("", [])
        self._refuse_contradiction(column.name, [*self._mentioned.get(column.name, []), *systems])
        return replace(
            column, unit=unit, note=f"the unit of {column.label[:SHOWN_LABEL]!r} is not given: {unit} is assumed"
        )

    def _unit_columns(self, header: Row, named_columns: Sequence[NamedColumn], first: Row) -> dict[int, int]:
        """Return a dict from the index of a numeric column to the index of the column that holds its units.

        The label of a column of units contains a word for "unit". A column without a label holds units if the `first`
        row of numbers has a unit there. A column of units belongs to the column whose quantity its label names, or else
        to the column before it.
        """
        name_by_index: dict[int, str] = {}  # the first quantity of each named column, from left to right
        for column in named_columns:
            name_by_index.setdefault(column.position, column.name)
        unit_columns: dict[int, int] = {}
        for index in range(max(len(header.cells), len(first.cells))):
            label = header.cell(index)
            subject = _subject_of_unit_label(label)
            is_unlabelled_unit = not label and is_unit(first.cell(index))
            if index in name_by_index or (subject is None and not is_unlabelled_unit):
                continue
            name = self._words.quantity_of(subject or "")
            # The owner is the column that has these units. If several columns hold the quantity, the first is the
            # owner.
            owner: int | None = index - 1
            if name:
                owner = next((position for position in name_by_index if name_by_index[position] == name), None)
            if owner in name_by_index:
                unit_columns.setdefault(owner, index)
        return unit_columns

    def _refuse_contradiction(self, name: str, statements: Iterable[UnitStatement]) -> None:
        """Raise InputError for the first statement that differs from the default unit that was assumed for `name`."""
        quantity = self._words.quantities[name]
        for statement in statements:
            if unit_of(quantity, statement.text) != quantity.default:
                bound = f"in {quantity.default}, or the unit of {name} given in the header of {self._assumed[name]}"
                hint = f"state the unit with --units, for example --units {name}={quantity.default}"
                raise validation_error(statement.place, statement.text[:SHOWN_LABEL], "", bound, hint)

    def _statements_in_cell(self, row: Row, index: int, cell: str) -> Iterator[tuple[str, str]]:
        """Yield the quantity and the unit of each statement that begins in a cell, as in `Force unit: kN`.

        `cell` is the beginning of the cell of `row` at `index`. The unit may also be in a cell after it. The quantity
        is "" if the statement names a system of units, as in `Unit system: Imperial`.
        """
        key, _, value = cell.replace("=", ":").partition(":")
        words = fold_words(re.sub(r"[()\[\]]", " ", key)).split(" ")
        if _UNIT_WORDS.isdisjoint(words):
            return
        # The unit is the text after the colon, or else the next cell that is not empty.
        stated_texts = list(filter(None, (value.strip(), *row.cells[index + 1 :])))
        subject = " ".join(word for word in words if word not in _UNIT_WORDS and word not in _FILLERS)
        name = self._words.quantity_of(subject)
        if name:
            if self._words.quantities[name].units and stated_texts:
                yield name, stated_texts[0]
        elif subject in _SYSTEM_WORDS:
            # As in `Units: N, mm`, or in `Unit system: Imperial`, which contradicts every assumed unit.
            for text in filter(None, re.split(r"[\s,;]+", " ".join(stated_texts))):
                names = [name for name, quantity in self._words.quantities.items() if unit_of(quantity, text)]
                yield from ((name, text) for name in names or [""])  # "" if the text is the name of a system


def _subject_of_unit_label(label: str) -> str | None:
    """Return what the label of a column of units describes, such as `force` for the label `Force unit`.

    The result is None if the label has no word for "unit", and "" if the label has only this word and numbers.
    """
    words = re.sub(r"[()\[\]]", " ", fold_words(label[:LONGEST_LABEL])).split()
    # A word with a number, such as `units2` or `unit.1`, is a word for "unit" too.
    other_words = [word for word in words if re.sub(r"[.\d]+$", "", word) not in _UNIT_WORDS]
    if len(other_words) == len(words):
        return None
    return " ".join(word for word in other_words if not word.isdecimal())


def agreed_unit(quantity: Quantity, statements: Iterable[UnitStatement]) -> str:
    """Return the unit on which all statements agree, or "" if there are none.

    Raises InputError for a text that is not a unit of the quantity, and if two statements differ.
    """
    first_by_unit: dict[str, UnitStatement] = {}  # the first statement of each unit
    for statement in statements:
        unit = unit_of(quantity, statement.text)
        if not unit:
            raise no_unit(statement.place, quantity, statement.text)
        first_by_unit.setdefault(unit, statement)
    if len(first_by_unit) > 1:
        (unit, first), (_, second), *_ = first_by_unit.items()
        bound = f"in {unit}, the unit that {first.place} states"
        raise validation_error(second.place, second.text[:SHOWN_LABEL], "", bound, "correct or remove one of them")
    return next(iter(first_by_unit), "")
