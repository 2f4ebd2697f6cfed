"""Texts and pictures of this folder from their templates, `*.jinja` beside this file."""

import math
import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def rendered(template: str, **values: object) -> str:
    """Return the text of a template with these values."""
    return _ENVIRONMENT.get_template(template).render(values)


def _digits(number: float, digits: int = 6) -> str:
    return f"{number:.{digits}g}"


def _plain(text: str) -> str:
    """Return a text, which a printer's file may have given, so that Markdown shows it as it is."""
    return re.sub(r"([\\`*_\[\]<>|&~])", r"\\\1", text)


_ENVIRONMENT = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)
_ENVIRONMENT.filters |= {"g": _digits, "plain": _plain, "degrees": math.degrees}
