"""Numbers and outcomes as text for readers, in terminals, on pages and on sheets."""

import math

OUTCOMES = {True: "passed", False: "failed", None: "undecided"}
"""Outcomes of a verdict as text."""
ROUND_OFF = 1e-12
"""Magnitude below which a number is shown as 0, in all units that are used: mm, N, MPa, N/m, %, and 1."""
_MAX_DECIMALS = 9  # maximum number of decimals; a number whose error bar needs more may be in scientific notation


def shown(value: object, unit: str = "", digits: int = 5, *, absent: str = "") -> str:
    """Return a value as text: a number with `digits` significant digits and its unit, or an outcome of a verdict.

    Round-off is shown as 0. A missing value, nan or infinity is shown as `absent`, and any other value as its text.
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return absent
    if isinstance(value, bool):
        return OUTCOMES[value]
    if isinstance(value, float):
        return f"{0.0 if abs(value) < ROUND_OFF else value:.{digits}g}{_unit_suffix(unit)}"
    return f"{value}{_unit_suffix(unit)}" if isinstance(value, int) else f"{value}"


def value_with_bar(value: float, bar: float | None, unit: str = "", *, in_percent: bool = False) -> str:
    """Return a number with its error bar and its unit, as in 1.23 ± 0.45 N; `bar` is the half width of 95 % coverage.

    The error bar has two digits, and the number ends at the same decimal. With `in_percent` the error bar is shown as a
    percentage of the number. A number without an error bar has five digits.
    """
    unit_suffix = _unit_suffix(unit)
    if not bar or not math.isfinite(bar):
        return f"{value:.5g}{unit_suffix}"
    two_digits = float(f"{bar:.1e}")
    decimals = 1 - math.floor(math.log10(two_digits))
    if decimals > _MAX_DECIMALS:
        number, half_width = f"{value:.5g}", f"{two_digits:.2g}"
    else:
        number, half_width = (f"{round(each, decimals):.{max(decimals, 0)}f}" for each in (value, two_digits))
    if in_percent:
        if not value:
            return f"{number}{unit_suffix}"
        percent = float(f"{100.0 * bar / abs(value):.2g}")
        return f"{number}{unit_suffix} ± {percent:g} %"  # 140, not 1.4e+02
    return f"{number} ± {half_width}{unit_suffix}"


def _unit_suffix(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def rounded(value: float, digits: int = 3, *, towards: float | None = None) -> float:
    """Return a value rounded to `digits` significant digits.

    It is rounded to the nearest number with these digits, or with `towards` in the direction of that number.
    """
    multiple = value if value == 0.0 or towards is None else next_multiple(value, digits, towards)
    return float(f"{multiple:.{digits}g}")


def next_multiple(value: float, digits: int, towards: float) -> float:
    """Return the next number with `digits` significant digits, from a value in the direction of `towards`.

    It is computed as a product, so its last bits may differ from those of the decimal number. A value within a
    millionth of the last digit from such a number counts as that number. Raises ValueError for 0.
    """
    step = 10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)  # value of the last digit
    round_to_whole = math.ceil if towards > value else math.floor
    return round_to_whole(round(value / step, 6)) * step


def round_below(value: float) -> float:
    """Return the largest number of the form 1, 2 or 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-12))
