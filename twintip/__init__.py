"""The public names of the package; docs/python-names.md collects their docstrings.

Units are mm, N and MPa. `__init__.pyi` lists the module of each name, for this file, editors and type checkers. A name
is imported on first use, so that `import twintip` is fast. `__version__` is the version of the installed package.
"""

import ast
from importlib import import_module
from pathlib import Path

_IMPORTS = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
_MODULE_OF = {
    imported.name: statement.module
    for statement in _IMPORTS.body
    if isinstance(statement, ast.ImportFrom) and statement.module
    for imported in statement.names
}
__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> object:
    """Import a public name on its first use. Raises AttributeError for any other name."""
    if name == "__version__":
        return import_module("importlib.metadata").version(__name__)
    if name not in _MODULE_OF:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    """Return the public names, although most of them are not yet imported."""
    return ["__version__", *__all__]
