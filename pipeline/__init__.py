"""IN WHICH ORDER, and is it good enough: `from pipeline import RunOptions, load_design, run`."""

import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.run import run as run

__all__ = ["RunOptions", "load_design", "run"]

_OURS = Path(__file__).resolve().parents[1]


def _refuse_shadows() -> None:
    """Raise ImportError, in one line, where another file of the name stands before a package of ours."""
    for name in ("cad", "mesh", "solve"):
        spec = find_spec(name)
        place = None if spec is None or spec.origin is None else Path(spec.origin).resolve()
        if place != _OURS / name / "__init__.py":
            msg = f"{place or name} hides the package {name!r} of twintip; rename that file or start in another folder"
            raise ImportError(msg)


_refuse_shadows()

from pipeline.options import RunOptions, load_design  # noqa: E402 - it imports cad, which must be ours


class _Package(ModuleType):
    """A package whose `run` stays the function when somebody imports the module of that name."""

    def __setattr__(self, name: str, value: object) -> None:
        """Bind a name; where the import system binds the module `pipeline.run`, bind its function instead."""
        super().__setattr__(name, value.run if name == "run" and isinstance(value, ModuleType) else value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:  # noqa: ANN401 - the functions of a run, imported when they are asked for
    if name != "run":
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return import_module("pipeline.run").run
