"""Conversion of records by declarations at their fields: to JSON data and back, and to one line of text.

A field declares its key, unit and meaning with `report_field`, and optionally:

- `key`: its name in the data, if that is not the name of the field;
- `times`: the factor from the field's own unit to the unit of the key;
- `left_out`: True to leave its key out if the field has its default, or the name of another field that decides;
- `inline`: a function from the record to the keys that replace its own;
- `told`: False for a field that is no key;
- `line`: a function from the record to the text of this field in a line;
- `absent`: the text in its place if the field has its default.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any

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
    if not any(item.metadata.keys() & {"left_out", "inline"} for item in items):
        return unstructure

    def data_of(record: Any) -> Plain:  # noqa: ANN401 - the record
        data: Plain = {}
        for key, value in unstructure(record).items():
            item = by_key[key]
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
    needed = [key_of(item) for item in items if item.metadata.get("told", True) and _is_needed(item)]

    def structure_complete(data: Any, of_kind: Any) -> Any:  # noqa: ANN401 - JSON data, and the record
        if isinstance(data, Mapping):
            for name in needed:
                if name not in data:
                    msg = f"{name} is missing"
                    raise InputError(msg, field=name)
        return structure(data, of_kind)

    return structure_complete


def told_fields(kind: Any) -> dict[str, Field[Any]]:  # noqa: ANN401 - any record
    """Return the fields of a record by their keys, without fields that are no key."""
    return {key_of(item): item for item in fields(kind) if item.metadata.get("told", True)}


def told_value(record: object, item: Field[Any]) -> Any:  # noqa: ANN401 - of any field
    """Return the value of a field in the unit of its key."""
    return scaled(getattr(record, item.name), item.metadata.get("times", 1.0))


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
