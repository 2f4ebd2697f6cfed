"""Parts of JSON data as typed records, each by its key; errors name the key."""

from dataclasses import fields
from typing import Any, TypeVar

from pipeline.storage.plain import Plain, from_plain

T = TypeVar("T")


def part(kind: type[T], data: Plain, key: str) -> T:
    """Return what stands at a key; raises ValueError where the key is missing or holds another kind."""
    if key not in data:
        msg = f"{key} is missing"
        raise ValueError(msg)
    return from_plain(kind, data[key], key)


def optional(kind: type[T], data: Plain, key: str) -> T | None:
    """Return what stands at a key, or None where it is null; raises ValueError where the key is missing."""
    return None if data.get(key, "") is None else part(kind, data, key)


def record(kind: type[T], data: Plain, key: str) -> T:
    """Return the record at a key, of whose other keys nothing is read."""
    return from_plain(kind, _taken(part(Plain, data, key), kind), key)


def records(kind: type[T], data: Plain, key: str) -> tuple[T, ...]:
    """Return the records of a list, of whose other keys nothing is read."""
    rows = part(tuple[Plain, ...], data, key)
    return tuple(from_plain(kind, _taken(row, kind), f"{key}[{place}]") for place, row in enumerate(rows))


def _taken(row: Plain, kind: type[Any]) -> Plain:
    """Return of a record the keys that a type has."""
    return {field.name: row[field.name] for field in fields(kind) if field.name in row}
