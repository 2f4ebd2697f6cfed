"""Signals of a sensor line by line, from a CSV file or a stream: time, travel if it is there, a force for each tip."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.headers import NO_FLAGS, ColumnFlags
from pipeline.measure.tables.stream import table_stream
from pipeline.measure.tables.units import FORCE, LENGTH, TIME, Quantity
from pipeline.measure.tables.words import WORDS
from sensor.quantity import validation_error, written_number

COUNTS = Quantity(units={"1": 1.0}, default="1", most=2.0**32)
_OF_CHANNELS = r"(f|counts|t) ([lh]|[0-9]+)"  # what headers call those of any sensor


@dataclass(frozen=True)
class Sample:
    """One line of a signal: its number, time [s], travel [mm] or None, and forces in the order of the tips [N].

    `times` are those of each channel [s], none where all have the one time.
    """

    line: int
    t: float
    x: float | None
    forces: tuple[float, ...]
    times: tuple[float, ...] = ()


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

    A time for each channel may stand in place of the one time of a line, or beside it; that is then of the travel.

    Where its header names counts, `counted`, its samples have those in place of forces.

    Raises InputError, in one line that names line and column, at the first line that is not as the header says.
    """

    def __init__(self, lines: Iterable[str], source: str, tips: int, flags: ColumnFlags = NO_FLAGS) -> None:
        """Read the header."""
        self.source = source
        of_forces, of_counts, of_channels = force_keys(tips), count_keys(tips), time_keys(tips)
        quantities = {name: Quantity(units=TIME, default="s", by_clock=True) for name in ("t", *of_channels)}
        quantities["t"] = replace(quantities["t"], words=tuple(WORDS["words"]["time"]))
        quantities["x"] = Quantity(units=LENGTH, default="mm", words=tuple(WORDS["words"]["travel"]))
        quantities |= dict.fromkeys(of_forces, Quantity(units=FORCE, default="N")) | dict.fromkeys(of_counts, COUNTS)
        example = ",".join(["t_s", *(f"{key}_N" for key in of_forces)])
        table = table_stream(lines, source, flags.applied(quantities), (of_forces, of_counts), example)
        self._form = table.form
        self._rows = table.rows
        self._columns = {column.name: column for column in table.columns}
        self.counted = set(of_counts) <= self._columns.keys()
        keys = of_counts if self.counted else of_forces
        self.timed = not self._columns.keys().isdisjoint(of_channels)
        needed = ("t",) if not self.timed else ("t", *of_channels) if "x" in self._columns else of_channels
        table.refuse_unlike((*needed, *keys), ("t", "x"), _OF_CHANNELS, example)
        self._force_columns = [self._columns[key] for key in keys]
        self._time_columns = [self._columns[key] for key in ("t", *of_channels) if key in self._columns]
        self.understood = table.understood
        self.notes = tuple(f"{source}: {column.note}" for column in table.columns if column.note)

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples; blank lines are left out."""
        form = self._form
        travel = self._columns.get("x")
        before = [-math.inf] * len(self._time_columns)
        for row in self._rows:
            times = [form.number(row, column) for column in self._time_columns]
            for column, t, earlier in zip(self._time_columns, times, before, strict=True):
                if t < earlier or (self.timed and t == earlier):
                    place = place_of(form.source, row.line, column.label)
                    bound = f"{'after' if self.timed else 'at least'} the {earlier:g} s of the line before"
                    raise validation_error(place, t, "s", bound, "sort the lines")
            before = times
            x = form.number(row, travel) if travel else None
            forces = tuple(form.number(row, column) for column in self._force_columns)
            yield Sample(row.line, times[0], x, forces, tuple(times[-len(forces) :]) if self.timed else ())
        if before[0] == -math.inf:
            bound = "at least one line of numbers below the header"
            raise validation_error(form.source, 0, "samples", bound, "record a press")

    def place(self, sample: Sample, tip: int) -> str:
        """Return how an error names the force of a tip in a sample, or the counts of its channel."""
        return place_of(self._form.source, sample.line, self._force_columns[tip].label)


def numbers_of_text(text: str, tips: int, flag: str, unit: str) -> list[float]:
    """Return the numbers of a flag like `--forces F1,F2,...`, one for each tip; raises InputError."""
    numbers = [number for number in map(written_number, text.split(",")) if number is not None]
    if not len(numbers) == tips == text.count(",") + 1:
        bound = f"{tips} numbers in {unit} with commas between, one for each tip of this sensor"
        raise validation_error(flag, text, "", bound, f"write {flag} F1,F2,..., decimals with a point")
    return numbers
