"""Single files in a person's folder: ours are replaced, theirs are refused or kept aside, all are whole."""

from pathlib import Path

import pytest

from cad.quantity import InputError
from pipeline.storage.files import place_file, place_files
from pipeline.storage.new_file import NewFile, refuse_existing, refuse_unwritable, write_all_new, write_new


def test_our_own_file_is_replaced_and_a_changed_one_is_refused_or_kept(tmp_path):
    path = tmp_path / "page.html"
    place_file(path, b"one", "--html")
    place_file(path, b"two", "--html")
    path.write_bytes(b"mine")
    with pytest.raises(InputError) as refused:
        place_file(path, b"three", "--html")
    assert (refused.value.field, path.read_bytes()) == ("--html", b"mine")
    place_file(path, b"three", "--html", force=True)
    assert (path.read_bytes(), (tmp_path / "page.html.bak").read_bytes()) == (b"three", b"mine")
    assert len(list(tmp_path.iterdir())) == 2


def test_of_several_files_none_is_written_where_one_is_taken(tmp_path):
    (tmp_path / "b.png").write_bytes(b"mine")
    with pytest.raises(InputError):
        place_files(tmp_path, {"a.png": b"1", "b.png": b"2"}, "--png")
    assert [path.name for path in tmp_path.iterdir()] == ["b.png"]


def test_output_folder_of_a_run_takes_no_other_file(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError):
        place_file(tmp_path / "out" / "page.html", b"x", "--html")


@pytest.mark.parametrize("place", ["file/page.html", "/proc/page.html"])
def test_place_that_cannot_be_written_is_refused(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    with pytest.raises(InputError) as refused:
        place_file(Path(place), b"x", "--html")
    assert refused.value.field == "--html"
    with pytest.raises(InputError):
        refuse_unwritable(Path(place), "--out")


def test_new_file_is_never_over_another_unless_forced(tmp_path):
    path = tmp_path / "unit.toml"
    write_new(path, "one", "--out")
    for refusing in (lambda: write_new(path, "two", "--out"), lambda: refuse_unwritable(path, "--out")):
        with pytest.raises(InputError) as refused:
            refusing()
        assert refused.value.field == "--out"
    write_new(path, "two", "--out", force=True)
    assert path.read_text(encoding="utf-8") == "two"
    assert [each.name for each in tmp_path.iterdir()] == ["unit.toml"]


def test_two_flags_with_one_file_write_none(tmp_path):
    files = [NewFile(tmp_path / "a.h", "1", "--c-header"), NewFile(tmp_path / "x" / ".." / "a.h", "2", "--micropython")]
    (tmp_path / "x").mkdir()
    with pytest.raises(InputError) as refused:
        write_all_new(files)
    assert refused.value.field == "--micropython"
    with pytest.raises(InputError):
        refuse_existing([NewFile(tmp_path / "y" / "a.h", "1", "--c-header")])
    assert [each.name for each in tmp_path.iterdir()] == ["x"]
