"""A look says what a whole run says, within its error bars, without a solid; a watch looks again at each change."""

import json
import signal
import subprocess
import sys
import time
from contextlib import suppress
from itertools import islice

import numpy as np
import pytest
from deadline import DEADLINE_S
from programs import PYTHON, ended
from random_designs import ROUGH, random_designs

from pipeline.main_job import evaluate
from pipeline.options import DESIGNS, RunOptions
from pipeline.report.check import check_path
from sensor.quantity import InputError
from twintip.cli import main

LOOK = RunOptions(look=True, tolerance=ROUGH.tolerance)
LOOK_FILES = {"design.toml", "latest.js", "report.html", "report.json", "response.csv"}
SELDOM = ("scipy.interpolate", "scipy.ndimage", "scipy.optimize", "scipy.stats", "trimesh")
"""Slow to load, and used by few scenes alone."""
UNLOADED = ("cadquery", "OCP", "vtkmodules", "pyvista", "ezdxf", *SELDOM)


def misses(design) -> np.ndarray:
    """Return how far the numbers of a look are from those of a run, over the bars of both."""
    rough = evaluate(design, LOOK)
    whole = evaluate(design)
    K_m_over_E = rough.contact.K_m_over_E()
    rows = [(K_m_over_E, whole.contact.K_m_over_E(), rough.contact.difference_error * K_m_over_E)]
    by_name = {verdict.name: verdict for verdict in whole.verdicts}
    for verdict in rough.verdicts:
        other = by_name[verdict.name]
        if verdict.error and other.value is not None:
            rows.append((verdict.value, other.value, verdict.error + (other.error or 0.0)))
    return np.array([abs(value - truth) / bar for value, truth, bar in rows])


def _misses_of(seed):
    """Yield the misses of random designs; those that no run takes, as a contact runs off its dome, are left out."""
    for design in random_designs(seed):
        with suppress(InputError):
            yield misses(design)


@pytest.mark.slow
def test_numbers_of_a_look_lie_within_its_bars_of_the_run():
    for found in islice(_misses_of(21), 1):
        assert found.max() <= 1.0


@pytest.mark.study
def test_bars_of_a_look_cover_95_percent_of_fifty_random_designs():
    found = np.concatenate(list(islice(_misses_of(22), 50)))
    assert (found <= 1.0).mean() >= 0.95


def loaded_by(*words):
    """Return which modules a run of these words has loaded that it should not need, and its exit code."""
    script = (
        "import sys; from twintip.cli import main; code = main(sys.argv[1:]); "
        f"print([name for name in {UNLOADED} if name in sys.modules], code)"
    )
    return ended(PYTHON, "-c", script, "run", *words).stdout.splitlines()[-1]


@pytest.mark.slow
def test_run_loads_here_only_what_its_scene_needs(tmp_path, monkeypatch):
    """Solids are made in another process; nothing is remembered, so that every solve is done."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    # so coarse a tolerance leaves verdicts undecided
    assert loaded_by("--tol", "0.1", "--out", str(tmp_path / "run")) == "[] 1"


def test_look_writes_answer_and_page_and_loads_no_cad_kernel(tmp_path):
    assert loaded_by("--look", "--out", str(tmp_path / "look")) == "[] 1"
    assert {path.name for path in (tmp_path / "look").iterdir()} == LOOK_FILES
    report = json.loads((tmp_path / "look" / "report.json").read_text())
    assert report["key"] in (tmp_path / "look" / "latest.js").read_text()
    assert not [verdict for verdict in report["verdicts"] if verdict["name"].startswith("geometry.")]
    assert max(spring["error_percent"] for spring in report["flexures"].values()) < 2.0


@pytest.mark.slow
def test_readings_that_tell_no_modulus_fail_and_lose_no_file(tmp_path):
    """Noise of a quarter of the force: no pose can be read, and what shows readings has nothing to show."""
    out = tmp_path / "look"
    assert main(["run", "--look", "--set", "reading.noise_percent=26", "--out", str(out)]) == 1
    assert {path.name for path in out.iterdir()} == LOOK_FILES
    verdicts = json.loads((out / "report.json").read_text())["verdicts"]
    outcomes = {verdict["name"]: verdict["passed"] for verdict in verdicts}
    assert (outcomes["reading.bias"], outcomes["reading.uncertainty"]) == (False, False)


@pytest.mark.slow
def test_look_has_no_part_to_check_and_keeps_a_file_of_a_person(tmp_path):
    out = tmp_path / "out"
    assert main(["run", "--look", "--out", str(out)]) == 1
    report = (out / "report.json").read_bytes()
    (failed,) = (verdict for verdict in check_path(out, None) if not verdict.passed)
    assert (failed.name, "--look" in failed.reference) == ("geometry.readable", True)
    (out / "mine.txt").write_text("a file of a person")
    assert main(["run", "--look", "--nl", "0.06", "--out", str(out)]) == 2
    assert (out / "report.json").read_bytes() == report


@pytest.mark.slow
def test_watch_looks_again_at_each_change_and_survives_a_bad_file(tmp_path):
    file = tmp_path / "mine.toml"
    text = (DESIGNS / "paper.toml").read_text()
    file.write_text(text)
    out = tmp_path / "out"
    report = out / "report.json"
    words = [sys.executable, "-m", "twintip", "run", "--watch", str(file), "--out", str(out)]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        try:
            _wait(report.exists)
            file.write_text(text.replace("NL = 0.05", "NL = nonsense"))
            assert any("mine.toml" in line for line in process.stderr)  # behind lines of progress
            file.write_text(text.replace("NL = 0.05", "NL = 0.07"))
            _wait(lambda: _nl(report) == 0.07)
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(DEADLINE_S) == 130


def _nl(report) -> float | None:
    try:
        return json.loads(report.read_text())["design"]["targets"]["NL"]
    except OSError:  # between two renames
        return None


def _wait(happened) -> None:
    end = time.monotonic() + DEADLINE_S
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.05)
