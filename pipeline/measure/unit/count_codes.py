"""Signed counts of converters whose log has no sign: in two's complement, or in offset binary.

A converter of n bits counts from -2^(n-1) on. Where the sign of two's complement is left out, -1 is written as 2^n - 1.
In offset binary the least count is written as 0, and 0 as 2^(n-1). Both are told apart by what a channel does. It has
no jump by most of the range, and a free sensor shows the zero of its calibration.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum

import numpy as np

from pipeline.measure.tables.files import place_of
from pipeline.measure.tables.measured_table import MeasuredTable
from sensor.arrays import Floats
from sensor.quantity import validation_error

_SMALLER = 0.5  # of the other span: the jump of a wrong code is most of the range
_FREE = 0.125  # of the largest count: how far a free sensor is from 0 at most
_PRESSED = 0.5  # of the largest count: how far the middle of a press is from a free sensor


class CountCode(Enum):
    """How counts are written."""

    SIGNED = "signed counts"
    WITHOUT_SIGN = "two's complement without its sign"
    OFFSET = "offset binary"

    def signed(self, counts: Floats, saturation: int) -> Floats:
        """Return signed counts of a converter whose largest count is `saturation`."""
        half = saturation + 1
        match self:
            case CountCode.SIGNED:
                return counts
            case CountCode.OFFSET:
                return counts - half
            case CountCode.WITHOUT_SIGN:
                return np.where((counts > saturation) & (counts < 2 * half), counts - 2 * half, counts)

    def understood(self, saturation: int) -> str:
        """Return how an answer says it."""
        zero = f"{saturation + 1} is 0" if self is CountCode.OFFSET else f"{2 * saturation + 1} is -1"
        return f"counts read as {self.value}: {zero}"


def _may_be_unsigned(counts: Floats, saturation: int) -> bool:
    """Say whether counts may lack their sign: none is below 0, and the range is one of whole bits."""
    is_range = saturation > 1 and (saturation + 1).bit_count() == 1
    return is_range and counts.min() >= 0.0 and counts.max() <= 2 * saturation + 1


def code_by_zero(counts: Floats, zero: Sequence[float] | Floats, saturation: int) -> CountCode:
    """Return the code by which the middle of counts (rows, channels) is nearest to the zero of their calibration."""
    if not _may_be_unsigned(counts, saturation):
        return CountCode.SIGNED
    far = {code: _from_zero(code, counts, zero, saturation) for code in (CountCode.WITHOUT_SIGN, CountCode.OFFSET)}
    is_offset = (far[CountCode.OFFSET] < far[CountCode.WITHOUT_SIGN]).all()
    return CountCode.OFFSET if is_offset else CountCode.WITHOUT_SIGN


def _from_zero(code: CountCode, counts: Floats, zero: Sequence[float] | Floats, saturation: int) -> Floats:
    """Return how far the middle of each channel is from its zero by a code."""
    return np.abs(np.median(code.signed(counts, saturation), axis=0) - zero)


def with_signed_counts(
    table: MeasuredTable, keys: Sequence[str], saturation: int, zero: Sequence[float] | None = None
) -> MeasuredTable:
    """Return a table whose counts, in the columns of some keys, are signed; it says what they were read as.

    `zero` are the signed counts without load of each channel; None for a table of weights, whose `force` tells where
    they are. Raises InputError for counts beyond the range whose code is not sure. What are no unsigned counts is
    left to `counts_of`.
    """
    counts = np.column_stack([table.numbers[key] for key in keys])
    if not _may_be_unsigned(counts, saturation):
        return table
    if zero is None:
        code = _code_of_weights(counts, counts[table.numbers["force"] == 0.0], saturation)
    else:
        code = _code_near(counts, zero, _PRESSED, saturation)
    if code is None:
        row = int(counts.max(axis=1).argmax())
        place = place_of(table.source, table.lines[row])
        bound = f"within +-{saturation}, or without a sign from a free sensor near 0 or {saturation + 1}"
        raise validation_error(place, float(counts.max()), "counts", bound, "write signed counts")
    signed = code.signed(counts, saturation)
    if (signed == counts).all():
        return table
    return replace(
        table,
        numbers={**table.numbers, **dict(zip(keys, signed.T, strict=True))},
        understood=f"{table.understood}; {code.understood(saturation)}",
    )


def _code_of_weights(counts: Floats, free: Floats, saturation: int) -> CountCode | None:
    """Return the code by which no channel jumps over the rows, counts and those of a free sensor (rows, channels).

    Where no channel passes 0 or the middle of the range, it is that by which the free sensor is near 0. Both codes then
    differ by a constant, which a tare takes off. None where it is not sure.
    """
    if counts.max() <= saturation:
        return CountCode.SIGNED
    without_sign = np.ptp(CountCode.WITHOUT_SIGN.signed(counts, saturation), axis=0)
    offset = np.ptp(CountCode.OFFSET.signed(counts, saturation), axis=0)
    jumps_as_offset = bool((without_sign <= _SMALLER * offset).any())
    jumps_without_sign = bool((offset <= _SMALLER * without_sign).any())
    if jumps_as_offset != jumps_without_sign:
        return CountCode.WITHOUT_SIGN if jumps_as_offset else CountCode.OFFSET
    is_shifted = (without_sign == offset).all() and len(free) > 0
    return _code_near(free, np.zeros(counts.shape[1]), _FREE, saturation) if is_shifted else None


def _code_near(counts: Floats, zero: Sequence[float] | Floats, near: float, saturation: int) -> CountCode | None:
    """Return the code of `code_by_zero`; None where it has counts beyond the range, and they are not near to zero."""
    code = code_by_zero(counts, zero, saturation)
    if _from_zero(code, counts, zero, saturation).max() <= near * saturation:
        return code
    return CountCode.SIGNED if counts.max() <= saturation else None


class SignedSamples:
    """Turns the counts of a signal into signed ones as they come, by the tare of its free sensor."""

    def __init__(
        self, free: Sequence[Sequence[float]], zero: Sequence[float], saturation: int, say: Callable[[str], None]
    ) -> None:
        """Take the counts of a free sensor, (samples, channels); `say` hears once what the counts are read as."""
        self._saturation = saturation
        self._say = say
        self._is_unsigned = False  # counts have come that are no signed ones
        self._is_signed = False  # or one below 0
        self._code = code_by_zero(np.array(free), zero, saturation)

    def signed(self, counts: Sequence[float], place: Callable[[int], str]) -> tuple[float, ...]:
        """Return the signed counts of one sample, whose channels errors name by their place.

        Raises InputError for a count below 0 after unsigned ones. After one below 0 counts are taken as they are.
        """
        written = np.array(counts)
        if written.min() < 0.0:
            if self._is_unsigned:
                channel = int(written.argmin())
                bound = f"0 or more: counts before are read as {self._code.value}"
                raise validation_error(place(channel), counts[channel], "counts", bound, "check the channel")
            self._is_signed = True
        if self._is_signed:
            return tuple(counts)
        signed = self._code.signed(written, self._saturation)
        if not self._is_unsigned and (signed != written).any():
            self._is_unsigned = True
            self._say(self._code.understood(self._saturation))
        return tuple(signed.tolist())
