"""How numbers are written: signs of decimals and of thousands, units behind them, and cells without one."""

import functools
import itertools
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from pipeline.tables.files import place_of
from pipeline.tables.units import is_unit
from sensor.quantity import validation_error

_LONGEST_NUMBER = 64
_DIGIT = re.compile("[0-9]")
_GROUPED_BY_SPACE = re.compile(r"([+-]?[0-9]{1,3})((?:[ '\u2019\u00a0\u202f\u2009][0-9]{3})+)(?![0-9])")
_NUMBER = re.compile(
    r"[+-]?(?P<digits>[0-9.,]*[0-9][0-9.,]*)(?P<exponent>[eEdD][+-]?[0-9]{1,4})?(?: ?(?P<unit>[^\W\d_]{1,12}))?"
)
_GROUPS = re.compile(r"[1-9][0-9]{0,2}([.,])[0-9]{3}(?:\1[0-9]{3})*")
_MISSING = frozenset(
    ("", "-", "--", "---", "nan", "na", "n/a", "#n/a", "#na", "null", "none", "#value!", "inf", "-inf")
)


class WrittenNumber(NamedTuple):
    """A cell that is a number: its text without spaces, the decimal sign and the sign between thousands, "" for none.

    It is `unclear` where the one sign in it may be either, as in 1,500. `unit` is what stands behind it.
    """

    text: str
    decimal: str
    grouping: str
    unclear: bool = False
    unit: str = ""

    def plain(self, decimal: str) -> str:
        """Return the number as Python writes it, where a sign is the decimal one."""
        grouping = "," if decimal == "." else "."
        return self.text.replace(grouping, "").replace(decimal, ".").replace("D", "e").replace("d", "e")


@functools.lru_cache(maxsize=4096)
def as_number(cell: str) -> WrittenNumber | None:
    """Return how a cell is written as a number, in digits 0 to 9; None for other text."""
    if not cell or len(cell) > _LONGEST_NUMBER or not _DIGIT.search(cell):
        return None
    text = cell.replace("\u2212", "-").replace("\u00b5", "u").replace("\u03bc", "u")
    grouped = _GROUPED_BY_SPACE.match(text)
    if grouped:
        text = grouped[1] + re.sub(r"[^0-9]", "", grouped[2]) + text[grouped.end() :]
    match = _NUMBER.fullmatch(text)
    if match is None or (match["unit"] and not is_unit(match["unit"])):
        return None
    unit = match["unit"] or ""
    text = text[: match.start("unit")].strip() if unit else text
    digits = match["digits"]
    signs = [letter for letter in digits if letter in ".,"]
    if not signs:
        return WrittenNumber(text, "", "", unit=unit)
    if len(signs) == 1:
        unclear = not match["exponent"] and not grouped and _GROUPS.fullmatch(digits) is not None
        return WrittenNumber(text, "" if unclear else signs[0], "", unclear, unit)
    # Of several signs the first ones part thousands; the last is the decimal one if it is another.
    *groups, last = signs
    grouping = signs[0]
    whole = digits if last == grouping else digits[: digits.rindex(last)]
    if set(groups) != {grouping} or not _GROUPS.fullmatch(whole):
        return None
    return WrittenNumber(text, "," if grouping == "." else ".", grouping, unit=unit)


def is_number(cell: str) -> bool:
    """Say whether a cell is written as a number, with a decimal point or comma, in digits 0 to 9."""
    return as_number(cell) is not None


def is_missing(cell: str) -> bool:
    """Say whether a cell is empty, or says in a common way that it holds no number."""
    return cell.lower() in _MISSING


def decimal_sign(source: str, columns: Iterable[Sequence[tuple[int, str]]]) -> str:
    """Return the decimal sign of the columns of a table, each a sequence of lines and cells.

    Raises InputError where numbers have two decimal signs, and where a sign may part thousands as well.
    """
    written = [[(line, number) for line, cell in cells if (number := as_number(cell))] for cells in columns]
    numbers = list(itertools.chain.from_iterable(written))
    of_commas = [(line, number) for line, number in numbers if number.decimal == ","]
    has_points = any(number.decimal == "." for _, number in numbers)
    odd = of_commas[:1] if has_points else []
    sign = "," if of_commas else "."
    is_sure = has_points or bool(of_commas)
    for column in written:
        unclear = [(line, number) for line, number in column if _may_be_thousands(number, sign)]
        if unclear and not (is_sure and _parts_thousands(column)):
            odd += unclear
    if odd:
        line, number = min(odd, key=lambda place: place[0])
        bound = "a number whose comma or point is surely decimal: commas may part thousands here"
        raise validation_error(place_of(source, line), number.text, "", bound, "export it with decimal points")
    return sign


def _may_be_thousands(number: WrittenNumber, sign: str) -> bool:
    """Say whether the one sign in a number may part its thousands, where `sign` is the decimal one of its table.

    In a table without decimal commas 1,500 may be 1500, while 1.500 is 1.5: points are decimal in most files.
    """
    return number.unclear and sign not in number.text


def _parts_thousands(column: Sequence[tuple[int, WrittenNumber]]) -> bool:
    """Say whether a column separates thousands: it has decimals, and each large number is separated."""
    numbers = [number for _, number in column]
    is_parted = all(number.grouping or number.unclear or len(_whole(number)) <= 3 for number in numbers)  # noqa: PLR2004
    return is_parted and any(number.decimal for number in numbers)


def _whole(number: WrittenNumber) -> str:
    return re.split(r"[.,eEdD]", number.text.lstrip("+-"))[0]
