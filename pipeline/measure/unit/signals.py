"""Signals of a sensor line by line from a CSV file or a stream: time, travel if it is there, one force for each tip."""

import math
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from cad.quantity import InputError

_UNITS = {
    "t": {"s": 1.0, "ms": 1e-3},
    "x": {"mm": 1.0, "um": 1e-3},
    "F": {"N": 1.0, "mN": 1e-3},
}
_DEFAULT_UNITS = {"t": "s", "x": "mm", "F": "N"}
_PAIR = "lh"  # how the tips of a pair are named, low and high
_LONGEST_LINE = 4096  # bytes: what is longer is no line of numbers
_NAME = re.compile(r"(?P<what>t|x|F)(?:_(?P<tip>l|h|\d+))?(?:_(?P<unit>[A-Za-z]+))?")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")


@dataclass(frozen=True)
class Sample:
    """One line of a signal: its number, time [s], travel [mm] or None, and forces in the order of the tips [N]."""

    line: int
    t: float
    x: float | None
    forces: tuple[float, ...]


@dataclass(frozen=True)
class SignalColumns:
    """The columns of a signal by place, what one unit of each is in s, mm or N, and what was assumed of their units.

    `forces` are the places of the forces in the order of the tips; `x` is None where there is no travel.
    """

    names: tuple[str, ...]
    delimiter: str
    factors: tuple[float, ...]
    t: int
    x: int | None
    forces: tuple[int, ...]
    assumed: tuple[str, ...]


def signal_columns(header: str, source: str, tips: int) -> SignalColumns:
    """Return the columns that a header names; raises InputError for one that is unknown, missing or of other tips."""
    delimiter = next((sign for sign in (";", "\t") if sign in header), ",")
    names = tuple(cell.strip().strip('"') for cell in header.split(delimiter))
    expected = expected_header(tips)
    columns = [_column(name, source, expected) for name in names]
    keys = [column.key for column in columns]
    for name, key in zip(names, keys, strict=True):
        if keys.count(key) > 1:
            msg = f"{source} line 1 column {name!r}: must stand once; remove one of the two"
            raise InputError(msg)
    _check_forces(keys, source, tips)
    if "t" not in keys:
        msg = f"{source} line 1: no column t_s; must be a header like {expected}; add the time of each sample"
        raise InputError(msg)
    return SignalColumns(
        names=names,
        delimiter=delimiter,
        factors=tuple(column.factor for column in columns),
        t=keys.index("t"),
        x=keys.index("x") if "x" in keys else None,
        forces=tuple(keys.index(key) for key in force_keys(tips)),
        assumed=tuple(column.assumed for column in columns if column.assumed),
    )


@dataclass(frozen=True)
class _Column:
    """What a column holds: `t`, `x` or a force like `F_1`, what one of its unit is, and what was assumed of it."""

    key: str
    factor: float
    assumed: str


def _column(name: str, source: str, expected: str) -> _Column:
    found = _NAME.fullmatch(name)
    if found is None or (found["what"] != "F") != (found["tip"] is None):
        msg = f"{source} line 1 column {name!r}: must be a header like {expected}; name each column with its unit"
        raise InputError(msg)
    what, unit = found["what"], found["unit"] or _DEFAULT_UNITS[found["what"]]
    known = _UNITS[what]
    if unit not in known:
        msg = f"{source} line 1 column {name!r}: unit {unit} must be one of {', '.join(known)}; convert the column"
        raise InputError(msg)
    assumed = "" if found["unit"] else f"{source}: column {name!r} gives no unit, taken as {unit}"
    return _Column(what if found["tip"] is None else f"F_{found['tip']}", known[unit], assumed)


def _check_forces(keys: Sequence[str], source: str, tips: int) -> None:
    """Raise InputError unless there is one force for each tip."""
    forces, given = force_keys(tips), sorted(key for key in keys if key.startswith("F_"))
    if given != sorted(forces):
        shown = ", ".join(given) or "none"
        bound = f"{', '.join(forces)}, one for each tip of this sensor"
        msg = f"{source} line 1: forces {shown}: must be {bound}; write a header like {expected_header(tips)}"
        raise InputError(msg)


def force_keys(tips: int) -> tuple[str, ...]:
    """Return the names of the forces of a sensor of so many tips, without their unit."""
    names = _PAIR if tips == len(_PAIR) else map(str, range(1, tips + 1))
    return tuple(f"F_{name}" for name in names)


def expected_header(tips: int) -> str:
    """Return the header of a signal of a sensor of so many tips."""
    return ",".join(["t_s", *(f"{key}_N" for key in force_keys(tips))])


class Signal:
    """A signal that is read as it comes; `columns` are those of its header.

    Raises InputError, in one line that names line and column, at the first line that is not as the header says.
    """

    def __init__(self, stream: BinaryIO, source: str, tips: int) -> None:
        """Read the header."""
        self._stream, self._source = stream, source
        self._number = 0
        header = self._line()
        if not header:
            msg = f"{source}: empty; must be a header like {expected_header(tips)} and lines of numbers; record a press"
            raise InputError(msg)
        self.columns = signal_columns(header, source, tips)

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples; blank lines are left out."""
        columns, before = self.columns, -math.inf
        while (line := self._line()) != "":
            if not line.strip():
                continue
            values = self._values(line)
            t = values[columns.t]
            if t < before:
                raise self._fault(columns.t, t, "s", f"at least the {before:g} s of the line before", "sort the lines")
            before = t
            travel = None if columns.x is None else values[columns.x]
            yield Sample(self._number, t, travel, tuple([values[place] for place in columns.forces]))
        if before == -math.inf:
            msg = f"{self._source}: no samples; must have lines of numbers below its header; record a press"
            raise InputError(msg)

    def fault_of_force(self, sample: Sample, tip: int, bound: str, remedy: str) -> InputError:
        """Return the error for the force of a tip in a sample that was just read."""
        return self._fault(self.columns.forces[tip], sample.forces[tip], "N", bound, remedy)

    def _line(self) -> str:
        """Return the next line without its end, "" at the end of the stream, a space for a blank line."""
        raw = self._stream.readline(_LONGEST_LINE)
        if not raw:
            return ""
        self._number += 1
        try:
            text = raw.decode("utf-8-sig" if self._number == 1 else "utf-8")
        except UnicodeDecodeError:
            text = "\0"
        if "\0" in text or len(raw) == _LONGEST_LINE:
            msg = f"{self._source} line {self._number}: must be text in UTF-8, lines of numbers; export it as CSV"
            raise InputError(msg)
        return text.rstrip("\r\n") or " "

    def _values(self, line: str) -> list[float]:
        """Return the numbers of a line, in s, mm and N."""
        columns = self.columns
        cells = line.split(columns.delimiter)
        if len(cells) != len(columns.names):
            remedy = "write decimals with a point" if columns.delimiter == "," else "mend that line"
            count = f"{len(cells)} values; must be {len(columns.names)}, as its header"
            msg = f"{self._source} line {self._number}: {count}; {remedy}"
            raise InputError(msg)
        try:
            values = [float(cell) * factor for cell, factor in zip(cells, columns.factors, strict=True)]
        except ValueError:
            values = [self._number_of(cell, place) for place, cell in enumerate(cells)]
        if not all(map(math.isfinite, values)):
            place = next(place for place, value in enumerate(values) if not math.isfinite(value))
            raise self._fault(place, values[place], "", "a finite number", "leave such samples out")
        return values

    def _number_of(self, cell: str, place: int) -> float:
        """Return the number of a cell; a decimal comma is one where commas do not part columns."""
        text = cell.strip().strip('"')
        if self.columns.delimiter != "," and _DECIMAL_COMMA.fullmatch(text):
            text = text.replace(",", ".")
        try:
            return float(text) * self.columns.factors[place]
        except ValueError:
            raise self._fault(place, text[:40], "", "a number", "mend that line") from None

    def _fault(self, place: int, value: object, unit: str, bound: str, remedy: str) -> InputError:
        shown = f"{value:g}" if isinstance(value, float) else repr(value)
        where = f"{self._source} line {self._number} column {self.columns.names[place]!r}"
        return InputError(f"{where} = {shown}{unit and f' {unit}'}: must be {bound}; {remedy}")


def forces_of_text(text: str, tips: int) -> Sequence[float]:
    """Return the forces [N] of `--forces F1,F2,...`; raises InputError."""
    cells = text.split(",")
    if len(cells) != tips:
        bound = f"{tips} in N, one for each tip of this sensor"
        example = ",".join(f"F{tip}" for tip in range(1, tips + 1))
        msg = f"--forces = {text!r}: {len(cells)} forces; must be {bound}; write --forces {example}"
        raise InputError(msg)
    try:
        return [float(cell) for cell in cells]
    except ValueError:
        msg = f"--forces = {text!r}: must be {tips} numbers in N with commas between; write decimals with a point"
        raise InputError(msg) from None


@contextmanager
def opened_signal(name: str) -> Iterator[BinaryIO]:
    """Open a file of signals, or the standard input for `-`; raises InputError for a file that cannot be read."""
    if name == "-":
        yield sys.stdin.buffer
        return
    path = Path(name)
    if not path.is_file():
        msg = f"FILE.csv = {name!r}: must be a CSV file that is there, or - for a stream; check the path"
        raise InputError(msg)
    with path.open("rb") as stream:
        yield stream
