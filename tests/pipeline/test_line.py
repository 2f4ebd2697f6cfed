"""A line of three tips has no housing: its readings alone are judged, and nothing of a part is told, drawn or made."""

import importlib
import json

import numpy as np
import pytest

from twintip.cli import main

FOULY = "docs/examples/fouly.toml"
DOMES = {
    "tips.shape": "dome",
    "tips.dome_radius_mm": 2.0,
    "tips.side_mm": 2.4,
    "press.travel_mm": 0.4,
    "reading.tilt_deg": 1.5,
    "reading.noise_percent": 0.3,
}
"""Domes are not solved on cells, so that they cost less than the cubes of the example, and read well at this tilt.

At 0.5 MPa the whole force rises by 0.08 N in the most tilted press, which must be ten times its noise.
"""


def flags(**changes):
    settings = {**DOMES, **changes}
    return [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    """Return the exit code and the folder of a line that reads well."""
    folder = tmp_path_factory.mktemp("line") / "fouly"
    code = main(["run", "--design", FOULY, *flags(), "--out", str(folder)])
    return code, folder


def load_report(folder):
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_line_that_reads_well_passes_by_its_readings_alone(line):
    code, folder = line
    outcomes = {verdict["name"]: verdict["passed"] for verdict in load_report(folder)["verdicts"]}
    names = ("reading.bias", "reading.uncertainty", "reading.touch", "reading.calibration")
    assert (outcomes, code) == (dict.fromkeys(names, True), 0)


@pytest.mark.slow
def test_report_of_a_line_tells_its_springs_and_nothing_of_a_part(line):
    """1/K of each spring in the order of the tips, high, low, high; off the diagonal a frame would stand."""
    _, folder = line
    report = load_report(folder)
    assert {path.name for path in folder.iterdir()} == {"design.toml", "response.csv", "report.html", "report.json"}
    assert set(report["errors"]) == {"P_max", "NL", "contact"}
    assert [report.get(key) for key in ("flexures", "housing", "behaviour")] == [None, None, None]
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert [name for name in ("housing.3mf", "pipeline design", "verdicts on the part") if name in page] == []
    per_mm = np.diag([1e3 / 17300.0, 1e3 / 753.0, 1e3 / 17300.0])
    np.testing.assert_allclose(report["read_out"]["springs_mm_per_N"], per_mm, rtol=1e-12)


def test_files_to_make_a_line_by_are_refused_before_any_work(tmp_path, capsys, monkeypatch):
    job = importlib.import_module("pipeline.sensor")
    monkeypatch.setattr(job, "fruit_compliance", lambda *_: pytest.fail("solved"))
    assert main(["design", "--design", FOULY, "--out", str(tmp_path / "made")]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith("pipeline: tips.layout = 'line' must be pair or square")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("words", [("explain", "leaf", "--out"), ("check",)])
def test_commands_take_the_folder_of_a_line(words, line):
    _, folder = line
    assert main([*words, str(folder)]) == 0


@pytest.mark.slow
def test_nothing_is_drawn_of_a_line(line, tmp_path, capsys):
    _, folder = line
    for flag, name in (("--png", "out"), ("--html", "out.html")):
        assert main(["view", str(folder), flag, str(tmp_path / name)]) == 2
        err = capsys.readouterr().err
        assert (err.count("\n"), str(folder) in err) == (1, True)
    assert list(tmp_path.iterdir()) == []
