"""`pipeline check`: an output folder as it was written passes, and every kind of damage to it fails by name."""

import errno
import hashlib
import json
import os
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest
from stand_ins import GOOD, result_of

from cad.fabrication.file_shapes import files_as_designed
from cad.files.sensor_files import write_sensor
from cad.parts.assembly import draw_sensor
from cad.parts.layout import housing_for
from mesh.housing.sweep import flexure_mesh
from pipeline.report import check
from pipeline.report.check import check_path, folder_geometry, unchanged_verdicts
from pipeline.report.outputs import write_outputs
from pipeline.storage.digests import file_digest, with_digest
from pipeline.storage.vtu import write_vtu
from sensor.design.parameters import Design, Targets
from sensor.design.processes import PROCESSES
from twintip.cli import main


def failed(folder):
    verdicts = (*unchanged_verdicts(folder), *folder_geometry(folder))
    return [verdict.name for verdict in verdicts if verdict.passed is not True]


@pytest.fixture
def folder(default_run, tmp_path):
    """Return a copy of the default run's folder that a test may damage."""
    return shutil.copytree(default_run.folder, tmp_path / "paper")


@pytest.fixture
def sensor(default_run):
    return draw_sensor(default_run.result.design, default_run.result.springs.housing)


@pytest.mark.slow
def test_folder_as_it_was_written_passes_and_is_not_changed(default_run, capsys):
    before = {path.name: path.read_bytes() for path in default_run.folder.iterdir()}
    assert main(["check", str(default_run.folder), "--json"]) == 0
    names = {verdict["name"] for verdict in json.loads(capsys.readouterr().out)}
    assert {"geometry.valid", "geometry.watertight", "geometry.leaf_thickness_low", "files.unchanged"} <= names
    assert {path.name: path.read_bytes() for path in default_run.folder.iterdir()} == before


def append(path):
    with path.open("a", encoding="utf-8") as file:
        file.write("\n")


def pipe(path):
    path.unlink()
    os.mkfifo(path)


def loop(path):
    path.unlink()
    path.symlink_to(path.name)


@pytest.mark.parametrize("name", ["assembly.step", "response.csv"])
@pytest.mark.parametrize("change", [append, pipe, loop, Path.unlink], ids=lambda change: change.__name__)
def test_file_that_is_not_as_it_was_written_fails(change, name, folder):
    change(folder / name)
    (verdict,) = (each for each in unchanged_verdicts(folder) if each.passed is not True)
    assert (verdict.name, verdict.value) == ("files.unchanged", 1.0)
    assert name in verdict.reference


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("housing.stl", None),
        pytest.param("housing.step", "rubbish", marks=pytest.mark.study),
        pytest.param("housing.3mf", "rubbish", marks=pytest.mark.study),
    ],
)
def test_missing_or_unreadable_housing_fails(name, content, folder):
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_text(content, encoding="utf-8")
    assert {"files.unchanged", "geometry.readable"} <= set(failed(folder))


@pytest.fixture(scope="module")
def of_another_run(tmp_path_factory, default_run):
    """Return a folder with files of a run whose leaves are longer and whose springs are others."""
    folder = tmp_path_factory.mktemp("another")
    housing = default_run.result.springs.housing
    longer = [1.05 * arm.flexure.length for arm in housing.arms]
    another = housing_for(Design(), PROCESSES["fdm-petg"], longer, default_run.result.springs.deflections)
    write_sensor(draw_sensor(Design(), another), folder)
    write_vtu(folder / "flexure.vtu", flexure_mesh(another, 4.0), {})
    write_outputs(result_of(Design(targets=Targets(NL=0.06))), folder)
    return folder


def forge(folder, name, of_another_run):
    """Put a file of another run in a folder, and make the digests of its report again."""
    shutil.copy(of_another_run / name, folder / name)
    path = folder / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    for entry in report["files"]:
        entry["sha256"] = file_digest(folder / entry["path"])
    path.write_text(json.dumps(with_digest(report)), encoding="utf-8")


@pytest.mark.slow
def test_solids_of_another_run_fail_though_their_digests_were_made_again(folder, sensor, of_another_run):
    content = (folder / "assembly.step").read_bytes()
    forge(folder, "assembly.step", of_another_run)
    assert files_as_designed(sensor, folder, ["assembly.step"]).passed is False
    (folder / "assembly.step").write_bytes(content)
    forge(folder, "housing.3mf", of_another_run)
    assert failed(folder) == ["geometry.as_designed"]


def test_edited_report_fails_its_digest_and_one_that_is_not_ours_is_refused(folder, capsys):
    path = folder / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    outside = folder.parent / "secret"
    outside.write_bytes(b"x")
    listed = [{"path": "../secret", "sha256": hashlib.sha256(b"x").hexdigest()}]
    path.write_text(json.dumps({**report, "files": listed}), encoding="utf-8")
    assert [each.name for each in unchanged_verdicts(folder) if not each.passed] == ["files.unchanged", "report.digest"]
    for text in (json.dumps({**report, "housing": {"a": 1}}), "[" * 10**5, "{}"):
        path.write_text(text, encoding="utf-8")
        assert main(["check", str(folder)]) == 2
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1), (None, 1)])
def test_verdict_on_a_file_decides_the_exit_code(passed, code, tmp_path, monkeypatch):
    monkeypatch.setattr("twintip.commands.check.check_path", lambda *_: (replace(GOOD, passed=passed),))
    (tmp_path / "part.stl").touch()
    assert main(["check", str(tmp_path / "part.stl")]) == code


def end_the_kernel(*_):
    """End the process, as a kernel does that reads a bad file."""
    os.kill(os.getpid(), signal.SIGSEGV)


@pytest.mark.slow
def test_file_that_ends_the_kernel_or_never_ends_is_one_failed_verdict(tmp_path, monkeypatch, capfd):
    path = tmp_path / "bad.step"
    path.touch()
    monkeypatch.setattr(check, "file_geometry", end_the_kernel)
    (verdict,) = check_path(path, PROCESSES["fdm-petg"])
    assert (verdict.name, verdict.passed) == ("geometry.readable", False)
    assert capfd.readouterr().err == ""
    monkeypatch.setattr(check, "SECONDS", 0.0)
    (verdict,) = check_path(path, PROCESSES["fdm-petg"])
    assert (verdict.name, verdict.passed) == ("geometry.readable", False)


def end_from_outside(*_):
    """End the process, as a system does that has no memory left."""
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.slow
def test_worker_that_the_system_ends_is_no_verdict_on_a_file(tmp_path, monkeypatch, capsys):
    path = tmp_path / "good.step"
    path.touch()
    monkeypatch.setattr(check, "file_geometry", end_from_outside)
    assert main(["check", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_file_that_the_machine_cannot_read_is_no_verdict(folder, monkeypatch):
    def unreadable(*_):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("pipeline.storage.digests.file_digest", unreadable)
    with pytest.raises(OSError, match="Input/output"):
        unchanged_verdicts(folder)
