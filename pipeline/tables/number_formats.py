"""Notations of numbers: decimal signs, thousands, units after numbers, times of day, and empty cells."""

import datetime
import functools
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from pipeline.tables.decoding import place_of
from pipeline.tables.units import is_unit
from sensor.quantity import validation_error

_LONGEST_NUMBER = 64
_SPACES = " '\u2019\u00a0\u202f\u2009"  # characters that may separate thousands


def _number(decimal: str, other: str) -> re.Pattern[str]:
    """Return the pattern of a number with a decimal sign, where the other sign may separate thousands.

    A number with an exponent has no single thousands sign: 1,500e3 is 1.5e3.
    """
    whole = rf"[0-9]+|[0-9]{{1,3}}(?:[{_SPACES}][0-9]{{3}})+|[1-9][0-9]{{0,2}}(?:\{other}[0-9]{{3}})+"
    exponent = "[eEdD][+-]?[0-9]{1,4}"
    return re.compile(
        rf"(?P<number>[+-]?(?![0-9]+\{other}[0-9]+{exponent})(?:(?:{whole})(?:\{decimal}[0-9]*)?|\{decimal}[0-9]+)"
        rf"(?:{exponent})?)(?: ?(?P<unit>[^\W\d_]{{1,12}}))?"
    )


_WITH_POINT, _WITH_COMMA = _number(".", ","), _number(",", ".")
_FOUR_DIGITS = re.compile("[+-]?[0-9]{4}")
_TIME_OF_DAY = re.compile(
    r"(?:(?P<date>\d{4}-\d\d-\d\d)[ T])?(?P<h>\d{1,2}):(?P<min>\d\d):(?P<s>\d\d(?:[.,]\d{1,9})?)", re.ASCII
)
_MISSING = frozenset(
    ("", "-", "--", "---", "nan", "na", "n/a", "#n/a", "#na", "null", "none", "#value!", "inf", "-inf")
)


class WrittenNumber(NamedTuple):
    """A cell that is a number: its text without spaces, its Python notations, and the unit after it.

    `with_point` and `with_comma` are the notations for these decimal signs, None if the text is no number with that
    sign.
    """

    text: str
    with_point: str | None
    with_comma: str | None
    unit: str

    @property
    def is_sure(self) -> bool:
        """Return whether it is a number with only one decimal sign."""
        return self.with_point is None or self.with_comma is None

    @property
    def unclear(self) -> bool:
        """Return whether its only sign may be decimal or separate thousands, as in 1,500 and 1.500."""
        return not self.is_sure and self.with_point != self.with_comma

    def plain(self, decimal: str) -> str | None:
        """Return the number in Python's notation for a decimal sign; for "", by the sign that the cell itself shows."""
        if decimal:
            return self.with_comma if decimal == "," else self.with_point
        return self.with_comma if self.with_point is None else self.with_point


@functools.lru_cache(maxsize=4096)
def as_number(cell: str) -> WrittenNumber | None:
    """Return the notation of a cell as a number, in digits 0 to 9; None for other text."""
    if not cell or len(cell) > _LONGEST_NUMBER:
        return None
    text = cell.replace("\u2212", "-")
    matches = [pattern.fullmatch(text) for pattern in (_WITH_POINT, _WITH_COMMA)]
    match = matches[0] or matches[1]
    if match is None or (match["unit"] and not is_unit(match["unit"])):
        return None
    number = match["number"].replace("D", "e").replace("d", "e")
    for space in _SPACES:
        number = number.replace(space, "")
    with_point = number.replace(",", "") if matches[0] else None
    with_comma = number.replace(".", "").replace(",", ".") if matches[1] else None
    return WrittenNumber(number, with_point, with_comma, match["unit"] or "")


def is_number(cell: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma, in digits 0 to 9."""
    return as_number(cell) is not None


def is_missing(cell: str) -> bool:
    """Return whether a cell is empty, or states in a common way that it holds no number."""
    return cell.lower() in _MISSING


def seconds_of_day(text: str) -> float | None:
    """Return the seconds of a time of day, with or without a date; None for other text."""
    match = _TIME_OF_DAY.fullmatch(text)
    if match is None:
        return None
    try:
        days = datetime.date.fromisoformat(match["date"]).toordinal() if match["date"] else 0
    except ValueError:
        return None
    seconds = float(match["s"].replace(",", "."))
    return 86400.0 * days + 3600.0 * int(match["h"]) + 60.0 * int(match["min"]) + seconds


def decimal_sign(source: str, columns: Iterable[Sequence[tuple[int, str]]]) -> str:
    """Return the decimal sign of the columns of a table, each a sequence of lines and cells.

    It is the comma if a number has no other reading, else the point. Raises InputError if numbers have two decimal
    signs, and if a sign may be a decimal comma or separate thousands.
    """
    written = [[(line, number) for line, cell in cells if (number := as_number(cell))] for cells in columns]
    every = [number for column in written for _, number in column]
    has_points = any(number.with_comma is None for number in every)
    sign = "," if any(number.with_point is None for number in every) and not has_points else "."
    odd = []
    for column in written:
        # A column separates thousands if one of its numbers shows the decimal sign, and none has four adjacent digits.
        numbers = [number for _, number in column]
        parts = any(number.is_sure for number in numbers) and not any(
            _FOUR_DIGITS.match(number.text) for number in numbers
        )
        for line, number in column:
            if number.plain(sign) is None or (number.unclear and sign not in number.text and not parts):
                odd.append((line, number.text))
    if odd:
        line, text = min(odd)
        bound = "a number whose comma or point is surely decimal: commas may separate thousands here"
        raise validation_error(place_of(source, line), text, "", bound, "export it with decimal points")
    return sign
