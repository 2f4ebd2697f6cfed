"""The doctor names what is missing, and only what every run needs makes it end with 2."""

import subprocess

import pytest

from pipeline.cli import main
from pipeline.commands import doctor
from pipeline.commands.doctor import package_row, place_row


@pytest.fixture
def quick(monkeypatch):
    """Import light modules instead of the heavy ones."""
    monkeypatch.setattr(doctor, "IMPORTS", ("json", "math"))


def found(name):
    (row,) = (row for row in doctor.examination() if row.name == name)
    return row


@pytest.mark.usefixtures("quick")
def test_here_everything_needed_is_present(capsys):
    assert main(["doctor"]) == 0
    printed = capsys.readouterr().out
    assert [
        word for word in ("Python", "cadquery", "import json", "ccx", "cores", "cache") if word not in printed
    ] == []


@pytest.mark.parametrize(
    ("version", "needed", "status"), [("2.4.6", True, "ok"), ("2.4.5", True, "note"), (None, True, "wrong")]
)
def test_missing_package_is_wrong_and_another_version_a_note(version, needed, status):
    assert package_row("numpy", version, "2.4.6", needed=needed).status == status


def test_missing_optional_package_is_a_note():
    assert package_row("mkl", None, "2026.2.0", needed=False).status == "note"


def test_import_that_fails_is_wrong_and_says_why(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "IMPORTS", ("json", "no_such_package"))
    row = found("import no_such_package")
    assert (row.status, row.found) == ("wrong", "fails")
    assert "No module named 'no_such_package'; run make setup" in row.remark
    assert found("import json").status == "ok"
    assert main(["doctor"]) == 2
    assert "no_such_package" in capsys.readouterr().out


def test_import_that_ends_the_process_is_wrong_and_so_is_what_comes_after(monkeypatch, tmp_path):
    (tmp_path / "crashes.py").write_text("import os\nos.abort()\n", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(doctor, "IMPORTS", ("json", "crashes", "math"))
    assert [found(f"import {name}").status for name in ("json", "crashes", "math")] == ["ok", "wrong", "wrong"]


def test_import_without_end_is_wrong(monkeypatch):
    def too_long(*_arguments, **_keywords):
        raise subprocess.TimeoutExpired("python", 1.0)

    monkeypatch.setattr(doctor.subprocess, "run", too_long)
    assert found("import gmsh").status == "wrong"


@pytest.mark.usefixtures("quick")
def test_cache_and_outputs_are_where_the_commands_write(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    assert found("cache").found == str(tmp_path / "cache" / "twintip")
    assert found("outputs").found == str(tmp_path / "outputs")
    assert list(tmp_path.iterdir()) == []


def test_place_below_a_file_or_without_permission_is_wrong(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert place_row("cache", tmp_path / "later" / "cache").status == "ok"
    assert place_row("cache", tmp_path / "file" / "cache").remark.endswith(
        "file is a file; choose or free another place"
    )
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    row = place_row("cache", tmp_path / "cache")
    assert (row.status, "cannot be written" in row.remark) == ("wrong", True)
