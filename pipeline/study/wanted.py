"""The outputs that a study may request: keys of report.json, what must be solved for each, and their values."""

from collections.abc import Iterable
from typing import Literal

from pipeline.report.keys import report_key, report_keys, value_at
from sensor.gone import refuse_gone_key
from sensor.quantity import nearest, validation_error
from sensor.verdict import row_of, verdict_rows

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""Levels of a solution by cost: closed forms and contact; springs fitted by finite elements; a whole run with files."""

VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
PASSED = "passed"
"""The key of an output that is not in the report: whether all verdicts of a run passed."""


def level_of(name: str, keys: Iterable[str]) -> Level:
    """Return the cheapest level of solution that yields all keys; `name` is the name of the list in the study file.

    Raises InputError for a key that is not in report.json; the message suggests the closest known key.
    """
    return max((_level_of(name, key) for key in keys), key=LEVELS.index, default="contact")


def _level_of(name: str, key: str) -> Level:
    """Return the level of one key; raises InputError for a key that a study cannot request."""
    refuse_gone_key(key)
    level = _verdict_level(key) if key.startswith("verdicts.") else _plain_level(key)
    for known_level in LEVELS:
        if known_level == level:
            return known_level
    # The key is unknown: suggest the closest one among all that can be requested, with their placeholders filled in.
    values = []
    for known_key in report_keys():
        if known_key.is_value and known_key.level:
            values.append(known_key.name.replace("[]", ".0").replace("SPRING", "low"))
    verdicts = [f"verdicts.{verdict}.value" for row in verdict_rows() if row.level for verdict in row.names]
    bound = "a key of report.json that docs/studies.md names, down to one number or text"
    raise validation_error(name, key, "", bound, f"did you mean {nearest(key, [*values, *verdicts, PASSED])}?")


def _plain_level(key: str) -> str:
    """Return the level of a key that does not belong to a verdict; an empty string if it cannot be requested."""
    if key == PASSED:
        return "files"
    known_key = report_key(key)
    return known_key.level if known_key is not None and known_key.is_value else ""


def _verdict_level(key: str) -> str:
    """Return the level of a key verdicts.NAME.FIELD; an empty string if it cannot be requested."""
    verdict, field = verdict_field(key)
    if field not in VERDICT_FIELDS:
        return ""
    row = row_of(verdict)
    level = (row.value_level if field == "value" else None) or row.level
    # A verdict on a solid has no level in the table of verdicts, because it needs a whole run.
    return level or ("files" if row.group == "solid" else "")


def verdict_field(key: str) -> tuple[str, str]:
    """Split a key verdicts.NAME.FIELD into NAME and FIELD; both are empty for any other key."""
    table, _, rest = key.partition(".")
    name, _, field = rest.rpartition(".")
    return (name, field) if table == "verdicts" else ("", "")


def wanted_value(report: object, key: str) -> object:
    """Return the value at a key of a report or of its parts; raises InputError if the report has no such key."""
    try:
        return value_at(report, key)
    except KeyError as error:
        bound = "a key of the report of this design"
        raise validation_error("wanted", key, "", bound, "request another key or change the base") from error
