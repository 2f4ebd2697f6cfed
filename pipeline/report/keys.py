"""The keys of report.json by their dotted names: unit, meaning, and value in a report."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

from pipeline.report.report import LeftOut, Report
from pipeline.storage.told import told_fields, told_value

_INDEX = re.compile(r"-?[0-9]+")


@dataclass(frozen=True, kw_only=True)
class ReportKey:
    """A key with its unit and meaning; `level` names what a study solves for it, empty if a study cannot request it."""

    name: str
    unit: str
    meaning: str
    level: str
    is_value: bool


def report_key(name: str) -> ReportKey | None:
    """Return the key of a dotted name; None if no report has it.

    A verdict is named by its name, which may contain dots; an element of a list by its index.
    """
    words = name.split(".")
    if words[0] == "verdicts" and len(words) > 1:
        words = ["verdicts", "0", words[-1]]
    kind: Any = Report
    metadata: dict[str, Any] = {}  # metadata along the path; inner fields override outer ones
    for word in words:
        if get_origin(kind) is tuple and _INDEX.fullmatch(word):
            kind = _element_type(kind)
        elif get_origin(kind) is dict:
            kind = _value_type(kind)
        elif word in (declared := _fields(kind)):
            item, kind = declared[word]
            metadata |= item.metadata
        else:
            return None
    return ReportKey(
        name=name,
        unit=metadata.get("unit", ""),
        meaning=metadata.get("meaning", ""),
        level=metadata.get("level", ""),
        is_value=get_origin(kind) not in (tuple, dict) and not is_dataclass(kind),
    )


def report_keys() -> Iterator[ReportKey]:
    """Yield every key in the order of a report.

    `[]` represents the elements of a list and SPRING low or high. Other words in capitals represent names that depend
    on the design or run.
    """
    for name, (item, kind) in _fields(Report).items():
        yield from _keys(item, kind, name, "")


def _keys(item: Field[Any], kind: Any, name: str, level: str) -> Iterator[ReportKey]:  # noqa: ANN401 - any type
    """Yield the key of a field, then the keys of the record in it; `level` is inherited from above."""
    level = item.metadata.get("level", level)
    while get_origin(kind) is tuple:  # for nested rows too: one `[]` represents both indices
        name = name if name.endswith("[]") else f"{name}[]"
        kind = _element_type(kind)
    if get_origin(kind) is dict:
        kind = _value_type(kind)
    each = item.metadata.get("each")
    name = name if each is None else f"{name}.{each}"
    below = {} if each == "KEY" else _fields(kind)  # KEY: another page lists these keys
    metadata = item.metadata
    yield ReportKey(name=name, unit=metadata["unit"], meaning=metadata["meaning"], level=level, is_value=not below)
    both_springs = {"low", "high"} <= below.keys() and below["low"][1] == below["high"][1]
    for word, (inner, inner_kind) in below.items():
        if both_springs and word == "high":
            continue
        if both_springs and word == "low":
            _, *of_spring = _keys(inner, inner_kind, f"{name}.SPRING", level)  # the first key is the spring itself
            yield from of_spring
        else:
            yield from _keys(inner, inner_kind, f"{name}.{word}", level)


def value_at(report: object, name: str) -> object:
    """Return the value at a dotted key of a report, or of parts by their keys.

    Verdicts are found by name, and elements of lists by index. Raises KeyError if there is none. Errors of solving a
    part propagate.
    """
    words = name.split(".")
    value = report
    if words[0] == "verdicts":
        verdicts: Any = _part(report, "verdicts", name)
        by_name = verdicts if isinstance(verdicts, Mapping) else {verdict.name: verdict for verdict in verdicts}
        value = _part(by_name, ".".join(words[1:-1]), name)  # names of verdicts contain dots
        words = words[-1:]
    for word in words:
        value = _part(value, word, name)
    return value


def _part(value: Any, word: str, name: str) -> object:  # noqa: ANN401 - a mapping, a list or a record
    """Return the named part of a mapping, list or record; raises KeyError with the name of the key."""
    if isinstance(value, Mapping):
        if word in value:
            return value[word]
    elif isinstance(value, tuple):
        if _INDEX.fullmatch(word) and -len(value) <= int(word) < len(value):
            return value[int(word)]
    else:
        kind: Any = type(value)
        if word in _fields(kind):
            return told_value(value, word)
    raise KeyError(name)


def _element_type(kind: Any) -> Any:  # noqa: ANN401 - any type
    """Return the type of the elements of a tuple."""
    return _without_none(get_args(kind)[0])


def _value_type(kind: Any) -> Any:  # noqa: ANN401 - any type
    """Return the type of the values of a dict."""
    return _without_none(get_args(kind)[1])


@cache
def _fields(kind: type) -> dict[str, tuple[Field[Any], Any]]:
    """Return the fields of a record type by name, each with its type; empty for another type."""
    if not is_dataclass(kind):
        return {}
    return {key: (item, _without_none(value_kind)) for key, (item, value_kind) in told_fields(kind).items()}


def _without_none(kind: Any) -> Any:  # noqa: ANN401 - any type
    """Return the type of a value without None and `LeftOut`."""
    if get_origin(kind) not in (Union, UnionType):
        return kind
    kinds = [one for one in get_args(kind) if one not in (NoneType, LeftOut)]
    return kinds[0] if len(kinds) == 1 else kind
