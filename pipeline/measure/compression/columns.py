"""What a column of a machine's table holds, by its header: force, travel or time, in which unit."""

import re
from dataclasses import dataclass
from typing import Literal

from cad.quantity import nearest, validation_error

Kind = Literal["force", "travel", "time"]

FORCE_UNITS = {"N": 1.0, "kN": 1e3, "mN": 1e-3, "kgf": 9.80665, "gf": 9.80665e-3, "lbf": 4.4482216152605}
"""Newtons in one unit; the kilogram-force and the pound-force are exact (BIPM, NIST SP 811)."""
TRAVEL_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "in": 25.4}
"""Millimetres in one unit."""
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
"""Seconds in one unit."""
UNITS: dict[Kind, dict[str, float]] = {"force": FORCE_UNITS, "travel": TRAVEL_UNITS, "time": TIME_UNITS}

_SPELLINGS = {
    "sec": "s", "sec.": "s", "second": "s", "seconds": "s", "秒": "s", "msec": "ms", "µm": "um", "μm": "um",
    "inch": "in", "kg": "kgf", "g": "gf", "lb": "lbf", "lbs": "lbf", "newton": "N", "分": "min",
}  # fmt: skip
_WORDS: dict[Kind, tuple[str, ...]] = {
    "force": (
        "force", "load", "f", "test force", "compression force", "compressive force", "compressive load",
        "standard force", "axial force", "kraft", "standardkraft", "試験力", "荷重", "力",
    ),
    "travel": (
        "travel", "stroke", "displacement", "disp", "disp.", "crosshead", "position", "deformation", "compression",
        "compressive extension", "extension", "x", "weg", "standardweg", "traversenweg", "ストローク", "変位",
    ),
    "time": ("time", "t", "elapsed time", "zeit", "prüfzeit", "時間", "時刻"),
}  # fmt: skip
_IN_BRACKETS = re.compile(r"^(.*?)\s*[(\[\uff08]\s*([^)\]\uff09]*)\s*[)\]\uff09]$")  # as wide brackets too
_BEHIND = re.compile(r"^(.*?)[\s_/,:-]+([^\s_/,:-]+)$")


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column by its place, from 0; `unit` is None where its header gives none."""

    place: int
    label: str
    kind: Kind
    unit: str | None


def column_of(place: int, cell: str) -> Column | None:
    """Return the column that a header's cell names; None for one that is neither force, travel nor time.

    Raises InputError for a unit in brackets that is not known.
    """
    bracketed = _IN_BRACKETS.match(cell)
    if bracketed:
        kind = _kind(bracketed[1])
        return None if kind is None else Column(place=place, label=cell, kind=kind, unit=unit_of(kind, bracketed[2]))
    kind = _kind(cell)
    if kind is not None:
        return Column(place=place, label=cell, kind=kind, unit=None)
    behind = _BEHIND.match(cell)
    kind = _kind(behind[1]) if behind else None
    if behind is None or kind is None:
        return None
    return Column(place=place, label=cell, kind=kind, unit=unit_of(kind, behind[2]))


def unit_of(kind: Kind, text: str, name: str = "") -> str:
    """Return the known unit that a text spells; raises InputError that calls the text by a name."""
    known = UNITS[kind]
    plain = text.strip()
    spelled = _SPELLINGS.get(plain.lower(), plain)
    if spelled in known:
        return spelled
    alike = [unit for unit in known if unit.lower() == spelled.lower()]
    if len(alike) == 1 and spelled.lower() != "mn":
        return alike[0]
    remedy = f"did you mean {nearest(plain, [*known])}?"
    raise validation_error(name or f"unit of the {kind}", plain, "", f"one of {', '.join(known)}", remedy)


def given_units(force: str | None, travel: str | None) -> dict[Kind, str]:
    """Return the units that the flags --force-unit and --travel-unit give; raises InputError for an unknown one."""
    given: dict[Kind, str | None] = {"force": force, "travel": travel}
    return {kind: unit_of(kind, unit, f"--{kind}-unit") for kind, unit in given.items() if unit is not None}


def is_unit(cell: str) -> bool:
    """Say whether a cell is one of the known units, as in a row of units."""
    plain = cell.strip("()[] ")
    spelled = _SPELLINGS.get(plain.lower(), plain)
    return any(spelled.lower() == unit.lower() for known in UNITS.values() for unit in known)


def _kind(words: str) -> Kind | None:
    plain = re.sub(r"[\s_]+", " ", words).strip().lower()
    return next((kind for kind, known in _WORDS.items() if plain in known), None)
