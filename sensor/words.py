"""The words and digits in which a person reads a value, on every screen, page and sheet."""

import math

OUTCOMES = {True: "passed", False: "failed", None: "undecided"}
"""How a verdict ended."""
ROUND_OFF = 1e-12
"""Below it a number says nothing in any unit that is shown: mm, N, MPa, N/m, %, fractions of numbers near 1."""
_PLAIN_DECIMALS = 9  # of a number that is written out; a smaller bar has a power of ten


def shown(value: object, unit: str = "", digits: int = 5, *, absent: str = "") -> str:
    """Return a number with some digits and its unit, an outcome in words, or another value as it is.

    Round-off is shown as 0; what is missing or not finite as `absent`.
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return absent
    if isinstance(value, bool):
        return OUTCOMES[value]
    if isinstance(value, float):
        return f"{0.0 if abs(value) < ROUND_OFF else value:.{digits}g}{_beside_number(unit)}"
    return f"{value}{_beside_number(unit)}" if isinstance(value, int) else f"{value}"


def with_bar(value: float, bar: float | None, unit: str = "", *, in_percent: bool = False) -> str:
    """Return a number ± the half width that holds 95 %, with its unit.

    The bar has two digits, and the number ends with them; `in_percent` the bar is told as a share of the number. A
    number without a bar has five digits.
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
    """Return the number of so many digits that is nearest to a value [its unit], or next to it towards a number."""
    found = value if value == 0.0 or towards is None else next_multiple(value, digits, towards)
    return float(f"{found:.{digits}g}")


def next_multiple(value: float, digits: int, towards: float) -> float:
    """Return the multiple of the last of so many digits that is next to a value towards a number [its unit].

    It is a product, whose last bits may differ from the number as it is written. A value that is off a multiple by a
    millionth of the last digit is that multiple. Raises ValueError for 0.
    """
    step = 10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)
    round_to_whole = math.ceil if towards > value else math.floor
    return round_to_whole(round(value / step, 6)) * step


def round_below(value: float) -> float:
    """Return the largest of 1, 2 or 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-12))
