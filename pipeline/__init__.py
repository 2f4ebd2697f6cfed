"""Run the stages in order, and evaluate the verdicts: `from pipeline import RunOptions, load_design, run`.

The names are imported on first use, so that the command line responds to Ctrl-C before anything is loaded.
"""

from importlib import import_module

TYPE_CHECKING = False  # importing it from `typing` takes longer than everything else here
if TYPE_CHECKING:
    from pipeline.main_job import run as run
    from pipeline.options import RunOptions as RunOptions
    from pipeline.options import load_design as load_design

__all__ = ["RunOptions", "load_design", "run"]

_MODULE_OF = {"RunOptions": "pipeline.options", "load_design": "pipeline.options", "run": "pipeline.main_job"}


def __getattr__(name: str) -> object:
    """Import a public name from its module when it is first used; raise AttributeError for any other name."""
    if name not in _MODULE_OF:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_MODULE_OF[name]), name)
