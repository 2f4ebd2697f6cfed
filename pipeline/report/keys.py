"""Look up the keys of report.json by dotted names: their unit, their meaning, and their value in a report."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

from pipeline.report.report import LeftOut, Report
from pipeline.storage.record_data import fields_by_key, value_at_key

_INDEX = re.compile(r"-?[0-9]+")  # index of an element of a list; a negative one counts from the end, as in Python


@dataclass(frozen=True, kw_only=True)
class ReportKey:
    """A key of report.json with its unit and its meaning.

    `level` is the stage that a study must solve to obtain the key, or "" if a study cannot request the key. `is_value`
    is True if the key has a single value, not a list or a record.
    """

    name: str
    unit: str
    meaning: str
    level: str
    is_value: bool


def report_key(name: str) -> ReportKey | None:
    """Return the key with a dotted name such as "contact.error_percent"; None if no report has this key.

    The types of the fields of `Report` determine the result, so no report is needed. An element of a list is selected
    by its index. A verdict is selected by its name, which may contain dots: "verdicts.reading.bias.value".
    """
    path = name.split(".")
    if path[0] == "verdicts" and len(path) > 1:
        # A list is indexed by number. All verdicts have the same keys, so the first one represents any of them.
        path = ["verdicts", "0", path[-1]]
    field_type: Any = Report
    metadata: dict[str, Any] = {}  # metadata along the path; inner fields override outer ones
    for part in path:
        if get_origin(field_type) is tuple and _INDEX.fullmatch(part):
            field_type = _element_type(field_type)
        elif get_origin(field_type) is dict:
            field_type = _value_type(field_type)
        else:
            declared_fields = _fields(field_type)
            if part not in declared_fields:
                return None
            item, field_type = declared_fields[part]
            metadata |= item.metadata
    return ReportKey(
        name=name,
        unit=metadata.get("unit", ""),
        meaning=metadata.get("meaning", ""),
        level=metadata.get("level", ""),
        is_value=get_origin(field_type) not in (tuple, dict) and not is_dataclass(field_type),
    )


def report_keys() -> Iterator[ReportKey]:
    """Yield every key that a report may have, in the order of the report.

    In a name, `[]` represents the elements of a list, and SPRING represents low or high. Other words in capitals
    represent names that depend on the design or the run.
    """
    for name, (item, field_type) in _fields(Report).items():
        yield from _walk_keys(item, field_type, name, "")


def _walk_keys(item: Field[Any], field_type: Any, name: str, level: str) -> Iterator[ReportKey]:  # noqa: ANN401 - any type
    """Yield the key of a field, then the keys of the record that it holds, depth first.

    `item` is the field with its metadata, `field_type` its type, and `name` its dotted name. The level is the stage
    that a study must solve to obtain the key. A field without a level inherits `level` from the enclosing record.
    """
    metadata = item.metadata
    own_level = metadata.get("level", level)
    full_name, value_type = _name_and_type_of_values(item, field_type, name)
    # The keys that KEY represents are listed on a different page.
    inner_fields = {} if metadata.get("each") == "KEY" else _fields(value_type)
    yield ReportKey(
        name=full_name,
        unit=metadata["unit"],
        meaning=metadata["meaning"],
        level=own_level,
        is_value=not inner_fields,
    )
    # If a record has entries of the same type for the two springs, they are described once, as SPRING.
    inner_types = {key: inner_type for key, (_, inner_type) in inner_fields.items()}
    has_two_springs = {"low", "high"} <= inner_types.keys() and inner_types["low"] == inner_types["high"]
    for key, (inner_item, inner_type) in inner_fields.items():
        if has_two_springs and key == "high":
            continue
        if has_two_springs and key == "low":
            # The first key is the spring itself, which is omitted because it has no value.
            _, *keys_of_spring = _walk_keys(inner_item, inner_type, f"{full_name}.SPRING", own_level)
            yield from keys_of_spring
        else:
            yield from _walk_keys(inner_item, inner_type, f"{full_name}.{key}", own_level)


def _name_and_type_of_values(item: Field[Any], field_type: Any, name: str) -> tuple[str, Any]:  # noqa: ANN401 - any type
    """Return the dotted name of the values in a field, and their type.

    `[]` is appended to the `name` of a list. For a mapping, the word that represents its keys is appended, because the
    keys depend on the run.
    """
    full_name = name
    value_type = field_type
    while get_origin(value_type) is tuple:
        if not full_name.endswith("[]"):  # a single `[]` represents both indices of a matrix
            full_name = f"{full_name}[]"
        value_type = _element_type(value_type)
    if get_origin(value_type) is dict:
        value_type = _value_type(value_type)
    placeholder = item.metadata.get("each")
    if placeholder is not None:
        full_name = f"{full_name}.{placeholder}"
    return full_name, value_type


def value_at(report: object, name: str) -> object:
    """Return the value at the dotted key `name` of a report, or of a mapping whose parts are solved on first use.

    A verdict is selected by its name, and an element of a list by its index. Raises KeyError if there is no such key.
    If a part cannot be solved, the exception of its solver is raised.
    """
    path = name.split(".")
    value = report
    if path[0] == "verdicts":
        verdicts: Any = _get_part(report, "verdicts", name)
        verdicts_by_name = verdicts
        if not isinstance(verdicts, Mapping):  # a report has a tuple of verdicts
            verdicts_by_name = {verdict.name: verdict for verdict in verdicts}
        # The name of a verdict may contain dots, so it is everything between "verdicts" and the last part.
        verdict_name = ".".join(path[1:-1])
        value = _get_part(verdicts_by_name, verdict_name, name)
        path = path[-1:]
    for part in path:
        value = _get_part(value, part, name)
    return value


def _get_part(value: Any, part: str, name: str) -> object:  # noqa: ANN401 - a mapping, a list or a record
    """Return the value in a mapping, a tuple or a record at one `part` of a dotted key.

    An element of a tuple is selected by its index, from the end if it is negative. Raises KeyError with the whole key
    `name` if there is no such part.
    """
    if isinstance(value, Mapping):
        if part in value:
            return value[part]
    elif isinstance(value, tuple):
        if _INDEX.fullmatch(part) and -len(value) <= int(part) < len(value):
            return value[int(part)]
    else:
        record_type: Any = type(value)
        if part in _fields(record_type):
            return value_at_key(value, part)
    raise KeyError(name)


def _element_type(field_type: Any) -> Any:  # noqa: ANN401 - any type
    """Return the type of the elements of a tuple type, without None."""
    return _without_none(get_args(field_type)[0])


def _value_type(field_type: Any) -> Any:  # noqa: ANN401 - any type
    """Return the type of the values of a dict type, without None."""
    return _without_none(get_args(field_type)[1])


@cache
def _fields(field_type: type) -> dict[str, tuple[Field[Any], Any]]:
    """Return the fields of a record type by name, each with its type; empty if the type is not a record."""
    if not is_dataclass(field_type):
        return {}
    return {key: (item, _without_none(value_type)) for key, (item, value_type) in fields_by_key(field_type).items()}


def _without_none(field_type: Any) -> Any:  # noqa: ANN401 - any type
    """Return a union type without None and `LeftOut`, which mean that a key has no value; keep other types unchanged.

    A union of several other types is also kept unchanged.
    """
    if get_origin(field_type) not in (Union, UnionType):
        return field_type
    members = [member for member in get_args(field_type) if member not in (NoneType, LeftOut)]
    return members[0] if len(members) == 1 else field_type
