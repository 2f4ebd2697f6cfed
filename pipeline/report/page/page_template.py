"""Render the templates in this folder as self-contained pages that include their style, scripts and data."""

import base64
import math
import zlib
from pathlib import Path

from cad.templates import template_environment
from pipeline.verdicts import in_words
from sensor import words

FIGURES = ("libraries/d3.min.js", "libraries/plot.min.js", "figures.js")
BODIES = ("libraries/model-viewer.min.js", "still.js", "bodies.js")
"""D3 and Observable Plot draw plots, and model-viewer shows bodies; NOTICE lists versions, licences and digests."""

_HERE = Path(__file__).parent
_ENVIRONMENT = template_environment(_HERE, autoescape=True)
_ENVIRONMENT.globals |= {"words": words, "rule": in_words}


def render_page(
    template: str, scripts: tuple[str, ...], data: object, *, latest: bool = False, **values: object
) -> str:
    """Render a template in this folder as an HTML page, which is complete in one file.

    `scripts` are files in this folder, in the order in which they run, and `data` is the JSON data that they read;
    numbers that are not finite become null. `values` are the variables of the template, whose text is escaped. With
    `latest`, the page reloads itself when the file `latest.js` in the output folder names a different run.
    """
    if latest:
        scripts = (*scripts, "latest.js")
    return _ENVIRONMENT.get_template(template).render(
        latest=latest,
        style=(_HERE / "page.css").read_text(encoding="utf-8"),
        scripts=[(_HERE / name).read_text(encoding="utf-8") for name in scripts],
        data=finite(data),
        **values,
    )


def load_templates(*names: str) -> None:
    """Compile templates in this folder, so that a later `render_page` is faster."""
    for name in names:
        _ENVIRONMENT.get_template(name)


def pack_bytes(content: bytes) -> str:
    """Return bytes compressed by zlib and encoded in base64; `unpacked` in figures.js decodes them."""
    return base64.b64encode(zlib.compress(content)).decode()


def finite(data: object) -> object:
    """Return nested JSON data with None in place of every number that is not finite."""
    if isinstance(data, dict):
        return {key: finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
