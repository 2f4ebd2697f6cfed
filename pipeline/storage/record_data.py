"""Conversion of records to JSON data and back, and to one line of text, controlled by the metadata of their fields.

A field declares its key, unit and meaning with `report_field`. Its metadata may also contain:

- `key`: the name of the field in the data, if it differs from the name of the field in the record;
- `times`: the factor that converts the unit of the field to the unit of the key;
- `left_out`: True if the key is omitted when the field has its default value, or the name of another field if the key
  is omitted when that other field has its default value;
- `inline`: a function of the record. It returns the keys and values that are written instead of the key of this field;
- `attribute_unit`: the unit of the field in docstrings, if it differs from the unit of its key;
- `has_key`: False for a field that has no key in the data;
- `flat`: a record type, for a field that holds such a record or None. The keys of this nested record are written at the
  same level as the keys of the outer record; for None their values are 0 or false. If the field has a key, the value of
  this key states whether there is a nested record;
- `line`: a function of the record, which returns the text of this field in a line;
- `absent`: the text that replaces `line` if the field has its default value.
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
    """Convert a record, or a list of records, to JSON data."""
    return _CONVERTER.unstructure(record)


def as_line(record: Any, names: Sequence[str]) -> str:  # noqa: ANN401 - any record
    """Return one line of text for a record: the texts of the fields in `names`, in this order.

    The text of a field comes from its metadata `line`, or from `absent` if the field has its default value. Empty texts
    are left out.
    """
    texts = []
    for name in names:
        item = record.__dataclass_fields__[name]
        if _is_default(record, item):
            texts.append(item.metadata.get("absent", ""))
        else:
            texts.append(item.metadata["line"](record))
    return "  ".join(filter(None, texts))


def unstructure_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any], Any]:  # noqa: ANN401 - any record
    """Return the cattrs unstructure hook that converts a record of type `kind` to JSON data.

    The hook uses `converter` for the values of the fields. The keys are in the order of the fields. The docstring of
    this module explains the metadata that control the hook.
    """
    items = fields(kind)
    overrides = {item.name: _override(item, converter) for item in items}
    unstructure = make_dict_unstructure_fn(kind, converter, **overrides)
    by_key = {key_of(item): item for item in items}
    if not any(item.metadata.keys() & {"left_out", "inline", "flat"} for item in items):
        return unstructure  # the overrides handle all other metadata

    def unstructure_selected(record: Any) -> Plain:  # noqa: ANN401 - the record
        """Convert a record, omit the keys that are left out, and insert the keys of inline and flat fields."""
        data: Plain = {}
        for key, value in unstructure(record).items():
            item = by_key[key]
            if "flat" in item.metadata:
                data |= _flat_data(item, value)
            elif _is_left_out(record, item):
                continue
            elif "inline" in item.metadata:
                data |= item.metadata["inline"](record)
            else:
                data[key] = value
        return data

    return unstructure_selected


def _is_left_out(record: Any, item: Field[Any]) -> bool:  # noqa: ANN401 - any record
    """Return whether the key of a field is left out of the data of a record, according to the metadata `left_out`."""
    left_out = item.metadata.get("left_out")  # True, the name of another field, or None
    deciding_field = record.__dataclass_fields__[left_out] if isinstance(left_out, str) else item
    return bool(left_out) and _is_default(record, deciding_field)


def structure_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any, Any], Any]:  # noqa: ANN401 - any record
    """Return the cattrs structure hook that converts JSON data to a record; this is the inverse of `unstructure_hook`.

    The hook raises InputError for a missing key. A key may be missing if its field has the metadata `left_out`, or
    `since` for a key that older data do not contain.
    """
    items = fields(kind)
    overrides = {item.name: _override(item, converter) for item in items}
    structure = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True, **overrides)
    required_keys = [key for key, (item, _) in fields_by_key(kind).items() if _is_required(item)]
    keys = {item.name: key_of(item) for item in items}
    flat_fields = [item for item in items if "flat" in item.metadata]

    def structure_complete(data: Any, record_type: Any) -> Any:  # noqa: ANN401 - JSON data, and the record
        """Check that all required keys are present, nest the keys of flat records, and make the record."""
        if isinstance(data, Mapping):  # `structure` rejects data of any other type
            _require_keys(data, required_keys)
            for item in flat_fields:
                data = _nest_record(data, item, converter)
        try:
            return structure(data, record_type)
        except cattrs.ClassValidationError as error:
            # The note of an error names the field. The message must name the key in the data instead.
            errors_with_notes, _ = error.group_exceptions()
            for _, note in errors_with_notes:
                note.name = keys[note.name]
            raise

    return structure_complete


def _require_keys(data: Mapping[str, Any], required_keys: Sequence[str]) -> None:
    """Raise InputError for the first required key that the data of a record lack."""
    for name in required_keys:
        if name not in data:
            msg = f"{name} is missing"
            raise InputError(msg, field=name)


@cache
def fields_by_key(kind: Any) -> dict[str, tuple[Field[Any], Any]]:  # noqa: ANN401 - any record
    """Return the keys of a record type in JSON data, each with its field and the type of its value.

    A field without a key is left out. A flat field holds a nested record, whose keys are written beside the keys of the
    outer record. The keys of the nested record are therefore included, with the fields of the nested record.
    """
    by_key: dict[str, tuple[Field[Any], Any]] = {}
    field_types = get_type_hints(kind)
    for item in fields(kind):
        is_flat = "flat" in item.metadata
        if _has_key(item):
            # The key of a flat field only states whether there is a nested record.
            value_type = bool if is_flat else field_types[item.name]
            by_key[key_of(item)] = (item, value_type)
        if is_flat:
            nested_kind = item.metadata["flat"]
            by_key |= fields_by_key(nested_kind)
    return by_key


def value_at_key(record: Any, key: str) -> Any:  # noqa: ANN401 - any record, and the value of any field
    """Return the value of a key in the JSON data of a record, in the unit of the key.

    Raises KeyError if the type of the record has no such key.
    """
    kind: Any = type(record)
    item, _ = fields_by_key(kind)[key]
    # The value of a flat field, and of each field of a flat record, is only known after converting the whole record.
    if "flat" in item.metadata or record.__dataclass_fields__.get(item.name) is not item:
        return as_data(record)[key]
    return scaled(getattr(record, item.name), item.metadata.get("times", 1.0))


def _flat_data(item: Field[Any], part: Plain | None) -> Plain:
    """Return the keys and values that a flat field contributes to the data of the outer record.

    `part` is the data of the nested record, or None if there is no nested record. For None, each key has the zero value
    of its type, so that the data always have the same keys.
    """
    own_key = {item.name: part is not None} if _has_key(item) else {}
    if part is not None:
        return own_key | part
    # A type that is called without an argument returns its zero value: float() is 0.0, and bool() is False.
    zeros = {key: value_type() for key, (_, value_type) in fields_by_key(item.metadata["flat"]).items()}
    return own_key | zeros


def _nest_record(data: Mapping[str, Any], item: Field[Any], converter: cattrs.Converter) -> Plain:
    """Return the data of an outer record in which a single key replaces the keys of its flat nested record.

    `item` is the field of the nested record, and the value of its key is this record. This is the inverse of
    `_flat_data`: the nested record is None if the key of its field is false. If the field has no key, the nested record
    is None if all its values are 0 or false.
    """
    kind = item.metadata["flat"]
    keys = fields_by_key(kind)
    nested_data = {key: value for key, value in data.items() if key in keys}
    outer_data = {key: value for key, value in data.items() if key not in keys}
    has_record = converter.structure(data[item.name], bool) if _has_key(item) else any(nested_data.values())
    nested_record = converter.structure(nested_data, kind) if has_record else None
    return outer_data | {item.name: nested_record}


def scaled(value: Any, factor: float) -> Any:  # noqa: ANN401 - numbers, or records if the factor is 1
    """Multiply a number, or all numbers in nested lists and mappings, by a factor; None remains None."""
    if factor == 1.0 or value is None:
        return value
    if isinstance(value, Mapping):
        return {name: scaled(each, factor) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return type(value)(scaled(each, factor) for each in value)
    return factor * value


def _override(item: Field[Any], converter: cattrs.Converter) -> Any:  # noqa: ANN401 - cattrs names no type for it
    """Return the cattrs override for a field, which defines its name in the data and the conversion of its unit.

    `converter` converts the value of the field. If the metadata contain `times`, the override also multiplies by this
    factor when a record is converted to data, and divides by it in the other direction.
    """
    if "flat" in item.metadata:
        return override(struct_hook=lambda record, _: record)  # `_nest_record` has already structured the record
    if not _has_key(item):
        return override(omit=True)
    times = item.metadata.get("times")
    if times is None:
        return override(rename=key_of(item))
    return override(
        rename=key_of(item),
        unstruct_hook=lambda value: scaled(converter.unstructure(value), times),
        struct_hook=lambda value, kind: scaled(converter.structure(value, kind), 1.0 / times),
    )


def _has_key(item: Field[Any]) -> bool:
    """Return whether a field has a key in the data, according to its metadata `has_key`."""
    return bool(item.metadata.get("has_key", True))


def _is_required(item: Field[Any]) -> bool:
    """Return whether data must contain the key of a field.

    The key of a field with a default value is optional if it may be left out, or if older data do not contain it.
    """
    has_default = item.default is not MISSING or item.default_factory is not MISSING
    may_be_absent = bool({"left_out", "since"} & item.metadata.keys())
    return not has_default or not may_be_absent


def _is_default(record: object, item: Field[Any]) -> bool:
    """Return whether a field of a record has its default value."""
    default = item.default if item.default_factory is MISSING else item.default_factory()
    return bool(getattr(record, item.name) == default)


_CONVERTER = strict_converter()
_CONVERTER.register_unstructure_hook_factory(is_dataclass, lambda kind: unstructure_hook(kind, _CONVERTER))
_CONVERTER.register_unstructure_hook(Design, design_as_mapping)
