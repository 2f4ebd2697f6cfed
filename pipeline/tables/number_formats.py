"""How cells write numbers: decimal signs, thousands separators, units after numbers, times of day, and empty cells."""

import datetime
import functools
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from pipeline.tables.decoding import place_of
from pipeline.tables.units import is_unit
from sensor.quantity import validation_error

_MAX_NUMBER_LENGTH = 64  # maximum length of a number; a longer text is not a number [characters]
_SPACES = " '\u2019\u00a0\u202f\u2009"  # characters that may separate thousands


def _number_pattern(decimal: str, other: str) -> re.Pattern[str]:
    """Return the pattern of a number with the decimal sign `decimal`, in which the sign `other` may separate thousands.

    If a number has an exponent and only one sign, the sign is decimal: 1,500e3 is 1.5e3.
    """
    by_spaces = rf"[0-9]{{1,3}}(?:[{_SPACES}][0-9]{{3}})+"  # thousands that spaces separate
    by_sign = rf"[1-9][0-9]{{0,2}}(?:\{other}[0-9]{{3}})+"  # thousands that the other sign separates
    whole = rf"[0-9]+|{by_spaces}|{by_sign}"
    exponent = "[eEdD][+-]?[0-9]{1,4}"
    other_is_decimal = rf"[0-9]+\{other}[0-9]+{exponent}"
    number = rf"[+-]?(?!{other_is_decimal})(?:(?:{whole})(?:\{decimal}[0-9]*)?|\{decimal}[0-9]+)(?:{exponent})?"
    unit = r"[^\W\d_]{1,12}"
    return re.compile(rf"(?P<number>{number})(?: ?(?P<unit>{unit}))?")


_WITH_POINT, _WITH_COMMA = _number_pattern(".", ","), _number_pattern(",", ".")
_FOUR_DIGITS = re.compile("[+-]?[0-9]{4}")
_TIME_OF_DAY = re.compile(
    r"(?:(?P<date>\d{4}-\d\d-\d\d)[ T])?(?P<h>\d{1,2}):(?P<min>\d\d):(?P<s>\d\d(?:[.,]\d{1,9})?)", re.ASCII
)
_MISSING = frozenset(
    ("", "-", "--", "---", "nan", "na", "n/a", "#n/a", "#na", "null", "none", "#value!", "inf", "-inf")
)


class WrittenNumber(NamedTuple):
    """A cell that holds a number: its text without spaces, and the unit after the number.

    `with_point` is the number in Python's notation if the point is the decimal sign, and `with_comma` if the comma is.
    Either of them is None if the text is not a number with that decimal sign.
    """

    text: str
    with_point: str | None
    with_comma: str | None
    unit: str

    @property
    def is_unambiguous(self) -> bool:
        """Return whether the text is a number with only one of the two decimal signs."""
        return self.with_point is None or self.with_comma is None

    @property
    def is_unclear(self) -> bool:
        """Return whether a sign in the text may be decimal or may separate thousands, as in 1,500 and 1.500."""
        return not self.is_unambiguous and self.with_point != self.with_comma

    def plain(self, decimal: str) -> str | None:
        """Return the number in Python's notation, or None if the text is not a number with the sign `decimal`.

        If `decimal` is "", the text itself determines the decimal sign; the point is preferred.
        """
        if decimal:
            return self.with_comma if decimal == "," else self.with_point
        return self.with_comma if self.with_point is None else self.with_point


@functools.lru_cache(maxsize=4096)
def as_number(cell: str) -> WrittenNumber | None:
    """Return the number that a cell holds, which may be followed by a unit; None for other text."""
    if not cell or len(cell) > _MAX_NUMBER_LENGTH:
        return None
    text = cell.replace("\u2212", "-")  # the typographic minus sign
    point_match, comma_match = _WITH_POINT.fullmatch(text), _WITH_COMMA.fullmatch(text)
    match = point_match or comma_match
    if match is None or (match["unit"] and not is_unit(match["unit"])):  # text such as `3 samples`
        return None
    number = match["number"].replace("D", "e").replace("d", "e")  # Fortran writes exponents with D
    for space in _SPACES:
        number = number.replace(space, "")
    # The sign that is not decimal separates thousands, so it is removed.
    with_point = number.replace(",", "") if point_match else None
    with_comma = number.replace(".", "").replace(",", ".") if comma_match else None
    return WrittenNumber(number, with_point, with_comma, match["unit"] or "")


def is_number(cell: str) -> bool:
    """Return whether a cell holds a number in digits 0 to 9, with a decimal point or comma."""
    return as_number(cell) is not None


def is_missing(cell: str) -> bool:
    """Return whether a cell is empty, or holds a common placeholder for a missing number, such as "-" or "n/a"."""
    return cell.lower() in _MISSING


def seconds_of_day(text: str) -> float | None:
    """Return a time of day in seconds, counted from the year 1 if the text has a date; None for other text."""
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
    """Return the decimal sign of all numbers in a table; each column is a sequence of pairs of line number and cell.

    The comma is decimal if at least one number is valid only with a decimal comma, and no number only with a decimal
    point. In all other cases, the point is decimal. Raises InputError if numbers have different decimal signs, or if a
    sign may be decimal or may separate thousands.
    """
    numbers_by_column = [[(line, number) for line, cell in cells if (number := as_number(cell))] for cells in columns]
    all_numbers = [number for column in numbers_by_column for _, number in column]
    has_points = any(number.with_comma is None for number in all_numbers)
    has_commas = any(number.with_point is None for number in all_numbers)
    sign = "," if has_commas and not has_points else "."
    ambiguous = [pair for column in numbers_by_column for pair in _ambiguous_numbers(column, sign)]
    if ambiguous:
        line, text = min(ambiguous)  # the first one in the file
        bound = "a number whose comma or point is clearly decimal, because commas may separate thousands here"
        raise validation_error(place_of(source, line), text, "", bound, "export it with decimal points")
    return sign


def _ambiguous_numbers(column: Sequence[tuple[int, WrittenNumber]], sign: str) -> Iterator[tuple[int, str]]:
    """Yield the line number and the text of each number in a column whose value is not certain.

    The number is invalid with the decimal sign `sign`, or its only sign is the other one and may be decimal too.
    """
    # The other sign separates thousands if one number of the column shows the decimal sign, and if no number begins
    # with four digits in a row.
    has_thousands_sign = any(number.is_unambiguous for _, number in column) and not any(
        _FOUR_DIGITS.match(number.text) for _, number in column
    )
    for line, number in column:
        is_invalid = number.plain(sign) is None
        is_unclear = number.is_unclear and sign not in number.text and not has_thousands_sign
        if is_invalid or is_unclear:
            yield line, number.text
