"""The Attributes section of numpydoc docstrings, generated from the units and meanings that fields declare."""

import dataclasses
import inspect
import re
import textwrap
from collections.abc import Iterator
from typing import Any, TypeVar

from sensor.quantity import key_of

RecordClass = TypeVar("RecordClass", bound=type[Any])

_EXAMPLES = "\n\nExamples\n--------\n"
_WIDTH = 100  # maximum number of characters in a line
_LINK = re.compile(r"\[([^]]+)\]\([^)]+\)")  # a Markdown link [text](address)
_FIRST_CLAUSE = re.compile(r"(?=; |\. )|$")  # matches the end of the first clause
_MODULE = re.compile(r"\b(?:\w+\.)+(?=\w)")  # matches the module before the name of a class


def with_attributes(record_class: RecordClass) -> RecordClass:
    """Add an Attributes section to the docstring of a record class, before its examples. This is a class decorator.

    Each attribute is described by its type and by the unit and meaning of its field. If the key in JSON has another
    name, that name follows.
    """
    if record_class.__doc__ is not None:  # the option -OO of Python removes all docstrings
        description, title, examples = inspect.cleandoc(record_class.__doc__).partition(_EXAMPLES)
        lines = [line for item in dataclasses.fields(record_class) for line in _attribute_lines(item)]
        record_class.__doc__ = "\n".join([description, "", "Attributes", "----------", *lines]) + title + examples
    return record_class


def _attribute_lines(item: dataclasses.Field[Any]) -> Iterator[str]:
    """Yield the lines that describe one attribute: its name and type, followed by its meaning and unit.

    `item` is the field that declares the attribute, by `report_field` for example. The unit follows the first clause of
    the meaning in brackets.
    """
    metadata = item.metadata
    type_name = _type_name(item.type)
    # The meaning is written for Markdown pages about JSON. A docstring has no links, and JSON's null is None in Python.
    without_links = _LINK.sub(r"\1", metadata["meaning"])
    meaning = re.sub(r"\bnull\b", "None", without_links)
    unit = metadata.get("attribute_unit", metadata["unit"])
    if unit and not type_name.startswith("int"):  # a count needs no unit
        meaning = _FIRST_CLAUSE.sub(f" [{unit}]", meaning, count=1)
    text = f"{meaning[0].upper()}{meaning[1:]}."
    key = key_of(item)
    if key != item.name:
        marked_key = key if "`" in key else f"`{key}`"  # a key may already be marked as code
        text += f" In JSON: {marked_key}."
    yield f"{item.name} : {type_name}"
    yield from textwrap.wrap(text, _WIDTH, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)


def _type_name(annotation: object) -> str:
    """Return the type annotation of a field in a readable form, without the names of modules."""
    text = annotation.__name__ if isinstance(annotation, type) else str(annotation)
    text = _MODULE.sub("", text).replace(" | ", " or ")
    text = re.sub(r"dict\[(\w+), (.+)\]", r"dict of \1 to \2", text)
    return re.sub(r"(tuple|list)\[([^]]+?)(, \.\.\.)?\]", r"\1 of \2", text)
