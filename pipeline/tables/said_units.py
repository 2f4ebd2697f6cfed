"""What the lines above and below a table say of the units of its columns."""

import itertools
import re
from collections.abc import Iterator
from typing import NamedTuple

from pipeline.tables.files import place_of
from pipeline.tables.headers import HeaderWords, folded
from pipeline.tables.rows import Row
from pipeline.tables.units import LONGEST_LABEL, SHOWN_LABEL, TIME, Quantity, needed_unit, no_unit, unit_of
from pipeline.tables.words import WORDS
from sensor.quantity import InputError, validation_error

_FILLERS = set(WORDS["fillers"])
_UNIT_WORDS = set(map(folded, WORDS["words"]["unit"]))
_SYSTEMS = {"", "system", "systems", "measure", "measurement", "measurements"}  # as in `Unit system,Imperial`
_MOST_HEARD = 50_000  # lines of text of a file
_UNIT = r"([^\W\d_]{1,12}|\u00b5m|\u03bcm)"
_BESIDE_NUMBER = re.compile(rf"(?<![\w.,:])[+-]?\d[\d.,]*\s?{_UNIT}(?![\w^])")
_IN_BRACKETS = re.compile(rf"[(\[{{<]\s*{_UNIT}\s*[)\]}}>/]")
_PREPOSITION = re.compile(r"in\s+\w")  # as in `test 3 in air`


class Said(NamedTuple):
    """A text that says a unit, and how an error names its place."""

    text: str
    place: str


class SaidUnits:
    """What lines of text say of units: those that state one, as `Force unit: kN`, and those that only name one."""

    def __init__(self, words: HeaderWords) -> None:
        """Begin with nothing said."""
        self._words = words
        self._stated: dict[str, list[Said]] = {}
        self._unclear: list[Said] = []
        self._named: dict[str, list[Said]] = {}
        self._assumed: dict[str, str] = {}
        self._of_last_block: set[str] = set()
        self._heard = 0

    def begin_block(self) -> None:
        """Let statements from here on replace the earlier ones: they are of the next table."""
        self._of_last_block = set(self._stated)

    def hear(self, source: str, row: Row) -> None:
        """Take what a line beside a table says; raises InputError if it contradicts a unit that was assumed."""
        self._heard += 1
        if self._heard > _MOST_HEARD:
            return
        place = place_of(source, row.line)
        stated: dict[str, list[Said]] = {}
        for index, cell in enumerate(row.cells):
            if cell:
                for name, text in self._statements(row, index, cell[:LONGEST_LABEL]):
                    stated.setdefault(name, []).append(Said(text, place))
                self._hear_cell(place, cell[:LONGEST_LABEL])
        self._unclear += stated.pop("", [])
        for name, said in stated.items():
            earlier = [] if name in self._of_last_block else self._stated.get(name, [])
            self._of_last_block.discard(name)
            self._stated[name] = [*earlier, *said]
            self._refuse_other_than_assumed(name, said)

    def hear_labels(self, source: str, header: Row, used: set[int]) -> None:
        """Take what the labels of other columns of a table say."""
        for index, label in enumerate(header.cells):
            if label and index not in used:
                self._hear_cell(place_of(source, header.line), label[:LONGEST_LABEL])

    def hear_cells(self, source: str, row: Row, used: set[int]) -> None:
        """Take the units in other cells of the first row of numbers."""
        for index, cell in enumerate(row.cells):
            if cell and index not in used:
                self._add_named(cell[:LONGEST_LABEL], Said(cell, place_of(source, row.line)))

    def stated(self, name: str) -> list[Said]:
        """Return what states the unit of a quantity."""
        return self._stated.get(name, [])

    def stated_since(self, name: str) -> list[Said]:
        """Return what states the unit of a quantity in the block that began last."""
        return [] if name in self._of_last_block else self.stated(name)

    def assume(self, place: str, name: str) -> None:
        """Note that the default unit of a quantity is assumed; raises InputError if a line names another one."""
        quantity = self._words.quantities[name]
        self._assumed[name] = quantity.default
        unclear = [] if quantity.units is TIME else self._unclear
        for said in [*self._named.get(name, []), *unclear][:1]:
            raise self._contradiction(name, quantity, said, place)

    def _statements(self, row: Row, index: int, cell: str) -> Iterator[tuple[str, str]]:
        """Yield quantity and unit of each statement that begins in a cell; "" for a unit of no quantity."""
        key, _, value = re.sub("=", ":", cell).partition(":")
        parts = folded(re.sub(r"[()\[\]]", " ", key)).split(" ")
        if not any(part in _UNIT_WORDS for part in parts):
            return
        values = list(filter(None, (value.strip(), *row.cells[index + 1 :])))
        of = " ".join(part for part in parts if part not in _UNIT_WORDS and part not in _FILLERS)
        name = self._words.quantity_of(of) if of else ""
        if name:
            if self._words.quantities[name].units and values:
                yield name, values[0]
        elif of in _SYSTEMS:
            texts = [part for text in values for part in re.split(r"[\s,;]+", text) if part]
            for text in texts:
                names = [each for each, quantity in self._words.quantities.items() if unit_of(quantity, text)]
                yield from zip(names or [""], itertools.repeat(text))

    def _hear_cell(self, place: str, cell: str) -> None:
        """Take the units that a cell names: beside a number, in brackets, or alone."""
        said = Said(cell, place)
        self._add_named(cell, said)
        for match in itertools.chain(_BESIDE_NUMBER.finditer(cell), _IN_BRACKETS.finditer(cell)):
            if not _PREPOSITION.match(cell, match.start(1)):
                self._add_named(match[1], said)

    def _add_named(self, text: str, said: Said) -> None:
        """Take a text that may be a unit: it counts for each quantity whose default is another one.

        Lines name times for many reasons, so those count only where they are stated.
        """
        for name, quantity in self._words.quantities.items():
            if (
                quantity.default
                and quantity.units is not TIME
                and unit_of(quantity, text) not in ("", quantity.default)
            ):
                self._named.setdefault(name, []).append(said)
                if name in self._assumed:
                    raise self._contradiction(name, quantity, said, "a table of this file")

    def _refuse_other_than_assumed(self, name: str, said: list[Said]) -> None:
        for text, place in said:
            quantity = self._words.quantities[name]
            if name in self._assumed and needed_unit(place, quantity, text) != self._assumed[name]:
                raise self._contradiction(name, quantity, Said(text, place), "a table of this file")

    @staticmethod
    def _contradiction(name: str, quantity: Quantity, said: Said, place: str) -> InputError:
        bound = f"in {quantity.default}, or the unit of {name} given in the header of {place}"
        hint = f"say the unit by --units {name}={quantity.default} or another one"
        return validation_error(said.place, said.text[:SHOWN_LABEL], "", bound, hint)


def told_unit(quantity: Quantity, said: list[Said]) -> str:
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
