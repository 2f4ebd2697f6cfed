"""Clocks that wrap around: 32-bit counters of milliseconds or microseconds, and times of day at midnight."""

from collections.abc import Callable

from pipeline.tables.columns import Column
from pipeline.tables.number_formats import seconds_of_day
from pipeline.tables.rows import Row
from pipeline.tables.table import FoundTable
from sensor.quantity import InputError, validation_error

_MILLIS = 2.0**32 * 1e-3  # [s] period of a board's millis()
_DAY = 86400.0  # [s]
_MICROS = 2.0**32 * 1e-6  # [s] period of a board's micros()
_PERIODS = {"ms": (_MILLIS,), "us": (_MICROS,), "s": (_MILLIS, _MICROS)}
_LONGEST_PAUSE = 60.0  # [s] longest pause between the two samples around a restart, and between the two before it


class Clock:
    """The times of a column [s], which keep increasing when the clock restarts."""

    def __init__(self, table: FoundTable, column: Column, say: Callable[[str], None]) -> None:
        """Begin before the first row of the table; `say` is called with a sentence on each restart of the clock."""
        self._table = table
        self._column = column
        self._say = say
        self._last_t: float | None = None  # time of the last row, as returned [s]
        self._was_pause = False  # True if a long pause precedes the last row
        self._offset = 0.0  # sum of the periods of all restarts until now [s]

    def seconds(self, row: Row, *, rises: bool = False) -> float:
        """Return the time of a row [s]; after each restart, the period of the clock is added.

        Raises InputError if the time decreases without a restart of the clock. With `rises`, InputError is also raised
        if two rows have the same time.
        """
        t = self._table.number(row, self._column) + self._offset
        previous_t = self._last_t
        self._last_t = t
        if previous_t is None or t > previous_t or (t == previous_t and not rises):
            self._was_pause = previous_t is not None and t - previous_t > _LONGEST_PAUSE
            return t
        period = self._period_of_restart(row, t, previous_t)
        if period is None:
            raise self._order_error(row, t, previous_t, rises=rises)
        self._offset += period
        self._last_t = t + period
        event = "passes midnight" if period == _DAY else f"passes 2^32 and restarts after {period:.10g} s"
        self._say(f"line {row.line}: the clock of {self._column.label!r} {event}; its times continue from there")
        return self._last_t

    def _period_of_restart(self, row: Row, t: float, previous_t: float) -> float | None:
        """Return the period [s] after which the clock has restarted at this row, or None if it did not restart.

        `t` and `previous_t` are the times of this row and of the row before it [s]. The clock restarted if `t` plus the
        period is at most `_LONGEST_PAUSE` after `previous_t`. If a long pause precedes the previous row, no restart is
        assumed.
        """
        if self._was_pause or t >= previous_t:
            return None
        for period in self._periods(row):
            if 0.0 <= t + period - previous_t <= _LONGEST_PAUSE:
                return period
        return None

    def _order_error(self, row: Row, t: float, previous_t: float, *, rises: bool) -> InputError:
        """Return the error for a time `t` that must come after `previous_t` [s].

        The offset is subtracted from both, so that the message states the times as they are in the file.
        """
        place = self._table.place(row.line, self._column)
        bound = f"{'after' if rises else 'at least'} the {previous_t - self._offset:g} s of the previous line"
        hint = "the clock stopped or restarted there: save each press in its own file, or correct the times"
        return validation_error(place, t - self._offset, "s", bound, hint)

    def _periods(self, row: Row) -> tuple[float, ...]:
        """Return the periods after which the clock may restart [s]: a day, or the range of a 32-bit counter."""
        if seconds_of_day(self._column.cell(row)) is not None:
            return (_DAY,)
        return _PERIODS.get(self._column.unit, ())
