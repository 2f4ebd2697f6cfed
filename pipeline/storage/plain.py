"""Conversion of frozen records to plain JSON data and back, by their type hints, for the cache and for reports."""

import math
from collections.abc import Iterable
from dataclasses import is_dataclass
from typing import Any, TypeVar, get_origin

import cattrs
import numpy as np
from cattrs.strategies import configure_union_passthrough

from sensor.quantity import InputError

T = TypeVar("T")
ROUND_OFF = 1e-6  # relative difference up to which two numbers are treated as equal
Plain = dict[str, Any]
"""A JSON object."""


def to_plain(record: object) -> Any:  # noqa: ANN401 - JSON data of any kind
    """Convert a record to nested JSON objects and lists."""
    return _CONVERTER.unstructure(record)


def from_plain(kind: type[T], data: object, name: str = "", converter: cattrs.Converter | None = None) -> T:
    """Convert plain data to a record of type `kind`; this is the inverse of `to_plain`.

    `converter` may be a `strict_converter` with additional hooks. Raises ValueError for a missing key, an unknown key,
    or a value of another type. The message contains the location in the data, which begins with `name`, or with the
    name of the type if there is no `name`.
    """
    try:
        _check_container(kind, data)
        return (converter or _CONVERTER).structure(data, kind)
    except (cattrs.BaseValidationError, ValueError, TypeError) as error:
        reasons = cattrs.transform_error(error, path=name or kind.__name__, format_exception=_reason)
        first_reason = reasons[0]  # a message is one line, and the user corrects one error at a time
        msg = f"{first_reason}; it must be as it was written"
        raise ValueError(msg) from error


def _check_container(kind: type, data: object) -> None:
    """Raise TypeError unless the data for a record or a dict is a JSON object, and the data for a tuple is a list."""
    is_object = is_dataclass(kind) or get_origin(kind) is dict
    if is_object and not isinstance(data, dict):
        msg = "expected a JSON object"
        raise TypeError(msg)
    if get_origin(kind) is tuple and not isinstance(data, list):
        msg = "expected a JSON list"
        raise TypeError(msg)


def _reason(error: BaseException, kind: type | None) -> str:
    """Return the reason for a message of `from_plain`; `kind` is the type that the value should have."""
    if isinstance(error, InputError):
        return str(error)
    return "expected a JSON object" if isinstance(error, AttributeError) else cattrs.v.format_exception(error, kind)


def _is_array(kind: object) -> bool:
    """Return whether a type is the NumPy array type, with or without parameters such as the type of its elements."""
    return getattr(kind, "__origin__", kind) is np.ndarray


def _to_float(value: object, _kind: type) -> float:
    """Convert a number to a float; raises TypeError for strings and Booleans, which `float` would accept."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        msg = f"expected a number, got {value!r}"
        raise TypeError(msg)
    return float(value)


def _check_type(value: object, kind: type) -> object:
    """Return a string, an integer or a Boolean unchanged.

    Raises TypeError for a value of another type, which a call of `kind` would convert.
    """
    if type(value) is not kind:
        msg = f"expected {kind.__name__}, got {value!r}"
        raise TypeError(msg)
    return value


def strict_converter() -> cattrs.Converter:
    """Return a cattrs converter between records and JSON data that rejects values of the wrong type.

    By default, cattrs would convert such values, for example the string "1" to the integer 1. Only an integer is
    accepted for a float. Tuples become lists, and arrays become nested lists.
    """
    converter = cattrs.Converter(forbid_extra_keys=True, unstruct_collection_overrides={tuple: list})
    configure_union_passthrough(float | int | str | bool | None, converter)
    converter.register_structure_hook(float, _to_float)
    for scalar in (str, int, bool):
        converter.register_structure_hook(scalar, _check_type)
    converter.register_structure_hook_func(_is_array, lambda data, _: np.array(data, dtype=np.float64))
    converter.register_unstructure_hook_func(_is_array, lambda array: array.tolist())
    return converter


_CONVERTER = strict_converter()


def first_largest(values: Iterable[float], least: float = 0.0) -> int:
    """Return the index of the first number that equals the largest number within round-off; NaN is ignored.

    Without a tolerance, the result would depend on the processor, because numbers that are equal by symmetry differ by
    round-off. Two numbers are treated as equal if they differ by at most the fraction ROUND_OFF of the larger number or
    of `least`. Raises ValueError if there is no number.
    """
    numbers = list(values)
    largest = max(number for number in numbers if not math.isnan(number))
    is_largest = (math.isclose(number, largest, rel_tol=ROUND_OFF, abs_tol=ROUND_OFF * least) for number in numbers)
    return list(is_largest).index(True)
