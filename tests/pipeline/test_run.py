"""The main job as a user runs it: the folder keeps its contract, the numbers are known, planted designs fail."""

import hashlib
import json
import math
from pathlib import Path

import pytest
from golden.comparison import moved
from golden.freeze import answer_of_run, measured

from twintip.cli import main

ACCURACY = Path(__file__).parents[2] / "docs" / "measurements.md"


def report_of(folder):
    def refuse(name):
        pytest.fail(f"{name} in report.json")

    return json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)


def verdicts_of(report):
    return {verdict["name"]: verdict for verdict in report["verdicts"]}


def numbers_of(report):
    """Return the report without what time it took, and without the files that hold it or the bytes of the kernel."""
    kept = {key: value for key, value in report.items() if key not in ("seconds", "cpu_seconds", "digest")}
    for part in (kept["contact"], *kept["flexures"].values()):
        part.pop("seconds")
    kept["files"] = [file for file in kept["files"] if not file["path"].endswith((".html", ".step"))]
    return kept


def test_default_run_passes_every_verdict(default_run):
    report = report_of(default_run.folder)
    assert {v["name"]: v["reference"] for v in report["verdicts"] if v["passed"] is not True} == {}
    assert (default_run.code, default_run.result.passed) == (0, True)


def test_default_run_answers_what_it_answered(default_run, tmp_path):
    """As tests/golden says of all frozen scenes, and readings by a unit of it; a spring that moves is named."""
    found = answer_of_run(default_run.code, default_run.folder)
    found["measured"] = measured(default_run.folder, tmp_path)
    design = ("design exit", "design files")
    assert moved("paper", found, without=design) == []
    key = "springs.K_l_N_per_m"
    planted = {**found["numbers"], key: 1.1 * found["numbers"][key]}
    (line,) = moved("paper", {**found, "numbers": planted}, without=design)
    assert line.startswith(key)


def test_printed_report_is_the_one_in_the_folder(default_run, capsys):
    """Which is answered again: nothing is solved, no file is touched."""
    before = [(path, path.stat().st_mtime_ns) for path in default_run.folder.iterdir()]
    assert main(["run", "--nl", "0.05", "--json", "--out", str(default_run.folder)]) == 0
    assert json.loads(capsys.readouterr().out) == report_of(default_run.folder)
    assert [(path, path.stat().st_mtime_ns) for path in default_run.folder.iterdir()] == before


def test_default_run_finds_the_right_springs(default_run):
    """K_l 905.7 and K_h 20831 N/m follow from the reference K_m/E of 1.322617 mm."""
    report = report_of(default_run.folder)
    assert report["springs"]["K_l_N_per_m"] == pytest.approx(905.7, rel=5e-4)
    assert report["springs"]["K_h_N_per_m"] == pytest.approx(20831.0, rel=5e-4)
    assert report["contact"]["K_m_over_E_mm"] == pytest.approx(
        1.322617, rel=1e-5 + 0.01 * report["contact"]["error_percent"]
    )
    for spring in report["flexures"].values():
        assert spring["stiffness_N_per_m"] == pytest.approx(spring["target_N_per_m"], rel=5e-3)
        assert 0.0 < spring["error_percent"] < 0.5


@pytest.mark.parametrize(
    ("name", "shown"), [*((name, name) for name in ("K_l", "K_h", "P_max", "NL")), ("contact", "contact, s11 - s12")]
)
def test_table_of_errors_in_the_docs_is_that_of_the_default_run(default_run, name, shown):
    """Two digits of each number, and the two largest shares."""
    budget = report_of(default_run.folder)["errors"][name]
    kinds = (budget[f"{kind}_percent"] for kind in ("discretisation", "model", "inputs"))
    shares = sorted(budget["model"] + budget["inputs"], key=lambda share: -abs(share["size_percent"]))[:2]
    largest = ", ".join(f"{share['effect']} {abs(share['size_percent']):.2g} %" for share in shares)
    row = f"| {shown} | {' | '.join(f'{percent:.2g} %' for percent in kinds)} | {largest} |"
    assert row in ACCURACY.read_text(encoding="utf-8")


def test_files_are_listed_with_their_digest(default_run):
    folder = default_run.folder
    listed = {entry["path"]: entry["sha256"] for entry in report_of(folder)["files"]}
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
    assert numbers_of(report_of(again)) == numbers_of(report_of(first))


@pytest.mark.usefixtures("without_page")
def test_spring_that_cannot_be_printed_is_a_verdict_and_leaves_the_rest(tmp_path, capsys):
    folder = tmp_path / "short"
    assert main(["run", "--set", "print.max_length_mm=20", "--out", str(folder)]) == 1
    report = report_of(folder)
    found = verdicts_of(report)
    assert found["printable.low"]["passed"] is False
    assert "targets.P_max" in found["printable.low"]["reference"]
    assert found["printable.high"]["passed"] is True
    assert report["flexures"]["low"]["stiffness_N_per_m"] is None
    assert (found["K_l"]["value"], found["K_l"]["passed"]) == (None, None)
    assert (found["P_max"]["passed"], found["geometry.made"]["passed"]) == (None, False)
    assert report["response"][-1]["P"][-1] == pytest.approx(5.0, rel=1e-6)
    assert math.isfinite(report["contact"]["error_percent"])
    assert not (folder / "housing.step").exists()
    assert "printable.low" in capsys.readouterr().out
