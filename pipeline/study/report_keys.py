"""The keys of report.json that a study may ask for, what has to be solved for each, and their values."""

from collections.abc import Iterable
from typing import Literal

from cad.design.tips import Tips
from cad.quantity import nearest, validation_error
from pipeline.evaluate import Part
from pipeline.storage.plain import Plain

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""By what they cost: closed forms and contact; springs fitted by finite elements; a whole run with its files."""

_VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
_VERDICTS: dict[str, Level] = {
    **dict.fromkeys(("P_max", "NL", "P_displacement_independent", "P_monotonic", "bruise"), "contact"),
    **dict.fromkeys((f"printable.{name}" for name in Tips().names), "contact"),
    **dict.fromkeys(("reading.bias", "reading.uncertainty", "reading.lift"), "contact"),
    **dict.fromkeys(("geometry.tip_face", "geometry.tip_shape"), "contact"),
    **dict.fromkeys(("K_l", "K_h"), "flexures"),
}
"""The verdicts but those on solids, whose names begin with one of the next."""
_ON_SOLIDS = ("geometry.", "fit.")
_SPRING_KEYS = (
    "target_N_per_m", "stiffness_N_per_m", "error_percent", "dimensions_mm", "root_strain",
    "root_strain_error_percent", "safety_factor", "dofs",
)  # fmt: skip
_KEYS: dict[str, tuple[str, ...]] = {
    "springs": ("K_l_N_per_m", "K_h_N_per_m", "K_m_max_N_per_m", "K_m_over_E_mm", "fruit_stiffness"),
    "contact": (
        "error_percent", "s11_error_percent", "method", "dofs", "status", "compliance_per_mm", "K_m_over_E_mm",
    ),
    "level": ("P_max", "P_max_error", "NL", "NL_error"),
    "reading": (
        "E_bias_percent", "E_bias_error_percent", "uncertainty_percent", "sources", "method", "lift_deg",
        "plates_before_zeroing_percent", "noise_for_10_percent", "refused", "moduli", "skin_pressure",
    ),
    **dict.fromkeys((f"flexures.{name}" for name in Tips().names), _SPRING_KEYS),
}  # fmt: skip
"""The keys of some parts of report.json, but how long a solve took, which is another number every time."""


def _levels_by_key() -> dict[str, Level]:
    """Return the level of each key that there is; further ones may lie below it."""
    levels: dict[str, Level] = {"response": "contact", "deflections_mm": "flexures"}
    levels |= dict.fromkeys(("behaviour", "errors", "paper", "passed"), "files")
    for part, keys in _KEYS.items():
        level: Level = "flexures" if part.startswith("flexures") else "contact"
        levels |= dict.fromkeys((f"{part}.{key}" for key in keys), level)
    return levels


_LEVELS_BY_KEY = _levels_by_key()


def level_of(name: str, keys: Iterable[str]) -> Level:
    """Return the cheapest level that gives all keys.

    Raises InputError that names the list of keys and the nearest known key, where one is not of report.json.
    """
    return max((_level_of(name, key) for key in keys), key=LEVELS.index, default="contact")


def _level_of(name: str, key: str) -> Level:
    verdict, _, field = key.removeprefix("verdicts.").rpartition(".")
    if key.startswith("verdicts."):
        if field in _VERDICT_FIELDS and verdict in _VERDICTS:
            return _VERDICTS[verdict]
        if field in _VERDICT_FIELDS and verdict.startswith(_ON_SOLIDS):
            return "files"
    for known, level in _LEVELS_BY_KEY.items():
        if key == known or key.startswith(f"{known}."):
            return level
    keys = [*_LEVELS_BY_KEY, *(f"verdicts.{verdict}.{field}" for verdict in _VERDICTS for field in _VERDICT_FIELDS)]
    bound = "a key of report.json that docs/studies.md names"
    raise validation_error(name, key, "", bound, f"did you mean {nearest(key, keys)}?")


def parts_of(keys: Iterable[str], *, reads: bool, linear: bool) -> tuple[Part, ...]:
    """Return which parts of an evaluation give some keys of the level contact.

    A design that `reads` is judged by its readings; a `linear` scene has P_max and NL by the two-spring law alone.
    """
    by_readings = ["reading", "verdicts.reading"]
    by_response = ["response", "verdicts.geometry", "verdicts.P_displacement_independent", "verdicts.P_monotonic"]
    (by_readings if reads else by_response).append("verdicts.bruise")
    if not linear:
        by_response += ["verdicts.P_max", "verdicts.NL"]
    parts: list[Part] = []
    for key in keys:
        if key.startswith(tuple(f"{part}." for part in by_readings)):
            parts.append("reading")
        if key.startswith(tuple(f"{part}." for part in by_response)):
            parts.append("response")
    return tuple(sorted(set(parts)))


def value_at_key(report: Plain, key: str) -> object:
    """Return the number, text or truth value at a dotted key; verdicts are found by name, lists by index from 0.

    Raises InputError where this design's report has no such key.
    """
    words = key.split(".")
    value: object = report
    if words[0] == "verdicts":
        verdicts = {verdict["name"]: verdict for verdict in report.get("verdicts", [])}
        value = verdicts.get(".".join(words[1:-1]))
        words = words[-1:]
    for word in words:
        if isinstance(value, dict) and word in value:
            value = value[word]
        elif isinstance(value, list) and word.isdecimal() and int(word) < len(value):
            value = value[int(word)]
        else:
            bound = "in the report of this design, and it is not"
            raise validation_error("wanted", key, "", bound, "ask for another key or change the base")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    bound = "one number or text, and it is a list or a table"
    raise validation_error("wanted", key, "", bound, "add the next key or the index in it")
