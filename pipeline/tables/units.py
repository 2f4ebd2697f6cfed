"""The units of measured quantities, and how tables spell them."""

import difflib
import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass

from pipeline.tables.header_words import WORDS
from sensor.quantity import STANDARD_GRAVITY, InputError, nearest, validation_error

LONGEST_LABEL = 200  # maximum length of a label that is searched for words [characters]
SHOWN_LABEL = 60  # length to which a label is truncated in messages [characters]
FORCE = {
    "N": 1.0,
    "kN": 1e3,
    "mN": 1e-3,
    "cN": 1e-2,
    "daN": 10.0,
    "kgf": STANDARD_GRAVITY,
    "gf": 1e-3 * STANDARD_GRAVITY,
    "lbf": 4.4482216152605,
    "ozf": 4.4482216152605 / 16.0,
    "kg": STANDARD_GRAVITY,
    "g": 1e-3 * STANDARD_GRAVITY,
    "lb": 4.4482216152605,
    "oz": 4.4482216152605 / 16.0,
}
"""Newtons per unit of force, or per weight of one unit of mass; the value of the pound-force is exact (NIST SP 811)."""
LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "nm": 1e-6, "in": 25.4, "mil": 25.4e-3, "ft": 304.8}
"""Millimetres per unit."""
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
"""Seconds per unit."""
MODULUS = {"MPa": 1.0, "kPa": 1e-3, "GPa": 1e3}
"""Megapascals per unit."""
_MEASURED = (FORCE, LENGTH, TIME, MODULUS)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """The quantity that a column holds: a number with a unit, or a text if `units` is empty.

    `units` maps each allowed unit to its factor. `default` is the unit that is assumed if no unit is stated; without a
    default, a unit is required. `most` is the largest allowed absolute value, in the unit whose factor is 1.

    `words` are further names of the quantity in headers. A word in `words_with_unit` names the quantity only together
    with one of its units, and only if no other column holds the quantity. Two fields come from flags. `flag_unit` is a
    unit that a header may omit but not contradict. `selected_column` selects a column by its header or by its number,
    counted from 1. With `by_clock`, the clock of a serial monitor may replace the column.
    """

    units: Mapping[str, float]
    default: str = ""
    most: float = math.inf
    words: tuple[str, ...] = ()
    words_with_unit: tuple[str, ...] = ()
    flag_unit: str = ""
    selected_column: str = ""
    by_clock: bool = False


def _strip_signs(text: str) -> str:
    """Return a text without spaces, and without punctuation that is common in and around units."""
    return re.sub(r"[\s_.-]+", "", unicodedata.normalize("NFKC", text)).strip("()[]{}<>:;*'\"")


_SPELLINGS = {
    **{_strip_signs(name).casefold(): name for units in _MEASURED for name in units},
    **{_strip_signs(word).casefold(): name for name, words in WORDS["units"].items() for word in words},
}
"""The unit of each symbol and of each word in words.toml, keyed in lower case and without signs."""


def unit_of(quantity: Quantity, text: str) -> str:
    """Return the unit of a quantity that a text spells, or "" if it does not spell one.

    The case of letters is ignored, except in the symbols `m`, `ms`, `mN` and `MPa`.
    """
    spelling = _strip_signs(text[:LONGEST_LABEL])
    if spelling in quantity.units:
        return spelling
    unit = _SPELLINGS.get(spelling.casefold(), "")
    # The first letter of these symbols must have the right case: Ms is not ms, and mPa is not MPa. A word such as
    # Millimetres is the same unit in any case.
    is_symbol = unit.casefold() == spelling.casefold()
    is_capital_for_small = is_symbol and unit in ("m", "ms", "mN") and spelling[0] == "M"
    is_small_for_capital = is_symbol and unit == "MPa" and spelling.startswith("mP")
    if is_capital_for_small or is_small_for_capital:
        return ""
    return unit if unit in quantity.units else ""


_OTHER_UNITS = {
    _strip_signs(word).casefold() for words in (*WORDS["others"].values(), WORDS["units"]["1"]) for word in words
}
"""Words for units other than of force, length and time, in lower case and without signs.

Some, such as MPa, are units of a measured quantity too.
"""
_POWER = re.compile(r"(?<=[^\W\d_])\^?[23]")  # as in mm2 and mm^2
_PARTS = re.compile(r"[/*\u00b7.\s-]+")  # signs between the units of a compound unit


def is_unit(text: str) -> bool:
    """Return whether a text spells a unit of any measured quantity."""
    return any(unit_of(Quantity(units=units), text) for units in _MEASURED)


def is_other_unit(text: str) -> bool:
    """Return whether a text spells a unit of another quantity, such as V, %, counts, or the compound N/mm."""
    if _strip_signs(text).casefold() in _OTHER_UNITS:
        return True
    plain, power_count = _POWER.subn("", unicodedata.normalize("NFKC", text).strip("()[]{}<> "))
    parts = _PARTS.split(plain)
    return len(parts) + power_count > 1 and all(map(is_unit, parts))  # a single unit without a power is no compound


def needed_unit(place: str, quantity: Quantity, text: str) -> str:
    """Return the unit that a text spells; raises InputError about `place` if it is not a unit of the quantity."""
    unit = unit_of(quantity, text)
    if not unit:
        raise no_unit(place, quantity, text)
    return unit


def no_unit(place: str, quantity: Quantity, text: str) -> InputError:
    """Return the error for a text at `place` that is not a unit of the quantity."""
    near = difflib.get_close_matches(text.lower(), [unit.lower() for unit in quantity.units], n=1)
    hint = f"did you mean {nearest(text, [*quantity.units])}?" if near else "correct it, or name another column"
    return validation_error(place, text[:SHOWN_LABEL], "", f"in one of {', '.join(quantity.units)}", hint)
