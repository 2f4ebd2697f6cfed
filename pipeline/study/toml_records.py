"""Conversion of TOML tables to records by cattrs, with one-line error messages."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Literal, TypeVar, get_origin

import cattrs
from cattrs.gen import make_dict_structure_fn, override

from sensor.quantity import InputError, as_float, key_of, unknown_name, validation_error

T = TypeVar("T")


class MisfitError(ValueError):
    """An error for an invalid value, raised where its key is not known; `named` adds the key."""

    def __init__(self, value: object, bound: str, hint: str) -> None:
        """Store the invalid value, and the bound and the hint for `validation_error`."""
        super().__init__(bound)
        self.value = value
        self.bound = bound
        self.hint = hint

    def named(self, name: str) -> InputError:
        """Return this error as an InputError about the key `name`."""
        return validation_error(name, str(self.value), "", self.bound, self.hint)


def record_of(kind: type[T], table: Mapping[str, Any], converter: cattrs.Converter) -> T:
    """Convert a TOML table to a record of type `kind`, with a converter from `file_converter`.

    Raises InputError for the first invalid key; the message contains its dotted name. For an unknown key, the message
    suggests the most similar known key.
    """
    try:
        return converter.structure(table, kind)
    except cattrs.BaseValidationError as errors:
        raise _first_error(errors, "") from errors


def file_converter() -> cattrs.Converter:
    """Return a cattrs converter from TOML tables to records, which rejects unknown keys.

    Numbers and strings are not converted, because the records check them. Only an integer in a float field becomes a
    float, and a list in a field for strings becomes a tuple. The metadata `key` of a field is its
    name in the file, if this differs from the name of the field.
    """
    converter = cattrs.Converter(forbid_extra_keys=True)
    for kind in (int, str):
        converter.register_structure_hook(kind, _unchanged)
    converter.register_structure_hook_func(lambda kind: is_instance_of(kind, Literal), _unchanged)
    converter.register_structure_hook(float, lambda value, _: as_float(value) if type(value) is int else value)
    converter.register_structure_hook(bool, _check_bool)
    converter.register_structure_hook_func(
        lambda kind: kind == tuple[str, ...], lambda value, _: tuple(value) if isinstance(value, list) else value
    )
    converter.register_structure_hook_factory(is_dataclass, lambda kind: _record_hook(kind, converter))
    return converter


def is_instance_of(kind: Any, origin: Any) -> bool:  # noqa: ANN401 - any types
    """Return whether `kind` is a parametrised form of the generic type `origin`, as `dict[str, int]` is of `dict`."""
    return get_origin(kind) is origin


def check_table(value: object) -> Mapping[str, Any]:
    """Return `value` unchanged; raises MisfitError if it is not a table."""
    if not isinstance(value, Mapping):
        bound = "a table"
        raise MisfitError(value, bound, "write the name of the table in brackets, and its keys below")
    return value


def _unchanged(value: Any, _: object) -> Any:  # noqa: ANN401 - any value
    """Return a value unchanged, as a structure hook of cattrs, whose second argument is the type of the field."""
    return value


def _check_bool(value: object, _: object) -> bool:
    """Return a Boolean unchanged; raises MisfitError for any other value, which cattrs would convert."""
    if not isinstance(value, bool):
        bound = "true or false"
        raise MisfitError(value, bound, "write true or false without quotes")
    return value


def _record_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any, Any], Any]:  # noqa: ANN401 - any record
    """Return the cattrs structure hook that converts a table to a record and rejects unknown keys."""
    renamed = {item.name: override(rename=key_of(item)) for item in fields(kind)}
    structure = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True, **renamed)  # type: ignore[arg-type]
    return lambda table, of_kind: structure(check_table(table), of_kind)


def _first_error(errors: cattrs.BaseValidationError, path: str) -> InputError:
    """Return the first error in a table as a one-line InputError; `path` is the dotted name of the table in the file.

    An unknown key is reported before a missing key, because a misspelled key causes both errors.
    """
    kind: Any = errors.cl  # the type of the record
    # The key of the minimum is False for an unknown key, and False sorts before True.
    error = min(errors.exceptions, key=lambda exception: not isinstance(exception, cattrs.ForbiddenExtraKeysError))
    if isinstance(error, cattrs.ForbiddenExtraKeysError):
        unknown = min(error.extra_fields)  # the first one in alphabetical order
        keys = list(map(key_of, fields(kind)))
        return unknown_name("key", _join_path(path, unknown), keys, unknown)
    location, hint = _location_and_hint(error, kind, path)
    match error:
        case cattrs.BaseValidationError():  # an error in a nested table
            return _first_error(error, location)
        case MisfitError():
            return error.named(location)
        case InputError():  # its message begins with a key of the record
            name = _join_path(location, error.field)
            return InputError(_join_path(location, str(error)), field=name, value=error.value, bound=error.bound)
    return validation_error(location, None, "", "given", hint)  # KeyError: the key is missing from the table


def _location_and_hint(error: Exception, kind: Any, path: str) -> tuple[str, str]:  # noqa: ANN401 - any record
    """Return the dotted name of the value that caused an error in a record of type `kind`, and the hint of its field.

    The notes that cattrs adds to the error contain the field and the list index of this value. `path` is the dotted
    name of the table. The hint is empty if the field has none.
    """
    location = path
    hint = ""
    for note in getattr(error, "__notes__", ()):
        if isinstance(note, cattrs.AttributeValidationNote):
            item = kind.__dataclass_fields__[note.name]
            location = _join_path(location, key_of(item))
            hint = item.metadata.get("hint", "")
        elif isinstance(note, cattrs.IterableValidationNote):
            location = _join_path(location, str(note.index))
    return location, hint


def _join_path(path: str, key: str) -> str:
    """Return the dotted name of a key in a table; the `path` of the outermost table is empty."""
    return f"{path}.{key}" if path else key
