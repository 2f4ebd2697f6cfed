"""`pipeline check --solve`: the file of a housing has the springs of its run, and what cannot be solved is refused."""

import json

import pytest

from twintip.cli import main

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
