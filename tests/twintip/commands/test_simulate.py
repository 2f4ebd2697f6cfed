"""`pipeline simulate` from the command line: its files, what it refuses, what it says, and the exit code of a proof."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from measured_units import MeasuredDesign

from instrument.proof import ProvedReading, evaluate_proof
from instrument.simulate.simulated_press import PressCurve
from twintip.cli import main
from twintip.commands import calibrate, read, simulate


@pytest.fixture(scope="module")
def report():
    """Return the report of mango, without a run."""
    return MeasuredDesign("mango").report


@pytest.fixture
def folder(report, monkeypatch, tmp_path):
    """Name a folder whose report is that of mango, and work beside it."""
    for command in (simulate, read, calibrate):
        monkeypatch.setattr(command, "read_report", lambda _: report)
    monkeypatch.chdir(tmp_path)
    return "outputs/mango"


QUICK = pytest.mark.usefixtures("_quick")


@pytest.fixture
def _quick(monkeypatch):
    """Press in no time: deflections rise evenly."""

    def curve(unit, _, hand):
        parts = np.linspace(0.0, 1.0, 19)[1:]
        return PressCurve(hand_press=hand, times=hand.press_s * parts, deflections=np.outer(parts, 0.1 / unit.domes.K))

    monkeypatch.setattr("instrument.simulate.simulation.press_curve", curve)


def test_a_simulated_log_is_read_back(folder, capsys):
    flags = ["--E", "1.5", "--radius", "45,110", "--azimuth", "30", "--tilt", "2", "--off-centre", "0.5"]
    assert main(["simulate", folder, *flags, "--thickness", "12", "--noise", "--seed", "7", "--out", "press.csv"]) == 0
    assert capsys.readouterr().out.splitlines() == ["press.csv", "then: pipeline read outputs/mango press.csv"]
    assert main(["read", folder, "press.csv", "--radius", "45,110", "--json"]) == 0
    said = capsys.readouterr()
    assert "--radius" not in said.err
    found = json.loads(said.out)
    # Springs as designed are read as such, and drift is not drawn large.
    assert found["E_MPa"] == pytest.approx(1.5, rel=0.2)
    assert found["tilt_deg"] == pytest.approx(2.0, abs=0.3)
    assert main(["read", folder, "press.csv", "--radius", "4.5,11"]) == 0  # in cm
    assert capsys.readouterr().err.count("note: --radius: ") == 2


@QUICK
def test_all_files_of_one_unit(folder, capsys):
    names = ["--weights", "w.csv", "--plate", "p.csv", "--ball", "b.csv", "--out", "press.csv"]
    assert main(["simulate", folder, *names, "--presses", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["files"] == ["w.csv", "p.csv", "b.csv", "press.csv"]
    calibration, reading = told["commands"]
    assert calibration.startswith(
        "pipeline calibrate outputs/mango w.csv --plate p.csv --ball b.csv --ball-reduced-modulus "
    )
    assert reading == "pipeline read outputs/mango press.csv --unit unit.toml --fruit-presses 0"
    head, *_ = Path("w.csv").read_text(encoding="utf-8").splitlines()
    assert head == "tip,weight_g,deflection_mm,counts_1,counts_2,counts_3,counts_4"
    log = Path("press.csv").read_text(encoding="utf-8")
    assert main(["simulate", folder, *names, "--presses", "2", "--seed", "2"]) == 0
    assert Path("press.csv").read_text(encoding="utf-8") != log


@pytest.mark.parametrize(("bars", "code"), [(0.9, 0), (2.5, 1)])
def test_the_exit_code_of_a_proof(bars, code, folder, monkeypatch, capsys):
    truth = {"E": 1.0 + 0.1 * bars, "radii": (45.0, 90.0), "thickness": None, "tilt": 1.0}
    reading = ProvedReading(**truth, E_read=1.0, u=0.1, error=-0.2, flags=("out_of_range",))
    monkeypatch.setattr(simulate, "prove", lambda _, count, seed, __: evaluate_proof("mango", seed, count * [reading]))
    assert main(["simulate", folder, "--prove", "3"]) == code
    _, row, *_, last = capsys.readouterr().out.splitlines()
    # Error and bar are parts of the truth, where the bar that is told is a part of what is told.
    percents = [float(number) for number in re.findall(r"(\S+) %", row)]
    assert percents == pytest.approx([-20.0, 10.0 * reading.E_read / reading.E], abs=0.05)
    assert last.startswith("not proved: 3 of 3 readings are outside" if code else "proved")
    assert main(["simulate", folder, "--prove", "3", "--json"]) == code
    told = json.loads(capsys.readouterr().out)
    assert (told["presses"], told["passed"], told["farthest"]) == (3, code == 0, pytest.approx(bars))
