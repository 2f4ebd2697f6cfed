"""Texts and pictures of this folder, made from templates, which are the files `*.jinja` in the same folder."""

import math
import re
import shlex
from pathlib import Path

from cad.templates import template_environment

EACH = " each"  # suffix of the mass of a printed part in the bill of materials


def render_template(template: str, **values: object) -> str:
    """Return the text of a template with these values."""
    return _ENVIRONMENT.get_template(template).render(values)


def _digits(number: float, digits: int = 6) -> str:
    """Return a number as text with this number of significant digits."""
    return f"{number:.{digits}g}"


def _mm(length: float) -> str:
    """Return a length [mm] as text with its unit."""
    return f"{_digits(length)} mm"


def _escape_markdown(text: str) -> str:
    """Return a text with Markdown's special characters escaped.

    Names from the file of a print process may contain any character.
    """
    return re.sub(r"([\\`*_\[\]<>|&~])", r"\\\1", text)


_ENVIRONMENT = template_environment(Path(__file__).parent)
_ENVIRONMENT.filters |= {
    "g": _digits,
    "mm": _mm,
    "plain": _escape_markdown,
    "shell": shlex.quote,
    "degrees": math.degrees,
}
