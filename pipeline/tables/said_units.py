"""What the lines beside a table say of the units of its columns."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import NamedTuple

from pipeline.tables.files import place_of
from pipeline.tables.headers import HeaderWords, folded
from pipeline.tables.rows import Row
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, TIME, Quantity, no_unit, unit_of
from pipeline.tables.words import WORDS
from sensor.quantity import validation_error

UNIT_WORDS = set(map(folded, WORDS["words"]["unit"]))
_FILLERS = set(WORDS["fillers"])
_SYSTEMS = {"", "system", "systems", "measure", "measurement", "measurements"}  # as in `Unit system,Imperial`
_UNIT = r"(?!in\s+\w)([^\W\d_]{1,12}|\u00b5m|\u03bcm)"  # but for a preposition, as in `test 3 in air`
_NAMED = re.compile(
    rf"(?<![\w.,:])[+-]?\d[\d.,]*\s?{_UNIT}(?![\w^])"  # beside a number
    rf"|[(\[{{<]\s*{_UNIT}\s*[)\]}}>/]"  # in brackets
)


class Said(NamedTuple):
    """A text that says a unit, and how an error names its place."""

    text: str
    place: str


class SaidUnits:
    """What lines of text say of units: those that state one, as `Force unit: kN`, and those that only name one.

    A statement holds for all tables below it until another one replaces it.
    """

    def __init__(self, words: HeaderWords) -> None:
        """Begin with nothing said."""
        self._words = words
        self._stated: dict[str, list[Said]] = {}
        self._others: dict[str, list[Said]] = {}  # named beside a table, and not the default
        self._assumed: dict[str, str] = {}

    def stated(self, name: str) -> list[Said]:
        """Return what states the unit of a quantity."""
        return self._stated.get(name, [])

    def hear(self, source: str, rows: Iterable[Row]) -> Mapping[str, list[Said]]:
        """Take what lines beside a table say, and return by quantity what they state.

        Raises InputError if they contradict a unit that was assumed.
        """
        stated: dict[str, list[Said]] = {}
        for row in rows:
            for index, cell in enumerate(row.cells):
                for name, text in self._statements(row, index, cell[:LONGEST_LABEL]):
                    stated.setdefault(name, []).append(Said(text, place_of(source, row.line)))
            self.hear_named(source, row)
            for name, place in self._assumed.items():
                self._refuse_contradiction(name, place, [*stated.get(name, []), *self._others.get(name, [])])
        self._stated |= stated
        return stated

    def hear_named(self, source: str, row: Row, used: Collection[int] = ()) -> None:
        """Take the units that cells beside the used columns name: alone, beside a number, or in brackets.

        Such a unit counts for each quantity whose default is another one. Lines name times for many reasons, so those
        count only if they are stated.
        """
        for cell in (cell[:LONGEST_LABEL] for index, cell in enumerate(row.cells) if cell and index not in used):
            for text in (cell, *(beside or inside for beside, inside in _NAMED.findall(cell))):
                for name, quantity in self._words.quantities.items():
                    is_other = unit_of(quantity, text) not in ("", quantity.default)
                    if quantity.default and quantity.units is not TIME and is_other:
                        self._others.setdefault(name, []).append(Said(cell, place_of(source, row.line)))

    def assume(self, name: str, place: str) -> None:
        """Note that a column has the default unit of its quantity; raises InputError if a line names another one."""
        self._assumed[name] = place
        is_time = self._words.quantities[name].units is TIME
        self._refuse_contradiction(name, place, [*self._others.get(name, []), *([] if is_time else self.stated(""))])

    def _refuse_contradiction(self, name: str, place: str, said: Iterable[Said]) -> None:
        """Raise InputError for the first text that says another unit of a quantity than its default."""
        quantity = self._words.quantities[name]
        for each in said:
            if unit_of(quantity, each.text) != quantity.default:
                bound = f"in {quantity.default}, or the unit of {name} given in the header of {place}"
                hint = f"say the unit by --units {name}={quantity.default} or another one"
                raise validation_error(each.place, each.text[:SHOWN_LABEL], "", bound, hint)

    def _statements(self, row: Row, index: int, cell: str) -> Iterator[tuple[str, str]]:
        """Yield quantity, "" for none, and unit of each statement that begins in a cell, as `Force unit: kN`."""
        key, _, value = cell.replace("=", ":").partition(":")
        parts = folded(re.sub(r"[()\[\]]", " ", key)).split(" ")
        if UNIT_WORDS.isdisjoint(parts):
            return
        values = list(filter(None, (value.strip(), *row.cells[index + 1 :])))
        of = " ".join(part for part in parts if part not in UNIT_WORDS and part not in _FILLERS)
        name = self._words.quantity_of(of)
        if name:
            if self._words.quantities[name].units and values:
                yield name, values[0]
        elif of in _SYSTEMS:
            for text in filter(None, re.split(r"[\s,;]+", " ".join(values))):
                names = [each for each, quantity in self._words.quantities.items() if unit_of(quantity, text)]
                yield from ((each, text) for each in names or [""])


def told_unit(quantity: Quantity, said: Iterable[Said]) -> str:
    """Return the one unit that all texts say, "" for no text; raises InputError if they differ, or say none."""
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
