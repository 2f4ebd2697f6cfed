"""What headers name: a quantity for each column with its unit, by known words or by what flags choose."""

import functools
import re
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from pipeline.measure.tables.numbers import is_number
from pipeline.measure.tables.rows import TableRow
from pipeline.measure.tables.units import LONGEST_LABEL, Quantity, is_unit, needed_unit, unit_of
from sensor.quantity import validation_error

_MOST_LOOKS = 50_000  # for a header: after more lines of text none is found
_IN_BRACKETS = re.compile(r"([^(\[{<]*)[(\[{<]([^)\]}>]*)[)\]}>]")
_SEPARATOR = re.compile(r"[\s_/,:;-]+")


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
                flagged[name] = replace(flagged[name], flag_unit=needed_unit("--units", flagged[name], unit))
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
                self._names |= dict.fromkeys(map(folded, (name, *quantity.words)), name)
        self._joined = {words.replace(" ", ""): name for words, name in self._names.items() if " " in words}
        self._looks = _MOST_LOOKS
        self._read = functools.lru_cache(maxsize=4096)(self._read_label)

    def name_of(self, words: str) -> str:
        """Return the quantity that words mean, "" for none."""
        plain = folded(words)
        return self._names.get(plain) or self._joined.get(plain, "")

    def columns(self, row: TableRow) -> Iterator[NamedColumn]:
        """Yield the columns that a row names, those that flags choose first."""
        for name, quantity in self.quantities.items():
            for index in _chosen_columns(row.cells, quantity):
                yield NamedColumn(index, name, _unit_behind(row.cells[index], quantity))
        for index, label in enumerate(row.cells):
            if label and len(label) <= LONGEST_LABEL:
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
            if label and len(label) <= LONGEST_LABEL:
                name, tail, is_known = self._read(label)
                if name in names and not is_known:
                    return label, name, tail
        return None

    def _read_label(self, label: str) -> tuple[str, str, bool]:
        """Return the quantity and the unit of a label, and True; if its end is no unit, that end and False."""
        if name := self.name_of(label):
            return name, "", True
        near = ("", "", False)
        for words, tail in label_parts(label):
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
    wanted = folded(quantity.chosen)
    whole = [index for index, label in enumerate(labels) if label and folded(label) == wanted]
    if whole:
        return whole
    if quantity.chosen.isdecimal() and 0 < int(quantity.chosen) <= len(labels):
        return [int(quantity.chosen) - 1]
    return [
        index
        for index, label in enumerate(labels)
        if any(folded(words) == wanted and is_unit(tail) for words, tail in label_parts(label))
    ]


def _unit_behind(label: str, quantity: Quantity) -> str:
    """Return the unit in a label that a flag chooses: one of the quantity, or what is surely a unit of another one."""
    if not quantity.units:
        return ""
    tails = [tail for _, tail in label_parts(label)]
    for tail in tails:
        if unit_of(quantity, tail):
            return tail
    return next((tail for tail in tails if "/" in tail or is_unit(tail)), "")


def label_parts(label: str) -> Iterator[tuple[str, str]]:
    """Yield each way to part a label into words and a tail, brackets first, then the longest words."""
    label = unicodedata.normalize("NFKC", label[:LONGEST_LABEL]).strip(" :;,\t")
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


def folded(words: str) -> str:
    """Return words without case, accents and marks, spaces for underscores and hyphens."""
    letters = unicodedata.normalize("NFKD", words[:LONGEST_LABEL].replace("\u00df", "ss")).casefold()
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return re.sub(r"[\s_-]+", " ", plain).strip(" .:;,*#\"'")
