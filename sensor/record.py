"""A base class for records with arrays. A record prints as one short line, and as a table in a notebook."""

import dataclasses
from collections.abc import Iterator, Mapping
from html import escape

import numpy as np

from sensor.arrays import Floats

_MAX_ENTRIES = 4  # maximum number of entries of an array or list that are shown one by one
_MAX_LENGTH = 80  # maximum number of characters that are shown of a value


class Record:
    """The base class of frozen dataclasses that hold results; they are declared with repr=False."""

    def __repr__(self) -> str:
        """Return the name of the class and its fields; an array is shown by its shape and range."""
        fields = ", ".join(f"{name}={text}" for name, text in _fields(self))
        return f"{type(self).__name__}({fields})"

    def _repr_html_(self) -> str:
        """Return the fields as an HTML table for notebooks."""
        rows = [f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in _fields(self)]
        return f"<table><caption>{escape(type(self).__name__)}</caption>{''.join(rows)}</table>"


def _fields(record: object) -> Iterator[tuple[str, str]]:
    """Yield the name of each field of a dataclass, and its value as short text."""
    for field in dataclasses.fields(record):  # type: ignore[arg-type]  # every record is a dataclass
        yield field.name, short_text(getattr(record, field.name))


def short_text(value: object) -> str:
    """Return a value as short text: a float with six digits, an array by its shape and range, a record by its class.

    A long tuple or list is represented by its length and the type of its first entry. A mapping is represented by its
    number of keys. Any other value is shown by its repr, which is cut off after 80 characters.
    """
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, np.ndarray):
        return _array_text(value)
    if dataclasses.is_dataclass(value):
        return f"{type(value).__name__}(...)"
    if isinstance(value, tuple | list):
        entries = ", ".join(map(short_text, value[:_MAX_ENTRIES]))
        is_short = len(value) <= _MAX_ENTRIES and len(entries) <= _MAX_LENGTH
        return f"({entries})" if is_short else f"{len(value)} x {type(value[0]).__name__}"  # for example "60 x float"
    if isinstance(value, Mapping):
        return f"{len(value)} keys"
    text = repr(value)
    return text if len(text) <= _MAX_LENGTH else f"{text[:_MAX_LENGTH]}..."


def _array_text(array: Floats) -> str:
    """Return the entries of a short vector, or the shape and the range of any other array."""
    if array.ndim == 1 and array.size <= _MAX_ENTRIES:
        return f"[{', '.join(f'{number:.6g}' for number in array.tolist())}]"
    shape = " x ".join(map(str, array.shape))
    finite = array[np.isfinite(array)]
    if finite.size == 0:
        return f"array of {shape or 'one'}"
    missing = "" if finite.size == array.size else f", {array.size - finite.size} missing"
    return f"array of {shape or 'one'}, {finite.min():.6g} to {finite.max():.6g}{missing}"
