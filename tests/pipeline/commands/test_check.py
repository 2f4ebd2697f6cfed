"""`pipeline check`: an output folder as it was written passes, and every kind of damage to it fails by name."""

import dataclasses
import hashlib
import json
import os
import re
import shutil
from pathlib import Path

import pytest
from stand_ins import result_of

from cad.checks.triangle_checks import library_mesh
from cad.design.processes import PROCESSES
from cad.files.sensor_files import write_sensor
from cad.files.step import write_step
from cad.files.stl import read_stl
from cad.parts.assembly import sensor_of
from cad.parts.cover_solid import cover_of, cover_part
from cad.parts.sensor import Body
from cad.quantity import InputError
from pipeline.cli import main
from pipeline.report.check import folder_check, limited_check
from pipeline.report.check.folder_check import check_folder
from pipeline.report.outputs import write_outputs
from pipeline.storage.seal import sealed_mapping


def failed(folder):
    return [verdict.name for verdict in check_folder(folder) if verdict.passed is not True]


def change_report(folder, **changes):
    path = folder / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**report, **changes}), encoding="utf-8")


@pytest.fixture
def folder(default_run, tmp_path):
    """Return a copy of the default run's folder that a test may damage."""
    return shutil.copytree(default_run.folder, tmp_path / "paper")


@pytest.fixture
def sensor(default_run):
    return sensor_of(default_run.result.design, default_run.result.springs.housing)


@pytest.fixture
def in_this_process(monkeypatch):
    """Let the command check folders in this process; test_json_is_a_list_of_verdicts starts another."""
    monkeypatch.setattr(limited_check, "verdicts_apart", lambda path, _process: check_folder(path))


@pytest.mark.usefixtures("in_this_process")
def test_folder_as_it_was_written_passes(default_run, capsys):
    assert main(["check", str(default_run.folder)]) == 0
    assert "geometry.leaf_thickness_low" in capsys.readouterr().out


def test_json_is_a_list_of_verdicts(default_run, capsys):
    assert main(["check", str(default_run.folder), "--json"]) == 0
    verdicts = json.loads(capsys.readouterr().out)
    assert {"geometry.valid", "geometry.watertight", "files.unchanged"} <= {verdict["name"] for verdict in verdicts}


def test_file_changed_since_the_run_fails(folder):
    with (folder / "housing.step").open("a", encoding="utf-8") as file:
        file.write("\n")
    assert failed(folder) == ["files.unchanged"]


@pytest.mark.parametrize("name", ["assembly.step", "flexure.vtu"])
def test_missing_file_that_the_report_lists_fails(name, folder):
    (folder / name).unlink()
    assert failed(folder) == ["files.unchanged"]


@pytest.mark.parametrize("name", ["housing.step", "housing.stl", "housing.3mf"])
def test_missing_or_unreadable_housing_fails_and_is_no_error(name, folder):
    (folder / name).write_text("rubbish", encoding="utf-8")
    assert {"files.unchanged", "geometry.readable"} <= set(failed(folder))
    (folder / name).unlink()
    assert failed(folder) == ["files.unchanged", "geometry.readable"]
    (unreadable,) = (verdict for verdict in check_folder(folder) if verdict.name == "geometry.readable")
    assert f"{name} cannot be measured, there is no such file" in unreadable.reference


def test_step_of_another_housing_fails_by_the_leaf_that_differs(folder, sensor, tmp_path):
    """The leaves have each other's thickness."""
    flexures = {arm.name: arm.flexure for arm in sensor.housing.arms}
    thicknesses = [leaf.thickness for leaf in flexures.values()]
    swapped = zip(flexures.items(), reversed(thicknesses), strict=True)
    changed = {name: dataclasses.replace(leaf, thickness=thickness) for (name, leaf), thickness in swapped}
    other = tmp_path / "other"
    other.mkdir()
    write_sensor(sensor_of(result_of().design, sensor.housing.with_flexures(changed)), other)
    shutil.copy(other / "housing.step", folder / "housing.step")
    expected = {"files.unchanged", "geometry.leaf_thickness_low", "geometry.leaf_thickness_high"}
    assert expected <= set(failed(folder))


@pytest.mark.slow
@pytest.mark.parametrize(("recess", "names"), [(1.0, []), (0.1, ["geometry.cover_clearance"])])
def test_cover_that_touches_what_moves_fails(folder, sensor, recess, names):
    cover = dataclasses.replace(cover_of(sensor), recess=recess)
    write_step((Body(name="cover", shape=cover_part(cover).shape, colour=(0.5, 0.5, 0.5)),), folder / "cover.step", "c")
    assert failed(folder) == names


def test_cover_that_cannot_be_read_fails_and_is_no_error(folder):
    (folder / "cover.step").write_text("rubbish", encoding="utf-8")
    assert failed(folder) == ["geometry.readable"]


def test_open_stl_fails_watertight(folder):
    path = folder / "housing.stl"
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    path.write_bytes(data[:80] + (count - 1).to_bytes(4, "little") + data[84:-50])
    assert {"files.unchanged", "geometry.watertight"} <= set(failed(folder))


@pytest.mark.slow
def test_folder_without_a_housing_fails_by_that(tmp_path, capsys):
    write_outputs(result_of(made=False), tmp_path)
    assert main(["check", str(tmp_path)]) == 1
    assert "failed geometry.made: no housing: see printable.*" in capsys.readouterr().out


@pytest.mark.usefixtures("in_this_process")
def test_report_that_is_not_ours_is_one_line_and_exit_2(folder, capsys):
    change_report(folder, housing={"a": 1})
    assert main(["check", str(folder)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "its report.json must be as it was written (required field missing @ housing." in error


def test_file_outside_the_folder_is_not_taken_for_one_inside(folder):
    outside = folder.parent / "secret"
    outside.write_text("x", encoding="utf-8")
    change_report(folder, files=[{"path": "../secret", "sha256": hashlib.sha256(b"x").hexdigest()}])
    assert failed(folder) == ["files.unchanged", "report.digest"]


@pytest.mark.slow
@pytest.mark.parametrize("process", ["fdm-petg", "dmls-17-4ph"])
def test_one_file_is_judged_by_the_rules_of_its_process(process, default_run, capsys):
    path = str(default_run.folder / "housing.stl")
    main(["check", path, "--process", process, "--json"])
    verdicts = {verdict["name"]: verdict for verdict in json.loads(capsys.readouterr().out)}
    assert verdicts["geometry.min_wall"]["limit"] == PROCESSES[process].min_wall_mm
    assert verdicts["geometry.min_wall"]["passed"] is True


@pytest.mark.slow
def test_one_file_is_judged_by_the_default_process_without_a_flag(default_run, capsys):
    assert main(["check", str(default_run.folder / "housing.stl")]) == 0
    (row,) = (line for line in capsys.readouterr().out.splitlines() if "geometry.min_wall" in line)
    assert f"{PROCESSES['fdm-petg'].min_wall_mm:g}" in row


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("housing.stl", "--process", "fdm-abs"), r"--process = 'fdm-abs': must be one of fdm-petg, .*; did you mean "),
        ((".", "--process", "fdm-pla"), r"--process = 'fdm-pla': must be left out for a folder; its design names the"),
    ],
)
def test_process_that_is_unknown_or_of_a_folder_is_refused(words, message, default_run, monkeypatch, capsys):
    monkeypatch.chdir(default_run.folder)
    assert main(["check", *words]) == 2
    assert re.match(f"pipeline: {message}", capsys.readouterr().err)


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


def loop(path):
    path.unlink()
    path.symlink_to(path.name)


def elsewhere(path):
    path.rename(path.parent.parent / path.name)
    path.symlink_to(path.parent.parent / path.name)


def nested(path):
    """Put thousands of folders in each other in the place of a file."""
    path.unlink()
    for _ in range(300):
        path.mkdir()
        path /= "nested"


def piped(path):
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize("change", [Path.unlink, loop, elsewhere, nested, piped, lambda path: path.chmod(0)])
@pytest.mark.parametrize("name", ["housing.step", "response.csv"])
def test_folder_whose_files_are_something_else_ends_in_verdicts(change, name, folder, monkeypatch):
    """What cannot be opened fails; a file that only this user cannot read is one, unless it is the super-user's."""
    if name == "response.csv":  # the part is not looked at again
        monkeypatch.setattr(folder_check, "_check_geometry", lambda _report, _folder: ())
    change(folder / name)
    wrong = failed(folder)
    if os.geteuid() != 0 or (folder / name).is_symlink() or not (folder / name).is_file():
        assert "files.unchanged" in wrong
        assert ("geometry.readable" in wrong) is (name == "housing.step")


@pytest.mark.parametrize("change", [Path.unlink, loop, nested, piped, lambda path: path.write_text("[" * 10**6)])
def test_report_that_is_something_else_is_one_line(change, folder):
    change(folder / "report.json")
    with pytest.raises(InputError, match=r"^PATH = [^\n]* must hold a report.json that can be read [^\n]*$"):
        check_folder(folder)


def test_stl_that_is_inside_out_fails_watertight(folder):
    mesh = library_mesh(read_stl(folder / "housing.stl"))
    mesh.invert()
    mesh.export(folder / "housing.stl")
    assert "geometry.watertight" in failed(folder)


def test_outcome_of_the_part_that_is_not_that_of_the_report_fails(folder):
    """Somebody made the report say that the leaf is too thin, and its digest fit."""
    path = folder / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    (verdict,) = (one for one in report["verdicts"] if one["name"] == "geometry.leaf_thickness_low")
    verdict |= {"value": 0.5, "passed": False}
    path.write_text(json.dumps(sealed_mapping(report)), encoding="utf-8")
    assert failed(folder) == ["report.geometry"]


def test_check_changes_nothing_in_a_folder(default_run):
    before = {path.name: path.read_bytes() for path in default_run.folder.iterdir()}
    check_folder(default_run.folder)
    assert {path.name: path.read_bytes() for path in default_run.folder.iterdir()} == before
