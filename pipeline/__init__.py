"""IN WHICH ORDER, and is it good enough: `from pipeline import RunOptions, load_design, run`."""

from typing import TYPE_CHECKING, Any

from pipeline.options import RunOptions, load_design

if TYPE_CHECKING:
    from pipeline.main_job import run as run

__all__ = ["RunOptions", "load_design", "run"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - the function of a run, imported when it is asked for
    if name != "run":
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    from pipeline.main_job import run

    return run
