"""Interpret table headers: the quantity and the unit of each column, from known words or from flags."""

import functools
import re
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from pipeline.tables.number_formats import is_number
from pipeline.tables.rows import Row
from pipeline.tables.units import LONGEST_LABEL, Quantity, is_other_unit, is_unit, needed_unit, unit_of
from sensor.quantity import validation_error

_MAX_HEADER_CHECKS = 50_000  # maximum number of lines that are checked for a header, which limits the time for a file
# A label in two groups: its words, and a text in brackets at its end, as in `Force (N)`
_IN_BRACKETS = re.compile(r"([^(\[{<]*)[(\[{<]([^)\]}>]*)[)\]}>]")
_WRITTEN_BY_R = re.compile(r"[^\W\d_]\w*([.]+[\w%]+)+[.]*")  # R turns Force (kgf) into Force..kgf.
_R_DOTS = re.compile(r"[.]{3,}$")
_SEPARATOR = re.compile(r"[\s_/,:;-]+")


class ColumnFlags(NamedTuple):
    """The flags `--columns NAME=HEADER,...` and `--units NAME=UNIT,...`.

    `others` are further names that the flags may contain, because another table of the same command has them.
    """

    columns: str | None = None
    units: str | None = None
    others: tuple[str, ...] = ()

    def applied(self, quantities: Mapping[str, Quantity]) -> dict[str, Quantity]:
        """Return the quantities, keyed by name, with the headers and units that the flags state.

        A flag may also name one of the `others`, which is ignored here. Raises InputError for any other unknown name,
        for two quantities in one column, and for a text that is not a unit of the quantity.
        """
        with_flags = dict(quantities)
        names = (*quantities, *self.others)
        name_of_column: dict[str, str] = {}
        for name, header in _named_values("--columns", self.columns, names):
            if name in with_flags:
                if header in name_of_column:
                    bound = f"a column other than the one of {name_of_column[header]}"
                    field = f"--columns {name}"
                    raise validation_error(field, header, "", bound, "give each quantity its own column")
                name_of_column[header] = name
                with_flags[name] = replace(with_flags[name], selected_column=header)
        for name, unit in _named_values("--units", self.units, names):
            if name in with_flags:
                with_flags[name] = replace(with_flags[name], flag_unit=needed_unit("--units", with_flags[name], unit))
        return with_flags


NO_FLAGS = ColumnFlags()


def _named_values(flag: str, text: str | None, names: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield each name and value of a flag's text NAME=VALUE,...; a value may contain commas.

    Raises InputError if the text does not have this form, or if a name is unknown or occurs twice.
    """
    if text is None:  # the flag is not given
        return
    # A value ends before the next known name. Longer names are tried first, because a name may begin with another one.
    name_pattern = "|".join(sorted(map(re.escape, names), key=len, reverse=True))
    # The split yields the text before the first name, which must be empty, and then a name, its value, a name, ...
    start, *parts = re.split(rf"(?:^|,)\s*({name_pattern})\s*=", text)
    values = dict(zip(parts[::2], map(str.strip, parts[1::2]), strict=True))
    is_each_name_once = 2 * len(values) == len(parts)  # a dict drops repeated names
    is_complete = not start and bool(values) and is_each_name_once and all(values.values())
    # Another `, WORD =` in a value is an unknown name.
    has_unknown_name = any(re.search(r",\s*\w+\s*=", value) for value in values.values())
    if not is_complete or has_unknown_name:
        bound = f"NAME=TEXT separated by commas, each NAME once and one of {', '.join(names)}"
        raise validation_error(flag, text, "", bound, "write for instance force=Kraft, force=2 or force=kN")
    yield from values.items()


class NamedColumn(NamedTuple):
    """A column that a header names: its index, counted from 0, the name of its quantity, and the units in its label."""

    position: int
    name: str
    units: tuple[str, ...]


class LabelMeaning(NamedTuple):
    """The name of the quantity that a label names, and the unit in the label; each is "" if there is none.

    If `needs_unit` is True, the label names the quantity only because it contains this unit.
    """

    name: str
    unit: str
    needs_unit: bool


class HeaderWords:
    """The words by which column labels name the quantities of a table."""

    def __init__(self, quantities: Mapping[str, Quantity]) -> None:
        """Index the words that name each quantity.

        If a flag selects the column of a quantity, the words of this quantity are not looked up in column labels.
        """
        self.quantities = quantities
        self._quantity_by_word: dict[str, str] = {}  # in any text, for example in `Force unit: kN`
        self._quantity_by_label: dict[str, str] = {}  # in column labels
        self._quantity_by_label_with_unit: dict[str, str] = {}  # in column labels that also contain a unit
        for name, quantity in quantities.items():
            by_label = dict.fromkeys(map(fold_words, (name, *quantity.words)), name)
            by_label_with_unit = dict.fromkeys(map(fold_words, quantity.words_with_unit), name)
            self._quantity_by_word |= {**by_label_with_unit, **by_label, fold_words(quantity.selected_column): name}
            if not quantity.selected_column:
                self._quantity_by_label_with_unit |= by_label_with_unit
                self._quantity_by_label |= by_label
        for quantity_by_words in (self._quantity_by_word, self._quantity_by_label):
            # A header may also write several words as one, such as `testforce`.
            joined_words = {words.replace(" ", ""): name for words, name in quantity_by_words.items() if " " in words}
            quantity_by_words.update(joined_words)
            quantity_by_words.pop("", None)  # the empty `selected_column` of a quantity that no flag selects
        self._checks_left = _MAX_HEADER_CHECKS  # number of rows that `is_header` may still check
        self.interpret_label = functools.lru_cache(maxsize=4096)(self._interpret_label)  # labels recur in many rows

    def quantity_of(self, words: str) -> str:
        """Return the name of the quantity that `words` mean, in a header or in other text; "" if there is none."""
        return self._quantity_by_word.get(fold_words(words), "")

    def columns(self, row: Row) -> list[NamedColumn]:
        """Return the columns that a row names as a header, from left to right.

        The quantity of a column follows from a flag, or from a known word in its label. Some words name a quantity only
        together with a unit, and only if no other column holds this quantity.
        """
        columns_by_word = []
        columns_by_word_with_unit = []
        for index, label in enumerate(row.cells):
            if len(label) > LONGEST_LABEL:  # such a text is not a label
                continue
            meaning = self.interpret_label(label)
            if meaning.needs_unit:
                columns_by_word_with_unit.append(NamedColumn(index, meaning.name, (meaning.unit,)))
            elif meaning.name:
                columns_by_word.append(NamedColumn(index, meaning.name, (meaning.unit,) if meaning.unit else ()))
        columns = self._columns_by_flag(row) + columns_by_word
        names = {column.name for column in columns}
        columns += [column for column in columns_by_word_with_unit if column.name not in names]
        return sorted(columns)  # by their index, which is the first item of a column

    def _columns_by_flag(self, row: Row) -> list[NamedColumn]:
        """Return the columns in a header that a flag selects for a quantity, by their label or by their number."""
        return [
            NamedColumn(index, name, tuple(_units_in(row.cells[index], name, quantity)))
            for name, quantity in self.quantities.items()
            for index in _selected_columns(row.cells, quantity.selected_column)
        ]

    def names(self, row: Row) -> set[str]:
        """Return the names of the quantities that a row names as a header."""
        return {column.name for column in self.columns(row)}

    def is_header(self, row: Row, needed: Sequence[Collection[str]]) -> bool:
        """Return whether a row is a header, which means that it names all quantities of at least one set in `needed`.

        None of the cells that name these quantities may be a number. The number of checks is limited: after
        `_MAX_HEADER_CHECKS` rows, the result is always False.
        """
        # Shortcut for speed: a row of numbers and empty cells is not a header. An empty cell passes the test, because
        # "" is contained in every string.
        if all(cell[:1] in "+-.,0123456789" for cell in row.cells) or self._checks_left == 0:
            return False
        self._checks_left -= 1
        columns = self.columns(row)
        names = {column.name for column in columns}
        is_complete = bool(names) and any(names.issuperset(needed_names) for needed_names in needed)
        return is_complete and not any(is_number(row.cells[column.position]) for column in columns)

    def numeric_columns(self, header: Row) -> list[int]:
        """Return the indices of the numeric columns that a header names."""
        return [column.position for column in self.columns(header) if self.quantities[column.name].units]

    def columns_by_number(self, needed: Sequence[Collection[str]]) -> dict[int, Quantity]:
        """Return the quantities of the columns that flags select by number; the keys are column indices from 0.

        The result is empty unless the flags select all quantities of at least one set in `needed`. Columns of text are
        left out.
        """
        # the number of the column of each quantity, counted from 1
        column_numbers = {
            name: int(quantity.selected_column)
            for name, quantity in self.quantities.items()
            if quantity.selected_column.isdecimal()
        }
        if not any(names and column_numbers.keys() >= set(names) for names in needed):
            return {}
        return {
            number - 1: self.quantities[name]
            for name, number in column_numbers.items()
            if number and self.quantities[name].units  # the number 0 selects no column
        }

    def find_near_miss(self, row: Row, names: Collection[str]) -> tuple[str, str, str] | None:
        """Return the first label that names one of the quantities `names`, but ends in a text that is not a unit.

        The result is the label, the name of the quantity, and the text after the name; None if there is no such label.
        """
        for label in row.cells:
            parts = list(label_parts(label)) if len(label) <= LONGEST_LABEL else []
            for words, tail in reversed(parts):  # the fewest words first, so that the longest tail is reported
                name = self._quantity_by_label.get(fold_words(words), "")
                if name in names and self.quantities[name].units:
                    return label, name, tail
        return None

    def _interpret_label(self, label: str) -> LabelMeaning:
        """Return the quantity that a label names, and the unit in the label.

        The label must consist of known words, which a unit of their quantity may follow.
        """
        if name := self._quantity_by_label.get(fold_words(label), ""):
            return LabelMeaning(name, "", needs_unit=False)
        for words, tail in label_parts(label):
            name = self._quantity_by_label.get(fold_words(words), "")
            # The tail is empty if the brackets of the label are, as in `Force ()`.
            if name and self.quantities[name].units and (not tail or unit_of(self.quantities[name], tail)):
                return LabelMeaning(name, tail, needs_unit=False)
            name = self._quantity_by_label_with_unit.get(fold_words(words), "")
            if name and unit_of(self.quantities[name], tail):
                return LabelMeaning(name, tail, needs_unit=True)
        return LabelMeaning("", "", needs_unit=False)


def _selected_columns(labels: Sequence[str], selected_column: str) -> list[int]:
    """Return the indices of the columns that the value `selected_column` of a flag selects; none if it is empty.

    The value is a label, the number of a column counted from 1, or a label without its unit. The first of these
    interpretations that selects a column is used.
    """
    if not selected_column:
        return []
    chosen_words = fold_words(selected_column)
    by_label = [index for index, label in enumerate(labels) if label and fold_words(label) == chosen_words]
    if by_label:
        return by_label
    if selected_column.isdecimal() and 0 < int(selected_column) <= len(labels):
        return [int(selected_column) - 1]
    return [index for index, label in enumerate(labels) if _is_label_with_unit(label, chosen_words)]


def _is_label_with_unit(label: str, chosen_words: str) -> bool:
    """Return whether a label consists of the words `chosen_words`, in the form of `fold_words`, and any unit."""
    return any(
        fold_words(words) == chosen_words and (is_unit(tail) or is_other_unit(tail))
        for words, tail in label_parts(label)
    )


def _units_in(label: str, name: str, quantity: Quantity) -> Iterator[str]:
    """Yield all units in the label of a column that a flag selects for the `quantity` of this `name`.

    Units of other quantities are yielded too, so that they can be refused. If neither the label nor a flag states a
    unit, a text in the place of a unit is yielded for the same reason.
    """
    if not quantity.units:  # a column of text
        return
    units = list(_trailing_units(label, name, quantity))
    yield from units
    if not units and not quantity.flag_unit:
        unknown_unit = _find_unknown_unit(label, quantity)
        if unknown_unit is not None:
            yield unknown_unit


def _find_unknown_unit(label: str, quantity: Quantity) -> str | None:
    """Return the text in the place of a unit in a label that has no known unit, or None if there is no such text.

    Such a text is in brackets, follows a word for the `quantity`, or consists of the dots that R writes instead of (%).
    """
    known_words = set(map(fold_words, (*quantity.words, *quantity.words_with_unit)))
    if fold_words(label) in known_words:
        return None
    if in_brackets := _IN_BRACKETS.fullmatch(label.strip(" :;,")):
        return in_brackets[2].strip()
    if dots := _R_DOTS.search(label):
        return dots[0]
    for words, tail in label_parts(label):
        # A number after a known word counts the columns of a quantity, as in `force 2`, so it is not a unit.
        if fold_words(words) in known_words and not tail.isdecimal():
            return tail
    return None


def _trailing_units(label: str, name: str, quantity: Quantity) -> Iterator[str]:
    """Yield the units at the end of a label, from right to left, such as N and then kN for `Force in kN in N`.

    `name` is the name of the `quantity` in the table. A unit of another quantity is yielded too, so that the caller can
    refuse it, and ends the search.
    """
    # A name such as F_l ends in its channel, here l. A label may repeat this letter, which is then not a unit.
    channel = name.rpartition("_")[2] if "_" in name else ""
    splits = [(words, tail) for words, tail in label_parts(label) if fold_words(tail).split(" ")[0] != channel]
    own_splits = [(words, tail) for words, tail in splits if unit_of(quantity, tail)]
    foreign_units = _foreign_units([tail for _, tail in splits], quantity)
    if foreign_units:
        yield foreign_units[0]
    elif own_splits:
        words, tail = own_splits[0]  # the split that is farthest to the right
        yield tail
        # The words before the unit may end in a further unit, if the preposition of the first one is removed.
        words = re.sub(r"\s(in|en|em)$", "", words)  # "in", in several languages
        yield from _trailing_units(words, name, quantity)


def _foreign_units(tails: Sequence[str], quantity: Quantity) -> list[str]:
    """Return the tails of a label that are units of other quantities than `quantity`.

    Units that `is_other_unit` accepts, such as V, come first. Units of other measured quantities, such as mm for a
    force, are omitted if a tail is a unit of `quantity`.
    """
    other_units = [tail for tail in tails if is_other_unit(tail) and not unit_of(quantity, tail)]
    if any(unit_of(quantity, tail) for tail in tails):
        return other_units
    return other_units + [tail for tail in tails if is_unit(tail)]


def label_parts(label: str) -> Iterator[tuple[str, str]]:
    """Yield each way to split a label into words and a tail that may be a unit, such as `Force` and `N`.

    If the label ends in brackets, their text is the first tail. The splits at spaces and punctuation follow, from right
    to left. If there are several pairs of brackets, the text in the last pair is the last tail.
    """
    label = unicodedata.normalize("NFKC", label[:LONGEST_LABEL]).strip(" :;,\t")
    if ".." in label or _WRITTEN_BY_R.fullmatch(label):
        label = re.sub(r"[.]+", " ", label).strip()  # R writes dots instead of spaces and brackets
    in_brackets = _IN_BRACKETS.fullmatch(label)
    if in_brackets:
        yield in_brackets[1].strip(" _/,:;-"), in_brackets[2].strip()
    separators = list(_SEPARATOR.finditer(label))
    for separator in reversed(separators):
        words, tail = label[: separator.start()], label[separator.end() :]
        if words and tail:
            yield words, re.sub(r"^(in|en|em) ", "", tail)  # "in", as in `Force in N`, in several languages
    # With more than one pair of brackets, the pattern above does not match. The tail is then in the last pair.
    without_closing = label.rstrip(")]}>")
    opening = max(map(without_closing.rfind, "([{<"))
    if without_closing != label and opening > 0:  # with words before the bracket
        yield without_closing[:opening].strip(), without_closing[opening + 1 :].strip()


def fold_words(words: str) -> str:
    """Return words in a form for comparison: lower case, no accents or punctuation, and single spaces."""
    letters = unicodedata.normalize("NFKD", words[:LONGEST_LABEL].replace("\u00df", "ss")).casefold()
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return re.sub(r"[\s_-]+", " ", plain).strip(" .:;,*#\"'")
