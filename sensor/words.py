"""Formatting of numbers and outcomes as text for the terminal, pages and sheets."""

import math

OUTCOMES = {True: "passed", False: "failed", None: "undecided"}
"""The text for each outcome of a verdict."""
ROUND_OFF = 1e-12
"""Magnitude below which a number is shown as 0. The same magnitude suits all units in use: mm, N, MPa, N/m, % and 1."""
_MAX_DECIMALS = 9  # maximum number of decimal places; beyond it, a number may be written in scientific notation


def value_text(value: object, unit: str = "", digits: int = 5, *, absent: str = "") -> str:
    """Return a value as text: a number with its unit, or a Boolean as the outcome of a verdict.

    A float has `digits` significant digits, and is shown as 0 if it is smaller than the round-off. An integer has all
    its digits. None, nan and infinity are shown as `absent`. Any other value is converted to a string.
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return absent
    if isinstance(value, bool):
        return OUTCOMES[value]
    if isinstance(value, float):
        number = 0.0 if abs(value) < ROUND_OFF else value
        return f"{number:.{digits}g}{unit_suffix(unit)}"
    return f"{value}{unit_suffix(unit)}" if isinstance(value, int) else f"{value}"  # text has no unit


def value_with_bar(value: float, bar: float | None, unit: str = "", *, in_percent: bool = False) -> str:
    """Return a number with its error bar and its unit, as in 1.23 ± 0.45 N.

    `bar` is the half width of the error bar for 95 % coverage. The error bar is shown with two significant digits, and
    the number with as many decimal places as the error bar. With `in_percent`, the error bar is shown as a percentage
    of the number. A number whose error bar is None, 0, infinite or nan is shown with five digits.
    """
    suffix = unit_suffix(unit)
    if not bar or not math.isfinite(bar):
        return f"{value:.5g}{suffix}"
    number, half_width = _to_digits_of_bar(value, bar)
    if not in_percent:
        return f"{number} ± {half_width}{suffix}"
    if not value:  # a percentage of 0 is not defined
        return f"{number}{suffix}"
    percent = float(f"{100.0 * bar / abs(value):.2g}")
    return f"{number}{suffix} ± {percent:g} %"  # 140, not 1.4e+02


def _to_digits_of_bar(value: float, bar: float) -> tuple[str, str]:
    """Return a number and the half width of its error bar as text, both up to the second digit of the half width."""
    rounded_bar = float(f"{bar:.1e}")  # two significant digits
    decimals = 1 - math.floor(math.log10(rounded_bar))  # number of decimal places of the second digit
    if decimals > _MAX_DECIMALS:  # small numbers are written in scientific notation
        return f"{value:.5g}", f"{rounded_bar:.2g}"
    # `decimals` is negative if the error bar is 100 or more. The numbers are then rounded to tens, hundreds, ...
    shown_decimals = max(decimals, 0)
    number = f"{round(value, decimals):.{shown_decimals}f}"
    half_width = f"{round(rounded_bar, decimals):.{shown_decimals}f}"
    return number, half_width


def unit_suffix(unit: str) -> str:
    """Return the unit after a space, or nothing for a dimensionless number."""
    return "" if unit in ("", "1") else f" {unit}"


def rounded(value: float, digits: int = 3, *, towards: float | None = None) -> float:
    """Return a value rounded to `digits` significant digits.

    The value is rounded to the nearest such number or, if `towards` is given, in the direction of that number.
    """
    multiple = value if value == 0.0 or towards is None else next_multiple(value, digits, towards)
    return float(f"{multiple:.{digits}g}")


def next_multiple(value: float, digits: int, towards: float) -> float:
    """Return the next number with `digits` significant digits, starting from a value in the direction of `towards`.

    If the value differs from such a number by less than a millionth of the last digit, that number is returned. The
    result is computed as a product, so its last bits may differ from those of the decimal number. Raises ValueError if
    the value is 0.
    """
    step = 10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)  # place value of the last significant digit
    round_to_whole = math.ceil if towards > value else math.floor
    return round_to_whole(round(value / step, 6)) * step


def round_below(value: float) -> float:
    """Return the largest number of the form 1, 2 or 5 times a power of ten that does not exceed a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-12))
