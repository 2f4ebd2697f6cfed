"""`pipeline check`: an output folder as it was written passes, and every kind of damage to it fails by name."""

import dataclasses
import hashlib
import json
import re
import shutil

import pytest

from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from cad.files.sensor_files import write_sensor
from cad.files.step import write_step
from cad.parts.cover import cover_of, cover_part
from cad.parts.layout import housing_for
from cad.parts.sensor import Body
from pipeline.cli import main
from pipeline.commands.check import check_folder
from pipeline.report.mapping import file_entries
from pipeline.stages.solids import sensor_of

DEFLECTIONS = (0.5, 0.11)


def write(folder, design, housing):
    write_sensor(sensor_of(design, housing), folder)
    report = {
        "design": {"name": design.name},
        "housing": dataclasses.asdict(housing),
        "deflections_mm": list(DEFLECTIONS),
        "files": file_entries(folder),
    }
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")


def failed(folder):
    return [finding.name for finding in check_folder(folder) if finding.passed is not True]


@pytest.fixture(scope="module")
def housing():
    return housing_for(Design(), PROCESSES["fdm-petg"], (28.9, 14.8), DEFLECTIONS)


@pytest.fixture(scope="module")
def written(tmp_path_factory, housing):
    folder = tmp_path_factory.mktemp("check")
    write(folder, Design(), housing)
    return folder


@pytest.fixture
def folder(written, tmp_path):
    """Return a copy that a test may damage."""
    return shutil.copytree(written, tmp_path / "paper")


def test_folder_as_it_was_written_passes(written, capsys):
    assert main(["check", str(written)]) == 0
    assert "geometry.leaf_thickness_low" in capsys.readouterr().out


def test_json_is_a_list_of_findings(written, capsys):
    assert main(["check", str(written), "--json"]) == 0
    findings = json.loads(capsys.readouterr().out)
    assert {"geometry.valid", "geometry.watertight", "files.unchanged"} <= {finding["name"] for finding in findings}


def test_file_changed_since_the_run_fails(folder):
    with (folder / "housing.step").open("a", encoding="utf-8") as file:
        file.write("\n")
    assert failed(folder) == ["files.unchanged"]


def test_missing_file_that_the_report_lists_fails(folder):
    (folder / "assembly.step").unlink()
    assert failed(folder) == ["files.unchanged"]


def test_step_of_another_housing_fails_by_the_leaf_that_differs(folder, housing, tmp_path):
    low = dataclasses.replace(housing.low, thickness=1.2)
    high = dataclasses.replace(housing.high, thickness=0.8)
    other = tmp_path / "other"
    other.mkdir()
    write(other, Design(), dataclasses.replace(housing, low=low, high=high))
    shutil.copy(other / "housing.step", folder / "housing.step")
    found = failed(folder)
    assert {"files.unchanged", "geometry.leaf_thickness_low", "geometry.leaf_thickness_high"} <= set(found)


@pytest.mark.parametrize(("recess", "names"), [(1.0, []), (0.1, ["geometry.cover_clearance"])])
def test_cover_that_touches_what_moves_fails(folder, housing, recess, names):
    cover = dataclasses.replace(cover_of(sensor_of(Design(), housing)), recess=recess)
    write_step((Body(name="cover", shape=cover_part(cover).shape, colour=(0.5, 0.5, 0.5)),), folder / "cover.step", "c")
    assert failed(folder) == names


def test_open_stl_fails_watertight(folder):
    path = folder / "housing.stl"
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    path.write_bytes(data[:80] + (count - 1).to_bytes(4, "little") + data[84:-50])
    assert {"files.unchanged", "geometry.watertight"} <= set(failed(folder))


@pytest.mark.parametrize(
    "report",
    [
        {"files": [], "design": {}, "housing": {"a": 1}, "deflections_mm": [0, 0]},
        {"files": 5, "design": {}, "housing": None, "deflections_mm": [0, 0]},
        3,
    ],
)
def test_report_that_is_not_ours_is_one_line_and_exit_2(tmp_path, capsys, report):
    (tmp_path / "report.json").write_text(json.dumps(report), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "its report.json must be" in error


def test_file_outside_the_folder_is_not_taken_for_one_inside(folder):
    outside = folder.parent / "secret"
    outside.write_text("x", encoding="utf-8")
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    report["files"] = [{"path": "../secret", "sha256": hashlib.sha256(b"x").hexdigest()}]
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    assert failed(folder) == ["files.unchanged"]


def test_one_file_is_judged_too(written, capsys):
    assert main(["check", str(written / "housing.stl")]) == 0
    assert "geometry.min_wall" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nothing", r"PATH = '.*nothing': must be an existing file or folder; name an output folder"),
        (".", r"PATH = '.*': must hold a report.json that can be read \(FileNotFoundError\); name an output folder"),
        ("a.txt", r"PATH = 'a.txt': must be a file of kind .step, .stp, .stl, .3mf; export the part as one of these"),
    ],
)
def test_path_that_cannot_be_judged_is_one_line_and_exit_2(tmp_path, capsys, name, message):
    (tmp_path / "a.txt").write_text("hello", encoding="utf-8")
    assert main(["check", str(tmp_path / name)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert re.search(message, error)
