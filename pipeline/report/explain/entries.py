"""The meaning of each verdict and symbol: the table for `explain`, the page and docs/words.md."""

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

from cad.parts.housing import TILT_DEG
from pipeline.report.keys import ReportKey, report_key
from sensor.design.fruits import FRUITS, NamedFruit
from sensor.design.printability import SHORTEST_LEAF
from sensor.design.reading import LARGEST_TOUCH_FRACTION
from sensor.gone import refuse_gone, refuse_gone_key
from sensor.quantity import InputError
from sensor.verdict import VerdictRow, verdict_rows

_CONSTANTS = {"touch_fraction": LARGEST_TOUCH_FRACTION, "shortest_leaf": SHORTEST_LEAF, "tilt_deg": TILT_DEG}
"""Constants that the texts may name in braces."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """The meaning of a name: a paragraph, its formula and its source.

    The number of a symbol is at `key` in report.json, elements of lists by their index, with its error in per cent at
    `error_percent`. It has the unit of the key, and `part` names its subject. The number of a verdict is found by its
    name, or at `key` if nothing was judged. A name that ends in `*` represents the names in `each`. `level` names what
    a study solves for a verdict, None if it cannot be requested. `value_level` names what it solves for the value, if
    the outcome needs less. `in_main_job` marks the ten nouns that are enough to read `pipeline/main_job.py`.
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
    """Return every entry, verdicts first.

    An entry with a key of report.json has the unit of the key, and its meaning unless it has its own.
    """
    loaded = [_of_verdict(row) for row in verdict_rows()]
    text = (Path(__file__).parent / "symbols.toml").read_text(encoding="utf-8")
    for name, table in tomllib.loads(text).items():
        aliases = tuple(table.pop("aliases", ()))
        key = report_key(table.get("key", ""))
        if key is not None:
            table = {"meaning": _sentence(key), **table, "unit": key.unit}
        table |= {column: _filled(table[column], _CONSTANTS) for column in ("meaning", "formula")}
        loaded.append(Entry(name=name, is_verdict=False, aliases=aliases, **table))
    return tuple(loaded)


def _of_verdict(row: VerdictRow) -> Entry:
    """Return the entry of a verdict, whose texts may name its own numbers too."""
    numbers = {
        "limit": row.limit,
        "tolerance": row.tolerance,
        "tolerance_percent": 100.0 * (row.tolerance or 0.0),
        "tolerance_with_pins_percent": 100.0 * row.tolerance_with_pins,
        **_CONSTANTS,
    }
    columns = {item.name: getattr(row, item.name) for item in fields(Entry) if hasattr(row, item.name)}
    columns |= {text: _filled(columns[text], numbers) for text in ("meaning", "formula")}
    return Entry(is_verdict=True, **columns)


def _filled(text: str, numbers: Mapping[str, float | str | None]) -> str:
    """Return a text with the numbers that it names in braces."""
    texts = {name: f"{number:g}" if isinstance(number, float) else number for name, number in numbers.items()}
    return text.format(**texts)


def _sentence(key: ReportKey) -> str:
    return f"{key.meaning[:1].upper()}{key.meaning[1:]}."


def entry_of(name: str) -> Entry:
    """Return the entry of a name, of a key of report.json, or of a fruit.

    Raises InputError for an unknown name, with the closest match.
    """
    refuse_gone(f"verdicts.{name}")
    refuse_gone_key(name)
    by_lower_case = {}
    for entry in entries():
        for alias in (entry.name, *entry.each, *entry.aliases):
            if alias == name:
                return entry
            by_lower_case[alias.lower()] = alias
    key = report_key(name)
    if key is not None:
        source = "docs/report-json.md"
        return Entry(
            name=name, meaning=_sentence(key), formula="", source=source, is_verdict=False, key=name, unit=key.unit
        )
    if name in FRUITS:
        return _of_fruit(FRUITS[name])
    by_lower_case |= {fruit: fruit for fruit in FRUITS}
    near = difflib.get_close_matches(name.lower(), by_lower_case, n=1)
    hint = f"Did you mean {by_lower_case[near[0]]}? " if near else ""
    bound = "a verdict, a symbol, a fruit or a key of report.json"
    msg = f"NAME = {name!r} must be {bound}. {hint}`pipeline explain` lists them all."
    raise InputError(msg, field="NAME", value=name, bound=bound)


def _of_fruit(fruit: NamedFruit) -> Entry:
    """Return the entry of a fruit, with the source of each of its ranges."""
    least, most = fruit.bruise_limit_MPa
    meaning = (
        f"A fruit of {fruit.in_words} [mm, MPa]. It bruises at a mean pressure of {least:g} to {most:g} MPa, and ripe "
        f"flesh relaxes to {100.0 * fruit.relaxes_to:g} % of a force. `pipeline suggest --fruit {fruit.name}` searches "
        "a sensor for it."
    )
    source = "; ".join(f"{key}: {text}" for key, text in fruit.sources)
    return Entry(name=fruit.name, meaning=meaning, formula="", source=source, is_verdict=False)
