"""The main job as a user runs it: the folder keeps its contract, the numbers are known, planted designs fail."""

import hashlib
import json
import math

import pytest
from golden.comparison import moved
from golden.freeze import answer_of_run, measured

from twintip.cli import main


def load_report(folder):
    def refuse(name):
        pytest.fail(f"{name} in report.json")

    return json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)


def numbers_of(report):
    """Return the report without what time it took, and without the files that hold it or the bytes of the kernel."""
    kept = {key: value for key, value in report.items() if key not in ("seconds", "cpu_seconds", "digest")}
    for part in (kept["contact"], *kept["flexures"].values()):
        part.pop("seconds")
    kept["files"] = [file for file in kept["files"] if not file["path"].endswith((".html", ".step"))]
    return kept


def test_default_run_passes_every_verdict(default_run):
    report = load_report(default_run.folder)
    assert {v["name"]: v["reference"] for v in report["verdicts"] if v["passed"] is not True} == {}
    assert (default_run.code, default_run.result.passed) == (0, True)


def test_default_run_answers_what_it_answered(default_run, tmp_path):
    """As tests/golden says of all frozen scenes, and readings by a unit of it."""
    found = answer_of_run(default_run.code, default_run.folder)
    found["measured"] = measured(default_run.folder, tmp_path)
    design = ("design exit", "design files")
    assert moved("paper", found, without=design) == []


def test_files_are_listed_with_their_digest(default_run):
    folder = default_run.folder
    listed = {entry["path"]: entry["sha256"] for entry in load_report(folder)["files"]}
    assert {"design.toml", "response.csv", "housing.step", "housing.stl", "assembly.step"} <= set(listed)
    assert set(listed) == {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} - {"report.json"}
    for path, digest in listed.items():
        assert hashlib.sha256((folder / path).read_bytes()).hexdigest() == digest


@pytest.mark.slow
@pytest.mark.usefixtures("without_page")
def test_design_file_repeats_the_run_without_its_cache(default_run, tmp_path, monkeypatch):
    """The numbers are the same, and the bytes of what this project writes itself."""
    first = default_run.folder
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    again = tmp_path / "again"
    assert main(["run", "--design", str(first / "design.toml"), "--out", str(again)]) == 0
    assert numbers_of(load_report(again)) == numbers_of(load_report(first))


@pytest.mark.usefixtures("without_page")
def test_spring_that_cannot_be_printed_is_a_verdict_and_leaves_the_rest(tmp_path, capsys):
    folder = tmp_path / "short"
    assert main(["run", "--set", "print.max_length_mm=20", "--out", str(folder)]) == 1
    report = load_report(folder)
    outcomes = {verdict["name"]: verdict["passed"] for verdict in report["verdicts"]}
    expected = {"printable.low": False, "printable.high": True, "geometry.made": False, "K_l": None, "P_max": None}
    assert {name: outcomes[name] for name in expected} == expected
    assert report["flexures"]["low"]["stiffness_N_per_m"] is None
    assert report["response"][-1]["P"][-1] == pytest.approx(5.0, rel=1e-6)
    assert math.isfinite(report["contact"]["error_percent"])
    assert not (folder / "housing.step").exists()
    assert "printable.low" in capsys.readouterr().out
