"""A fault of the machine is an error wherever it arises in a run: no verdict, no file, nothing kept."""

import errno
import functools
import shutil
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext

import pytest

import mesh.housing.sweep
import pipeline.springs.mounts
from pipeline.main_job import run
from pipeline.options import RunOptions, load_design

FAULTS = {
    "disk full": OSError(errno.ENOSPC, "No space left on device"),
    "no memory": MemoryError(),
    "Ctrl-C": KeyboardInterrupt(),
    "worker lost": BrokenProcessPool("terminated"),
}
BY_GMSH = {**FAULTS, "gmsh": Exception("std::bad_alloc")}  # the bare class is what gmsh raises
BY_SUPERLU = {**FAULTS, "SuperLU": RuntimeError("SUPERLU_MALLOC fails for buf in intCalloc()")}
LOOK = {  # where it arises: the faults that may, and the stage whose result is not kept yet
    "solve.linear.splu": (BY_SUPERLU, "contact"),
    "gmsh.initialize": (BY_GMSH, "flexures"),
    "gmsh.model.mesh.generate": (BY_GMSH, "flexures"),
    "pipeline.springs.mounts.clamped_half": (FAULTS, "flexures"),
    "pipeline.sensor.press_scene": (FAULTS, None),
    "pipeline.report.page.page.flexure_body": (FAULTS, None),
    "pipeline.report.outputs.make_page": (FAULTS, None),
}
WHOLE_RUN = {  # what a look leaves out
    "pipeline.making.solids.write_solids": (FAULTS, "solids"),
    "cad.files.sensor_files.write_step": (FAULTS, "solids"),
    "pipeline.making.field_files.write_vtu": (FAULTS, None),
}
ENVIRONMENT = (OSError, MemoryError, BrokenProcessPool, KeyboardInterrupt)
QUICK = ("solve.linear.splu", "gmsh.initialize", "gmsh.model.mesh.generate", "pipeline.sensor.press_scene")
CASES = [
    pytest.param(place in LOOK, place, *given, id=place, marks=() if place in QUICK else pytest.mark.slow)
    for place, given in {**LOOK, **WHOLE_RUN}.items()
]


def forget_springs():
    """Forget what the process itself remembers, so that it is made again."""
    for function in (mesh.housing.sweep.mesh_of_counts, pipeline.springs.mounts.coarse_half):
        function.cache_clear()


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """Return a function that gives what is kept after a run, or a look, without a fault, and its result."""

    @functools.cache
    def solved(look):
        folder = tmp_path_factory.mktemp("clean")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
            options = RunOptions(out=folder / "out", tolerance=0.02, look=look)
            result = run(load_design("paper"), options, beside=False)
        forget_springs()
        return folder / "cache", result

    return solved


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Return the folder of a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    forget_springs()
    return tmp_path / "cache" / "twintip"


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def values(result):
    return [(verdict.name, verdict.value, verdict.passed) for verdict in result.verdicts]


@pytest.mark.parametrize(("look", "place", "faults", "stage"), CASES)
def test_fault_is_an_error_that_keeps_nothing(clean, cache, tmp_path, look, place, faults, stage):
    before, expected = clean(look)
    shutil.copytree(before, cache.parent, ignore=shutil.ignore_patterns(f"{stage}-*"))
    kept = names(cache)
    options = RunOptions(out=tmp_path / "out", tolerance=0.02, look=look)
    for fault in faults.values():

        def fail(*_, fault=fault, **__):
            raise fault

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(place, fail)
            with pytest.raises(ENVIRONMENT):
                run(load_design("paper"), options, beside=False)
        assert names(cache) == kept
        assert not (tmp_path / "out").exists()
    assert values(run(load_design("paper"), options, beside=False)) == values(expected)


class LostWorkers(Executor):
    """Workers that the system ends, whatever they are at."""

    def submit(self, *_, **__):  # type: ignore[override]
        lost = Future()
        lost.set_exception(BrokenProcessPool("terminated"))
        return lost


@pytest.mark.parametrize(("stage", "tolerance"), [("flexures", 0.01), ("solids", 0.02)])
def test_lost_worker_is_an_error_that_keeps_nothing(cache, tmp_path, monkeypatch, stage, tolerance):
    """Below a tolerance of 0.02 the springs wait for the solid of the worker, with which their mesh is compared."""
    monkeypatch.setattr("pipeline.main_job.cad_worker", lambda _: nullcontext(LostWorkers()))
    with pytest.raises(BrokenProcessPool):
        run(load_design("paper"), RunOptions(out=tmp_path / "out", tolerance=tolerance))
    assert not list(cache.glob(f"{stage}-*"))
    assert not (tmp_path / "out").exists()
