"""The default run, once for all tests of the session; studies that are solved in this process, and a study file."""

import contextlib
import io
from concurrent.futures import Executor, Future
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import pipeline
from pipeline import main_job
from pipeline.result import SensorResult
from pipeline.storage.workers import cad_worker
from pipeline.study import engines as workers
from pipeline.study.engines import Engine
from twintip.cli import main


@dataclass(frozen=True, kw_only=True)
class DefaultRun:
    """The exit code of `pipeline run --nl 0.05`, its folder, what it returned to the command and what it printed."""

    code: int
    folder: Path
    result: SensorResult
    printed: str


@pytest.fixture(autouse=True, scope="session")
def _kernel_here(kernel_here):
    """Make solids in this process."""


@pytest.fixture(scope="session")
def default_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "default"
    results: list[SensorResult] = []
    work = pipeline.run

    def kept(design, options, **named):
        results.append(work(design, options, **named))
        return results[-1]

    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr(pipeline, "run", kept)
        patch.setattr(main_job, "cad_worker", cad_worker)
        code = main(["run", "--nl", "0.05", "--out", str(folder)])
    return DefaultRun(code=code, folder=folder, result=results[0], printed=printed.getvalue())


class InProcess(Executor):
    """Runs what it is given at once."""

    def submit(self, fn, /, *args, **kwargs):
        """Return a future that has ended."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - a future keeps whatever was raised
            future.set_exception(error)
        return future


@pytest.fixture(scope="session")
def engine():
    return Engine(open=InProcess, close=Executor.shutdown, workers=1, lost=(ConnectionError,))


@pytest.fixture
def in_process(engine, monkeypatch):
    """Let commands solve in this process."""
    monkeypatch.setattr(workers, "chosen_engine", lambda _processes, _scheduler: nullcontext(engine))


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
def written(tmp_path):
    """Write a study file, of some text with replacements."""

    def write(text=LAW, **replaced):
        for old, new in replaced.items():
            text = text.replace(old, new)
        path = tmp_path / "springs.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
