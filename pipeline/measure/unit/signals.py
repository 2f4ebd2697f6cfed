"""Signals of a sensor line by line, from a CSV file or a stream: time, travel if it is there, a force for each tip."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from cad.quantity import InputError, validation_error
from pipeline.measure.measured_table import (
    FORCE,
    LENGTH,
    TIME,
    Quantity,
    format_of,
    is_number,
    place_of,
    refuse_other_length,
    strict_columns,
)

COUNTS = Quantity(units={"1": 1.0}, default="1", most=2.0**31)


@dataclass(frozen=True)
class Sample:
    """One line of a signal: its number, time [s], travel [mm] or None, and forces in the order of the tips [N]."""

    line: int
    t: float
    x: float | None
    forces: tuple[float, ...]


def force_keys(tips: int) -> tuple[str, ...]:
    """Return the names of the forces of a sensor of so many tips, without their unit; those of a pair are l and h."""
    if tips == 2:  # noqa: PLR2004 - a pair
        return "F_l", "F_h"
    return tuple(f"F_{tip}" for tip in range(1, tips + 1))


def count_keys(tips: int) -> tuple[str, ...]:
    """Return the names of the counts of the channels of a sensor of so many tips, as those of its forces."""
    return tuple(f"counts_{key.removeprefix('F_')}" for key in force_keys(tips))


class Signal:
    """A signal that is read as its lines come; `notes` say which units were assumed.

    Where its header names counts, `counted`, its samples have those in place of forces.

    Raises InputError, in one line that names line and column, at the first line that is not as the header says.
    """

    def __init__(self, lines: Iterable[str], source: str, tips: int) -> None:
        """Read the header."""
        self._lines = enumerate(lines, start=1)
        _, header = next(self._lines, (1, ""))
        self.counted = "counts_" in header.lower()
        keys = count_keys(tips) if self.counted else force_keys(tips)
        unit = "" if self.counted else "_N"
        example = ",".join(["t_s", *(f"{key}{unit}" for key in keys)])
        if not header.strip():
            bound = f"a header like {example} and lines of numbers"
            raise validation_error(source, "", "", bound, "record a press")
        quantities = {"t": Quantity(units=TIME, default="s"), "x": Quantity(units=LENGTH, default="mm")}
        for key in keys:
            quantities[key] = COUNTS if self.counted else Quantity(units=FORCE, default="N")
        self._format = format_of(source, [header])
        columns = strict_columns(self._format, self._format.row(1, header), quantities, ("t", *keys), example)
        self._columns = {column.name: column for column in columns}
        self._force_columns = [self._columns[key] for key in keys]
        self.notes = tuple(f"{source}: {column.note}" for column in columns if column.note)

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples; blank lines are left out."""
        form = self._format
        before = -math.inf
        for number, line in self._lines:
            row = form.row(number, line)
            if row.empty:
                continue
            refuse_other_length(form, row, len(self._columns))
            t = form.number(row, self._columns["t"])
            if t < before:
                place = place_of(form.source, number, self._columns["t"].label)
                raise validation_error(place, t, "s", f"at least the {before:g} s of the line before", "sort the lines")
            before = t
            x = form.number(row, self._columns["x"]) if "x" in self._columns else None
            yield Sample(number, t, x, tuple(form.number(row, column) for column in self._force_columns))
        if before == -math.inf:
            bound = "at least one line of numbers below the header"
            raise validation_error(form.source, 0, "samples", bound, "record a press")

    def force_error(self, sample: Sample, tip: int, bound: str, hint: str, unit: str = "N") -> InputError:
        """Return the error for the force of a tip in a sample, or for the counts of its channel."""
        place = place_of(self._format.source, sample.line, self._force_columns[tip].label)
        return validation_error(place, sample.forces[tip], unit, bound, hint)


def numbers_of_text(text: str, tips: int, flag: str, unit: str) -> list[float]:
    """Return the numbers of a flag like `--forces F1,F2,...`, one for each tip; raises InputError."""
    cells = [cell.strip() for cell in text.split(",")]
    if len(cells) != tips or not all(is_number(cell) for cell in cells):
        bound = f"{tips} numbers in {unit} with commas between, one for each tip of this sensor"
        example = ",".join(f"F{tip}" for tip in range(1, tips + 1))
        raise validation_error(flag, text, "", bound, f"write {flag} {example}, decimals with a point")
    return [float(cell) for cell in cells]
