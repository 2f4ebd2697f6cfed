"""The one way in which templates are read: texts, pictures, pages and source code that are filled with values."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def template_environment(folder: Path, *, autoescape: bool = False) -> Environment:
    """Return what reads the templates of a folder; a value that a template names and nobody gives is an error."""
    return Environment(
        loader=FileSystemLoader(folder),
        autoescape=autoescape,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
