"""The Jinja environment for templates of texts, pictures, pages and source code."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def template_environment(folder: Path, *, autoescape: bool = False) -> Environment:
    """Return the Jinja environment for the templates in a folder. In it, an undefined variable raises an error."""
    return Environment(
        loader=FileSystemLoader(folder),
        autoescape=autoescape,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
