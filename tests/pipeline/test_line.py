"""A line of three tips has no housing: its readings alone are judged, and nothing of a part is told, drawn or made."""

import importlib
import json

import numpy as np
import pytest
from refusal import refusal

from pipeline import RunOptions, load_design, run
from sensor.design.tip_mount import plate_depth
from sensor.quantity import InputError
from twintip.cli import main

FOULY = "docs/examples/fouly.toml"
BY_CELLS = 5e-3  # of forces: what the cells of flat tips leave, as the run tells of its contact
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


def report_of(folder):
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def test_line_that_reads_well_passes_by_its_readings_alone(line):
    code, folder = line
    report = report_of(folder)
    outcomes = {verdict["name"]: verdict["passed"] for verdict in report["verdicts"]}
    names = ("reading.bias", "reading.uncertainty", "reading.touch", "reading.calibration")
    assert outcomes == dict.fromkeys(names, True)
    assert code == 0


def test_report_of_a_line_tells_nothing_of_a_part(line):
    _, folder = line
    report = report_of(folder)
    assert {path.name for path in folder.iterdir()} == {"design.toml", "response.csv", "report.html", "report.json"}
    assert "flexures" not in report
    assert set(report["errors"]) == {"P_max", "NL", "contact"}
    assert (report["housing"], report["behaviour"], report["accuracy"]["springs"]) == (None, None, None)
    assert "no housing" in report["notes"][0]
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert [name for name in ("housing.3mf", "pipeline design", "verdicts on the part") if name in page] == []


def test_springs_of_a_line_are_those_it_gives_and_do_not_move_each_other(line):
    """1/K of each in the order of the tips, high, low, high; off the diagonal a frame would stand."""
    _, folder = line
    report = report_of(folder)
    per_mm = np.diag([1e3 / 17300.0, 1e3 / 753.0, 1e3 / 17300.0])
    np.testing.assert_allclose(report["read_out"]["springs_mm_per_N"], per_mm, rtol=1e-12)
    assert (report["springs"]["K_l_N_per_m"], report["springs"]["K_h_N_per_m"]) == (753.0, 17300.0)


@pytest.mark.parametrize("limit", ["bias", pytest.param("uncertainty", marks=pytest.mark.slow)])
def test_line_that_reads_badly_fails_by_that_reading(limit, tmp_path):
    """It is off by per cents: a limit of a thousandth is planted."""
    planted = {f"reading.{limit}_limit": 1e-3}
    assert main(["run", "--look", "--design", FOULY, *flags(**planted), "--out", str(tmp_path / "bad")]) == 1
    failed = [verdict["name"] for verdict in report_of(tmp_path / "bad")["verdicts"] if not verdict["passed"]]
    assert failed == [f"reading.{limit}"]


def test_line_without_readings_is_judged_by_its_force_ratio(tmp_path):
    unset = dict.fromkeys(("reading.tilt_deg", "reading.noise_percent", "reading", "bench"), "")
    words = flags(**unset, **{"targets.P_max": 5})
    main(["run", "--look", "--design", FOULY, *words, "--out", str(tmp_path / "ratio")])
    names = {verdict["name"] for verdict in report_of(tmp_path / "ratio")["verdicts"]}
    assert names == {"P_max", "NL", "P_displacement_independent", "P_monotonic"}


def test_files_to_make_a_line_by_are_refused_before_any_work(tmp_path, capsys, monkeypatch):
    job = importlib.import_module("pipeline.sensor")
    monkeypatch.setattr(job, "fruit_compliance", lambda *_: pytest.fail("solved"))
    assert main(["design", "--design", FOULY, "--out", str(tmp_path / "made")]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith("pipeline: tips.layout = 'line' must be pair or square")
    assert list(tmp_path.iterdir()) == []
    assert refusal(run, load_design(FOULY), RunOptions(out=tmp_path / "made", fabrication=True)).field == "tips.layout"
    assert list(tmp_path.iterdir()) == []


def test_pins_of_a_line_need_no_room_for_feet():
    """Feet of pins of 1 mm are wider than 2.5 mm; a line is not printed and has none."""
    design = load_design(FOULY, {"tips.socket": "pin"})
    assert plate_depth(design, design.process) == design.process.depth_mm
    square = load_design(FOULY, {"tips.socket": "pin", "tips.layout": "square", "tips.order": "", "tips.outer_mm": ""})
    with pytest.raises(InputError):
        plate_depth(square, square.process)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        pytest.param(["check", "{line}"], 0, marks=pytest.mark.slow),
        (["explain", "K_l", "--out", "{line}"], 0),
        (["explain", "leaf", "--out", "{line}"], 0),
        (["view", "{line}", "--png", "{out}"], 2),
        (["view", "{line}", "--html", "{out}.html"], 2),
    ],
    ids=lambda value: " ".join(value[:3]) if isinstance(value, list) else str(value),
)
def test_commands_take_the_folder_of_a_line_or_refuse_it_in_one_line(words, code, line, tmp_path, capsys):
    _, folder = line
    capsys.readouterr()
    assert main([word.format(line=folder, out=tmp_path / "out") for word in words]) == code
    err = capsys.readouterr().err
    if code:
        assert err.count("\n") == 1
        assert str(folder) in err
        assert list(tmp_path.iterdir()) == []


def test_calibrated_line_reads_the_modulus_that_its_forces_are_of(line, tmp_path, capsys):
    """Weights bend springs of just the design's stiffness that do not creep: its own forces read its own modulus."""
    _, folder = line
    report = report_of(folder)
    of_kind = {"low": 753.0, "high": 17300.0}
    rows = ["tip,weight_g,deflection_mm"]
    for tip in report["tips"]:
        for grams in (10.0, 20.0, 30.0):
            rows.append(f"{tip['name']},{grams},{9.80665e-3 * grams / of_kind[tip['spring']] * 1e3:.12g}")
    weights, unit = tmp_path / "weights.csv", tmp_path / "unit.toml"
    weights.write_text("\n".join(rows) + "\n", encoding="utf-8")
    assert main(["calibrate", str(folder), str(weights), "--out", str(unit)]) == 0
    with unit.open("a", encoding="utf-8") as text:
        text.write("creep_per_decade = 0.0\ncreep_error = 0.0\n")
    press = tmp_path / "press.csv"
    for row in report["response"]:
        lines = ["t_s,F_1_N,F_2_N,F_3_N"]
        for index, forces in enumerate(zip(*row["F_N"], strict=True)):
            lines.append(",".join([f"{index}", *(f"{force:.12g}" for force in forces)]))
        press.write_text("\n".join(lines) + "\n", encoding="utf-8")
        capsys.readouterr()
        assert main(["read", str(folder), str(press), "--unit", str(unit), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["E_MPa"] == pytest.approx(row["E_MPa"], rel=BY_CELLS)
    assert main(["read", str(folder), "--unit", str(unit), "--forces", "0.2,0.1,0.2"]) == 2
    for flag, name in (("--c-header", "unit.h"), ("--micropython", "unit.py")):
        assert main(["read", str(folder), "--unit", str(unit), flag, str(tmp_path / name)]) == 0
