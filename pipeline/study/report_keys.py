"""The keys of report.json that a study may ask for, what has to be solved for each, and their values."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, Literal

from cad.design.tips import Tips
from cad.quantity import InputError, nearest, validation_error
from pipeline.report.stored import StoredContact, StoredReading, StoredSizing, StoredSpring, StoredTargets
from pipeline.storage.plain import Plain

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""By what they cost: closed forms and contact; springs fitted by finite elements; a whole run with its files."""

_VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")


def _numbers_of(record: type[Any]) -> tuple[str, ...]:
    """Return the keys of a record, but how long it took, which is another number every time."""
    return tuple(item.name for item in dataclasses.fields(record) if item.name != "seconds")


_RECORDS: Mapping[str, type[Any]] = {
    "springs": StoredSizing,
    "contact": StoredContact,
    "level": StoredTargets,
    "reading": StoredReading,
    **{f"flexures.{name}": StoredSpring for name in Tips().names},
}
_WHOLE = ("response", "deflections_mm", "behaviour", "errors", "paper", "passed")
_SECTIONS: Mapping[str, tuple[str, ...]] = {
    **{section: _numbers_of(kind) for section, kind in _RECORDS.items()},
    **dict.fromkeys(_WHOLE, ()),
}
"""Each part of report.json with its keys; any key below a part where none is listed."""
_CONTACT_VERDICTS = (
    "P_max", "NL", *(f"printable.{name}" for name in Tips().names), "P_displacement_independent", "P_monotonic",
    "geometry.tip_face", "geometry.tip_shape", "bruise", "reading.bias", "reading.uncertainty", "reading.lift",
)  # fmt: skip
_FLEXURE_VERDICTS = ("K_l", "K_h")
_FILE_VERDICTS = ("geometry.", "fit.")


def level_of(keys: Iterable[str]) -> Level:
    """Return the cheapest level that gives all keys; raises InputError for one that is no key of report.json."""
    return max((_level_of(key) for key in keys), key=LEVELS.index, default="contact")


def refuse_unknown(name: str, keys: Iterable[str]) -> None:
    """Raise InputError that names a list of keys and the nearest known key, where one is not of report.json."""
    for key in keys:
        try:
            _level_of(key)
        except InputError as error:
            msg = f"{name} {error}"
            raise InputError(msg, field=name, value=key, bound=error.bound) from error


def parts_of(keys: Iterable[str], *, reads: bool, linear: bool) -> tuple[str, ...]:
    """Return which parts of an evaluation give some keys of the level contact: "response", "reading".

    A design that `reads` is judged by its readings; a `linear` scene has P_max and NL by the two-spring law alone.
    """
    parts = set()
    for key in keys:
        name = verdict_name(key)
        if key.split(".")[0] == "reading" or name.startswith("reading.") or (name == "bruise" and reads):
            parts.add("reading")
        elif (
            key.split(".")[0] == "response"
            or name in ("P_displacement_independent", "P_monotonic", "bruise")
            or name.startswith("geometry.tip")
            or (name in ("P_max", "NL") and not linear)
        ):
            parts.add("response")
    return tuple(sorted(parts))


def verdict_name(key: str) -> str:
    """Return the name of the verdict that a key is of, nothing where it is of none."""
    return key.removeprefix("verdicts.").rpartition(".")[0] if key.startswith("verdicts.") else ""


def value_at_key(report: Plain, key: str) -> object:
    """Return the number, text or truth value at a dotted key; verdicts are found by name, lists by index from 0.

    Raises InputError where this design's report has no such key.
    """
    name = verdict_name(key)
    words = key.split(".")
    value: object = report
    if name:
        value = next((row for row in report.get("verdicts", []) if row["name"] == name), {})
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


def _level_of(key: str) -> Level:
    name = verdict_name(key)
    if name and key.rpartition(".")[2] in _VERDICT_FIELDS:
        if name in _CONTACT_VERDICTS:
            return "contact"
        if name in _FLEXURE_VERDICTS:
            return "flexures"
        if name.startswith(_FILE_VERDICTS):
            return "files"
    for section, names in _SECTIONS.items():
        rest = key.removeprefix(f"{section}.").split(".")[0]
        if key == section and not names:
            return _level_of_section(section)
        if key.startswith(f"{section}.") and (not names or rest in names):
            return _level_of_section(section)
    known = [f"{section}.{name}" for section, names in _SECTIONS.items() for name in names]
    known += [
        f"verdicts.{name}.{field}" for name in (*_CONTACT_VERDICTS, *_FLEXURE_VERDICTS) for field in _VERDICT_FIELDS
    ]
    known += [section for section, names in _SECTIONS.items() if not names]
    bound = "a key of report.json that docs/studies.md names"
    raise validation_error("key", key, "", bound, f"did you mean {nearest(key, known)}?")


def _level_of_section(section: str) -> Level:
    if section in ("behaviour", "errors", "paper", "passed"):
        return "files"
    return "flexures" if section.startswith(("flexures", "deflections")) else "contact"
