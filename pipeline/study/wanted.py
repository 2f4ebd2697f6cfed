"""Keys that a study may request: keys of report.json, what must be solved for each, and their values."""

from collections.abc import Iterable
from typing import Literal

from pipeline.report.keys import report_key, report_keys, value_at
from sensor.gone import refuse_gone_key
from sensor.quantity import nearest, validation_error
from sensor.verdict import row_of, verdict_rows

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""Levels by cost: closed forms and contact; springs fitted by finite elements; a whole run with its files."""

VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
PASSED = "passed"
"""The key for whether all verdicts of a run passed, in addition to the keys of its report."""


def level_of(name: str, keys: Iterable[str]) -> Level:
    """Return the cheapest level that gives all keys.

    Raises InputError, which names the list of keys and the closest known key, for a key that is not in report.json.
    """
    return max((_level_of(name, key) for key in keys), key=LEVELS.index, default="contact")


def _level_of(name: str, key: str) -> Level:
    """Return the level of one key; raises InputError for one that a study cannot request."""
    refuse_gone_key(key)
    level = _verdict_level(key) if key.startswith("verdicts.") else _plain_level(key)
    for known in LEVELS:
        if known == level:
            return known
    values = []
    for one in report_keys():
        if one.is_value and one.level:
            values.append(one.name.replace("[]", ".0").replace("SPRING", "low"))
    verdicts = [f"verdicts.{verdict}.value" for row in verdict_rows() if row.level for verdict in row.names]
    bound = "a key of report.json that docs/studies.md names, down to one number or text"
    raise validation_error(name, key, "", bound, f"did you mean {nearest(key, [*values, *verdicts, PASSED])}?")


def _plain_level(key: str) -> str:
    """Return the level of a report key that belongs to no verdict; empty if it cannot be requested."""
    if key == PASSED:
        return "files"
    found = report_key(key)
    return found.level if found is not None and found.is_value else ""


def _verdict_level(key: str) -> str:
    """Return the level of verdicts.NAME.FIELD; empty if it cannot be requested."""
    verdict, field = verdict_field(key)
    if field not in VERDICT_FIELDS:
        return ""
    row = row_of(verdict)
    level = (row.value_level if field == "value" else None) or row.level
    # All verdicts are in the table; verdicts on solids need a whole run.
    return level or ("files" if row.group == "solid" else "")


def verdict_field(key: str) -> tuple[str, str]:
    """Return the NAME and the FIELD of verdicts.NAME.FIELD; both are empty for any other key."""
    table, _, rest = key.partition(".")
    name, _, field = rest.rpartition(".")
    return (name, field) if table == "verdicts" else ("", "")


def wanted_value(report: object, key: str) -> object:
    """Return the value at a key of a report or of its parts.

    Raises InputError if this design's report has no such key.
    """
    try:
        return value_at(report, key)
    except KeyError as error:
        bound = "a key of the report of this design"
        raise validation_error("wanted", key, "", bound, "request another key or change the base") from error
