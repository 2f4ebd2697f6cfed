"""Texts and pictures of this folder from their templates, `*.jinja` beside this file."""

import math
import re
import shlex
from pathlib import Path

from cad.templates import template_environment

EACH = " each"  # after the mass of a printed part in the bill of materials


def render_template(template: str, **values: object) -> str:
    """Return the text of a template with these values."""
    return _ENVIRONMENT.get_template(template).render(values)


def _digits(number: float, digits: int = 6) -> str:
    return f"{number:.{digits}g}"


def _mm(length: float) -> str:
    return f"{_digits(length)} mm"


def _plain(text: str) -> str:
    """Return a text, which a printer's file may have given, so that Markdown shows it as it is."""
    return re.sub(r"([\\`*_\[\]<>|&~])", r"\\\1", text)


_ENVIRONMENT = template_environment(Path(__file__).parent)
_ENVIRONMENT.filters |= {
    "g": _digits,
    "mm": _mm,
    "plain": _plain,
    "shell": shlex.quote,
    "degrees": math.degrees,
}
