"""Signals of a sensor line by line, from a CSV file or a stream: time, and a force for each tip."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from pipeline.tables.clock import Clock
from pipeline.tables.files import place_of
from pipeline.tables.headers import NO_FLAGS, ColumnFlags, folded, label_parts
from pipeline.tables.rows import Rows
from pipeline.tables.table import FoundTable, one_table, shown
from pipeline.tables.units import FORCE, TIME, Quantity
from pipeline.tables.words import WORDS
from sensor.quantity import validation_error, written_number

COUNTS = Quantity(units={"1": 1.0}, default="1", most=2.0**32)
_OF_CHANNELS = r"(f|counts|t) ([lh]|[0-9]+)"  # what headers call those of any sensor


class Sample(NamedTuple):
    """One line of a signal: its number, time [s], and forces in the order of the tips [N].

    `times` are those of each channel [s], none where all have the one time. `fruit` is what the file calls the fruit.
    """

    line: int
    t: float
    forces: tuple[float, ...]
    times: tuple[float, ...] = ()
    fruit: str = ""


def force_keys(tips: int) -> tuple[str, ...]:
    """Return the names of the forces of a sensor of so many tips, without their unit; those of a pair are l and h."""
    names = "lh" if tips == 2 else range(1, tips + 1)  # noqa: PLR2004 - a pair
    return tuple(f"F_{name}" for name in names)


def count_keys(tips: int) -> tuple[str, ...]:
    """Return the names of the counts of the channels of a sensor of so many tips, as those of its forces."""
    return tuple(key.replace("F_", "counts_") for key in force_keys(tips))


def time_keys(tips: int) -> tuple[str, ...]:
    """Return the names of the times of the channels of a sensor of so many tips, as those of its forces."""
    return tuple(key.replace("F_", "t_") for key in force_keys(tips))


class Signal:
    """A signal that is read as its lines come; `notes` say which units were assumed, `understood` what is read.

    A time for each channel may stand in place of the one time of a line. A column may name the fruit, `names_fruit`.

    Where its header names counts, `counted`, its samples have those in place of forces. `say` hears which lines are
    left out, and where a clock begins anew.

    Raises InputError, in one line that names line and column, at the first line that is not as the header says.
    """

    def __init__(
        self, rows: Rows, tips: int, flags: ColumnFlags = NO_FLAGS, say: Callable[[str], None] = lambda _: None
    ) -> None:
        """Read the header."""
        self.source = rows.source
        of_forces, of_counts, of_channels = force_keys(tips), count_keys(tips), time_keys(tips)
        quantities = {name: Quantity(units=TIME, default="s", by_clock=True) for name in ("t", *of_channels)}
        quantities["t"] = replace(quantities["t"], words=tuple(WORDS["words"]["time"]))
        quantities["fruit"] = Quantity(units={})
        quantities |= dict.fromkeys(of_forces, Quantity(units=FORCE, default="N")) | dict.fromkeys(of_counts, COUNTS)
        example = ",".join(["t_s", *(f"{key}_N" for key in of_forces)])
        table = one_table(rows, flags.applied(quantities), (of_forces, of_counts), example)
        self._table = table
        self._say = say
        self._columns = {column.name: column for column in table.columns}
        self.counted = set(of_counts) <= self._columns.keys()
        keys = of_counts if self.counted else of_forces
        self.timed = not self._columns.keys().isdisjoint(of_channels)
        needed = of_channels if self.timed else ("t",)
        _refuse_unlike(table, (*needed, *keys), ("t", "fruit"), example)
        self.names_fruit = "fruit" in self._columns
        self._force_columns = [self._columns[key] for key in keys]
        self._clocks = [Clock(table, self._columns[key], say) for key in ("t", *of_channels) if key in self._columns]
        self.understood = replace(table, rows=iter(()), left_out=[], skipped=[]).understood
        self.notes = tuple(f"{self.source}: {column.note}" for column in table.columns if column.note)

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples; blank lines are left out."""
        table = self._table
        count = 0
        for row in table.rows:
            self._say_left_out()
            times = [clock.seconds(row, rises=self.timed) for clock in self._clocks]
            forces = tuple(table.number(row, column) for column in self._force_columns)
            count += 1
            fruit = self._columns["fruit"].cell(row) if self.names_fruit else ""
            yield Sample(row.line, times[0], forces, tuple(times[-len(forces) :]) if self.timed else (), fruit)
        self._say_left_out()
        if count == 0:
            bound = "at least one line of numbers below the header"
            raise validation_error(table.source, 0, "samples", bound, "record a press")

    def _say_left_out(self) -> None:
        """Tell which lines without numbers have been left out since the last time; a stream may go on for ever."""
        for row in (*self._table.left_out, *self._table.skipped):
            self._say(f"left out {shown(row)}")
        self._table.left_out.clear()
        self._table.skipped.clear()

    def place(self, sample: Sample, tip: int) -> str:
        """Return how an error names the force of a tip in a sample, or the counts of its channel."""
        return self._table.place(sample.line, self._force_columns[tip])


def _refuse_unlike(table: FoundTable, needed: Sequence[str], others: Sequence[str], example: str) -> None:
    """Raise InputError unless all of `needed` are columns of a table beside `others`, and no further channel is."""
    names = {column.name: column.label for column in table.columns}
    if not names.keys() >= set(needed):
        bound = f"a header that also has {' and '.join(name for name in needed if name not in names)}"
        place = place_of(table.source, table.header.line)
        raise validation_error(place, table.header.text, "", bound, f"write for instance {example}")
    further = [label for name, label in names.items() if name not in needed and name not in others]
    for label in table.header.cells:
        if label and label not in names.values():
            words = [label, *(words for words, _ in label_parts(label))]
            further += [label] if any(re.fullmatch(_OF_CHANNELS, folded(word)) for word in words) else []
    if further:
        place = place_of(table.source, table.header.line, further[0])
        bound = f"one of {', '.join((*others, *needed))}, as this sensor has"
        raise validation_error(place, further[0], "", bound, f"write for instance {example}")


def numbers_of_text(text: str, tips: int, flag: str, unit: str) -> list[float]:
    """Return the numbers of a flag like `--forces F1,F2,...`, one for each tip; raises InputError."""
    numbers = [number for number in map(written_number, text.split(",")) if number is not None]
    if not len(numbers) == tips == text.count(",") + 1:
        bound = f"{tips} numbers in {unit} with commas between, one for each tip of this sensor"
        raise validation_error(flag, text, "", bound, f"write {flag} F1,F2,..., decimals with a point")
    return numbers
