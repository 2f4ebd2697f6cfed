"""IN WHICH ORDER, and is it good enough: `from pipeline import RunOptions, load_design, run`."""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pipeline.options import RunOptions, load_design

if TYPE_CHECKING:
    from pipeline.run import run as run

__all__ = ["RunOptions", "load_design", "run"]


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
