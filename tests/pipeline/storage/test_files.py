"""Single files in a person's folder: ours are replaced, theirs are refused or kept aside, all are whole."""

import os
import socket
from pathlib import Path

import pytest
from refusal import refusal

from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.storage.folder import OutputError, output_folder
from sensor.quantity import InputError


def test_unchanged_file_of_ours_is_replaced_and_a_changed_one_never(tmp_path):
    path = tmp_path / "sub" / "page.html"
    assert write_files({path: b"one"}, "--html") == [path]
    write_files({path: b"two"}, "--html")
    path.write_bytes(b"mine")
    refused = refusal(write_files, {path: b"three"}, "--html")
    assert (refused.field, refused.value, path.read_bytes()) == ("--html", str(path), b"mine")
    write_files({path: b"three"}, "--html", force=True)
    write_files({path: b"four"}, "--html", force=True)
    path.write_bytes(b"also mine")
    write_files({path: b"five"}, "--html", force=True)
    assert {each.name: each.read_bytes() for each in path.parent.iterdir()} == {
        "page.html": b"five",
        "page.html.bak": b"mine",
        "page.html.2.bak": b"also mine",
    }


def test_file_of_a_person_that_holds_the_same_bytes_is_left(tmp_path):
    path = tmp_path / "unit.toml"
    path.write_bytes(b"the same")
    before = path.stat()
    assert write_files({path: b"the same"}, "--out") == [path]
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert list(tmp_path.iterdir()) == [path]


def test_of_several_files_none_is_written_where_one_is_taken(tmp_path):
    (tmp_path / "b.png").write_bytes(b"mine")
    files = {tmp_path / "a.png": b"1", tmp_path / "b.png": b"2"}
    with pytest.raises(InputError):
        write_files(files, "--png")
    assert [path.name for path in tmp_path.iterdir()] == ["b.png"]
    write_files(files, "--png", force=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png", "b.png.bak"]


def make_socket(path):
    with socket.socket(socket.AF_UNIX) as opened:
        opened.bind(os.path.relpath(path))  # a path of a socket is short


NO_FILES = {
    "folder": Path.mkdir,
    "pipe": os.mkfifo,
    "socket": make_socket,
    "link to a device": lambda path: path.symlink_to("/dev/null"),
    "link to nothing": lambda path: path.symlink_to("nowhere"),
    "link to a file": lambda path: path.symlink_to(__file__),
}


@pytest.mark.parametrize("make", NO_FILES.values(), ids=NO_FILES)
def test_what_is_no_file_is_never_moved_or_replaced(make, tmp_path, monkeypatch):
    place = tmp_path / "place"
    place.mkdir()
    monkeypatch.chdir(place)
    make(place / "b.png")
    before = (place / "b.png").lstat()
    for options in ({}, {"force": True}):
        with pytest.raises(InputError):
            write_files({place / "a.png": b"1", place / "b.png": b"2"}, "--png", **options)
    with pytest.raises(InputError):
        write_files({place / "c.png": lambda part: (part.touch(), make(place / "c.png"))}, "--png", force=True)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OutputError), output_folder(place, force=True):
        pytest.fail("the folder was given")
    assert sorted(path.name for path in place.iterdir()) == ["b.png", "c.png"]
    after = (place / "b.png").lstat()
    assert (after.st_ino, after.st_mode) == (before.st_ino, before.st_mode)


def test_device_is_never_moved_or_replaced():
    with pytest.raises(InputError):
        write_files({Path("/dev/null"): b"1"}, "--out", force=True)
    assert Path("/dev/null").is_char_device()


@pytest.mark.parametrize("force", [False, True])
def test_output_folder_of_a_run_takes_no_other_file(force, tmp_path):
    (tmp_path / "report.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError):
        write_files({tmp_path / "unit.toml": b"x"}, "--out", force=force)
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


def test_what_a_kill_left_is_cleared_by_the_next_and_a_folder_of_a_person_is_not(tmp_path):
    path = tmp_path / "unit.toml"
    write_files({path: b"old"}, "--out")
    child = os.fork()
    if child == 0:
        write_files({path: lambda part: (part.write_bytes(b"half"), os._exit(9))}, "--out", force=True)
    os.waitpid(child, 0)
    assert path.read_bytes() == b"old"
    assert sorted(each.name for each in tmp_path.iterdir()) == [".unit.toml.twintip", "unit.toml"]
    write_files({path: b"new"}, "--out")
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [("unit.toml", b"new")]
    mine = tmp_path / ".unit.toml.twintip" / "part"
    mine.parent.mkdir()
    mine.write_bytes(b"precious")
    refused = refusal(write_files, {path: b"newer"}, "--out")
    assert (refused.field, path.read_bytes(), mine.read_bytes()) == ("--out", b"new", b"precious")


@pytest.mark.parametrize("place", ["file/page.html", "/proc/page.html", "/proc/new/page.html"])
def test_place_that_cannot_be_written_is_refused_before_anything_is_done(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    for write in (
        lambda: check_paths_are_free([Path(place)], "--html"),
        lambda: write_files({Path(place): b"x"}, "--html", force=True),
    ):
        assert refusal(write).field == "--html"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
