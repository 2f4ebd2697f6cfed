"""What a study may ask for: keys of report.json, what has to be solved for each, and their values."""

from collections.abc import Iterable
from typing import Literal

from pipeline.report.keys import report_key, report_keys, value_at
from sensor.gone import refuse_gone_key
from sensor.quantity import nearest, validation_error
from sensor.verdict import row_of, verdict_rows

Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""By what they cost: closed forms and contact; springs fitted by finite elements; a whole run with its files."""

VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
PASSED = "passed"
"""Whether all verdicts of a run passed: what a study may ask for beside the keys of its report."""


def level_of(name: str, keys: Iterable[str]) -> Level:
    """Return the cheapest level that gives all keys.

    Raises InputError that names the list of keys and the nearest known key, where one is not of report.json.
    """
    return max((_level_of(name, key) for key in keys), key=LEVELS.index, default="contact")


def _level_of(name: str, key: str) -> Level:
    """Return the level of one key; raises InputError for one that no study may ask for."""
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
    """Return the level of a key of report.json that is no verdict's; an empty text for one that none may ask for."""
    if key == PASSED:
        return "files"
    found = report_key(key)
    return found.level if found is not None and found.is_value else ""


def _verdict_level(key: str) -> str:
    """Return the level of verdicts.NAME.FIELD; an empty text for one that none may ask for."""
    verdict, field = verdict_field(key)
    if field not in VERDICT_FIELDS:
        return ""
    row = row_of(verdict)
    level = (row.value_level if field == "value" else None) or row.level
    # The table has every verdict; those on solids are known to a whole run only.
    return level or ("files" if row.group == "solid" else "")


def verdict_field(key: str) -> tuple[str, str]:
    """Return the NAME and the FIELD of verdicts.NAME.FIELD; both are empty for a key of no verdict."""
    table, _, rest = key.partition(".")
    name, _, field = rest.rpartition(".")
    return (name, field) if table == "verdicts" else ("", "")


def wanted_value(report: object, key: str) -> object:
    """Return the value at a key of a report, or of parts of one by their keys.

    Raises InputError where this design's report has no such key.
    """
    try:
        return value_at(report, key)
    except KeyError as error:
        bound = "a key of the report of this design"
        raise validation_error("wanted", key, "", bound, "ask for another key or change the base") from error
