"""Numbers and outcomes as text for readers, on all screens, pages and sheets."""

import math

OUTCOMES = {True: "passed", False: "failed", None: "undecided"}
"""Outcomes of a verdict as text."""
ROUND_OFF = 1e-12
"""Largest number that is shown as 0, in all units that are shown: mm, N, MPa, N/m, %, fractions of numbers near 1."""
_PLAIN_DECIMALS = 9  # most decimals of a number; with a smaller bar, number and bar may have a power of ten


def shown(value: object, unit: str = "", digits: int = 5, *, absent: str = "") -> str:
    """Return a number with some digits and its unit, an outcome as text, or another value unchanged.

    Round-off is shown as 0, a missing or infinite value as `absent`.
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return absent
    if isinstance(value, bool):
        return OUTCOMES[value]
    if isinstance(value, float):
        return f"{0.0 if abs(value) < ROUND_OFF else value:.{digits}g}{_beside_number(unit)}"
    return f"{value}{_beside_number(unit)}" if isinstance(value, int) else f"{value}"


def with_bar(value: float, bar: float | None, unit: str = "", *, in_percent: bool = False) -> str:
    """Return a number ± its half width of 95 % coverage, with its unit.

    The bar has two digits, and the number ends at the same decimal. With `in_percent` the bar is a percentage of the
    number. A number without a bar has five digits.
    """
    of_unit = _beside_number(unit)
    if not bar or not math.isfinite(bar):
        return f"{value:.5g}{of_unit}"
    two_digits = float(f"{bar:.1e}")
    decimals = 1 - math.floor(math.log10(two_digits))
    if decimals > _PLAIN_DECIMALS:
        number, half_width = f"{value:.5g}", f"{two_digits:.2g}"
    else:
        number, half_width = (f"{round(each, decimals):.{max(decimals, 0)}f}" for each in (value, two_digits))
    if in_percent:
        if not value:
            return f"{number}{of_unit}"
        percent = float(f"{100.0 * bar / abs(value):.2g}")
        return f"{number}{of_unit} ± {percent:g} %"  # 140, not 1.4e+02
    return f"{number} ± {half_width}{of_unit}"


def _beside_number(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def rounded(value: float, digits: int = 3, *, towards: float | None = None) -> float:
    """Return a value [its unit] with so many significant digits.

    It is the nearest such number, or, with `towards`, the next one from the value towards that number.
    """
    found = value if value == 0.0 or towards is None else next_multiple(value, digits, towards)
    return float(f"{found:.{digits}g}")


def next_multiple(value: float, digits: int, towards: float) -> float:
    """Return the next number with so many significant digits from a value towards another number [same unit].

    It is a product, whose last bits may differ from the number as it is written. A value that is within a millionth of
    the last digit of such a number is that number. Raises ValueError for 0.
    """
    step = 10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)
    round_to_whole = math.ceil if towards > value else math.floor
    return round_to_whole(round(value / step, 6)) * step


def round_below(value: float) -> float:
    """Return the largest number not above a positive value that is 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-12))
