"""`pipeline check --solve`: the file of a housing has the springs of its run, and what cannot be solved is refused."""

import json

import cadquery as cq
import pytest

from twintip.cli import main
from twintip.commands import check

REFUSED = {
    "triangles": ("housing.stl", ("--design", "paper"), "--solve"),
    "nothing that says where": ("housing.step", (), "--solve"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_solved_is_refused_in_one_line(case, tmp_path, capsys):
    name, flags, field = REFUSED[case]
    path = tmp_path / name
    path.write_bytes(b"")
    assert main(["check", str(path), *flags, "--solve"]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"pipeline: {field} = ")
    assert error.count("\n") == 1


PLATE = cq.Workplane("XZ").rect(40.0, 20.0).extrude(6.0)
WRONG = {
    "two bodies": (PLATE.union(PLATE.translate((100.0, 0.0, 0.0))), (), "PART"),
    "a point beside it": (PLATE, ("--held=0,0,30",), "--held"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_part_is_refused_before_the_springs_of_the_design_are_solved(case, tmp_path, capsys, monkeypatch):
    shape, flags, field = WRONG[case]
    path = tmp_path / "part.step"
    cq.exporters.export(cq.Workplane(cq.Compound.makeCompound(shape.vals())), str(path))
    monkeypatch.setattr(check, "_designed_springs", None)
    assert main(["check", str(path), "--design", "paper", *flags, "--solve"]) == 2
    assert capsys.readouterr().err.startswith(f"pipeline: {field} = ")


@pytest.mark.slow
def test_a_housing_in_inches_is_named_so(tmp_path, capsys):
    """It is shorter than any part, and only the size of the design's housing tells why."""
    longest = 73.657 / 25.4
    path = tmp_path / "part.step"
    cq.exporters.export(cq.Workplane("XZ").rect(longest, 1.0).extrude(0.4), str(path))
    assert main(["check", str(path), "--design", "paper", "--solve"]) == 2
    assert "as if in inches" in capsys.readouterr().err


@pytest.mark.study
def test_the_file_of_a_run_has_its_springs(tmp_path, capsys):
    """That the command passes for the housing of the preset is held by .ci/run."""
    folder = tmp_path / "paper"
    assert main(["run", "--design", "paper", "--out", str(folder)]) == 0
    capsys.readouterr()
    assert main(["check", str(folder / "housing.step"), "--design", "paper", "--solve", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    of_run = {verdict["name"]: verdict for verdict in report["verdicts"]}
    of_file = {verdict["name"]: verdict for verdict in told["verdicts"]}
    for name in ("K_l", "K_h"):
        bars = of_run[name]["error"] + of_file[name]["error"]
        assert abs(of_file[name]["value"] - of_run[name]["value"]) <= bars
        assert of_file[name]["error"] <= 0.01 * of_file[name]["value"]  # the bar that is promised
    assert "geometry.as_designed" not in of_file
