"""Convert counts that a log writes without signs, in two's complement or in offset binary, to signed counts.

The smallest count of a converter with n bits is -2^(n-1). Two's complement read as an unsigned integer writes -1 as
2^n - 1. Offset binary writes the smallest count as 0, and 0 as 2^(n-1).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pipeline.tables.decoding import place_of
from pipeline.tables.measured_table import MeasuredTable
from sensor.quantity import validation_error


def signed_counts(
    written: Sequence[float], counts_as: str | None, saturation: int, place: Callable[[int], str]
) -> tuple[float, ...]:
    """Return the signed counts of one row of a table, one per channel.

    `counts_as` is the notation of the counts `written`: "unsigned" for two's complement read as unsigned integers,
    "offset" for offset binary, or None for signed counts. `saturation` is the largest signed count. `place` maps the
    index of a channel to the name of its cell in messages. Raises InputError for a count at or beyond an end of the
    converter's range.
    """
    half_range = saturation + 1  # 2^(n-1) for a converter with n bits
    # Codes without signs run from 0 to 2^n - 1.
    lowest, highest = (-saturation, saturation) if counts_as is None else (0, 2 * saturation + 1)
    signed = []
    for channel, count in enumerate(written):
        signed_count = count
        if counts_as == "offset":
            signed_count = count - half_range
        elif counts_as == "unsigned" and count >= half_range:  # a negative count in two's complement
            signed_count = count - 2 * half_range
        if abs(signed_count) >= saturation or not lowest <= count <= highest:
            bound = f"between {lowest} and {highest}, the ends of the converter's range"
            hint = "check the channel, use a smaller load, or give --counts-as if the counts have no signs"
            raise validation_error(place(channel), count, "counts", bound, hint)
        signed.append(signed_count)
    return tuple(signed)


def with_signed_counts(
    table: MeasuredTable, keys: Sequence[str], counts_as: str | None, saturation: int
) -> MeasuredTable:
    """Return a copy of the table with signed counts in the columns `keys`; raises InputError like `signed_counts`."""
    rows = zip(*(table.numbers[key].tolist() for key in keys), strict=True)
    signed_rows = []
    for line, row in zip(table.lines, rows, strict=True):
        places = [place_of(table.source, line, key) for key in keys]
        signed_rows.append(signed_counts(row, counts_as, saturation, places.__getitem__))
    signed_columns = dict(zip(keys, np.array(signed_rows).T, strict=True))
    return replace(table, numbers={**table.numbers, **signed_columns})


def refuse_without_counts(counts_as: str | None, source: object) -> None:
    """Raise InputError if `--counts-as` is given for a source without counts."""
    if counts_as is not None:
        bound = f"left out, because {source} has no counts"
        raise validation_error("--counts-as", counts_as, "", bound, "leave it out")
