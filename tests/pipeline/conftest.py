"""The default run, once for all tests of the session."""

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path

import pytest

import pipeline
from pipeline import main_job
from pipeline.result import SensorResult
from pipeline.storage.workers import cad_worker
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
