"""Records from tables of a TOML file by cattrs, with one-line errors."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Literal, TypeVar, get_origin

import cattrs
from cattrs.gen import make_dict_structure_fn, override

from sensor.quantity import InputError, as_float, key_of, unknown_name, validation_error

T = TypeVar("T")


class MisfitError(ValueError):
    """A value that does not fit its place; code that knows the place turns it into an InputError."""

    def __init__(self, value: object, bound: str, hint: str) -> None:
        """Store the value, and the bound and hint for `validation_error`."""
        super().__init__(bound)
        self.value = value
        self.bound = bound
        self.hint = hint

    def named(self, name: str) -> InputError:
        """Return the error with the name of the place."""
        return validation_error(name, str(self.value), "", self.bound, self.hint)


def record_of(kind: type[T], table: Mapping[str, Any], converter: cattrs.Converter) -> T:
    """Return the record of a table, structured by a converter of `file_converter`.

    Raises InputError for the first wrong key by its dotted name; for an unknown key it names the closest known one.
    """
    try:
        return converter.structure(table, kind)
    except cattrs.BaseValidationError as errors:
        raise _first_error(errors, "") from errors


def file_converter() -> cattrs.Converter:
    """Return a converter from tables to records; numbers and texts pass unchanged, because records check them.

    A field may have another `key` in the file. Integers become floats for float fields, and lists of texts tuples.
    """
    converter = cattrs.Converter(forbid_extra_keys=True)
    for text_or_whole in (int, str):
        converter.register_structure_hook(text_or_whole, _itself)
    converter.register_structure_hook_func(lambda kind: is_of(kind, Literal), _itself)
    converter.register_structure_hook(float, lambda value, _: as_float(value) if type(value) is int else value)
    converter.register_structure_hook(bool, _truth)
    converter.register_structure_hook_func(
        lambda kind: kind == tuple[str, ...], lambda value, _: tuple(value) if isinstance(value, list) else value
    )
    converter.register_structure_hook_factory(is_dataclass, lambda kind: _record_hook(kind, converter))
    return converter


def is_of(kind: Any, origin: Any) -> bool:  # noqa: ANN401 - any types
    """Return whether a type is an instance of a generic type, such as `dict[str, int]` of `dict`."""
    return get_origin(kind) is origin


def check_table(value: object) -> Mapping[str, Any]:
    """Return a table unchanged; raises MisfitError for anything else."""
    if not isinstance(value, Mapping):
        bound = "a table"
        raise MisfitError(value, bound, "write its name in brackets and its keys below it")
    return value


def _itself(value: Any, _: object) -> Any:  # noqa: ANN401 - any value
    return value


def _truth(value: object, _: object) -> bool:
    if not isinstance(value, bool):
        bound = "true or false"
        raise MisfitError(value, bound, "write one of these words, without quotes")
    return value


def _record_hook(kind: Any, converter: cattrs.Converter) -> Callable[[Any, Any], Any]:  # noqa: ANN401 - any record
    """Return cattrs' function from a table to a record."""
    renamed = {item.name: override(rename=key_of(item)) for item in fields(kind)}
    structure = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True, **renamed)  # type: ignore[arg-type]
    return lambda table, of_kind: structure(check_table(table), of_kind)


def _first_error(errors: cattrs.BaseValidationError, path: str) -> InputError:
    """Return the first error of a table at a dotted path as one line; unknown keys come before missing ones."""
    kind: Any = errors.cl
    error = min(errors.exceptions, key=lambda one: not isinstance(one, cattrs.ForbiddenExtraKeysError))
    if isinstance(error, cattrs.ForbiddenExtraKeysError):
        unknown = min(error.extra_fields)
        keys = list(map(key_of, fields(kind)))
        return unknown_name("key", _joined(path, unknown), keys, unknown)
    hint = ""
    for note in getattr(error, "__notes__", ()):
        if isinstance(note, cattrs.AttributeValidationNote):
            item = kind.__dataclass_fields__[note.name]
            path = _joined(path, key_of(item))
            hint = item.metadata.get("hint", "")
        elif isinstance(note, cattrs.IterableValidationNote):
            path = _joined(path, str(note.index))
    match error:
        case cattrs.BaseValidationError():
            return _first_error(error, path)
        case MisfitError():
            return error.named(path)
        case InputError():  # the message begins with a key of the record
            name = _joined(path, error.field)
            return InputError(_joined(path, str(error)), field=name, value=error.value, bound=error.bound)
    return validation_error(path, None, "", "given", hint)  # KeyError: the key is missing in the table


def _joined(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key
