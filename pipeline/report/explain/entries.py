"""What each verdict and symbol means: the entries of verdicts.toml and symbols.toml; the standard library only."""

import difflib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cad.quantity import InputError


@dataclass(frozen=True, kw_only=True)
class Entry:
    """What a name means: a paragraph, its formula and its source.

    A verdict's number is found by its name; that of a symbol by `key` in report.json, parts of lists by their place,
    with the error in per cent at `error_percent`; `unit` says of which place it is. A name that ends in `*` stands for
    the names in `each`.
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


def entries() -> tuple[Entry, ...]:
    """Return every entry, verdicts first."""
    folder = Path(__file__).parent
    found = []
    for kind in ("verdicts", "symbols"):
        for name, table in tomllib.loads((folder / f"{kind}.toml").read_text(encoding="utf-8")).items():
            texts: dict[str, Any] = {
                key: tuple(value) if isinstance(value, list) else value for key, value in table.items()
            }
            found.append(Entry(name=name, is_verdict=kind == "verdicts", **texts))
    return tuple(found)


def entry_names() -> tuple[str, ...]:
    """Return the names that can be explained, one for each spring where an entry stands for several."""
    return tuple(name for entry in entries() for name in entry.each or (entry.name,))


def entry_of(name: str) -> Entry:
    """Return the entry of a name; raises InputError for a name that nothing explains, with one that is near it."""
    every = entries()
    for entry in every:
        if name in (entry.name, *entry.aliases, *entry.each):
            return entry
    known = [*entry_names(), *(alias for entry in every for alias in entry.aliases)]
    folded = {one.lower(): one for one in known}
    near = [folded[name.lower()]] if name.lower() in folded else difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    msg = f"NAME = {name!r}: must be a verdict or a symbol; {hint}`pipeline explain` lists them all"
    raise InputError(msg)
