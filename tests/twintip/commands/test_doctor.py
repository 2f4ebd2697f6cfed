"""The doctor names what is missing, and only what every run needs makes it end with 2."""

import subprocess

import pytest

from twintip.cli import main
from twintip.commands import doctor
from twintip.commands.doctor import folder_row, package_row


def statuses(*names):
    rows = {row.name: row.status for row in doctor.examine_machine()}
    return [rows[name] for name in names]


def test_here_everything_needed_is_present(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(doctor, "IMPORTS", ("json",))  # in place of the heavy ones
    monkeypatch.chdir(tmp_path)
    assert main(["doctor"]) == 0
    printed = capsys.readouterr().out
    words = ("Python", "cadquery", "import json", "ccx", "memory", "cache", "outputs")
    assert [word for word in words if word not in printed] == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("version", "locked", "status"),
    [("2.4.6", "2.4.6", "ok"), ("2.4.5", "2.4.6", "note"), ("2.4.5", None, "ok"), (None, "2.4.6", "wrong")],
)
def test_missing_package_is_wrong_and_another_version_a_note(version, locked, status):
    assert package_row("numpy", version, locked).status == status


def test_import_that_fails_or_ends_its_process_is_wrong(monkeypatch, tmp_path, capsys):
    (tmp_path / "crashes.py").write_text("import os\nos.abort()\n", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(doctor, "IMPORTS", ("json", "crashes", "no_such_package"))
    assert statuses("import json", "import crashes", "import no_such_package") == ["ok", "wrong", "wrong"]
    assert main(["doctor"]) == 2
    assert "ModuleNotFoundError" in capsys.readouterr().out


def test_import_without_end_is_wrong(monkeypatch):
    def too_long(*_arguments, **_keywords):
        raise subprocess.TimeoutExpired("python", 1.0)

    monkeypatch.setattr(doctor.subprocess, "run", too_long)
    assert statuses("import gmsh") == ["wrong"]


def test_place_below_a_file_or_without_permission_is_wrong(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    assert folder_row("cache", tmp_path / "later" / "cache").status == "ok"
    assert folder_row("cache", tmp_path / "file" / "cache").status == "wrong"
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    assert folder_row("cache", tmp_path / "cache").status == "wrong"
