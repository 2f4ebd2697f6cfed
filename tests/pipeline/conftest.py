"""The default run, once for all tests of the session, and a stand-in for it where a test is of what is around it."""

import contextlib
import io
import json
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from stand_ins import result_of, stored_report

import pipeline
from pipeline import main_job
from pipeline.cli import main
from pipeline.options import RunOptions
from pipeline.result import SensorResult
from pipeline.storage.folder import output_folder
from pipeline.storage.workers import cad_worker
from sensor.design.parameters import Design


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


class StandInRun:
    """Stands for `pipeline.run`: writes a report where it is told, keeps what it was asked for, returns a result."""

    def __init__(self):
        """Pass every verdict, until told otherwise."""
        self.asked: list[tuple[Design, RunOptions]] = []
        self.passed: bool | None = True
        self.error: BaseException | None = None
        self.result = result_of()

    @property
    def designs(self):
        """Return the designs that were run."""
        return [design for design, _ in self.asked]

    def __call__(self, design, options, **_):
        """Run nothing, or raise inside the output folder."""
        verdicts = tuple(replace(verdict, passed=self.passed) for verdict in self.result.verdicts)
        sensor = replace(self.result.sensor, design=design)
        result = replace(self.result, sensor=sensor, options=options, verdicts=verdicts)
        with output_folder(options.out, force=options.force) as folder:
            result = replace(result, report=stored_report(result))
            (folder / "report.json").write_text(json.dumps(result.report), encoding="utf-8")
            if self.error is not None:
                raise self.error
        self.asked.append((design, options))
        return result


@pytest.fixture
def stand_in_run(tmp_path, monkeypatch):
    """Put a light run in the place of the real one, in an empty current folder."""
    run = StandInRun()
    monkeypatch.setattr(pipeline, "run", run)
    monkeypatch.chdir(tmp_path)
    return run
