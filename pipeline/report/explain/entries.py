"""The table of the meanings of verdicts and symbols, for `pipeline explain`, the page and docs/words.md."""

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

from cad.parts.housing import TILT_DEG
from pipeline.report.keys import ReportKey, report_key
from sensor.design.fruits import FRUITS, NamedFruit
from sensor.design.printability import SHORTEST_LEAF
from sensor.design.reading import LARGEST_TOUCH_FRACTION
from sensor.gone import refuse_removed, refuse_removed_key
from sensor.quantity import InputError
from sensor.verdict import VerdictRow, verdict_rows

_CONSTANTS = {"touch_fraction": LARGEST_TOUCH_FRACTION, "shortest_leaf": SHORTEST_LEAF, "tilt_deg": TILT_DEG}
"""Constants that the texts may contain, by the name in braces."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """The meaning of a verdict, a symbol or a key: a paragraph, a formula and a source.

    The value of a symbol is at the dotted `key` of report.json, and its error in per cent is at the key
    `error_percent`. `part` is the part of the sensor that the value describes. The value of a verdict is found by the
    name of the verdict, or at `key` if the report has no such verdict. A name that ends in `*` represents the names in
    `each`. `level` is the lowest level of a study that decides the verdict. It is None if there is no such level: a
    verdict on solids then requires a whole run, and a study cannot request any other.
    `value_level` is the lowest level that has the value of the verdict, if it is a higher one. `in_main_job` is True
    for the ten nouns that are enough to read `pipeline/main_job.py`.
    """

    name: str
    meaning: str
    formula: str
    source: str
    is_verdict: bool
    aliases: tuple[str, ...] = ()
    each: tuple[str, ...] = ()
    key: str | None = None
    error_percent: str | None = None
    unit: str = "1"
    part: str | None = None
    level: str | None = None
    value_level: str | None = None
    in_main_job: bool = False


@cache
def entries() -> tuple[Entry, ...]:
    """Return all entries: verdicts from `sensor/verdicts.toml`, then symbols from `symbols.toml`.

    The result is cached, because every lookup of a name searches all entries.
    """
    verdict_entries = [_verdict_entry(row) for row in verdict_rows()]
    text = (Path(__file__).parent / "symbols.toml").read_text(encoding="utf-8")
    symbol_entries = [_symbol_entry(name, table) for name, table in tomllib.loads(text).items()]
    return (*verdict_entries, *symbol_entries)


def _symbol_entry(name: str, table: Mapping[str, Any]) -> Entry:
    """Return the entry of the symbol called `name` from its table in `symbols.toml`.

    A symbol with a key of report.json has the unit of the key. Unless the table gives a meaning, the symbol also has
    the meaning of the key.
    """
    values: dict[str, Any] = {**table, "aliases": tuple(table.get("aliases", ()))}
    key = report_key(table.get("key", ""))
    if key is not None:
        values["unit"] = key.unit
        values.setdefault("meaning", _meaning_of(key))
    for field_name in ("meaning", "formula"):
        values[field_name] = _fill_in(values[field_name], _CONSTANTS)
    return Entry(name=name, is_verdict=False, **values)


def _verdict_entry(row: VerdictRow) -> Entry:
    """Return the entry of a verdict from its row in `sensor/verdicts.toml`.

    In the meaning and the formula, the limit and the tolerances replace their names in braces.
    """
    numbers = {
        "limit": row.limit,
        "tolerance": row.tolerance,
        "tolerance_percent": 100.0 * (row.tolerance or 0.0),
        "tolerance_with_pins_percent": 100.0 * row.tolerance_with_pins,
        **_CONSTANTS,
    }
    # A row has some of the fields of an entry, by the same names.
    values = {item.name: getattr(row, item.name) for item in fields(Entry) if hasattr(row, item.name)}
    values |= {field_name: _fill_in(values[field_name], numbers) for field_name in ("meaning", "formula")}
    return Entry(is_verdict=True, **values)


def _fill_in(text: str, numbers: Mapping[str, float | str | None]) -> str:
    """Return a text with the names in braces replaced by their numbers."""
    texts = {name: f"{number:g}" if isinstance(number, float) else number for name, number in numbers.items()}
    return text.format(**texts)


def _meaning_of(key: ReportKey) -> str:
    """Return the meaning of a key as a sentence, with a capital letter and a full stop."""
    return f"{key.meaning[:1].upper()}{key.meaning[1:]}."


def find_entry(name: str) -> Entry:
    """Find the entry of a verdict, a symbol, a key of report.json or a fruit; they are searched in this order.

    Raises InputError for an unknown name, with the closest known name as a hint, and for a name that an earlier version
    had.
    """
    # These two calls only raise InputError for a name that an earlier version had.
    refuse_removed(f"verdicts.{name}")
    refuse_removed_key(name)
    for entry in entries():
        if name in _names_of(entry):
            return entry
    key = report_key(name)
    if key is not None:
        return _key_entry(key)
    if name in FRUITS:
        return _fruit_entry(FRUITS[name])
    raise _unknown_name_error(name)


def _names_of(entry: Entry) -> tuple[str, ...]:
    """Return all names by which an entry can be found."""
    return (entry.name, *entry.each, *entry.aliases)


def _unknown_name_error(name: str) -> InputError:
    """Return the error for a name without an entry; the message suggests the most similar known name.

    The case of letters is ignored in the comparison.
    """
    names_by_lower_case = {known_name.lower(): known_name for entry in entries() for known_name in _names_of(entry)}
    names_by_lower_case |= {fruit: fruit for fruit in FRUITS}  # the names of fruits have no capital letters
    close_matches = difflib.get_close_matches(name.lower(), names_by_lower_case, n=1)
    hint = f"Did you mean {names_by_lower_case[close_matches[0]]}? " if close_matches else ""
    bound = "a verdict, a symbol, a fruit or a key of report.json"
    msg = f"NAME = {name!r} must be {bound}. {hint}`pipeline explain` lists them all."
    return InputError(msg, field="NAME", value=name, bound=bound)


def _key_entry(key: ReportKey) -> Entry:
    """Return the entry of a key of report.json, which has no formula."""
    return Entry(
        name=key.name,
        meaning=_meaning_of(key),
        formula="",
        source="docs/report-json.md",
        is_verdict=False,
        key=key.name,
        unit=key.unit,
    )


def _fruit_entry(fruit: NamedFruit) -> Entry:
    """Return the entry of a fruit: a paragraph with its ranges, and the source of each range."""
    lowest, highest = fruit.bruise_limit_MPa
    meaning = (
        f"A fruit of {fruit.in_words} [mm, MPa]. It bruises at a mean pressure of {lowest:g} to {highest:g} MPa, and "
        f"ripe flesh relaxes to {100.0 * fruit.relaxes_to:g} % of a force. "
        f"`pipeline suggest --fruit {fruit.name}` searches for a sensor for it."
    )
    source = "; ".join(f"{key}: {text}" for key, text in fruit.sources)
    return Entry(name=fruit.name, meaning=meaning, formula="", source=source, is_verdict=False)
