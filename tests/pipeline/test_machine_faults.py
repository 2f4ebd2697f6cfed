"""A fault of the machine is an error wherever it arises in a run: no verdict, no file, nothing kept."""

import errno
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
PLACES = {  # where it arises: the faults that may, and the stage whose result is not kept yet
    "solve.linear.splu": (BY_SUPERLU, "contact"),
    "gmsh.initialize": (BY_GMSH, "flexures"),
    "gmsh.model.geo.synchronize": (BY_GMSH, "flexures"),
    "gmsh.model.mesh.generate": (BY_GMSH, "flexures"),
    "gmsh.model.mesh.getNodes": (BY_GMSH, "flexures"),
    "pipeline.springs.mounts.clamped_half": (FAULTS, "flexures"),
    "pipeline.making.solids.write_solids": (FAULTS, "solids"),
    "cad.files.sensor_files.write_step": (FAULTS, "solids"),
    "cad.checks.sensor_checks.closed_verdicts": (FAULTS, "solids"),
    "pipeline.evaluate.press_scene": (FAULTS, None),
    "pipeline.evaluate.spring_behaviour": (FAULTS, None),
    "pipeline.evaluate.sensor_errors": (FAULTS, None),
    "pipeline.making.fields.write_vtu": (FAULTS, None),
    "pipeline.report.page.page.flexure_body": (FAULTS, None),
    "pipeline.report.outputs.page_of": (FAULTS, None),
}
ENVIRONMENT = (OSError, MemoryError, BrokenProcessPool, KeyboardInterrupt)
DRAWN = ("cad.files.sensor_files.write_step", "cad.checks.sensor_checks.closed_verdicts")  # first, which takes seconds
CASES = [
    pytest.param(place, *given, id=place, marks=pytest.mark.slow if place in DRAWN else ())
    for place, given in PLACES.items()
]


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """Return what is kept after a run without a fault, and its result."""
    folder = tmp_path_factory.mktemp("clean")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        result = run(load_design("paper"), RunOptions(out=folder / "out", tolerance=0.02), beside=False)
    return folder / "cache", result


@pytest.fixture
def kept(clean, tmp_path, monkeypatch):
    """Return a function that keeps all that the run without a fault kept but a stage, and returns the folder of it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for function in (mesh.housing.sweep.mesh_of_counts, pipeline.springs.mounts.coarse_half):
        function.cache_clear()

    def keep(stage):
        shutil.copytree(clean[0], tmp_path / "cache", ignore=shutil.ignore_patterns(f"{stage}-*"))
        return tmp_path / "cache" / "twintip"

    return keep


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def values(result):
    return [(verdict.name, verdict.value, verdict.passed) for verdict in result.verdicts]


@pytest.mark.parametrize(("place", "faults", "stage"), CASES)
def test_fault_is_an_error_that_keeps_nothing(clean, kept, tmp_path, place, faults, stage):
    cache = kept(stage)
    before = names(cache)
    options = RunOptions(out=tmp_path / "out", tolerance=0.02)
    for fault in faults.values():

        def fail(*_, fault=fault, **__):
            raise fault

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(place, fail)
            with pytest.raises(ENVIRONMENT):
                run(load_design("paper"), options, beside=False)
        assert names(cache) == before
        assert not (tmp_path / "out").exists()
    if stage != "solids":  # which take seconds
        assert values(run(load_design("paper"), options, beside=False)) == values(clean[1])


class LostWorkers(Executor):
    """Workers that the system ends, whatever they are at."""

    def submit(self, *_, **__):  # type: ignore[override]
        lost = Future()
        lost.set_exception(BrokenProcessPool("terminated"))
        return lost


@pytest.mark.parametrize(("stage", "tolerance"), [("flexures", 0.01), ("solids", 0.02)])
def test_lost_worker_is_an_error_that_keeps_nothing(kept, tmp_path, monkeypatch, stage, tolerance):
    """Below a tolerance of 0.02 the springs wait for the solid of the worker, with which their mesh is compared."""
    monkeypatch.setattr("pipeline.main_job.cad_worker", lambda _: nullcontext(LostWorkers()))
    cache = kept(stage)
    with pytest.raises(BrokenProcessPool):
        run(load_design("paper"), RunOptions(out=tmp_path / "out", tolerance=tolerance))
    assert not list(cache.glob(f"{stage}-*"))
    assert not (tmp_path / "out").exists()
