"""Headers: the quantity and the unit of each column, by known words or by flags."""

import functools
import itertools
import re
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from pipeline.tables.number_formats import is_number
from pipeline.tables.rows import Row
from pipeline.tables.units import LONGEST_LABEL, Quantity, is_other_unit, is_unit, needed_unit, unit_of
from sensor.quantity import validation_error

_MOST_LOOKS = 50_000  # most lines that are checked for a header
_IN_BRACKETS = re.compile(r"([^(\[{<]*)[(\[{<]([^)\]}>]*)[)\]}>]")
_WRITTEN_BY_R = re.compile(r"[^\W\d_]\w*([.]+[\w%]+)+[.]*")  # R turns Force (kgf) into Force..kgf.
_SIGNS_BY_R = re.compile(r"[.]{3,}$")
_SEPARATOR = re.compile(r"[\s_/,:;-]+")


class ColumnFlags(NamedTuple):
    """The flags `--columns NAME=HEADER,...` and `--units NAME=UNIT,...`; `others` are names in other tables."""

    columns: str | None = None
    units: str | None = None
    others: tuple[str, ...] = ()

    def applied(self, quantities: Mapping[str, Quantity]) -> dict[str, Quantity]:
        """Return quantities with the settings of the flags; raises InputError for another name or unit."""
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
    """Yield name and value of each part of NAME=VALUE,..., whose values may contain commas; raises InputError."""
    if text is None:
        return
    known = "|".join(sorted(map(re.escape, names), key=len, reverse=True))
    start, *parts = re.split(rf"(?:^|,)\s*({known})\s*=", text)
    values = dict(zip(parts[::2], map(str.strip, parts[1::2]), strict=True))
    is_whole = not start and 0 < 2 * len(values) == len(parts) and all(values.values())
    if not is_whole or any(re.search(r",\s*\w+\s*=", value) for value in values.values()):
        bound = f"NAME=TEXT separated by commas, each NAME once and one of {', '.join(names)}"
        raise validation_error(flag, text, "", bound, "write for instance force=Kraft, force=2 or force=kN")
    yield from values.items()


class NamedColumn(NamedTuple):
    """A column that a row names: its index, from 0, its quantity, and the units in its label."""

    at: int
    name: str
    units: tuple[str, ...]


class HeaderWords:
    """The meaning of labels for a set of quantities."""

    def __init__(self, quantities: Mapping[str, Quantity]) -> None:
        """Store the words of quantities; a quantity with a column chosen by a flag has no other words in a header."""
        self.quantities = quantities
        self._every: dict[str, str] = {}
        self._names: dict[str, str] = {}
        self._beside_unit: dict[str, str] = {}
        for name, quantity in quantities.items():
            words, weak = dict.fromkeys(map(folded, (name, *quantity.words)), name), map(folded, quantity.beside_unit)
            of_unit = dict.fromkeys(weak, name)
            self._every |= {**of_unit, **words, folded(quantity.chosen): name}
            if not quantity.chosen:
                self._beside_unit |= of_unit
                self._names |= words
        for names in (self._every, self._names):
            names |= {words.replace(" ", ""): name for words, name in names.items() if " " in words}
            names.pop("", None)
        self._looks = _MOST_LOOKS
        self.named = functools.lru_cache(maxsize=4096)(self._named)

    def quantity_of(self, words: str) -> str:
        """Return the quantity that words name anywhere in a file, or an empty string."""
        return self._every.get(folded(words), "")

    def columns(self, row: Row) -> list[NamedColumn]:
        """Return the columns that a row names, in order."""
        found = [
            NamedColumn(index, name, tuple(_units_in(row.cells[index], name, quantity)))
            for name, quantity in self.quantities.items()
            for index in _chosen_columns(row.cells, quantity.chosen)
        ]
        read = [(index, *self.named(label)) for index, label in enumerate(row.cells) if len(label) <= LONGEST_LABEL]
        found += [
            NamedColumn(index, name, (tail,) if tail else ()) for index, name, tail, weak in read if name and not weak
        ]
        names = {column.name for column in found}
        found += [NamedColumn(index, name, (tail,)) for index, name, tail, weak in read if weak and name not in names]
        return sorted(found)

    def names(self, row: Row) -> set[str]:
        """Return the quantities that a row names."""
        return {column.name for column in self.columns(row)}

    def is_header(self, row: Row, needed: Sequence[Collection[str]]) -> bool:
        """Return whether a row names all of one needed set, and the named columns hold no numbers."""
        if all(cell[:1] in "+-.,0123456789" for cell in row.cells) or self._looks == 0:  # true for empty cells too
            return False
        self._looks -= 1
        named = self.columns(row)
        names = {column.name for column in named}
        is_named = bool(names) and any(names.issuperset(each) for each in needed)
        return is_named and not any(is_number(row.cells[column.at]) for column in named)

    def measured(self, header: Row) -> list[int]:
        """Return the indices of the number columns that a row names."""
        return [column.at for column in self.columns(header) if self.quantities[column.name].units]

    def columns_by_number(self, needed: Sequence[Collection[str]]) -> dict[int, Quantity]:
        """Return the number columns by index if flags select all of one needed set by number."""
        chosen = {name: int(each.chosen) for name, each in self.quantities.items() if each.chosen.isdecimal()}
        if not any(names and chosen.keys() >= set(names) for names in needed):
            return {}
        return {at - 1: self.quantities[name] for name, at in chosen.items() if at and self.quantities[name].units}

    def near(self, row: Row, names: Collection[str]) -> tuple[str, str, str] | None:
        """Return label, quantity and tail of the first column that begins with a quantity and ends in no unit."""
        for label in row.cells:
            for words, tail in reversed(list(label_parts(label)) if len(label) <= LONGEST_LABEL else []):
                name = self._names.get(folded(words), "")
                if name in names and self.quantities[name].units:
                    return label, name, tail
        return None

    def _named(self, label: str) -> tuple[str, str, bool]:
        """Return the quantity of a label (or ""), the unit after its words, and whether only that unit identifies it.

        The label is a known word, by itself or with a unit of its quantity. Some words are valid only with a unit.
        """
        if name := self._names.get(folded(label), ""):
            return name, "", False
        for words, tail in label_parts(label):
            name = self._names.get(folded(words), "")
            if name and self.quantities[name].units and (not tail or unit_of(self.quantities[name], tail)):
                return name, tail, False
            name = self._beside_unit.get(folded(words), "")
            if name and unit_of(self.quantities[name], tail):
                return name, tail, True
        return "", "", False


def _chosen_columns(labels: Sequence[str], chosen: str) -> list[int]:
    """Return the columns whose label equals a flag's header, with or without its unit, or the column of its number."""
    if not chosen:
        return []
    wanted = folded(chosen)
    whole = [index for index, label in enumerate(labels) if label and folded(label) == wanted]
    by_number = [int(chosen) - 1] if chosen.isdecimal() and 0 < int(chosen) <= len(labels) else []
    return (
        whole
        or by_number
        or [
            index
            for index, label in enumerate(labels)
            if any(
                folded(words) == wanted and (is_unit(tail) or is_other_unit(tail)) for words, tail in label_parts(label)
            )
        ]
    )


def _units_in(label: str, name: str, quantity: Quantity) -> Iterator[str]:
    """Yield all units in the label of a column chosen by a flag, including units of other quantities.

    Unless a flag gives the unit, some texts are taken as unknown units: a text in brackets, a text after a known word,
    and R's notation of (%).
    """
    units = list(_units_behind(label, name, quantity)) if quantity.units else []
    known = set(map(folded, (*quantity.words, *quantity.beside_unit)))
    yield from units
    if units or not quantity.units or quantity.flag_unit or folded(label) in known:
        return
    if in_brackets := _IN_BRACKETS.fullmatch(label.strip(" :;,")):
        yield in_brackets[2].strip()
    elif dots := _SIGNS_BY_R.search(label):
        yield dots[0]
    else:
        behind = (tail for words, tail in label_parts(label) if folded(words) in known and not tail.isdecimal())
        yield from itertools.islice(behind, 1)


def _units_behind(label: str, name: str, quantity: Quantity) -> Iterator[str]:
    """Yield each unit at the end of a label, last one first; the end of a name such as F_l is its channel."""
    channel = name.rpartition("_")[2] if "_" in name else ""
    parts = [(words, tail) for words, tail in label_parts(label) if folded(tail).split(" ")[0] != channel]
    of_quantity = [(words, tail) for words, tail in parts if unit_of(quantity, tail)]
    others = [tail for _, tail in parts if is_other_unit(tail) and not unit_of(quantity, tail)]
    others += [tail for _, tail in parts if is_unit(tail) and not of_quantity]
    if others:
        yield others[0]
    elif of_quantity:
        words, tail = of_quantity[0]
        yield tail
        yield from _units_behind(re.sub(r"\s(in|en|em)$", "", words), name, quantity)


def label_parts(label: str) -> Iterator[tuple[str, str]]:
    """Yield each split of a label into words and a tail, brackets first, then the longest words."""
    label = unicodedata.normalize("NFKC", label[:LONGEST_LABEL]).strip(" :;,\t")
    if ".." in label or _WRITTEN_BY_R.fullmatch(label):
        label = re.sub(r"[.]+", " ", label).strip()
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
    """Return words without case, accents and marks, with spaces for underscores and hyphens."""
    letters = unicodedata.normalize("NFKD", words[:LONGEST_LABEL].replace("\u00df", "ss")).casefold()
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return re.sub(r"[\s_-]+", " ", plain).strip(" .:;,*#\"'")
