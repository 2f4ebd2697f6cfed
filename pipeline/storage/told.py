"""Conversion of records by declarations at their fields: to JSON data and back, and to one line of text.

A field declares its key, unit and meaning with `report_field`, and optionally:

- `key`: its name in the data, if that is not the name of the field;
- `times`: the factor from the field's own unit to the unit of the key;
- `left_out`: True to leave its key out if the field has its default, or the name of another field that decides;
- `inline`: a function from the record to the keys that replace its own;
- `attribute_unit`: the field's own unit for docstrings, if that is not the unit of its key;
- `told`: False for a field that is no key;
- `flat`: the type of a record, or None, whose keys stand beside those of this one. For None they are 0 or false. The
  key of the field itself, if it is told, is whether there is a record;
- `line`: a function from the record to the text of this field in a line;
- `absent`: the text in its place if the field has its default.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from typing import Any, get_type_hints

import cattrs
from cattrs.gen import make_dict_structure_fn, make_dict_unstructure_fn, override

from pipeline.storage.plain import Plain, strict_converter
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design
from sensor.quantity import InputError, key_of


def as_data(record: object) -> Any:  # noqa: ANN401 - JSON data of any kind
    """Return a record, or a list of records, as JSON data."""
    return _CONVERTER.unstructure(record)


def as_line(record: Any, names: Sequence[str]) -> str:  # noqa: ANN401 - any record
    """Return a record as one line: the texts of the named fields in order."""
    texts = []
    for name in names:
        item = record.__dataclass_fields__[name]
        is_absent = _is_default(record, item)
        texts.append(item.metadata.get("absent", "") if is_absent else item.metadata["line"](record))
    return "  ".join(filter(None, texts))


def unstructure_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any], Any]:  # noqa: ANN401 - any record
    """Return cattrs' function from a record to JSON data, with keys in the order of the fields."""
    items = fields(kind)
    unstructure = make_dict_unstructure_fn(kind, converter, **{item.name: _override(item, converter) for item in items})
    by_key = {key_of(item): item for item in items}
    if not any(item.metadata.keys() & {"left_out", "inline", "flat"} for item in items):
        return unstructure

    def data_of(record: Any) -> Plain:  # noqa: ANN401 - the record
        data: Plain = {}
        for key, value in unstructure(record).items():
            item = by_key[key]
            if "flat" in item.metadata:
                data |= _flat_data(item, value)
                continue
            left_out = item.metadata.get("left_out")
            decides = kind.__dataclass_fields__[left_out] if isinstance(left_out, str) else item
            if left_out and _is_default(record, decides):
                continue
            if "inline" in item.metadata:
                data |= item.metadata["inline"](record)
            else:
                data[key] = value
        return data

    return data_of


def structure_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any, Any], Any]:  # noqa: ANN401 - any record
    """Return cattrs' function from JSON data to a record, the inverse of `unstructure_hook`.

    A missing key raises InputError, unless it may be left out or was added later (a field with `since`).
    """
    items = fields(kind)
    overrides = {item.name: _override(item, converter) for item in items}
    structure = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True, **overrides)
    needed = [key for key, (item, _) in told_fields(kind).items() if _is_needed(item)]
    keys = {item.name: key_of(item) for item in items}
    flat = [item for item in items if "flat" in item.metadata]

    def structure_complete(data: Any, of_kind: Any) -> Any:  # noqa: ANN401 - JSON data, and the record
        if isinstance(data, Mapping):
            for name in needed:
                if name not in data:
                    msg = f"{name} is missing"
                    raise InputError(msg, field=name)
            for item in flat:
                data = _with_record(data, item, converter)
        try:
            return structure(data, of_kind)
        except cattrs.ClassValidationError as error:
            for _, note in error.group_exceptions()[0]:
                note.name = keys[note.name]  # a message names what stands in the data
            raise

    return structure_complete


@cache
def told_fields(kind: Any) -> dict[str, tuple[Field[Any], Any]]:  # noqa: ANN401 - any record
    """Return the fields of a record type by their keys, each with its type, without those that are no key."""
    found: dict[str, tuple[Field[Any], Any]] = {}
    hints = get_type_hints(kind)
    for item in fields(kind):
        is_flat = "flat" in item.metadata
        if item.metadata.get("told", True):
            found[key_of(item)] = (item, bool if is_flat else hints[item.name])
        if is_flat:
            found |= told_fields(item.metadata["flat"])
    return found


def told_value(record: Any, key: str) -> Any:  # noqa: ANN401 - any record, and the value of any field
    """Return the value at a key of a record, in the unit of the key; raises KeyError if it has no such key."""
    kind: Any = type(record)
    item, _ = told_fields(kind)[key]
    if "flat" in item.metadata or record.__dataclass_fields__.get(item.name) is not item:
        return as_data(record)[key]
    return scaled(getattr(record, item.name), item.metadata.get("times", 1.0))


def _flat_data(item: Field[Any], part: Plain | None) -> Plain:
    """Return the data that a flat field adds, from the data of its record."""
    own = {item.name: part is not None} if item.metadata.get("told", True) else {}
    absent = {key: kind() for key, (_, kind) in told_fields(item.metadata["flat"]).items()}
    return own | (absent if part is None else part)


def _with_record(data: Mapping[str, Any], item: Field[Any], converter: cattrs.Converter) -> Plain:
    """Return data in which the record of a flat field replaces its keys; the record is None if the data deny it."""
    kind = item.metadata["flat"]
    keys = told_fields(kind)
    part = {key: value for key, value in data.items() if key in keys}
    others = {key: value for key, value in data.items() if key not in keys}
    is_told = item.metadata.get("told", True)
    is_there = converter.structure(data[item.name], bool) if is_told else any(part.values())
    return others | {item.name: converter.structure(part, kind) if is_there else None}


def scaled(value: Any, factor: float) -> Any:  # noqa: ANN401 - numbers, or records if the factor is 1
    """Return a number, or each number of lists and mappings, times a factor; None stays None."""
    if factor == 1.0 or value is None:
        return value
    if isinstance(value, Mapping):
        return {name: scaled(each, factor) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return type(value)(scaled(each, factor) for each in value)
    return factor * value


def _override(item: Field[Any], converter: cattrs.Converter) -> Any:  # noqa: ANN401 - cattrs names no type for it
    """Return cattrs' override for a field."""
    if "flat" in item.metadata:
        return override(struct_hook=lambda record, _: record)  # `_with_record` makes it
    if not item.metadata.get("told", True):
        return override(omit=True)
    times = item.metadata.get("times")
    if times is None:
        return override(rename=key_of(item))
    return override(
        rename=key_of(item),
        unstruct_hook=lambda value: scaled(converter.unstructure(value), times),
        struct_hook=lambda value, kind: scaled(converter.structure(value, kind), 1.0 / times),
    )


def _is_needed(item: Field[Any]) -> bool:
    """Return whether data must have the key of a field: it may not be left out, and was not added later."""
    return item.default is item.default_factory is MISSING or not {"left_out", "since"} & item.metadata.keys()


def _is_default(record: object, item: Field[Any]) -> bool:
    """Return whether a field of a record has its default."""
    default = item.default if item.default_factory is MISSING else item.default_factory()
    return bool(getattr(record, item.name) == default)


_CONVERTER = strict_converter()
_CONVERTER.register_unstructure_hook_factory(is_dataclass, lambda kind: unstructure_hook(kind, _CONVERTER))
_CONVERTER.register_unstructure_hook(Design, design_as_mapping)
