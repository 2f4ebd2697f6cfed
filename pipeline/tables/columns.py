"""The columns of a table with their units: all statements of a file about one column must agree."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import HeaderWords, NamedColumn, folded
from pipeline.tables.number_formats import as_number, is_missing, seconds_of_day
from pipeline.tables.rows import Row
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, TIME, Quantity, is_unit, needed_unit, no_unit, unit_of
from sensor.quantity import validation_error

_UNIT_WORDS = set(map(folded, WORDS["words"]["unit"]))
_FILLERS = set(WORDS["fillers"])
_SYSTEMS = {"", "system", "systems", "measure", "measurement", "measurements"}  # as in `Unit system,Imperial`
_UNIT = r"(?!in\s+\w)([^\W\d_]{1,12}|\u00b5m|\u03bcm)"  # except a preposition, as in `test 3 in air`
_NAMED = re.compile(
    rf"(?<![\w.,:])[+-]?\d[\d.,]*\s?{_UNIT}(?![\w^])"  # beside a number
    rf"|[(\[{{<]\s*{_UNIT}\s*[)\]}}>/]"  # in brackets
)


class Said(NamedTuple):
    """A text that states a unit, and the name of its place for errors."""

    text: str
    place: str


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column by its index, from 0: its header, the name of its quantity, and its unit, "" for a column of texts.

    `note` names an assumed unit, if any. `unit_index` is the column of its units, if there is one. The clock of a
    serial monitor has the index -1. `place` is the name of its header in errors.
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
        """Return the name of the column in answers."""
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        return f"{self.name} = {self.label[:SHOWN_LABEL]!r}{unit}"

    @property
    def factor(self) -> float:
        """Return the value of one unit [mm, N, s, MPa or 1]."""
        return self.quantity.units[self.unit]

    @property
    def is_written(self) -> bool:
        """Return whether it holds numbers in cells."""
        return bool(self.unit) and self.index >= 0

    def cell(self, row: Row) -> str:
        """Return the cell of a row in this column, "" beyond the end of the row."""
        return row.clock if self.index < 0 else row.cell(self.index)

    def refuse_other_unit(self, said: Iterable[Said]) -> None:
        """Raise InputError if a text states another unit of the column than the one used."""
        if self.is_written:
            told_unit(self.quantity, [Said(self.unit, self.place), *said])


class StatedUnits:
    """Statements of text lines about units: some state one, as `Force unit: kN`, and some only mention one.

    A statement holds for all tables below it until another one replaces it.
    """

    def __init__(self, words: HeaderWords) -> None:
        """Begin without statements."""
        self._words = words
        self._stated: dict[str, list[Said]] = {}
        self._others: dict[str, list[Said]] = {}  # mentioned beside a table, and not the default
        self._assumed: dict[str, str] = {}

    def hear(self, source: str, rows: Iterable[Row]) -> Mapping[str, list[Said]]:
        """Record the statements of lines beside a table, and return them by quantity.

        Raises InputError if they contradict an assumed unit.
        """
        stated: dict[str, list[Said]] = {}
        for row in rows:
            for index, cell in enumerate(row.cells):
                for name, text in self._statements(row, index, cell[:LONGEST_LABEL]):
                    stated.setdefault(name, []).append(Said(text, place_of(source, row.line)))
            self.hear_named(source, row)
            for name in self._assumed:
                self._refuse_contradiction(name, [*stated.get(name, []), *self._others.get(name, [])])
        self._stated |= stated
        return stated

    def hear_named(self, source: str, row: Row, used: Collection[int] = ()) -> None:
        """Record the units that unused cells mention: by themselves, beside a number, or in brackets.

        Such a unit is recorded for each quantity with another default. Lines mention times for many reasons, so times
        count only if they are stated.
        """
        for cell in (cell[:LONGEST_LABEL] for index, cell in enumerate(row.cells) if cell and index not in used):
            for text in (cell, *(beside or inside for beside, inside in _NAMED.findall(cell))):
                for name, quantity in self._words.quantities.items():
                    is_other = unit_of(quantity, text) not in ("", quantity.default)
                    if quantity.default and quantity.units is not TIME and is_other:
                        self._others.setdefault(name, []).append(Said(cell, place_of(source, row.line)))

    def columns(self, source: str, header: Row, below: Sequence[Row], first: Row) -> list[Column]:
        """Return the columns that a header names, each with its unit.

        Units may be in the header, in rows below it, beside the first numbers, in lines above, or in a flag. Raises
        InputError if they differ or are invalid, and if the default is assumed while a line mentions another unit.
        """
        named = self._words.columns(header)
        unit_columns = self._unit_columns(header, named, first)
        used = {column.at for column in named} | set(unit_columns.values())
        units = first._replace(cells=tuple(cell if is_unit(cell) else "" for cell in first.cells))
        for row in (header, *below, units):
            self.hear_named(source, row, used)
        quantities = self._words.quantities
        of_units = [row for row in below if any(unit_of(quantities[each.name], row.cell(each.at)) for each in named)]
        columns = []
        for at, name, in_label in named:
            quantity = quantities[name]
            label = header.cell(at) or f"{at + 1}"
            column = Column(
                index=at,
                label=label,
                name=name,
                quantity=quantity,
                unit_index=unit_columns.get(at),
                place=place_of(source, header.line, label),
            )
            if quantity.units:
                said = [Said(text, "--units") for text in [quantity.flag_unit] if text]
                said += [Said(text, column.place) for text in in_label]
                # Below a column without a unit, any text may be an unknown unit.
                rows = of_units if said else below
                said += [Said(row.cell(at), place_of(source, row.line)) for row in rows if not is_missing(row.cell(at))]
                number = as_number(first.cell(at))
                beside = (number.unit if number else "", first.cell(unit_columns.get(at, -1)))
                said += [Said(text, place_of(source, first.line, label)) for text in beside if text]
                said += [each for each in self._stated.get(name, []) if not said or unit_of(quantity, each.text)]
                is_of_day = seconds_of_day(first.cell(at)) is not None
                column = self._with_unit(column, said, is_told=is_of_day)
            columns.append(column)
        return columns

    def _with_unit(self, column: Column, said: Sequence[Said], *, is_told: bool) -> Column:
        """Return a column with its stated unit, or else with the default unit and a note that this is assumed.

        `is_told` states that the numbers themselves show their unit, as a time of day does; then there is no note.
        """
        quantity = column.quantity
        unit = told_unit(quantity, said) or needed_unit(column.place, quantity, quantity.default)
        if said or unit == "1" or is_told:
            return replace(column, unit=unit)
        self._assumed[column.name] = column.place
        systems = [] if quantity.units is TIME else self._stated.get("", [])
        self._refuse_contradiction(column.name, [*self._others.get(column.name, []), *systems])
        return replace(
            column, unit=unit, note=f"the unit of {column.label[:SHOWN_LABEL]!r} is not given: {unit} is assumed"
        )

    def _unit_columns(self, header: Row, named: Sequence[NamedColumn], first: Row) -> dict[int, int]:
        """Return the index of the units' column for each column: one labelled so, or an unlabelled one behind it."""
        taken = {column.at: column.name for column in reversed(named)}
        found: dict[int, int] = {}
        for index in range(max(len(header.cells), len(first.cells))):
            label = header.cell(index)
            words = re.sub(r"[()\[\]]", " ", folded(label[:LONGEST_LABEL])).split()
            others = [word for word in words if re.sub(r"[.\d]+$", "", word) not in _UNIT_WORDS]
            if index in taken or (len(others) == len(words) and (label or not is_unit(first.cell(index)))):
                continue
            name = self._words.quantity_of(" ".join(word for word in others if not word.isdecimal()))
            of = next((at for at in reversed(taken) if taken[at] == name), None) if name else index - 1
            if of in taken:
                found.setdefault(of, index)
        return found

    def _refuse_contradiction(self, name: str, said: Iterable[Said]) -> None:
        """Raise InputError for the first text that contradicts the assumed default of a quantity."""
        quantity = self._words.quantities[name]
        for each in said:
            if unit_of(quantity, each.text) != quantity.default:
                bound = f"in {quantity.default}, or the unit of {name} given in the header of {self._assumed[name]}"
                hint = f"set the unit by --units {name}={quantity.default} or another one"
                raise validation_error(each.place, each.text[:SHOWN_LABEL], "", bound, hint)

    def _statements(self, row: Row, index: int, cell: str) -> Iterator[tuple[str, str]]:
        """Yield quantity ("" for none) and unit of each statement that begins in a cell, as `Force unit: kN`."""
        key, _, value = cell.replace("=", ":").partition(":")
        parts = folded(re.sub(r"[()\[\]]", " ", key)).split(" ")
        if _UNIT_WORDS.isdisjoint(parts):
            return
        values = list(filter(None, (value.strip(), *row.cells[index + 1 :])))
        of = " ".join(part for part in parts if part not in _UNIT_WORDS and part not in _FILLERS)
        name = self._words.quantity_of(of)
        if name:
            if self._words.quantities[name].units and values:
                yield name, values[0]
        elif of in _SYSTEMS:  # as `Units: N, mm`, or `Unit system: Imperial`, which contradicts each assumed unit
            for text in filter(None, re.split(r"[\s,;]+", " ".join(values))):
                names = [each for each, quantity in self._words.quantities.items() if unit_of(quantity, text)]
                yield from ((each, text) for each in names or [""])


def told_unit(quantity: Quantity, said: Iterable[Said]) -> str:
    """Return the unit that all texts state, "" without texts; raises InputError if they differ or are invalid."""
    told: dict[str, Said] = {}
    for each in said:
        unit = unit_of(quantity, each.text)
        if not unit:
            raise no_unit(each.place, quantity, each.text)
        told.setdefault(unit, each)
    if len(told) > 1:
        (unit, first), (_, second), *_ = told.items()
        bound = f"in {unit}, as {first.place} says"
        raise validation_error(second.place, second.text[:SHOWN_LABEL], "", bound, "correct or leave out one of them")
    return next(iter(told), "")
