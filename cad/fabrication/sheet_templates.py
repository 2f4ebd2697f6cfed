"""Texts and pictures of this folder from templates, which are the files `*.jinja` beside this one."""

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
    return f"{number:.{digits}g}"


def _mm(length: float) -> str:
    return f"{_digits(length)} mm"


def _plain(text: str) -> str:
    """Return a text escaped for Markdown; names from the file of a print process may hold any sign."""
    return re.sub(r"([\\`*_\[\]<>|&~])", r"\\\1", text)


_ENVIRONMENT = template_environment(Path(__file__).parent)
_ENVIRONMENT.filters |= {
    "g": _digits,
    "mm": _mm,
    "plain": _plain,
    "shell": shlex.quote,
    "degrees": math.degrees,
}
