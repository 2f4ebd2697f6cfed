"""The outputs that a study may request: their keys in report.json, the level of solution for each, and their values."""

from collections.abc import Iterable
from typing import Literal

from pipeline.report.keys import report_key, report_keys, value_at
from sensor.gone import refuse_removed_key
from sensor.quantity import nearest, validation_error
from sensor.verdict import row_of, verdict_rows

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""Levels of solution in order of cost.

`contact` solves the contact and sizes the springs by closed-form expressions. `flexures` fits the springs by finite
elements. `files` is a whole run that writes all files.
"""

VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
PASSED = "passed"
"""The key of an output that report.json does not contain: whether all verdicts of a run passed."""


def level_of(name: str, keys: Iterable[str]) -> Level:
    """Return the lowest level of solution that provides all keys; `name` is the name of the list in the study file.

    Raises InputError for a key that is not in report.json; the message suggests the most similar known key.
    """
    return max((_level_of(name, key) for key in keys), key=LEVELS.index, default="contact")


def _level_of(name: str, key: str) -> Level:
    """Return the level of one key; raises InputError for a key that a study cannot request.

    `name` is the name of the list in the study file that contains the key.
    """
    refuse_removed_key(key)
    level = _verdict_level(key) if key.startswith("verdicts.") else _plain_level(key)
    for known_level in LEVELS:  # this loop also narrows the type from str to Level
        if known_level == level:
            return known_level
    bound = "a key of report.json that docs/studies.md lists and that holds a single number or string"
    suggestion = nearest(key, _requestable_keys())
    raise validation_error(name, key, "", bound, f"did you mean {suggestion}?")


def _requestable_keys() -> list[str]:
    """Return the keys that a message may suggest in place of an unknown key, because a study can request them.

    Placeholders in keys are filled in, so that a suggestion can be copied. For a verdict, only the key of its value is
    included.
    """
    plain_keys = []
    for known_key in report_keys():
        if known_key.is_value and known_key.level:
            plain_keys.append(known_key.name.replace("[]", ".0").replace("SPRING", "low"))
    verdict_keys = [f"verdicts.{verdict}.value" for row in verdict_rows() if row.level for verdict in row.names]
    return [*plain_keys, *verdict_keys, PASSED]


def _plain_level(key: str) -> str:
    """Return the level of a key that is not part of a verdict; an empty string if it cannot be requested."""
    if key == PASSED:
        return "files"
    known_key = report_key(key)
    return known_key.level if known_key is not None and known_key.is_value else ""


def _verdict_level(key: str) -> str:
    """Return the level of a key verdicts.NAME.FIELD; an empty string if it cannot be requested.

    The lowest level that decides the verdict is returned. The value of a verdict may need a higher level than its
    outcome.
    """
    verdict, field = verdict_field(key)
    if field not in VERDICT_FIELDS:
        return ""
    row = row_of(verdict)
    if field == "value" and row.value_level:
        return row.value_level
    if row.level:
        return row.level
    # Verdicts on solids have no level in the table of verdicts, because they always need a whole run.
    return "files" if row.group == "solid" else ""


def verdict_field(key: str) -> tuple[str, str]:
    """Split a key verdicts.NAME.FIELD into NAME and FIELD; both are empty for any other key."""
    table, _, rest = key.partition(".")
    name, _, field = rest.rpartition(".")
    return (name, field) if table == "verdicts" else ("", "")


def wanted_value(report: object, key: str) -> object:
    """Return the value of a key in a report or in its parts; raises InputError if the report lacks this key."""
    try:
        return value_at(report, key)
    except KeyError as error:
        bound = "a key of the report of this design"
        raise validation_error("wanted", key, "", bound, "request another key, or change the base") from error
