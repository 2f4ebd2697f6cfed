"""How a record is told: as data by the keys that its fields declare, and as one line of text.

A field declares its key, unit and meaning with `report_field`, and where it needs them:

- `key`: its name in the data, where that is not the name of the field;
- `times`: the factor from the field's own unit to the unit of the key;
- `left_out`: True to leave its key out if the field has its default, the name of another field if that one has;
- `inline`: a function from the record to the keys that stand in place of its own;
- `told`: False for a field that is no key;
- `line`: a function from the record to the text of this field in a line;
- `absent`: the text in its place if the field has its default.
"""

from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any

import cattrs
from cattrs.gen import make_dict_unstructure_fn, override

from pipeline.storage.plain import Plain, strict_converter
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design

_DECLARED = {"key", "times", "left_out", "inline"}


def as_data(record: object) -> Any:  # noqa: ANN401 - JSON data of any kind
    """Return a record, or a list of records, as JSON data."""
    return _CONVERTER.unstructure(record)


def as_line(record: Any, names: Sequence[str]) -> str:  # noqa: ANN401 - any record
    """Return a record as one line: the texts of its fields in the order of their names."""
    texts = []
    for name in names:
        item = record.__dataclass_fields__[name]
        is_absent = _is_default(record, item)
        texts.append(item.metadata.get("absent", "") if is_absent else item.metadata["line"](record))
    return "  ".join(filter(None, texts))


def unstructure_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any], Any]:  # noqa: ANN401 - any record
    """Return the function with which cattrs makes JSON data of a record, its keys in the order of the fields."""
    items = fields(kind)
    hidden: dict[str, Any] = {item.name: override(omit=True) for item in items if not item.metadata.get("told", True)}
    unstructure = make_dict_unstructure_fn(kind, converter, **hidden)
    if not any(item.metadata.keys() & _DECLARED for item in items):
        return unstructure
    by_name = {item.name: item for item in items}

    def data_of(record: Any) -> Plain:  # noqa: ANN401 - the record
        plain = unstructure(record)
        data: Plain = {}
        for name, value in plain.items():
            item = by_name[name]
            left_out = item.metadata.get("left_out")
            decides = by_name[left_out] if isinstance(left_out, str) else item
            if left_out and _is_default(record, decides):
                continue
            if "inline" in item.metadata:
                data |= item.metadata["inline"](record)
            elif "times" in item.metadata and value is not None:
                data[item.metadata["key"]] = item.metadata["times"] * value
            else:
                data[item.metadata.get("key", name)] = value
        return data

    return data_of


def _is_default(record: object, item: Field[Any]) -> bool:
    """Return whether a field of a record has its default."""
    default = item.default if item.default_factory is MISSING else item.default_factory()
    return bool(getattr(record, item.name) == default)


_CONVERTER = strict_converter()
_CONVERTER.register_unstructure_hook_factory(is_dataclass, lambda kind: unstructure_hook(kind, _CONVERTER))
_CONVERTER.register_unstructure_hook(Design, design_as_mapping)
