"""The templates of this folder, `*.jinja`, from which texts and pictures are rendered."""

import math
import re
import shlex
from pathlib import Path

from cad.templates import template_environment

EACH = " each"  # suffix of the mass of a printed part in the bill of materials


def render_template(template: str, **values: object) -> str:
    """Return the text of a template file, rendered with these values."""
    return _ENVIRONMENT.get_template(template).render(values)


def _digits(number: float, digits: int = 6) -> str:
    return f"{number:.{digits}g}"


def _mm(length: float) -> str:
    return f"{_digits(length)} mm"


def _escape_markdown(text: str) -> str:
    """Escape the special characters of Markdown in a text.

    This is necessary because names from a process file may contain any character.
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
