"""Read the signal of a sensor, a time and one force per tip, line by line from a file or a stream."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from pipeline.tables.clock import Clock
from pipeline.tables.decoding import place_of
from pipeline.tables.header_words import WORDS
from pipeline.tables.headers import NO_FLAGS, ColumnFlags, fold_words, label_parts
from pipeline.tables.rows import Rows
from pipeline.tables.table import FoundTable, one_table, row_text
from pipeline.tables.units import FORCE, TIME, Quantity
from sensor.quantity import parse_number, validation_error

COUNTS = Quantity(units={"1": 1.0}, default="1", most=2.0**32)
_CHANNEL_LABEL = r"(f|counts|t) ([lh]|[0-9]+)"  # label of a channel's column, for any sensor


class Sample(NamedTuple):
    """One line of a signal: its line number, its time [s], and the forces in the order of the tips [N].

    `times` [s] holds one time per channel; it is empty if all channels share the time `t`. `fruit` is the name of the
    fruit in the file.
    """

    line: int
    t: float
    forces: tuple[float, ...]
    times: tuple[float, ...] = ()
    fruit: str = ""


def force_keys(tips: int) -> tuple[str, ...]:
    """Return the column names of the forces without unit: F_l and F_h for a pair, otherwise F_1 to F_n for n tips."""
    names = "lh" if tips == 2 else range(1, tips + 1)  # noqa: PLR2004 - a pair
    return tuple(f"F_{name}" for name in names)


def count_keys(tips: int) -> tuple[str, ...]:
    """Return the column names of the counts, named like the forces."""
    return tuple(key.replace("F_", "counts_") for key in force_keys(tips))


def time_keys(tips: int) -> tuple[str, ...]:
    """Return the column names of the channels' times, named like the forces."""
    return tuple(key.replace("F_", "t_") for key in force_keys(tips))


class Signal:
    """A signal that is read line by line as it arrives; iterate over it for its samples.

    `notes` lists units that were assumed, and `summary` describes the columns. `timed` is True if the table has one
    time per channel, and `names_fruit` is True if a column holds the name of the fruit. If `counted` is True, the table
    has counts, and the samples hold counts instead of forces.
    """

    def __init__(
        self, rows: Rows, tips: int, flags: ColumnFlags = NO_FLAGS, say: Callable[[str], None] = lambda _: None
    ) -> None:
        """Read the header of `rows`, for a sensor with `tips` tips.

        `flags` states columns and units that the header lacks. `say` is called with a note for each line that is left
        out, each time a clock restarts, and if the tare differs from the zero of the calibration. Raises InputError if
        a column is missing, or belongs to another sensor.
        """
        self.source = rows.source
        # The names of the columns; a table may have a common time `t`, or one time per channel.
        forces, counts, times = force_keys(tips), count_keys(tips), time_keys(tips)
        example = ",".join(["t_s", *(f"{key}_N" for key in forces)])  # a valid header, for messages
        table = one_table(rows, flags.applied(_column_quantities(tips)), (forces, counts), example)
        self._table = table
        self.say = say
        self._columns = {column.name: column for column in table.columns}
        self.counted = set(counts) <= self._columns.keys()
        channels = counts if self.counted else forces
        self.timed = not self._columns.keys().isdisjoint(times)
        required_times = times if self.timed else ("t",)
        _check_columns(table, (*required_times, *channels), ("t", "fruit"), example)
        self.names_fruit = "fruit" in self._columns
        self._force_columns = [self._columns[key] for key in channels]
        self._clocks = [Clock(table, self._columns[key], say) for key in ("t", *times) if key in self._columns]
        # The rows have not been read yet, so the summary describes only the columns.
        self.summary = replace(table, rows=iter(()), left_out=[], skipped=[]).summary
        self.notes = tuple(f"{self.source}: {column.note}" for column in table.columns if column.note)

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples, and report each line that is left out.

        Raises InputError for an invalid line, and if there is no sample.
        """
        table = self._table
        sample_count = 0
        for row in table.rows:
            self._report_left_out()
            # The times of a channel must increase, because its forces are interpolated between them.
            times = [clock.seconds(row, rises=self.timed) for clock in self._clocks]
            forces = tuple(table.number(row, column) for column in self._force_columns)
            sample_count += 1
            fruit = self._columns["fruit"].cell(row) if self.names_fruit else ""
            # `times` holds the common time `t` first, if the table has one, and then the times of the channels.
            channel_times = tuple(times[-len(forces) :]) if self.timed else ()
            yield Sample(row.line, times[0], forces, channel_times, fruit)
        self._report_left_out()
        if sample_count == 0:
            bound = "at least one line of numbers below the header"
            raise validation_error(table.source, 0, "samples", bound, "record a press")

    def _report_left_out(self) -> None:
        """Report the lines that were left out since the last call, because a stream may never end."""
        for row in (*self._table.left_out, *self._table.skipped):
            self.say(f"left out {row_text(row)}")
        self._table.left_out.clear()
        self._table.skipped.clear()

    def place(self, sample: Sample, tip: int) -> str:
        """Return the name of the cell that holds the force of tip number `tip`, for messages."""
        return self._table.place(sample.line, self._force_columns[tip])


def _column_quantities(tips: int) -> dict[str, Quantity]:
    """Return the quantity of each column that a signal of a sensor with `tips` tips may have, by its key."""
    time = Quantity(units=TIME, default="s", by_clock=True)
    quantities = dict.fromkeys(("t", *time_keys(tips)), time)
    quantities["t"] = replace(time, words=tuple(WORDS["words"]["time"]))
    quantities["fruit"] = Quantity(units={})  # a name, which has no unit
    quantities |= dict.fromkeys(force_keys(tips), Quantity(units=FORCE, default="N"))
    quantities |= dict.fromkeys(count_keys(tips), COUNTS)
    return quantities


def _check_columns(table: FoundTable, required: Sequence[str], optional: Sequence[str], example: str) -> None:
    """Raise InputError unless a table has all `required` columns and no channel that this sensor lacks.

    Columns whose names are in `optional` are allowed too. The message shows `example`, a valid header.
    """
    labels = {column.name: column.label for column in table.columns}  # text in the header, by the key of the column
    if not labels.keys() >= set(required):
        bound = f"a header that also has {' and '.join(name for name in required if name not in labels)}"
        place = place_of(table.source, table.header.line)
        raise validation_error(place, table.header.text, "", bound, f"write for instance {example}")
    unknown = [label for name, label in labels.items() if name not in required and name not in optional]
    # A column that was not recognised may still be a channel of another sensor, with more tips.
    unknown += [label for label in table.header.cells if label not in labels.values() and _is_channel_label(label)]
    if unknown:
        place = place_of(table.source, table.header.line, unknown[0])
        bound = f"one of {', '.join((*optional, *required))}, the columns of this sensor"
        raise validation_error(place, unknown[0], "", bound, f"write for instance {example}")


def _is_channel_label(label: str) -> bool:
    """Return whether a label in a header is the label of a channel of any sensor, with or without a unit."""
    if not label:
        return False
    candidates = [label, *(words for words, _ in label_parts(label))]  # as a whole, and without its unit
    return any(re.fullmatch(_CHANNEL_LABEL, fold_words(words)) for words in candidates)


def numbers_of_text(text: str, tips: int, flag: str, unit: str) -> list[float]:
    """Return the numbers of a flag such as `--forces F1,F2,...`, one per tip.

    Raises InputError if a part of the text is not a number, or if the number of parts is not the number of tips.
    """
    parts = text.split(",")
    numbers = [number for number in map(parse_number, parts) if number is not None]
    if not len(numbers) == tips == len(parts):
        bound = f"{tips} comma-separated numbers in {unit}, one for each tip of this sensor"
        raise validation_error(flag, text, "", bound, f"write {flag} F1,F2,..., with decimal points")
    return numbers
