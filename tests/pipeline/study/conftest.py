"""Studies that are solved in this process, and a study file that a test writes."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest

from pipeline.study.workers.engine import Engine


class InProcess(Executor):
    """Runs what it is given at once."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return a future that has ended."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - a future keeps whatever was raised
            future.set_exception(error)
        return future


@pytest.fixture
def engine() -> Engine:
    return Engine(open=InProcess, workers=1, lost=(ConnectionError,))


LAW = """
base = "paper"
samples = 8
seed = 7
wanted = ["springs.K_l_N_per_m", "springs.K_h_N_per_m"]
[vary]
"targets.P_max" = { from = 3, to = 8 }
"""
"""A study of one scene of contact."""


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    """Write a study file, of some text with replacements."""

    def write(text: str = LAW, **replaced: str) -> Path:
        for old, new in replaced.items():
            text = text.replace(old, new)
        path = tmp_path / "springs.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
