"""What every test gets: a fixed seed, a cache of its own, and a way to plant source files."""

import contextlib
import functools
import hashlib
import importlib
import os
import pickle
import random
import signal
import textwrap

import numpy as np
import pytest
from hypothesis import settings

SEED = 20190701

settings.register_profile("same-every-time", derandomize=True, deadline=None)
settings.load_profile("same-every-time")


@pytest.fixture(autouse=True)
def _fixed_seed():
    random.seed(SEED)
    np.random.seed(SEED)  # noqa: NPY002 - for code that draws from the global generator


@pytest.fixture(autouse=True, scope="session")
def _signals_heard():
    """Hear the signals that a shell's background job and nohup ignore, and that every child would inherit ignored."""
    for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, handler)


@pytest.fixture(autouse=True, scope="session")
def _no_width_of_a_terminal():
    """Take away the width of whoever's terminal started the tests: answers are as wide as without one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("COLUMNS", raising=False)
        yield


@pytest.fixture(autouse=True, scope="session")
def _no_lines_of_progress():
    """Let a busy machine print no line on what a command is at: tests count the lines of an error."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("twintip.commands.progress.FIRST_LINE_S", 3600.0)
        yield


@pytest.fixture
def rng():
    """Return a generator that starts the same in every test."""
    return np.random.default_rng(SEED)


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory):
    """Keep the user's cache out of the tests: a result stored there earlier could hide a mistake.

    The workers of one session share it, so that a contact or a spring that tests of both take is solved once.
    """
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "cache"
    folder.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="session")
def curves_once(_own_cache):
    """Let the workers of one session share the force curves of pressed bodies: those of one law take 5 s to solve."""
    solve = importlib.import_module("solve.compression.force_curve").fit_force_curve

    @functools.cache
    def fit_force_curve(*press):
        kept = _own_cache / f"curve-{hashlib.sha256(repr(press).encode()).hexdigest()}"
        with contextlib.suppress(FileNotFoundError):
            return pickle.loads(kept.read_bytes())
        curve = solve(*press)
        part = kept.with_suffix(f".{os.getpid()}")
        part.write_bytes(pickle.dumps(curve))
        part.replace(kept)
        return curve

    with pytest.MonkeyPatch.context() as patch:
        for module in ("solve.compression.force_curve", "instrument.compress.force_law"):
            patch.setattr(f"{module}.fit_force_curve", fit_force_curve)
        yield


@pytest.fixture(scope="session")
def kernel_here():
    """Let runs make their solids in this process: each worker would load the CAD kernel once more, for 3 s.

    `default_run` and commands in processes of their own have their worker.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.import_module("pipeline.main_job"), "cad_worker", lambda _: contextlib.nullcontext())
        yield


@pytest.fixture
def plant(tmp_path):
    """Return a function that writes source files below a fresh root and returns that root."""

    def write(files):
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(textwrap.dedent(text), encoding="utf-8")
        return tmp_path

    return write


@pytest.fixture
def without_page(monkeypatch):
    """Let runs write an empty report.html; tests of pages have their own."""
    monkeypatch.setattr(importlib.import_module("pipeline.report.outputs"), "make_page", lambda *_: "")


@pytest.fixture
def wrong_traction(monkeypatch):
    """Plant a wrong sign in one shear traction of the half-space, as the remainder sees it."""
    halfspace = importlib.import_module("solve.halfspace.potentials")
    right = halfspace.stress

    def wrong(fields, poisson):
        sigma: np.ndarray = right(fields, poisson)
        sigma[0, 2] *= -1.0
        sigma[2, 0] = sigma[0, 2]
        return sigma

    monkeypatch.setattr(halfspace, "stress", wrong)


@pytest.fixture
def stand_in_run(tmp_path, monkeypatch):
    """Put a light run in the place of the real one, in an empty current folder."""
    from stand_ins import StandInRun

    import pipeline

    run = StandInRun()
    monkeypatch.setattr(pipeline, "run", run)
    monkeypatch.chdir(tmp_path)
    return run
