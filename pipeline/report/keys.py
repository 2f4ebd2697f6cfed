"""The keys of report.json by their dotted names: unit, meaning, and value in a report."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

from pipeline.report.report import LeftOut, Report
from pipeline.storage.record_data import fields_by_key, value_at_key

_INDEX = re.compile(r"-?[0-9]+")


@dataclass(frozen=True, kw_only=True)
class ReportKey:
    """A key of report.json with its unit and its meaning.

    `level` names the stage that a study solves for it; it is empty if a study cannot request the key. `is_value` marks
    a key of a single value, not of a list or a record.
    """

    name: str
    unit: str
    meaning: str
    level: str
    is_value: bool


def report_key(name: str) -> ReportKey | None:
    """Return the key of a dotted name, such as "contact.error_percent"; None if no report has it.

    The types of the fields of `Report` are followed word by word. An element of a list is named by its index. A verdict
    is named by its own name, which may contain dots: "verdicts.reading.bias.value".
    """
    path = name.split(".")
    if path[0] == "verdicts" and len(path) > 1:  # all verdicts have the same keys, so the first represents them
        path = ["verdicts", "0", path[-1]]
    kind: Any = Report
    metadata: dict[str, Any] = {}  # metadata along the path; inner fields override outer ones
    for word in path:
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
    """Yield every key that a report may have, in the order of a report.

    In a name, `[]` represents the elements of a list, and SPRING represents low or high. Other words in capitals
    represent names that depend on the design or the run.
    """
    for name, (item, kind) in _fields(Report).items():
        yield from _walk_keys(item, kind, name, "")


def _walk_keys(item: Field[Any], kind: Any, name: str, level: str) -> Iterator[ReportKey]:  # noqa: ANN401 - any type
    """Yield the key of a field, then the keys of the record in it, depth first.

    `kind` is the type of the field, and `name` its dotted name. `level` is that of the record around it, which a field
    without a level inherits.
    """
    level = item.metadata.get("level", level)
    while get_origin(kind) is tuple:  # one `[]` also represents both indices of a matrix
        name = name if name.endswith("[]") else f"{name}[]"
        kind = _element_type(kind)
    if get_origin(kind) is dict:
        kind = _value_type(kind)
    each = item.metadata.get("each")
    name = name if each is None else f"{name}.{each}"
    below = {} if each == "KEY" else _fields(kind)  # KEY: another page lists these keys
    metadata = item.metadata
    yield ReportKey(name=name, unit=metadata["unit"], meaning=metadata["meaning"], level=level, is_value=not below)
    # A record with equal entries for both springs is described once, under SPRING.
    both_springs = {"low", "high"} <= below.keys() and below["low"][1] == below["high"][1]
    for word, (inner, inner_kind) in below.items():
        if both_springs and word == "high":
            continue
        if both_springs and word == "low":
            _, *keys_of_spring = _walk_keys(inner, inner_kind, f"{name}.SPRING", level)  # without the spring itself
            yield from keys_of_spring
        else:
            yield from _walk_keys(inner, inner_kind, f"{name}.{word}", level)


def value_at(report: object, name: str) -> object:
    """Return the value at a dotted key of a report, or of a mapping of its parts that are solved on first use.

    Verdicts are found by their names, and elements of lists by index. Raises KeyError if there is no such key, and the
    errors of the solvers if a part cannot be solved.
    """
    path = name.split(".")
    value = report
    if path[0] == "verdicts":
        verdicts: Any = _get_part(report, "verdicts", name)
        verdicts_by_name = (
            verdicts if isinstance(verdicts, Mapping) else {verdict.name: verdict for verdict in verdicts}
        )
        value = _get_part(verdicts_by_name, ".".join(path[1:-1]), name)  # names of verdicts contain dots
        path = path[-1:]
    for word in path:
        value = _get_part(value, word, name)
    return value


def _get_part(value: Any, word: str, name: str) -> object:  # noqa: ANN401 - a mapping, a list or a record
    """Return the part of a mapping, list or record at one `word` of the dotted key `name`; raises KeyError."""
    if isinstance(value, Mapping):
        if word in value:
            return value[word]
    elif isinstance(value, tuple):
        if _INDEX.fullmatch(word) and -len(value) <= int(word) < len(value):
            return value[int(word)]
    else:
        kind: Any = type(value)
        if word in _fields(kind):
            return value_at_key(value, word)
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
    return {key: (item, _without_none(value_kind)) for key, (item, value_kind) in fields_by_key(kind).items()}


def _without_none(kind: Any) -> Any:  # noqa: ANN401 - any type
    """Return the type of a value without None and `LeftOut`."""
    if get_origin(kind) not in (Union, UnionType):
        return kind
    kinds = [member for member in get_args(kind) if member not in (NoneType, LeftOut)]
    return kinds[0] if len(kinds) == 1 else kind
