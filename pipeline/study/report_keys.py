"""The keys of report.json that a study may ask for, what has to be solved for each, and their values."""

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from cad.input_file import read_toml
from cad.quantity import nearest, validation_error
from pipeline.evaluate import Part
from pipeline.storage.plain import Plain

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""By what they cost: closed forms and contact; springs fitted by finite elements; a whole run with its files."""

VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
_ON_SOLIDS = ("verdicts.geometry.", "verdicts.fit.")  # each solid has verdicts of its own, which only a run knows


def _levels_by_key() -> dict[str, Level]:
    """Return the level of each key that there is; further ones may lie below it."""
    tables = read_toml(Path(__file__).with_suffix(".toml"), "keys of a report")
    levels: dict[str, Level] = {}
    for level in LEVELS:
        for part, keys in tables[level].items():
            levels |= dict.fromkeys((f"{part}.{key}" for key in keys) if keys else [part], level)
    return levels


_LEVELS_BY_KEY = _levels_by_key()


def level_of(name: str, keys: Iterable[str]) -> Level:
    """Return the cheapest level that gives all keys.

    Raises InputError that names the list of keys and the nearest known key, where one is not of report.json.
    """
    return max((_level_of(name, key) for key in keys), key=LEVELS.index, default="contact")


def _level_of(name: str, key: str) -> Level:
    verdict, _, field = key.rpartition(".")
    of_verdict = key.startswith("verdicts.")
    for known, level in _LEVELS_BY_KEY.items():
        below_key = not of_verdict and f"{key}.".startswith(f"{known}.")
        if below_key or (verdict == known and field in VERDICT_FIELDS):
            return level
    if verdict.startswith(_ON_SOLIDS) and field in VERDICT_FIELDS:
        return "files"
    bound = "a key of report.json that docs/studies.md names"
    raise validation_error(name, key, "", bound, f"did you mean {nearest(key, list(_LEVELS_BY_KEY))}?")


def parts_of(keys: Iterable[str], *, reads: bool, linear: bool) -> tuple[Part, ...]:
    """Return which parts of an evaluation give some keys of the level contact.

    A design that `reads` is judged by its readings; a `linear` scene has P_max and NL by the two-spring law alone.
    """
    by_readings = ["reading.", "verdicts.reading."]
    by_response = ["response.", "verdicts.geometry.", "verdicts.P_displacement_independent.", "verdicts.P_monotonic."]
    (by_readings if reads else by_response).append("verdicts.bruise.")
    if not linear:
        by_response += ["verdicts.P_max.", "verdicts.NL."]
    wanted = list(keys)
    parts: list[Part] = []
    if any(key.startswith(tuple(by_readings)) for key in wanted):
        parts.append("reading")
    if any(key.startswith(tuple(by_response)) for key in wanted):
        parts.append("response")
    return tuple(parts)


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
